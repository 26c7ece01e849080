"""A sound set of a 4-fold craft, built from potential flow, a fin and strips; and the same with one fault."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from towtank.derive.check import FAIL, WARN
from towtank.derive.consistency import consistency
from towtank.derive.published import stated
from towtank.derive.table import Derivatives, Reference
from towtank.symbols import FOURFOLD_TIES

LENGTH, DIAMETER, DENSITY = 4.0, 0.5, 1000.0
MASS = 620.0
REFERENCE = Reference(LENGTH, 2.0, DENSITY, 1.9)
BODY = {"displaced_mass": MASS, "diameter": DIAMETER}

# Added mass of a slender spheroid; a fin of lift slope 60 kg/m, 1.9 m aft; strips of drag coefficient 0.8.
HORIZONTAL = {
    "Xudot": -20.0, "Yvdot": -600.0, "Kpdot": -0.5, "Nrdot": -480.0, "Yrdot": 20.0, "Nvdot": 20.0,
    "Xuu": -9.0, "Xvv": 5.0, "Xvvvv": 100.0, "Xvr": 560.0, "Xrr": 10.0,
    "Yuv": -60.0, "Yvv": -680.0, "Yur": 94.0, "Yrr": 60.0,
    "Nuv": -466.0, "Nvv": 60.0, "Nur": -197.0, "Nrr": -680.0, "Kup": -3.0, "Kpp": -0.2,
    "Xuudd": -5.0, "Yuudr": 40.0, "Nuudr": -76.0, "Kuudroll": 9.0,
}  # fmt: skip
SOUND = HORIZONTAL | {
    name: sign * HORIZONTAL[twin] for name, (twin, sign) in FOURFOLD_TIES.items() if twin in HORIZONTAL
}


def sound(**changes: float) -> Derivatives:
    """The sound set, some terms changed."""
    return a_set({**SOUND, **changes})


def a_set(values, std=None, symmetry="fourfold", body=BODY, **quality) -> Derivatives:
    return stated("case", values, REFERENCE, std=std, quality={"symmetry": symmetry, "body": body, **quality})


def without(*names: str) -> Derivatives:
    return a_set({name: value for name, value in SOUND.items() if name not in names})


def correlated(d: Derivatives, pair: tuple[str, str], std: float) -> Derivatives:
    """``pair`` known to ``std``, and fully correlated."""
    c = np.array([float(name in pair) for name in d.names])
    return replace(d, covariance_fit=std**2 * np.outer(c, c))


def found(d: Derivatives, *verdicts: str, craft=None) -> set[str]:
    """Names of the checks with one of the verdicts; fail and warn when none is named."""
    wanted = verdicts or (FAIL, WARN)
    return {check.name for check in consistency(d, craft) if check.verdict in wanted}
