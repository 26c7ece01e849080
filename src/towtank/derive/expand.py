"""From the unknowns of the regression to the terms of the model: ties, and the symmetry of the added mass."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from towtank.derive.select import Choice, allowed, reciprocal
from towtank.derive.system import tie_matrix
from towtank.frames import Array
from towtank.symbols import TERMS


@dataclass(frozen=True)
class Expansion:
    """terms = matrix (terms, unknowns) @ unknowns.   gaps : added-mass halves before they were averaged.

    copied : term -> the half it was copied from, where the runs determine one half only.
    """

    names: tuple[str, ...]
    matrix: Array
    gaps: dict[str, Any]
    copied: dict[str, str]


def expand(choice: Choice, symmetry: str, unknowns: Array, covariance: Array) -> Expansion:
    """Terms of the model from the unknowns (n,) with ``covariance`` (n, n).

    Source     lamb1932: M_A of potential flow is symmetric, so Yrdot = Nvdot.
    Departure  The two identified halves are averaged and their difference reported (THEORY section 2, eq. 2.13).
    """
    rows = dict(zip(choice.order, tie_matrix(choice), strict=True))
    gaps: dict[str, Any] = {}
    copied: dict[str, str] = {}
    out = dict(rows)
    for name in [n for n in allowed(symmetry) if TERMS[n].is_added_mass and reciprocal(n) != n]:
        twin = reciprocal(name)
        if name in rows and twin in rows:
            out[name] = 0.5 * (rows[name] + rows[twin])
            if list(TERMS).index(name) < list(TERMS).index(twin):
                difference = rows[name] - rows[twin]
                gaps[f"{name} - {twin}"] = {
                    "difference": float(difference @ unknowns),
                    "std": float(np.sqrt(max(difference @ covariance @ difference, 0.0))),
                    name: float(rows[name] @ unknowns),
                    twin: float(rows[twin] @ unknowns),
                }
        elif twin in rows:
            out[name], copied[name] = rows[twin], twin
    names = tuple(name for name in TERMS if name in out)
    return Expansion(names, np.array([out[name] for name in names]).reshape(len(names), -1), gaps, copied)
