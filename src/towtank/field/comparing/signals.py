"""What is looked for in a motion: steady turns, swings after a reversal, steps of an order, power in bands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from towtank.frames import Array

Span = tuple[int, int]
"""First sample and the one after the last."""

TURNING = np.radians(0.5)
"""Least yaw rate [rad/s] of a turn."""
WINDOW = 10.0
"""Shortest steady turn [s]."""
STEADY = 0.03
"""Largest standard deviation of the yaw rate in a steady turn, as a share of its mean."""
SMOOTH = 2.0
"""Time [s] over which the yaw rate is averaged before a turn is looked for."""
RUDDER = np.radians(3.0)
"""Least rudder on both sides of a reversal [rad]."""
DWELL = 5.0
"""Shortest time [s] between two reversals."""
HEADING_STEP, DEPTH_STEP = np.radians(5.0), 0.5
"""Least step of an order [rad, m]."""
HOLD = 20.0
"""Shortest time [s] that an order must hold after a step."""
SETTLED = 0.05
"""A step has settled when what is left of it stays within this share of it, or within ``CLOSE``."""
CLOSE = {"psi": np.radians(1.0), "z": 0.1}
LONGEST_SEGMENT = 30.0
"""Length [s] of the segments of a spectrum."""
BANDS = ((0.0, 0.1), (0.1, 0.5), (0.5, 2.0))
"""Bands of a spectrum [Hz]: course and depth keeping, manoeuvres, roll and noise."""


@dataclass(frozen=True)
class Step:
    """An order that jumped at sample ``at`` from ``before`` to ``after`` and held to ``end``."""

    at: int
    end: int
    before: float
    after: float


def runs(held: NDArray[np.bool_]) -> list[Span]:
    """The runs of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], held.astype(int), [0]])))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def filled(values: Array, tick: float, hold: float = 1.0) -> Array:
    """``values`` (N,) with holes up to ``hold`` [s] bridged by straight lines."""
    held = np.isfinite(values)
    if held.all() or held.sum() < 2:
        return values
    out = np.interp(np.arange(len(values)), np.flatnonzero(held), values[held])
    for a, b in runs(~held):
        if a == 0 or b == len(values) or (b - a + 1) * tick > hold + 1e-9:
            out[a:b] = np.nan
    return np.asarray(out)


def steady_turns(r: Array, tick: float) -> list[Span]:
    """Spans of a yaw rate (N,) [rad/s] that stands: its spread over ``WINDOW`` is below ``STEADY`` of its mean.

    A span is ``SMOOTH`` shorter on both sides than the window that shows it.
    """
    wide, narrow = max(2, round(WINDOW / tick)), max(1, round(SMOOTH / tick))
    values = filled(r, tick)
    if len(values) < wide + narrow:
        return []
    smooth = _mean(values, narrow)
    mean, square = _mean(smooth, wide), _mean(smooth**2, wide)
    spread = np.sqrt(np.maximum(square - mean**2, 0.0))
    with np.errstate(invalid="ignore"):
        steady = (np.abs(mean) > TURNING) & (spread < STEADY * np.abs(mean))
    out = np.zeros(len(values), dtype=bool)
    half = wide // 2
    for a, b in runs(steady):
        # What the averages have drawn in from before and after is left out.
        out[max(0, a - half + narrow) : b + half - narrow] = True
    return runs(out & np.isfinite(values))


def _mean(values: Array, width: int) -> Array:
    """Moving mean of ``width`` samples around each; NaN where the window leaves the values or meets a hole."""
    held = np.isfinite(values)
    total = np.cumsum(np.concatenate([[0.0], np.where(held, values, 0.0)]))
    count = np.cumsum(np.concatenate([[0], held.astype(int)]))
    out = np.full(len(values), np.nan)
    first = width // 2
    whole = count[width:] - count[:-width] == width
    part = np.where(whole, (total[width:] - total[:-width]) / width, np.nan)
    out[first : first + len(part)] = part
    return out


def reversals(rudder: Array, tick: float) -> list[int]:
    """Samples at which a rudder (N,) [rad] goes over to the other side, with ``RUDDER`` or more on both."""
    values = np.nan_to_num(rudder)
    level = max(RUDDER, 0.5 * float(np.percentile(np.abs(values), 90)))
    side = np.where(values >= level, 1, np.where(values <= -level, -1, 0))
    there = np.flatnonzero(side)
    changes = [int(b) for a, b in pairwise(there) if side[a] != side[b]]
    gaps = np.diff([*changes, len(values)])
    kept = [at for at, gap in zip(changes, gaps, strict=True) if gap * tick >= DWELL]
    # The reversal is where the rudder passes zero, not where it has arrived on the other side.
    return [_crossing(values, at) for at in kept]


