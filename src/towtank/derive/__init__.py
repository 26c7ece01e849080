"""Stage 5: from captive runs to derivatives. Calling the package runs the stage: ``towtank.derive(runs)``."""

from towtank.stage import make_callable

ENTRY = "towtank.derive.derive:derive"
make_callable(__name__)
