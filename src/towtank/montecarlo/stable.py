"""Stability of every drawn craft in straight flight with fixed controls."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from towtank.frames import Array
from towtank.model.equations import Model
from towtank.model.values import to_variant
from towtank.verdict.criteria import horizontal_matrix, index, vertical_matrix


def stability(model: Model, columns: Mapping[str, Array]) -> dict[str, list[float | None]]:
    """Growth rate [1/s] of the least damped mode and stability index of both planes, for each drawn craft.

    "horizontal_growth", "vertical_growth", "horizontal_index", "vertical_index". On the slopes at the origin where the
    derivatives hold them: each craft's slope is moved by as many standard uncertainties as its wide fit was.

    Source     ``towtank.verdict.criteria``; mass and CG of each craft enter.
    """
    speed, v = model.craft.speed, lumped(model, columns)
    body = replace(model.constants.body, **{name: columns[name] for name in ("m", "xG", "yG", "zG")})
    out = {}
    for plane, matrix in (("horizontal", horizontal_matrix), ("vertical", vertical_matrix)):
        growth = np.linalg.eigvals(matrix(model, v, speed, body)).real.max(axis=1)
        out[f"{plane}_growth"] = growth
        out[f"{plane}_index"] = index(model, v, plane, body)
    return {name: [float(x) if np.isfinite(x) else None for x in values] for name, values in out.items()}


def lumped(model: Model, columns: Mapping[str, Array]) -> dict[str, Array]:
    """The drawn derivatives (term -> (N,)) in the lumped variant, linear terms at the origin where there are slopes."""
    d = model.derivatives
    total = to_variant(d, "lumped")
    drawn = {name: columns[name] - d[name] for name in d.names}
    # Both variants differ by sums of added masses: a linear map, so deviations go through it as they are.
    out = {name: total[name] + _deviation(name, drawn, d.variant) for name in total.names}
    std = dict(zip(d.names, np.sqrt(np.diag(d.covariance)), strict=True))
    for name, value in total.origin.items():
        own = total.origin_std.get(name, std.get(name, 0.0))
        size = std.get(name, 0.0)
        unit = drawn[name] / size if name in drawn and size > 0.0 else 0.0
        out[name] = value + own * unit * np.ones(len(columns["m"]))
    return out


def _deviation(name: str, drawn: Mapping[str, Array], variant: str) -> Array:
    from towtank.model.values import shares

    own = drawn.get(name, np.zeros(len(next(iter(drawn.values())))))
    if variant == "lumped":
        return own
    return own + sum((factor * drawn[mass] for mass, factor in shares(name) if mass in drawn), np.zeros_like(own))
