"""Craft drawn from the uncertainty of the derivatives, to fly a record side by side."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from towtank.derive.covariance import root_of
from towtank.errors import InputError
from towtank.field.log import CHANNELS
from towtank.field.replay import Scatter
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.model.rigid_body import mass_matrix
from towtank.symbols import LOADS, RATES

SEED = 20
TRIES = 30
"""Times a craft is drawn again."""


def drawn(model: Model, count: int, seed: int = SEED, bias: Mapping[str, float] | None = None) -> Scatter:
    """``count`` craft: derivatives, current, states at the begin of each part, and offsets of the sensors.

    bias : channel -> standard deviation of its offset, which lasts the record.

    Source     Normal distributions; the covariance is that of the derivatives (fit, mesh and model form together).
    Departure  A craft whose mass matrix is not positive definite is drawn again.

    Raises
    ------
    InputError
        Fewer than two craft, or an uncertainty of the added masses as large as they are.
    """
    if count < 2:
        raise InputError(f"samples: {count} craft make no band. Ask for two or more with --samples; 200 is usual.")
    d, random = model.derivatives, np.random.default_rng((seed, 1))
    root = root_of(d.covariance, d.values)
    table = d.values + random.standard_normal((count, len(d.names))) @ root.T
    for _ in range(TRIES):
        bad = ~_sound(model, dict(zip(d.names, table.T, strict=True)))
        if not bad.any():
            break
        table[bad] = d.values + random.standard_normal((int(bad.sum()), len(d.names))) @ root.T
    else:
        raise InputError(
            f"compare {model.craft.name}: no craft with a positive mass matrix was drawn in {TRIES} tries. The "
            "uncertainty of the added masses is as large as they are: narrow it."
        )
    varying = {name: table[:, i] for i, name in enumerate(d.names) if np.ptp(table[:, i]) > 0.0}
    current = random.standard_normal((count, 3))
    places = list(CHANNELS)
    offsets = {
        name: size * np.random.default_rng((seed, 3, places.index(name))).standard_normal(count)
        for name, size in (bias or {}).items()
        if size > 0.0
    }
    return Scatter(varying, current, seed, offsets)


def _sound(model: Model, columns: Mapping[str, Array]) -> NDArray[np.bool_]:
    """True (n,) where M_RB - M_A is positive definite."""
    count = len(next(iter(columns.values())))
    rigid = np.array(mass_matrix(model.constants.body), dtype=float)
    mass = np.tile(rigid, (count, 1, 1))
    for i, load in enumerate(LOADS):
        for j, rate in enumerate(RATES):
            name = f"{load}{rate}dot"
            mass[:, i, j] -= columns.get(name, np.full(count, model.derivatives[name]))
    return np.asarray(np.linalg.eigvalsh(0.5 * (mass + mass.transpose(0, 2, 1)))[:, 0] > 0.0)
