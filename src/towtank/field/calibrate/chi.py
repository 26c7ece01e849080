"""What is left of each channel beside what its stated noise leads to expect."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from towtank.field.calibrate.fit import Crew, Fit
from towtank.field.calibrate.normal import spread
from towtank.field.calibrate.shoot import CHUNK, Turn
from towtank.frames import Array

SAMPLED = 8
"""Groups of windows on which the unknowns' share is taken, at least: it is some per cent of the samples."""


def leverage(fit: Fit, number: int, crew: Crew) -> Array:
    """Samples of each channel (C,) of a record that its own unknowns fit: a mean of squares is smaller by that share.

    Source     brysonho1975, ch. 12: trace of H P H^T, H the whitened slopes, P the covariance after the fit.
    """
    case, found, C = fit.cases[number], fit.found[number], fit.shared[number]
    P = spread(case.windows, case.links, found.piece, found.equations, C).states
    Y = found.equations.gains
    values, columns = fit.unknowns.values(fit.z), fit.unknowns.columns
    common = case.engine.common(values)

    def one(span: slice) -> Array:
        _, tangent = case.engine.fly(common, found.point, span, slopes=True)
        tangent *= case.windows.weight[span][..., None]
        s, g = Turn(case.engine, found.point, span, columns).rows(tangent, case.windows.weight[span])
        count, n, c, _ = s.shape
        s, g = s.reshape(count, n * c, -1), g.reshape(count, n * c, -1)
        out = ((s @ P[span]) * s).sum(axis=2) + ((g - 2.0 * (s @ Y[span])) @ C * g).sum(axis=2)
        return np.asarray(out.reshape(count, n, c).sum(axis=(0, 1)))

    total = len(found.point.states)
    spans = [slice(a, min(a + CHUNK, total)) for a in range(0, total, CHUNK)]
    some = spans[:: max(1, len(spans) // SAMPLED)]
    taken = np.asarray(sum(crew.each([partial(one, span) for span in some])))
    return taken * total / sum(span.stop - span.start for span in some)


def tables(fit: Fit, threads: int | None = None) -> tuple[dict[str, dict[str, float]], ...]:
    """For each record: channel -> samples, std, mean square of what is left in these, and that expected (1 at best)."""
    crew, out = Crew(threads), []
    try:
        for number, case in enumerate(fit.cases):
            it, square, taken = case.windows, fit.found[number].piece.square, leverage(fit, number, crew)
            out.append({
                name: {
                    "samples": float(count), "std": it.std[name],
                    "chi2": float(square[place] / max(count - taken[place], 1e-9)), "taken": float(taken[place]),
                }
                for name, count in it.used.items() for place in [it.channels.index(name)]
            })  # fmt: skip
    finally:
        crew.close()
    return tuple(out)


def worst(table: dict[str, dict[str, float]], names: Sequence[str]) -> float:
    """Largest factor by which what is left of ``names`` differs from what is expected."""
    return max((max(table[n]["chi2"], 1.0 / max(table[n]["chi2"], 1e-9)) for n in names if n in table), default=1.0)
