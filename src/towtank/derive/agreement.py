"""Two sets of one craft, term by term: another level, another tank, another fit."""

from __future__ import annotations

import numpy as np

from towtank.derive.check import (
    FAIL,
    NOT_APPLICABLE,
    PASS,
    SIGMAS,
    WARN,
    Check,
    Subject,
    absent,
    gathered,
    subject,
)
from towtank.derive.convert import about_point
from towtank.derive.table import Derivatives
from towtank.errors import DeriveError

FAR = 3.0
"""Combined standard uncertainties beyond which two values do not describe the same thing: 3 in 1000 by chance."""


def compare(a: Derivatives, b: Derivatives) -> tuple[Check, ...]:
    """Terms that both sets state, in combined standard uncertainties.

    Parameters
    ----------
    a, b : of one craft or of its model in another scale. ``b`` is converted to the variant "lumped" as ``a`` is, to the
        point of ``a`` and, by primes, to its length, speed and density.

    Returns
    -------
    A line for every term that differs, and one for the others. Terms without an uncertainty in either set, or too small
    to be seen in the motion, give no verdict.

    Raises
    ------
    DeriveError
        A set that cannot be checked, or sets without a common term.

    Source     jcgm100 (combined standard uncertainty).
    """
    one = subject(a)
    other = subject(about_point(b, a.reference.origin_from_nose / a.reference.length * b.reference.length))
    common = [name for name in one.values if name in other.values]
    if not common:
        raise DeriveError(f"{a.craft} ({a.level}) and {b.craft} ({b.level}) have no term in common.")
    found = [_term(name, one, other) for name in common]
    judged = [check for check in found if check.verdict != NOT_APPLICABLE]
    title = f"{a.level} against {b.level}"
    words = f"terms agree within {SIGMAS:g} combined standard uncertainties."
    out = gathered(title, judged, words, "neither set states an uncertainty for a term that matters.")
    rest = [check for check in found if check.verdict == NOT_APPLICABLE]
    if judged and rest:
        out = (*out, absent(f"{title}: not judged", f"{', '.join(c.name.split()[-1] for c in rest)}; no uncertainty."))
    return out


def _term(name: str, one: Subject, other: Subject) -> Check:
    scale = one.prime(name, 1.0) / other.prime(name, 1.0)
    value, expected = one.values[name], other.values[name] / scale
    gap = value - expected
    std = float(np.hypot(one.std({name: 1.0}), other.std({name: 1.0}) / scale))
    words = f"{name} = {value:.4g} against {expected:.4g}, combined standard uncertainty {std:.2g}."
    title = f"agreement: {name}"
    if std == 0.0:
        return absent(title, words)
    value = abs(gap) / std
    verdict = PASS if value <= SIGMAS else WARN if value <= FAR else FAIL
    if verdict != PASS:
        words += " One of the uncertainties leaves something out, or the two describe different bodies or ranges."
    return Check(title, verdict, value, SIGMAS, words)
