"""The metrics of a comparison, fixed in advance: name, channel, formula, unit, source, as data in one place."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from towtank.field.comparing import signals
from towtank.field.comparing.signals import BANDS, CLOSE, Span, Step, filled
from towtank.field.log import MEASURED
from towtank.frames import Array

COMPARED = tuple(MEASURED)
"""Channels whose error is told."""


@dataclass(frozen=True)
class Marks:
    """Where things happen in a record; the model is read at the same places.

    tick [s].   spans : whole parts that were flown.   turns : steady turns.   reversals : (at, end) of the swing after
    each reversal of the rudder.   heading, depth : steps of the orders.
    """

    tick: float
    spans: tuple[Span, ...] = ()
    turns: tuple[Span, ...] = ()
    reversals: tuple[Span, ...] = ()
    heading: tuple[Step, ...] = ()
    depth: tuple[Step, ...] = ()


Motion = Mapping[str, Array]
"""Channel -> (N,), NaN where there is nothing; a channel may be absent."""
Motions = Mapping[str, Array]
"""Channel -> (M, N), likewise, of M craft."""
Reader = Callable[[Motions, Marks], Array]


@dataclass(frozen=True)
class Metric:
    """One number that is read alike from the record, the model and every drawn craft.

    needs : channels it takes, all of them.   formula, source : in words.   loop : "closed" for what says nothing in
    open loop, "" else.
    """

    name: str
    channel: str
    unit: str
    formula: str
    source: str
    needs: tuple[str, ...]
    of: Reader
    loop: str = ""


def marks_of(record: Motion, spans: Sequence[Span], tick: float) -> Marks:
    """Turns, swings and steps of a record; ``rudder``, ``heading_order`` and ``depth_order`` stand among its channels.

    A swing is looked for only where no heading is ordered, so that the rudder itself is the order; and within a part.
    """
    turns: tuple[Span, ...] = ()
    if "r" in record:
        found = [(max(a, x), min(b, y)) for a, b in signals.steady_turns(record["r"], tick) for x, y in spans]
        turns = tuple((a, b) for a, b in found if (b - a) * tick >= 0.5 * signals.WINDOW)
    swings: list[Span] = []
    ordered = "heading_order" in record and np.isfinite(record["heading_order"]).any()
    if "rudder" in record and not ordered:
        at = signals.reversals(record["rudder"], tick)
        swings = list(pairwise([*at, len(record["rudder"])]))
    within = [(a, b) for a, b in swings for x, y in spans if x <= a and b <= y]
    steps = {
        name: tuple(signals.steps_of(record[name], least, tick)) if name in record else ()
        for name, least in (("heading_order", signals.HEADING_STEP), ("depth_order", signals.DEPTH_STEP))
    }
    return Marks(tick, tuple(spans), turns, tuple(within), steps["heading_order"], steps["depth_order"])


def _mean(values: Sequence[float]) -> float:
    held = [value for value in values if np.isfinite(value)]
    return float(np.mean(held)) if held else np.nan


def _in_turns(values: Array, marks: Marks) -> float:
    return _average(np.concatenate([values[a:b] for a, b in marks.turns])) if marks.turns else np.nan


def _turn_rate(m: Motion, marks: Marks) -> float:
    return _in_turns(np.abs(m["r"]), marks)


def _turn_radius(m: Motion, marks: Marks) -> float:
    speed = m["ahead"] if "ahead" in m else m["u"] if "u" in m else m["speed"]
    return _in_turns(speed, marks) / _in_turns(np.abs(m["r"]), marks)


def _average(values: Array) -> float:
    held = values[np.isfinite(values)]
    return float(held.mean()) if len(held) else np.nan


def _swings(m: Motion, marks: Marks, which: int) -> float:
    return _mean([signals.swing(m["psi"], m["r"], a, b, marks.tick)[which] for a, b in marks.reversals])


def _steps(m: Motion, marks: Marks, channel: str, which: int) -> float:
    steps = marks.heading if channel == "psi" else marks.depth
    return _mean([signals.answer(m[channel], step, CLOSE[channel], marks.tick)[which] for step in steps])


def _fins(m: Motion) -> list[Array]:
    return [m[name] for name in sorted(m) if name.startswith("delta")]


def _fin_rms(m: Motion, marks: Marks) -> float:
    squares = [_average(fin[a:b] ** 2) for fin in _fins(m) for a, b in marks.spans]
    return float(np.sqrt(_mean(squares)))


def _fin_travel(m: Motion, marks: Marks) -> float:
    swept, way = [], 0.0
    speed = m["ahead"] if "ahead" in m else m["u"] if "u" in m else m["speed"]
    fins = _fins(m)
    for a, b in marks.spans:
        swept += [float(np.nansum(np.abs(np.diff(fin[a:b])))) for fin in fins]
        way += _average(speed[a:b]) * (b - a - 1) * marks.tick
    return sum(swept) / (len(fins) * way) if way > 0.0 else np.nan


def _band(m: Motions, marks: Marks, channel: str, band: tuple[float, float]) -> Array:
    values = np.stack([filled(row, marks.tick) for row in m[channel]])
    there = np.isfinite(values)
    share = there.mean(axis=1)
    # A craft that was lost has no power; it must not take away the spans of the others.
    held = there[share >= 0.5 * float(share.max())].all(axis=0)
    spans = [(a + x, a + y) for a, b in marks.spans for x, y in signals.runs(held[a:b])]
    return signals.band_rms(values, spans, marks.tick, band)


def _each(of: Callable[[Motion, Marks], float]) -> Reader:
    """``of`` one motion, for many."""

    def read(m: Motions, marks: Marks) -> Array:
        count = len(next(iter(m.values())))
        return np.array([of({name: rows[i] for name, rows in m.items()}, marks) for i in range(count)])

    return read


def _spectral() -> list[Metric]:
    out = []
    for channel in ("r", "q"):
        for low, high in BANDS:
            formula = f"root of the power spectral density of {channel} over {low:g} to {high:g} Hz"

            def read(
                m: Motions, marks: Marks, channel: str = channel, band: tuple[float, float] = (low, high)
            ) -> Array:
                return _band(m, marks, channel, band)

            out.append(
                Metric(f"{channel}_power_{low:g}_{high:g}_hz", channel, "rad/s", formula, "welch1967", (channel,), read)
            )
    return out


METRICS: tuple[Metric, ...] = (
    Metric(
        "turn_rate", "r", "rad/s", "mean of |r| over the steady turns of the record", "ittc75040201", ("r",),
        _each(_turn_rate),
    ),
    Metric(
        "turn_radius", "r", "m", "mean speed over mean |r| in the steady turns; speed through the water where measured",
        "ittc75040201", ("r", "u|ahead|speed"), _each(_turn_radius),
    ),
    Metric(
        "swing_overshoot", "psi", "rad", "mean over the rudder's reversals of the heading beyond that at a reversal",
        "imo2002", ("psi", "r"), _each(lambda m, marks: _swings(m, marks, 0)),
    ),
    Metric(
        "swing_time", "psi", "s", "mean time from a reversal of the rudder to the largest heading", "imo2002",
        ("psi", "r"), _each(lambda m, marks: _swings(m, marks, 1)),
    ),
    Metric(
        "heading_overshoot", "psi", "rad", "mean heading beyond the order after a step of it", "definition", ("psi",),
        _each(lambda m, marks: _steps(m, marks, "psi", 0)), "closed",
    ),
    Metric(
        "heading_settling", "psi", "s", "mean time until the heading stays within 5 % of a step, or 1 deg", "towtank",
        ("psi",), _each(lambda m, marks: _steps(m, marks, "psi", 1)), "closed",
    ),
    Metric(
        "depth_overshoot", "z", "m", "mean depth beyond the order after a step of it", "definition", ("z",),
        _each(lambda m, marks: _steps(m, marks, "z", 0)), "closed",
    ),
    Metric(
        "depth_settling", "z", "s", "mean time until the depth stays within 5 % of a step, or 0.1 m", "definition",
        ("z",), _each(lambda m, marks: _steps(m, marks, "z", 1)), "closed",
    ),
    Metric(
        "fin_rms", "delta", "rad", "root of the mean square fin angle", "definition", ("delta1",), _each(_fin_rms),
        "closed",
    ),
    Metric(
        "fin_travel", "delta", "rad/m", "mean angle that a fin sweeps over the way made", "towtank",
        ("delta1", "u|ahead|speed"), _each(_fin_travel), "closed",
    ),
    *_spectral(),
)  # fmt: skip
"""What is read from record, model and drawn craft. A metric of which the record has nothing is left out."""


def able(metric: Metric, record: Motion, loop: str) -> bool:
    """Whether a record in a loop has what a metric takes."""
    if metric.loop and metric.loop != loop:
        return False
    return all(any(one in record for one in need.split("|")) for need in metric.needs)


def read(metric: Metric, motions: Motions, marks: Marks) -> Array:
    """The metric (M,) of M motions; NaN where one has none."""
    with np.errstate(all="ignore"):
        return metric.of(motions, marks)


ERRORS: Mapping[str, tuple[str, str]] = {
    "bias": ("mean of record less model", "ittc75030101"),
    "rms": ("root of the mean square of record less model", "ittc75030101"),
    "nrms": ("rms over the standard deviation of the record", "definition"),
    "inside": ("share of the samples within the 95 % band of the drawn craft", "jcgm100"),
    "inside_with_noise": ("the same with the noise and bias of the sensors added to the craft", "jcgm100"),
}
"""Errors that are told of every channel -> formula, source."""