def _crossing(values: Array, at: int) -> int:
    side = np.sign(values[at])
    while at > 0 and np.sign(values[at - 1]) == side:
        at -= 1
    return at


def swing(psi: Array, r: Array, at: int, end: int, tick: float) -> tuple[float, float]:
    """Overshoot [rad] of the heading beyond that at a reversal, and the time [s] to it; NaN where it does not end."""
    part = filled(psi[at:end], tick)
    rate = filled(r[max(0, at - 3) : at + 4], tick)
    if len(part) < 3 or not np.isfinite(part).all() or not np.isfinite(rate).any():
        return np.nan, np.nan
    over = np.sign(np.nanmean(rate)) * (part - part[0])
    top = int(np.argmax(over))
    if not 0 < top < len(part) - 1:
        return np.nan, np.nan
    return float(over[top]), float(top * tick)


def steps_of(order: Array, least: float, tick: float) -> list[Step]:
    """Jumps of an order (N,) by ``least`` or more that then holds for ``HOLD`` seconds; NaN where it does not act."""
    out = []
    for a, b in runs(np.isfinite(order)):
        values = order[a:b]
        edges = [*(np.flatnonzero(np.abs(np.diff(values)) >= 0.2 * least) + 1).tolist(), len(values)]
        for at, end in pairwise(edges):
            if abs(values[at] - values[at - 1]) >= least and (end - at) * tick >= HOLD:
                out.append(Step(a + at, a + end, float(values[at - 1]), float(values[at])))
    return out


def answer(values: Array, step: Step, close: float, tick: float) -> tuple[float, float]:
    """Overshoot beyond the order, and settling time [s]; NaN where the record has holes or it does not settle."""
    part = filled(values[step.at : step.end], tick)
    if len(part) < 3 or not np.isfinite(part).all():
        return np.nan, np.nan
    size = step.after - step.before
    over = max(0.0, float((np.sign(size) * (part - step.after)).max()))
    outside = np.flatnonzero(np.abs(part - step.after) > max(SETTLED * abs(size), close))
    if not len(outside):
        return over, 0.0
    last = int(outside[-1])
    return over, (np.nan if last >= len(part) - 2 else (last + 1) * tick)


def power(values: Array, spans: Sequence[Span], tick: float) -> tuple[Array, Array]:
    """Frequencies (F,) [Hz] and one-sided power spectral density (..., F) of (..., N), over the segments of all spans.

    Source     welch1967: Hann windows of ``LONGEST_SEGMENT`` seconds that overlap by half, each less its mean.
    """
    frequency, density, _ = _welch(values, values, spans, tick)
    return frequency, np.real(density)


def coherence(a: Array, b: Array, spans: Sequence[Span], tick: float, band: tuple[float, float]) -> float:
    """Coherence of two channels in a band, weighted by the power of the first; NaN with fewer than four segments.

    Source     welch1967, the cross spectrum averaged likewise.
    """
    frequency, cross, count = _welch(a, b, spans, tick)
    if count < 4:
        return np.nan
    first, second = (_welch(one, one, spans, tick)[1].real for one in (a, b))
    inside = (frequency >= band[0]) & (frequency < band[1]) & (first * second > 0.0)
    if not inside.any():
        return np.nan
    shared = np.abs(cross[inside]) ** 2 / (first[inside] * second[inside])
    return float(np.average(shared, weights=first[inside]))


def band_rms(values: Array, spans: Sequence[Span], tick: float, band: tuple[float, float]) -> Array:
    """Root of the power (M,) of ``values`` (M, N) in a band, zero frequency left out; NaN without a whole segment."""
    frequency, density = power(values, spans, tick)
    inside = (frequency >= band[0]) & (frequency < band[1]) & (frequency > 0.0)
    if not inside.any():
        return np.full(len(values), np.nan)
    return np.asarray(np.sqrt(density[:, inside].sum(axis=1) * (frequency[1] - frequency[0])))


def _welch(a: Array, b: Array, spans: Sequence[Span], tick: float) -> tuple[Array, Array, int]:
    from scipy.signal import csd

    n = round(LONGEST_SEGMENT / tick)
    usable = [(x, y) for x, y in spans if y - x >= n]
    total, count, frequency = np.zeros(0), 0, np.zeros(0)
    for x, y in usable:
        segments = (y - x - n) // (n - n // 2) + 1
        frequency, density = csd(
            a[..., x:y], b[..., x:y], fs=1.0 / tick, window="hann", nperseg=n, noverlap=n // 2, detrend="constant"
        )
        total = density * segments if not count else total + density * segments
        count += segments
    return np.asarray(frequency), np.asarray(total / count if count else total), count
