"""How late a record stands behind the model, by cross-correlation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from towtank.frames import Array

CANDIDATES = ("r", "q", "psi", "theta", "z")
"""Channels that tell a lag, quickest first: the first whose correlation is ``HIGH``, else that with the highest."""
LONGEST = 5.0
"""Longest lag [s] that is looked for."""
SHARE = 0.25
"""Longest lag as a share of the record."""
HIGH = 0.9
"""Correlation from which a lag is taken for one of the clocks, and not for a difference of the motions."""
GAIN = 0.5
"""Share to which a lag must bring down what the correlation lacks to 1, to be taken for one of the clocks."""
LEAST = 20
"""Samples that record and model must have in common at a lag."""


@dataclass(frozen=True)
class Lag:
    """The record says at t + ``seconds`` what the model does at t.

    peak : normalised correlation there, 1 for motions of one shape; before : at no lag.   channel : that tells it.
    applied : whether the comparison takes it out.   words : all this in words.
    """

    seconds: float = 0.0
    peak: float = float("nan")
    before: float = float("nan")
    channel: str = ""
    applied: bool = False
    words: str = "time alignment: not told, no channel moves enough; record and model are compared as they stand"


def lag_of(record: Mapping[str, Array], model: Mapping[str, Array], tick: float, *, align: bool | None = None) -> Lag:
    """The lag of ``record`` behind ``model``, channels (N,) on one clock of ``tick`` [s], NaN where there is nothing.

    align : True takes it out, False leaves it; None takes out a lag above half a tick whose correlation is ``HIGH`` and
    without which it is plainly lower (``GAIN``).

    Source     Normalised cross-correlation over what both hold at each lag, its peak refined by a parabola through
               three points.
    Valid      Motions with a scale of time shorter than ``LONGEST``; a lag within ``SHARE`` of the record.
    """
    best = Lag()
    for name in CANDIDATES:
        if name in record and name in model:
            found = _lag(np.asarray(record[name]), np.asarray(model[name], dtype=float), tick, name)
            if found is not None and not found.peak <= best.peak:
                best = found
        if best.peak >= HIGH:
            break
    if not best.channel:
        return best
    plain = best.peak >= HIGH and 1.0 - best.peak <= GAIN * (1.0 - best.before)
    applied = bool(align if align is not None else abs(best.seconds) > 0.5 * tick and plain)
    said = "taken out of the comparison" if applied else "left as it is"
    words = (
        f"time alignment: the record is {abs(best.seconds):.3g} s {'behind' if best.seconds >= 0 else 'ahead of'} the "
        f"model by {best.channel}, correlation {best.peak:.3f} there and {best.before:.3f} without a shift; {said}"
    )
    return Lag(best.seconds, best.peak, best.before, best.channel, applied, words)


def _lag(record: Array, model: Array, tick: float, name: str) -> Lag | None:
    from scipy.signal import correlate

    seen = np.isfinite(record) & np.isfinite(model)
    if seen.sum() < LEAST:
        return None
    a_held, b_held = np.isfinite(record), np.isfinite(model)
    a = np.where(a_held, record - np.median(record[a_held]), 0.0)
    b = np.where(b_held, model - np.median(model[b_held]), 0.0)
    if not (a.any() and b.any()):
        return None

    def over(x: Array, y: Array) -> Array:
        return np.asarray(correlate(x, y, mode="full", method="fft"))

    both = over(a_held.astype(float), b_held.astype(float))
    power = over(a * a, b_held.astype(float)) * over(a_held.astype(float), b * b)
    least = 1e-12 * float(power.max())
    value = np.where(power > least, over(a, b) / np.sqrt(np.maximum(power, least)), -np.inf)
    shifts = np.arange(-(len(b) - 1), len(a))
    reach = min(LONGEST, SHARE * len(a) * tick)
    inside = (np.abs(shifts) * tick <= reach + 1e-9) & (both > LEAST - 0.5)
    if not inside.any():
        return None
    value = np.where(inside, value, -np.inf)
    top = int(np.argmax(value))
    offset, peak = _parabola(value, top)
    before = float(value[int(np.flatnonzero(shifts == 0)[0])])
    return Lag(float((shifts[top] + offset) * tick), float(peak), before, name)


def _parabola(value: Array, top: int) -> tuple[float, float]:
    """Place, from ``top``, and height of the parabola through the values around it."""
    if not 0 < top < len(value) - 1 or not np.isfinite(value[top - 1 : top + 2]).all():
        return 0.0, float(value[top])
    low, mid, high = value[top - 1 : top + 2]
    bend = low - 2.0 * mid + high
    if bend >= 0.0:
        return 0.0, float(mid)
    offset = 0.5 * (low - high) / bend
    return float(offset), float(mid - 0.25 * (low - high) * offset)


def moved(values: Array, seconds: float, tick: float) -> Array:
    """Rows ``values`` (..., N) as they were ``seconds`` earlier, by straight lines; NaN beyond the ends."""
    if seconds == 0.0:
        return values
    n = values.shape[-1]
    at = np.arange(n) - seconds / tick
    low = np.floor(at).astype(int)
    share = at - low
    inside = (low >= 0) & (low + 1 < n)
    a, b = np.clip(low, 0, n - 1), np.clip(low + 1, 0, n - 1)
    out = (1.0 - share) * values[..., a] + share * values[..., b]
    return np.asarray(np.where(inside, out, np.nan), dtype=values.dtype)
