"""Noise of the sensors on numpy: the numbers that ``c/loop.c`` draws."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from towtank.frames import Array

_Words = NDArray[np.uint64]


def normal(seed: int, count: int, sensor: int, reading: int) -> Array:
    """Standard normal numbers (count,) of one reading of a sensor, one for each trajectory.

    Source     splitmix64 of the numbers that name the reading (steele2014); Box and Muller.
    """
    z = np.uint64(seed % 2**64) * np.full(count, 0xD1342543DE82EF95, dtype=np.uint64)
    z += np.arange(count, dtype=np.uint64) * np.uint64(0x9FB21C651E98DF25)
    z += np.full(count, sensor, dtype=np.uint64) * np.uint64(0xC2B2AE3D27D4EB4F)
    z += np.full(count, reading, dtype=np.uint64) * np.uint64(0x165667B19E3779F9)
    u = (_mixed(z + np.uint64(0x9E3779B97F4A7C15)).astype(float) + 0.5) * 2.0**-53
    v = _mixed(z + np.uint64(0x3C6EF372FE94F82A)).astype(float) * 2.0**-53
    return np.asarray(np.sqrt(-2.0 * np.log(u)) * np.cos(2.0 * np.pi * v))


def _mixed(z: _Words) -> _Words:
    """The upper 53 bits of the hash of ``z``."""
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.asarray((z ^ (z >> np.uint64(31))) >> np.uint64(11))
