"""Run: what a tank measured in one captive test."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from towtank.frames import Array
from towtank.plan.history import History

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class Run:
    """Loads and motion of one captive test; N samples about the body origin, SNAME axes, SI.

    id : file-name slug with hash.   name, kind : of the captive test.
    craft : name.   symmetry : of the craft, as in ``Craft.symmetry``.
    level : "semi-empirical", "rans", "experiment", "published", or "known coefficients".
    speed : reference speed U [m/s].   period : [s], 0 when steady.   periods : number of periods recorded.
    density [kg/m3], length [m], origin_from_nose [m] : reference of the loads.
    history : time, position, attitude, velocities, accelerations.
    delta : fin angles (N, n_fins) [rad].   control : virtual rudder, elevator, aileron, sum of squares (N, 4).
    loads : X Y Z K M N (N, 6) [N, N m], hydrodynamic load only: no weight, buoyancy or body inertia.
    parts : named shares (N, 6) that add up to ``loads``; may be empty.
    ensemble : loads of the model-form ensemble (members, N, 6), or None.
    flags : validity remarks, never empty silently: each is a short sentence with the limit.
    exploratory : recorded, never fitted.
    diameter : of the hull [m]; 0 where it is not known.
    """

    id: str
    name: str
    kind: str
    craft: str
    symmetry: str
    level: str
    speed: float
    period: float
    periods: int
    density: float
    length: float
    origin_from_nose: float
    history: History
    delta: Array
    control: Array
    loads: Array
    parts: Mapping[str, Array] = field(default_factory=dict)
    ensemble: Array | None = None
    flags: tuple[str, ...] = ()
    exploratory: bool = False
    provenance: Mapping[str, Any] = field(default_factory=dict)
    diameter: float = 0.0

    @property
    def steady(self) -> bool:
        """True for a run with one condition held."""
        return self.period == 0.0

    @property
    def settled(self) -> NDArray[np.intp]:
        """Indices of the samples to be analysed: whole periods, the first dropped; all of them when steady."""
        n = len(self.history.time)
        if self.steady:
            return np.arange(n)
        per = (n - 1) // self.periods
        first = per if self.periods > 1 else 0
        return np.arange(first, first + per * max(self.periods - 1, 1))

    def dataset(self) -> xarray.Dataset:
        """The run as an xarray Dataset with ``units`` and ``long_name`` on every variable."""
        import xarray

        from towtank.tank.files import run_variables

        variables, attrs = run_variables(self)
        return xarray.Dataset({k: (v.dims, v.values, dict(v.attrs)) for k, v in variables.items()}, attrs=attrs)
