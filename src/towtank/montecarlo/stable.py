"""Stability of every drawn craft in straight flight with fixed controls."""

from __future__ import annotations

from collections.abc import Mapping

from towtank.frames import Array
from towtank.model.equations import Model
from towtank.verdict.criteria import growth, index
from towtank.verdict.many import Many

PLANES = ("horizontal", "vertical")


def stability(model: Model, columns: Mapping[str, Array]) -> dict[str, Array]:
    """Growth rate [1/s] of the least damped mode and stability index of both planes (N,), for each drawn craft.

    "horizontal_growth", "vertical_growth", "horizontal_index", "vertical_index". On the slopes at the origin where the
    derivatives hold them: each craft's slope is moved by as many standard uncertainties as its wide fit was.

    Source     ``towtank.verdict.criteria``; mass and CG of each craft enter. A craft ballasted to neutral stays so.
    """
    craft = Many(model, columns)
    out = {f"{plane}_growth": growth(craft, plane, model.craft.speed) for plane in PLANES}
    return out | {f"{plane}_index": index(model, craft.v, plane, craft.body) for plane in PLANES}
