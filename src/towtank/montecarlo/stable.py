"""Stability of every drawn craft in straight flight with fixed controls."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from towtank.frames import Array
from towtank.model.equations import Model
from towtank.model.values import shares, to_variant
from towtank.montecarlo.draw import body_of
from towtank.verdict.criteria import horizontal_matrix, index, vertical_matrix

PLANES = ("horizontal", "vertical")


def stability(model: Model, columns: Mapping[str, Array]) -> dict[str, Array]:
    """Growth rate [1/s] of the least damped mode and stability index of both planes (N,), for each drawn craft.

    "horizontal_growth", "vertical_growth", "horizontal_index", "vertical_index". On the slopes at the origin where the
    derivatives hold them: each craft's slope is moved by as many standard uncertainties as its wide fit was.

    Source     ``towtank.verdict.criteria``; mass and CG of each craft enter. A craft ballasted to neutral stays so.
    """
    speed, v = model.craft.speed, lumped(model, columns)
    body = body_of(model, columns)
    if neutral(model):
        body = replace(body, b=body.m)
    out = {}
    for plane, matrix in zip(PLANES, (horizontal_matrix, vertical_matrix), strict=True):
        out[f"{plane}_growth"] = np.linalg.eigvals(matrix(model, v, speed, body)).real.max(axis=1)
        out[f"{plane}_index"] = index(model, v, plane, body)
    return out


def neutral(model: Model) -> bool:
    """True for a craft whose displaced mass is its mass: it was ballasted, and its drawn craft are too."""
    return bool(model.constants.body.b == model.constants.body.m)


def lumped(model: Model, columns: Mapping[str, Array]) -> dict[str, Array]:
    """The drawn derivatives (term -> (N,)) in the lumped variant, linear terms at the origin where there are slopes."""
    d = model.derivatives
    total = to_variant(d, "lumped")
    count = len(next(iter(columns.values())))
    drawn = {name: columns[name] - d[name] for name in d.names}
    # Both variants differ by sums of added masses: a linear map, so deviations go through it as they are.
    moved = {name: _deviation(name, drawn, d.variant, count) for name in total.names}
    std = dict(zip(total.names, np.sqrt(np.maximum(np.diag(total.covariance), 0.0)), strict=True))
    out = {name: total[name] + moved[name] for name in total.names}
    for name, value in total.origin.items():
        size = float(std.get(name, 0.0))
        unit = moved[name] / size if size > 0.0 else np.zeros(count)
        out[name] = value + total.origin_std.get(name, size) * unit
    return out


def _deviation(name: str, drawn: Mapping[str, Array], variant: str, count: int) -> Array:
    own = drawn.get(name, np.zeros(count))
    if variant == "lumped":
        return own
    return np.asarray(sum((factor * drawn[mass] for mass, factor in shares(name) if mass in drawn), own))
