"""A record and the model side by side, with the band of craft drawn from the uncertainty of the derivatives."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from towtank.errors import InputError
from towtank.field.align import Lag, lag_of, moved
from towtank.field.begin import Beginning
from towtank.field.comparing import signals
from towtank.field.comparing.draws import SEED, drawn
from towtank.field.comparing.metrics import COMPARED, METRICS, Marks, Metric, able, marks_of, read
from towtank.field.comparing.result import (
    GROWTH,
    ChannelScore,
    Comparison,
    Score,
    Series,
    Spectrum,
    Uncertainty,
)
from towtank.field.course import Course, course_of, held
from towtank.field.log import CHANNELS, SeaLog
from towtank.field.replay import Replay, Scatter, flown
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.pilot.law import Pilot
from towtank.progress import Progress, Silent
from towtank.provenance import digest, provenance

SAMPLES = 200
"""Craft that make the band."""
LOW, HIGH = 0.025, 0.975
"""Ends of the 95 % band."""
NOISY = 50
"""Noisy records of the best estimate from which the uncertainty of the data is read."""


@dataclass(frozen=True)
class _Sides:
    """What is compared, on the ticks of the record: record and best estimate (N,), finer steps (N,), craft (M, N)."""

    record: Mapping[str, Array]
    model: Mapping[str, Array]
    finer: Mapping[str, Array]
    craft: Mapping[str, Array]
    std: Mapping[str, float]
    bias: Mapping[str, float]
    marks: Marks
    spans: tuple[tuple[int, int], ...]
    scatter: Scatter


def compare(
    model: Model,
    log: SeaLog,
    *,
    pilot: Pilot | None = None,
    horizon: float | None = None,
    samples: int = SAMPLES,
    align: bool | None = None,
    start: Beginning | None = None,
    speed: float | None = None,
    seed: int = SEED,
    pilot_name: str = "",
    progress: Progress | None = None,
) -> Comparison:
    """Replay ``log`` with ``model`` and put both side by side, metric by metric.

    Parameters
    ----------
    pilot, horizon, start, speed : as for ``towtank.field.course.course_of``.
    samples : craft drawn from the covariance of the derivatives for the band; they share the inputs of the record.
    align : True takes out the lag between record and model, False leaves it, None as in ``lag_of``.

    Source     ittc75020603 for what is laid beside each other; ittc75030101 and asmevv20 for E = D - S, U_val from
               input, numbers and data, and "validated at the level U_val" for |E| <= U_val.
    Departure  The uncertainties are half the 95 % intervals of craft, begins and noise that are drawn, not sums of
               sensitivities.

    Raises
    ------
    InputError
        A record that cannot be replayed, or that measured nothing of the motion.
    """
    bars = progress or Silent()
    course = course_of(model, log, pilot=pilot, horizon=horizon, start=start, speed=speed)
    names = [name for name in COMPARED if name in course.drive.seen and np.isfinite(course.drive.seen[name]).sum() > 3]
    if not names:
        raise InputError(
            f"log {log.name}: it measured nothing of the motion, so there is nothing to compare. Give one channel "
            f"or more of {', '.join(COMPARED)}."
        )
    best = flown(course, names=names)
    fine = flown(course, names=names, finer=2)
    scatter = drawn(model, samples, seed, log.bias)
    many = flown(course, scatter, names=names, progress=bars)
    record = _record(course, log, model, names)
    lag = lag_of(
        record, {name: values[0] for name, values in best.channels.items()}, course.drive.clock.tick, align=align
    )
    sides = _sides(course, log, record, best, fine, many, lag, scatter)
    channels = tuple(_channel(name, sides, course) for name in _told(sides, course))
    metrics = tuple(score for score in (_metric(metric, sides, course.loop) for metric in METRICS) if score)
    included, missing = _uncertainties(course, log, names, samples)
    return Comparison(
        name=log.name, craft=model.craft.name, record_level=log.level, level=model.derivatives.level, loop=course.loop,
        pilot=pilot_name if pilot else "", horizon=horizon, samples=samples, tick=course.drive.clock.tick,
        parts=tuple((float(best.time[p.first]), float(best.time[p.last])) for p in course.parts), lag=lag,
        current=course.current.flow, current_std=course.current.std, channels=channels, metrics=metrics,
        series=_series(best.time, sides), spectra=_spectra(sides), assumed=tuple(log.assumed), included=included,
        missing=missing, words=(lag.words, *many.words, *_doubts(log)),
        flags=dict(Counter(flag.kind for flag in log.flags)),
        provenance=provenance(
            {"log": digest({n: v.tolist() for n, v in log.channels.items()}, 16),
             "derivatives": digest(model.derivatives.as_dict(), 16)}
        ),
    )  # fmt: skip


def _record(course: Course, log: SeaLog, model: Model, names: Sequence[str]) -> dict[str, Array]:
    """Channels (N + 1,) of the record on the ticks: the motion, the fins, the virtual rudder, the orders."""
    from towtank.field.drive import nearest

    time, tick = course.drive.time, course.drive.clock.tick
    out = {name: np.array(course.drive.seen[name]) for name in names}
    fins = [f"delta{i + 1}" for i in range(len(model.craft.fins))]
    if log.has(*fins):
        out |= {name: nearest(log.time, log[name], time, tick) for name in fins}
        out["rudder"] = np.asarray(model.virtual([out[name] for name in fins])[0])
    elif log.has("rudder"):
        out["rudder"] = nearest(log.time, log["rudder"], time, tick)
    for name, other in (("heading_order", "turn_order"), ("depth_order", "pitch_order")):
        (values, since), (_, later) = held(log, name, time), held(log, other, time)
        acts = np.isfinite(since) & ~(later > since)
        if acts.any():
            out[name] = np.append(np.where(acts, values, np.nan), np.nan)
    return out


def _sides(
    course: Course, log: SeaLog, record: dict[str, Array], best: Replay, fine: Replay, many: Replay, lag: Lag,
    scatter: Scatter,
) -> _Sides:  # fmt: skip
    tick = course.drive.clock.tick
    shift = lag.seconds if lag.applied else 0.0
    shared = [name for name in best.channels if name in record and name not in ("rudder", "elevator", "aileron")]
    spans = tuple((part.first, part.last + (1 if part is course.parts[-1] else 0)) for part in course.parts)
    inside = np.zeros(len(best.time), dtype=bool)
    for a, b in spans:
        inside[a:b] = True
    kept = {name: np.where(inside, values, np.nan) for name, values in record.items()}
    sizes = {word: {name: float(getattr(log, word).get(name, 0.0)) for name in shared} for word in ("std", "bias")}
    return _Sides(
        kept,
        {name: moved(best[name][0], shift, tick) for name in shared},
        {name: moved(fine[name][0], shift, tick) for name in shared},
        {name: moved(many[name], shift, tick) for name in shared},
        sizes["std"], sizes["bias"], marks_of(kept, spans, tick), spans, scatter,
    )  # fmt: skip


def _told(sides: _Sides, course: Course) -> list[str]:
    """Channels whose error is told: the motion, and the fins where a pilot moves them."""
    return [name for name in sides.model if not name.startswith("delta") or course.loop == "closed"]


def _noise(sides: _Sides, name: str, count: int, length: int) -> Array:
    """Noise and bias (count, length) of the sensor of a channel, as the record states them.

    The first ``scatter.count`` biases are those with which the craft began.
    """
    place = list(CHANNELS).index(name)
    random = np.random.default_rng((sides.scatter.seed, 2, place))
    white = random.standard_normal((count, length), dtype=np.float32) * sides.std[name]
    offset = sides.scatter.bias.get(name, np.zeros(sides.scatter.count))
    return np.asarray(white + np.resize(offset, count)[:, None])


def band_of(values: Array) -> tuple[Array, Array]:
    """Ends (N,) of the band of ``values`` (M, N), craft that are lost (NaN) left out.

    Source     jcgm100, 7.7 of supplement 1: quantiles of drawn values, by straight lines between them.
    """
    rows = np.sort(values, axis=0)  # NaN goes last
    count = np.isfinite(values).sum(axis=0)
    column = np.arange(values.shape[1])

    def at(share: float) -> Array:
        place = np.maximum(count - 1, 0) * share
        low = np.floor(place).astype(int)
        high = np.minimum(low + 1, np.maximum(count - 1, 0))
        return np.asarray(rows[low, column] + (place - low) * (rows[high, column] - rows[low, column]), dtype=float)

    return at(LOW), at(HIGH)


def _half(values: Array) -> float:
    """Half the width of the 95 % interval of ``values`` (M,), NaN where fewer than half are there."""
    there = values[np.isfinite(values)]
    if len(there) < max(2, 0.5 * len(values)):
        return float("nan")
    low, high = np.quantile(there, (LOW, HIGH))
    return float(0.5 * (high - low))


def _more(together: float, alone: float) -> float:
    """What has to be added to ``alone``, as squares, for ``together``; 0 where the two make up for each other."""
    return float(np.sqrt(max(together**2 - alone**2, 0.0))) if np.isfinite(together + alone) else float("nan")


def _channel(name: str, sides: _Sides, course: Course) -> ChannelScore:
    record, model, craft = sides.record[name], sides.model[name], sides.craft[name]
    off = record - model
    good = np.isfinite(off)
    noise = _noise(sides, name, len(craft), len(record))
    low, high = band_of(craft)
    wide_low, wide_high = band_of(craft + noise)
    scatter = craft[:, good] - model[good]
    with np.errstate(all="ignore"):
        drift = np.nanmean(scatter, axis=1)
        both = np.nanmean(scatter + noise[:, good], axis=1)
        expected = np.sqrt(np.nanmean((scatter + noise[:, good]) ** 2))
    numerical = abs(float(np.nanmean(sides.finer[name][good] - model[good]))) if good.any() else np.nan
    mean, rms = (float(np.mean(off[good])), float(np.sqrt(np.mean(off[good] ** 2)))) if good.any() else (np.nan,) * 2
    unit = CHANNELS[name][0]
    bias = Score(
        f"bias of {name}", name, unit, "mean of record less model", "ittc75030101", mean, 0.0,
        Uncertainty(_half(drift), numerical, _more(_half(both), _half(drift))),
    )  # fmt: skip
    spread = float(np.std(record[good])) if good.any() else np.nan
    return ChannelScore(
        name, unit, int(good.sum()), bias, rms, rms / spread if spread > 0.0 else np.nan, float(expected),
        _share(record, low, high, good), _share(record, wide_low, wide_high, good), _growth(off, sides, course),
        tuple(_rms(off[a:b]) for a, b in sides.spans), float(np.hypot(sides.std[name], sides.bias[name])),
    )  # fmt: skip


def _share(record: Array, low: Array, high: Array, good: Array) -> float:
    inside = (record[good] >= low[good]) & (record[good] <= high[good])
    return float(inside.mean()) if len(inside) else np.nan


def _rms(off: Array) -> float:
    there = off[np.isfinite(off)]
    return float(np.sqrt(np.mean(there**2))) if len(there) else float("nan")


def _growth(off: Array, sides: _Sides, course: Course) -> tuple[float, ...]:
    """Rms at ``GROWTH`` after the begins: samples within a second of that time, over all parts that are so long."""
    tick = course.drive.clock.tick
    out = []
    for after in GROWTH:
        near = round(0.5 / tick)
        places = [a + round(after / tick) for a, b in sides.spans if a + round(after / tick) <= b]
        out.append(
            _rms(np.concatenate([off[max(0, p - near) : p + near + 1] for p in places]) if places else np.zeros(0))
        )
    return tuple(out)


def _metric(metric: Metric, sides: _Sides, loop: str) -> Score | None:
    """A metric of record, model and craft; None where the record has none.

    The model is read through the sensors of the record: the mean over noisy copies of it. So noise that adds to a
    metric, as to a power or a travel, adds on both sides.
    """
    if not able(metric, sides.record, loop):
        return None
    marks, needed = sides.marks, _needed(metric.needs, sides.model)
    seen = {name: np.isfinite(sides.record[name]) for name in needed}

    def of(motions: Mapping[str, Array]) -> Array:
        # Read where the record has samples, so that a slow sensor counts alike on both sides.
        return read(metric, {name: np.where(seen[name], motions[name], np.nan) for name in needed}, marks)

    own = float(of({name: sides.record[name][None] for name in needed})[0])
    if not np.isfinite(own):
        return None
    bare = float(of({name: sides.model[name][None] for name in needed})[0])
    craft, finer = of(sides.craft), float(of({name: sides.finer[name][None] for name in needed})[0])
    model, data = bare, 0.0
    if any(sides.std[name] or sides.bias[name] for name in needed):
        noise = {name: _noise(sides, name, NOISY, len(seen[name])) for name in needed}
        noisy = of({name: sides.model[name] + noise[name] for name in needed})
        model, data = float(np.mean(noisy)), _half(noisy)
    return Score(
        metric.name, metric.channel, metric.unit, metric.formula, metric.source, own, model,
        Uncertainty(_half(craft - bare), abs(finer - bare), data), float(np.isfinite(craft).mean()),
    )  # fmt: skip


def _needed(needs: Sequence[str], have: Mapping[str, Array]) -> list[str]:
    out = [one for need in needs for one in need.split("|") if one in have]
    return out + [name for name in have if name.startswith("delta") and "delta1" in needs and name not in out]


def _series(time: Array, sides: _Sides) -> Series:
    bands = {name: band_of(values) for name, values in sides.craft.items()}
    record = {name: values for name, values in sides.record.items() if name in bands or name in CHANNELS}
    return Series(
        time, record, dict(sides.model), {n: b[0] for n, b in bands.items()}, {n: b[1] for n, b in bands.items()}
    )


def _spectra(sides: _Sides) -> tuple[Spectrum, ...]:
    out = []
    for name in ("r", "q"):
        if name not in sides.model:
            continue
        own, other = (signals.filled(one[name], sides.marks.tick) for one in (sides.record, sides.model))
        both = np.isfinite(own) & np.isfinite(other)
        spans = [(a + x, a + y) for a, b in sides.spans for x, y in signals.runs(both[a:b])]
        frequency, record = signals.power(own, spans, sides.marks.tick)
        if not len(frequency):
            continue
        model = signals.power(other, spans, sides.marks.tick)[1]
        shared = tuple(signals.coherence(own, other, spans, sides.marks.tick, band) for band in signals.BANDS)
        out.append(Spectrum(name, frequency, record, model, shared))
    return tuple(out)


def _doubts(log: SeaLog) -> list[str]:
    """The flags of a record in one line; nothing is left out because of them."""
    found = Counter(flag.kind for flag in log.flags)
    told = ", ".join(f"{count} {kind}" for kind, count in found.items())
    return [f"flags of the record: {told}; flagged samples are compared as they stand"] if found else []


def _uncertainties(
    course: Course, log: SeaLog, names: Sequence[str], samples: int
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """What U_val holds and what it does not, in words."""
    stated = [name for name in names if log.std.get(name) or log.bias.get(name)]
    silent = [name for name in names if name not in stated]
    guessed = [name for name in stated if name in log.assumed]
    included = [
        f"input: derivatives, {samples} craft drawn from their covariance (fit, mesh and model form)",
        "input: state at each begin, by the errors of its fit",
        "numerical: the same flight with half the step",
    ]
    if course.current.std.any():
        included.append("input: mean current, by its standard error")
    if stated:
        more = f" (assumed: {', '.join(guessed)})" if guessed else ""
        included.append(f"data: noise and bias of {', '.join(stated)}{more}")
    missing = ["currents that change in time and depth", "mass, centre of gravity and fins of the craft as it swam"]
    fins = [name for name in log.bias if name.startswith("delta") and log.bias[name] > 0.0]
    if course.pilot is None and fins:
        included.append("input: fin angles, by their stated bias")
        missing.append("noise of the fin angles in the record")
    elif course.pilot is None:
        missing.append("errors of the fin angles in the record")
    else:
        missing.append("differences between this pilot, which sees without noise, and the one aboard")
    missing += [f"what the record does not tell ({word})" for word in course.words if "rests at its trim" in word]
    if silent:
        missing.append(f"noise and bias of {', '.join(silent)}: not stated in the record")
    return tuple(included), tuple(missing)
