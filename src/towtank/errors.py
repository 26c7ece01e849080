"""The one exception family. Every message says what is wrong, where, the limit and its reason, the remedy."""


class TowtankError(Exception):
    """Base of every error a user may meet. ``exit_code`` is what the command line returns."""

    exit_code = 3


class InputError(TowtankError):
    """A file, option or number given by the user cannot be used."""

    exit_code = 2


class CraftError(InputError):
    """The craft cannot be built, or does not float as stated."""


class PlanError(InputError):
    """A captive test is outside what the method can represent."""


class ArtefactError(InputError):
    """A file of the study is missing, incomplete, or of another schema."""


class TankError(TowtankError):
    """A captive test could not be run."""


class DeriveError(TowtankError):
    """The runs do not determine the derivatives that were asked for."""


class TrialError(TowtankError):
    """A free-running trial could not be carried out or has no index."""
