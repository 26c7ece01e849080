"""Derivatives: the coefficients with their uncertainty, and where they came from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from towtank.derive.fin_curve import FinCurve
from towtank.frames import Array


@dataclass(frozen=True)
class Reference:
    """What makes values into primes, and where moments are taken. length [m], speed [m/s], density [kg/m3]."""

    length: float
    speed: float
    density: float
    origin_from_nose: float


@dataclass(frozen=True)
class Derivatives:
    """Coefficients in the order of ``names``; values (n,), covariances (n, n), SI.

    craft, level : as in Run.   variant : "lumped" or "split" (THEORY section 2).
    covariance_fit, covariance_mesh, covariance_model : kept apart; their sum is ``covariance``.
    runs : term -> names of the runs it rests on.   rejected : (run name, reason).
    origin : slopes at the origin of the linear terms (Yuv, Nuv, Yur, Nur, Zuw, Muw, Zuq, Muq), used by the stability
        indices; the main values are the wide-range fit used by the model.   origin_std : their standard uncertainty.
    quality : numbers about the fit: condition number, lambda, gaps between symmetric halves, range of the fit, fins'
        linear range, residual per run, classical Fourier results; plain JSON content.
    fin_curve : fin loads beyond the linear range and the straightening factors; None where no run went beyond it.
    """

    craft: str
    level: str
    variant: str
    reference: Reference
    names: tuple[str, ...]
    values: Array
    covariance_fit: Array
    covariance_mesh: Array
    covariance_model: Array
    runs: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    rejected: tuple[tuple[str, str], ...] = ()
    origin: Mapping[str, float] = field(default_factory=dict)
    origin_std: Mapping[str, float] = field(default_factory=dict)
    quality: Mapping[str, Any] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)
    fin_curve: FinCurve | None = None

    @property
    def covariance(self) -> Array:
        """Total covariance (n, n)."""
        return self.covariance_fit + self.covariance_mesh + self.covariance_model

    def __getitem__(self, name: str) -> float:
        """Value of a term; 0 for one that the set does not hold."""
        return float(self.values[self.names.index(name)]) if name in self.names else 0.0

    def as_dict(self) -> dict[str, float]:
        """Term -> value."""
        return dict(zip(self.names, (float(v) for v in self.values), strict=True))

    def __str__(self) -> str:
        """The table of ``towtank.derive.show``."""
        from towtank.derive.show import table

        return table(self)

    __repr__ = __str__
