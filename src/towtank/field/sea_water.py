"""The water of a synthetic sea: a mean current, its shear with depth, and eddies that come and go."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from towtank.errors import InputError
from towtank.frames import Array

PIECE = 0.5
"""Time [s] over which the current of a craft is held. An eddy that lasts 20 s changes by 2 % in it."""
LASTING = 20.0
"""Time [s] over which the eddies forget themselves, where none is given; assumed."""
GROUND = 2**32
"""Seeds are below this number."""


@dataclass(frozen=True)
class Environment:
    """The water that a craft swims in.

    current (3,) [m/s, north, east, down] at the depth ``depth`` [m].   shear (2,) [1/s] : gain of its north and east
    parts with each metre of depth.   turbulence (3,) [m/s] : standard deviations of the north, east and down parts of
    the eddies.   correlation [s] : time over which they fall to 1/e.   piece [s] : time over which the current that a
    craft feels is held.   seed : of the eddies; each of several craft has its own from it.

    Raises
    ------
    InputError
        Numbers that are not finite, a negative spread, a time that is not positive, or a seed that is no seed.
    """

    current: tuple[float, float, float] = (0.0, 0.0, 0.0)
    shear: tuple[float, float] = (0.0, 0.0)
    depth: float = 0.0
    turbulence: tuple[float, float, float] = (0.0, 0.0, 0.0)
    correlation: float = LASTING
    piece: float = PIECE
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse what is no water."""
        sizes = {"current": 3, "shear": 2, "turbulence": 3}
        for name, size in sizes.items():
            values = np.asarray(getattr(self, name), dtype=float)
            if values.shape != (size,) or not np.isfinite(values).all():
                raise InputError(f"water: {name} {getattr(self, name)!r}. Give {size} finite numbers.")
        if min(self.turbulence) < 0.0:
            raise InputError(f"water: turbulence {self.turbulence}. A standard deviation is 0 or more.")
        for name in ("correlation", "piece"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise InputError(f"water: {name} {getattr(self, name)} s. Give a finite time above zero.")
        if not np.isfinite(self.depth):
            raise InputError(f"water: depth {self.depth} m of the current. Give a finite depth.")
        check_seed(self.seed)

    @property
    def steady(self) -> bool:
        """True when the current is the same everywhere and always."""
        return not any((*self.shear, *self.turbulence))


def check_seed(seed: int) -> int:
    """``seed``, if it is a whole number from 0 to 2^32 - 1.

    Raises
    ------
    InputError
        It is not.
    """
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or not 0 <= seed < GROUND:
        raise InputError(f"seed {seed!r} is no seed. Give a whole number from 0 to {GROUND - 1}.")
    return int(seed)


def passing_time(length: float, speed: float) -> float:
    """Correlation time [s] that a craft at ``speed`` [m/s] feels in eddies of the ``length`` [m].

    Source     taylor1938: eddies stand still while the craft swims through them.
    Valid      Turbulence well below the speed.

    Raises
    ------
    InputError
        A length or speed that is not positive.
    """
    if not (length > 0.0 and speed > 0.0):
        raise InputError(f"water: eddies of {length:g} m at {speed:g} m/s. Give a length and a speed above zero.")
    return length / speed


def eddies(environment: Environment, step: float, count: int, pieces: int) -> Array:
    """Velocities (count, pieces, 3) [m/s, NED] of the eddies that ``count`` craft feel, ``step`` [s] apart.

    Source     fossen2021, ch. 10: first-order Gauss-Markov process; gillespie1996 for steps of any length:
               c(t + dt) = f c(t) + std sqrt(1 - f^2) n, f = exp(-dt / T). It starts in its steady state.
    Departure  The sources let speed or one variable wander; here each of the three parts does, on its own.
    """
    f = np.exp(-step / environment.correlation)
    noise = np.stack([
        np.random.default_rng([environment.seed, i]).standard_normal((pieces, 3)) for i in range(count)
    ])  # fmt: skip
    noise[:, 1:] *= np.sqrt(1.0 - f * f)
    return np.asarray(lfilter([1.0], [1.0, -f], noise, axis=1) * np.asarray(environment.turbulence))


def mean_current(environment: Environment, depth: Array, more: Sequence[float] = (0.0, 0.0, 0.0)) -> Array:
    """Current (..., 3) [m/s, NED] at ``depth`` (...,) [m] without eddies; ``more`` (3,) is added everywhere."""
    below = np.asarray(depth, dtype=float)[..., None] - environment.depth
    return np.asarray(
        np.asarray(environment.current) + np.asarray(more, dtype=float) + below * np.array([*environment.shear, 0.0])
    )
