"""FinCurve: how the load of a fin departs from a straight line with its angle, and what drift and turning add to it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

import numpy as np

from towtank.errors import InputError
from towtank.frames import Array

PARAMETERS = ("stall", "curvature", "drop", "width")
"""Parameters of the curve, in the order of ``FinCurve.std``."""


@dataclass(frozen=True)
class FinCurve:
    """Load of one fin at the angle a over its linear coefficient times u|u|, g(a) [rad].

        g(a) = sign(a) m (1 + b m) (1 - drop clip((|a| - stall) / width, 0, 1)),   m = min(|a|, stall)

    stall [rad] : angle of the largest load.   curvature : b [1/rad].   drop : share of the largest load that is lost
        beyond the stall, over the angle width [rad].
    std : standard uncertainties of stall, curvature, drop, width.   residual : rms of the loads less the curve, over
        the rms of the loads.   largest : largest angle of the runs [rad]; the curve is held beyond it.
    level : level of evidence of the runs.   source : what it was fitted to, in words.   runs : their names.
    kappa_v, kappa_r : load of a fin per angle of the flow that drift (turning) brings to it, over that per angle of
        its own deflection; 0 where they are not known.   kappa_std : their standard uncertainties.
    station_from_nose : where the angle of turning is taken [m]; 0 where kappa_r is 0.
    kappa_level, kappa_source : as level and source, of the two factors.

    Source     THEORY section 5. The form is this project's: a quadratic up to the stall, then a ramp to a plateau.
    Valid      Ahead, to the angle ``largest``.
    """

    stall: float
    curvature: float
    drop: float
    width: float
    source: str
    runs: tuple[str, ...] = ()
    level: str = ""
    std: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    residual: float = 0.0
    largest: float = 0.0
    kappa_v: float = 0.0
    kappa_r: float = 0.0
    kappa_std: tuple[float, float] = (0.0, 0.0)
    station_from_nose: float = 0.0
    kappa_level: str = ""
    kappa_source: str = ""

    def __post_init__(self) -> None:
        """Refuse a curve that is no curve.

        Raises
        ------
        InputError
            A number that is not finite, or with which the load would fall before the stall or change its sign.
        """
        numbers = (self.stall, self.curvature, self.drop, self.width, self.kappa_v, self.kappa_r)
        if not all(math.isfinite(number) for number in numbers):
            raise InputError(f"fin curve: {numbers} are not all finite. Give a number for each parameter.")
        if not (self.stall > 0.0 and self.width > 0.0):
            raise InputError(
                f"fin curve: stall {self.stall:g} rad and width {self.width:g} rad must be positive: one is where the "
                "load is largest, the other how far it then falls. For a fin that does not stall leave the curve out."
            )
        if not (0.0 <= self.drop <= 1.0 and self.curvature * self.stall >= -0.5):
            raise InputError(
                f"fin curve: drop {self.drop:g} must lie in 0 to 1 and curvature {self.curvature:g} /rad above "
                f"{-0.5 / self.stall:.3g} /rad, or the load would fall before the stall. Check units: rad, not deg."
            )

    def about(self, origin: float, shift: float) -> FinCurve:
        """The curve for an origin ``shift`` [m] ahead of the one at ``origin`` [m] aft of the nose.

        Drift about the new point brings v - shift r to the old one, so the two factors mix where they differ.

        Raises
        ------
        InputError
            The new point lies at the fins, where turning brings them no angle.
        """
        if self.kappa_v == self.kappa_r or shift == 0.0:
            return self
        old = origin - self.station_from_nose
        new = old - shift
        if abs(new) < 1e-6 * max(abs(old), 1e-9):
            raise InputError(
                f"fin curve: the new point, {origin - shift:g} m aft of the nose, is where the fins stand. Turning "
                "brings them no angle there, so kappa_r has no value. Take another point, or set both factors to zero."
            )
        return replace(self, kappa_r=(self.kappa_r * old - self.kappa_v * shift) / new)

    def __call__(self, angle: Array | float) -> Array:
        """The curve [rad] at ``angle`` [rad], any shape."""
        size = np.abs(np.asarray(angle, dtype=float))
        m = np.minimum(size, self.stall)
        lost = self.drop * np.clip((size - self.stall) / self.width, 0.0, 1.0)
        return np.asarray(np.sign(angle) * m * (1.0 + self.curvature * m) * (1.0 - lost))


def fin_curve_document(curve: FinCurve | None) -> dict[str, Any] | None:
    """``curve`` as plain content of a file; None where there is none."""
    return None if curve is None else asdict(curve)


def fin_curve_of(content: Mapping[str, Any] | None) -> FinCurve | None:
    """The curve of the content that ``fin_curve_document`` gives.

    KeyError, TypeError or ValueError when it is not whole. Entries that this version does not know are left out.
    """
    if content is None:
        return None
    known = {field.name: content[field.name] for field in fields(FinCurve) if field.name in content}
    known = {name: tuple(value) if isinstance(value, list | tuple) else value for name, value in known.items()}
    try:
        return FinCurve(**known)
    except InputError as error:
        raise ValueError(str(error)) from None
