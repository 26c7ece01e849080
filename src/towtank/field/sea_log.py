"""What instruments make of a swim: a record with noise, offsets, readings now and then, dropouts and counts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towtank.errors import InputError
from towtank.field.log import CHANNELS, FINS, MEASURED, Flag, SeaLog
from towtank.field.sea import Swim
from towtank.field.sea_water import check_seed
from towtank.frames import Array
from towtank.pilot.sensors import TYPICAL, Reading
from towtank.provenance import digest, provenance

Mask = NDArray[np.bool_]

SMOOTH = (*MEASURED, *(f"delta{i + 1}" for i in range(FINS)))
"""Channels that go on a straight line between control periods; thrust, commands and orders are held."""
LARGEST_JITTER = 0.4
"""A time stamp is off by at most this share of the period of the record, so that the order of the rows stays."""


@dataclass(frozen=True)
class Instrument:
    """One instrument and the ``channels`` it gives, in the unit of each.

    reading : period [s] (0 is every row), std of its white noise, std of an offset drawn once a record.   step : of its
    counts, 0 for none.   dropout : probability that a reading begins a dropout, which lasts ``lasting`` [s] and takes
    all its channels.   latency [s] : age of what it gives.

    Raises
    ------
    InputError
        A channel that a record does not have, a number that is negative or not finite, or a probability above 1.
    """

    channels: tuple[str, ...]
    reading: Reading = field(default_factory=Reading)
    step: float = 0.0
    dropout: float = 0.0
    lasting: float = 0.0
    latency: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what is no instrument."""
        unknown = [name for name in self.channels if name not in CHANNELS]
        if unknown or not self.channels:
            raise InputError(
                f"instrument: no channel {unknown[0] if unknown else ''!r}. Choose from {', '.join(CHANNELS)}."
            )
        numbers = (self.step, self.dropout, self.lasting, self.latency)
        if not all(np.isfinite(x) and x >= 0.0 for x in numbers) or self.dropout > 1.0:
            raise InputError(
                f"instrument of {', '.join(self.channels)}: step {self.step:g}, dropout {self.dropout:g}, lasting "
                f"{self.lasting:g} s, latency {self.latency:g} s. Give finite numbers of 0 or more; a dropout is a "
                "probability, at most 1."
            )

    @property
    def std(self) -> float:
        """Standard deviation of its white noise with that of its counts, step / sqrt(12)."""
        return float(np.hypot(self.reading.std, self.step / np.sqrt(12.0)))


@dataclass(frozen=True)
class Instruments:
    """What writes a record, a row every ``period`` [s].

    A channel without an instrument is exact in every row; the speed without one is that of the velocities as read.
    jitter [s] : standard deviation of the time stamps, cut off at 0.4 periods.   outages [1/s] : how often the logger
    stands still for ``outage`` [s]; its rows are missing.   left_out : channels that are not recorded.   assumed :
    whether the numbers are assumed, not those of a product.

    Raises
    ------
    InputError
        A channel with two instruments, a period that is not positive, or a negative number.
    """

    items: tuple[Instrument, ...] = ()
    period: float = 0.1
    jitter: float = 0.0
    outages: float = 0.0
    outage: float = 0.0
    left_out: tuple[str, ...] = ()
    assumed: bool = True

    def __post_init__(self) -> None:
        """Refuse what writes no record."""
        names = [name for item in self.items for name in item.channels]
        twice = [name for name in names if names.count(name) > 1]
        if twice:
            raise InputError(f"instruments: {twice[0]} is given by two of them. Give each channel one instrument.")
        numbers = (self.period, self.jitter, self.outages, self.outage)
        if not all(np.isfinite(x) and x >= 0.0 for x in numbers) or self.period == 0.0:
            raise InputError(
                f"instruments: period {self.period:g} s, jitter {self.jitter:g} s, outages {self.outages:g} 1/s of "
                f"{self.outage:g} s. Give a period above zero, the others 0 or more."
            )

    def has(self, channel: str) -> bool:
        """Whether an instrument of its own gives ``channel``."""
        return any(channel in item.channels for item in self.items)

    def of(self, channel: str) -> Instrument:
        """The instrument of ``channel``; an exact one when there is none."""
        return next((item for item in self.items if channel in item.channels), Instrument((channel,)))


def _degrees(value: float) -> float:
    return float(np.radians(value))


STANDARD = Instruments(
    (
        Instrument(("x", "y"), TYPICAL.position, step=0.01, dropout=0.01, lasting=10.0),
        Instrument(("z",), TYPICAL.depth, step=0.001),
        Instrument(("psi",), TYPICAL.compass, step=_degrees(0.1)),
        Instrument(("phi", "theta"), TYPICAL.tilt, step=_degrees(0.1)),
        Instrument(("p", "q", "r"), TYPICAL.gyro, step=_degrees(0.01)),
        Instrument(("u", "v", "w"), TYPICAL.log, step=0.001, dropout=0.001, lasting=3.0),
        Instrument(("ahead", "slip", "plunge"), replace(TYPICAL.log, std=0.02), step=0.001, dropout=0.001, lasting=3.0),
        Instrument(tuple(f"delta{i + 1}" for i in range(FINS)), Reading(0.0, _degrees(0.05)), step=_degrees(0.1)),
        Instrument(("revolutions",), Reading(0.0, 0.02), step=1.0 / 60.0),
    ),
    left_out=("speed",),
)  # fmt: skip
"""Assumed: the order of size of what small AUVs carry. Noise and periods as in ``towtank.pilot.sensors.TYPICAL``; the
water track twice as noisy as the bottom track; fixes every second, lost for 10 s now and then; counts of 0.1 deg."""
EXACT = Instruments(assumed=False)
"""Every channel exact in every row."""


def observe(
    swum: Swim, instruments: Instruments = STANDARD, seed: int = 0, *, one: int = 0, epoch: float | None = None,
    datum: tuple[float, float] | None = None, name: str | None = None, notes: Sequence[str] = (),
) -> SeaLog:  # fmt: skip
    """The record that ``instruments`` write of craft ``one`` of ``swum``, marked as synthetic.

    Parameters
    ----------
    seed : of the noise; the same seed gives the same record.   epoch [s, UTC] : of its first row.   datum : latitude
    and longitude [rad] of x = y = 0.   name : of the record, the trial's with ``-synthetic`` when left out.   notes :
    that are kept in the provenance beside those of the trial.

    Reading k of an instrument is taken in the row nearest to k periods. It holds the truth ``latency`` ago, a straight
    line between control periods; thrust, commands and orders are those that stand.

    Raises
    ------
    InputError
        No such craft, a craft that did not swim for two rows, or a seed that is no seed.
    """
    rows = _rows(swum, instruments, one)
    draw = _Draw(check_seed(seed), rows, instruments)
    names = [name for name in CHANNELS if name in swum.channels and name not in instruments.left_out]
    channels = {name: draw.measured(name, _truth(swum, one, name, instruments)(rows)) for name in names}
    if "speed" in names and not instruments.has("speed"):
        channels["speed"] = np.linalg.norm([channels[name] for name in ("u", "v", "w")], axis=0)
    kept, flags = draw.logged()
    stamps = draw.stamps()[kept]
    shape = {
        word: {name: value for name in names if (value := getattr(source(name), attr)) > 0.0}
        for word, attr, source in (
            ("std", "std", instruments.of),
            ("bias", "bias", lambda n: instruments.of(n).reading),
        )
    }
    noisy = tuple(dict.fromkeys([*shape["std"], *shape["bias"]])) if instruments.assumed else ()
    return SeaLog(
        name=name or f"{swum.trial.name}-synthetic", craft=swum.model.craft.name, time=stamps - stamps[0],
        channels={name: values[kept] for name, values in channels.items()}, std=shape["std"], bias=shape["bias"],
        assumed=noisy, synthetic=True, epoch=epoch, datum=datum, flags=flags,
        conversions=("Synthetic: a program made this record up from a model; no craft was at sea.",),
        provenance=_origin(swum, one, instruments, seed, draw.offsets, notes),
    )  # fmt: skip


def _rows(swum: Swim, instruments: Instruments, one: int) -> Array:
    """Times (M,) [s] of the rows."""
    if not 0 <= one < len(swum):
        raise InputError(f"craft {one} of {len(swum)}. Count from 0.")
    alive = np.flatnonzero(np.isfinite(swum.channels["x"][one]))
    last = float(swum.time[alive[-1]]) if len(alive) else 0.0
    count = int(np.floor(last / instruments.period + 1e-9)) + 1
    if count < 2:
        raise InputError(
            f"{swum.trial.name} lasted {last:.3g} s, less than two rows {instruments.period:g} s apart. Give a "
            "longer trial or a shorter period."
        )
    return np.asarray(instruments.period * np.arange(count))


def _truth(swum: Swim, one: int, name: str, instruments: Instruments) -> Callable[[Array], Array]:
    """Function of the times (M,) of the rows that gives the truth (M,) of ``name`` then, less the latency."""
    time, values, late = swum.time, swum.channels[name][one], instruments.of(name).latency

    def at(rows: Array) -> Array:
        when = np.maximum(rows - late, time[0])
        if name in SMOOTH:
            held = np.isfinite(values)
            return np.asarray(np.interp(when, time[held], values[held]))
        place = np.clip(np.searchsorted(time, when + 1e-9, side="right") - 1, 0, len(time) - 1)
        return np.asarray(values[place])

    return at


@dataclass
class _Draw:
    """Random parts of a record; each channel and instrument draws on its own, so that one more changes no other."""

    seed: int
    rows: Array
    instruments: Instruments
    offsets: dict[str, float] = field(default_factory=dict)

    def source(self, kind: int, place: int = 0) -> np.random.Generator:
        """Generator of one ``kind`` of numbers of the channel or instrument at ``place``."""
        return np.random.default_rng([self.seed, 7, kind, place])

    def measured(self, name: str, truth: Array) -> Array:
        """What stands in the rows (M,) of channel ``name``."""
        item, place = self.instruments.of(name), list(CHANNELS).index(name)
        draw, reading = self.source(0, place), item.reading
        offset = float(reading.bias * draw.standard_normal())
        values = truth + offset + reading.std * draw.standard_normal(len(truth))
        if reading.bias:
            self.offsets[name] = offset
        if item.step:
            values = item.step * np.round(values / item.step)
        return np.where(self.taken(item), values, np.nan)

    def taken(self, item: Instrument) -> Mask:
        """Rows (M,) in which ``item`` gives a reading."""
        every = max(1, round(item.reading.period / self.instruments.period))
        taken: Mask = np.arange(len(self.rows)) % every == 0
        if not item.dropout:
            return taken
        draw = self.source(1, list(CHANNELS).index(item.channels[0]))
        begins = taken & (draw.random(len(self.rows)) < item.dropout)
        return taken & ~self.covered(begins, item.lasting)

    def covered(self, begins: Mask, lasting: float) -> Mask:
        """Rows (M,) within ``lasting`` [s] of one of ``begins``, that one with them."""
        rows = max(1, int(np.ceil(lasting / self.instruments.period - 1e-9)))
        return np.asarray(np.convolve(begins, np.ones(rows))[: len(begins)] > 0.5)

    def logged(self) -> tuple[Mask, tuple[Flag, ...]]:
        """Rows (M,) that are written, and a flag for each hole. The first and the last row are always written."""
        i = self.instruments
        begins = self.source(2).random(len(self.rows)) < i.outages * i.period
        kept = ~self.covered(begins, i.outage) if i.outages and i.outage else np.ones(len(self.rows), dtype=bool)
        kept[[0, -1]] = True
        held = np.flatnonzero(kept)
        flags = tuple(
            Flag("gap", "time", float(self.rows[a]), float(self.rows[b]), int(b - a - 1),
                 f"the logger stood still: {b - a - 1} rows are missing")
            for a, b in pairwise(held) if b - a > 1
        )  # fmt: skip
        return kept, flags

    def stamps(self) -> Array:
        """Times (M,) [s] written beside the rows."""
        i = self.instruments
        if not i.jitter:
            return self.rows
        off = i.jitter * self.source(3).standard_normal(len(self.rows))
        return np.asarray(self.rows + np.clip(off, -LARGEST_JITTER * i.period, LARGEST_JITTER * i.period))


def _origin(
    swum: Swim, one: int, instruments: Instruments, seed: int, offsets: Mapping[str, float], notes: Sequence[str]
) -> dict[str, Any]:  # fmt: skip
    """Provenance of a record: how it was made up, and the offsets and the current that were drawn."""
    s, model = swum.trial.setting, swum.model
    alive = np.isfinite(swum.channels["x"][one])
    felt = swum.current[one][alive]
    return provenance(
        {"model": digest([model.craft, vars(model.constants.c), model.options], 16)},
        synthetic=True,
        model_level=model.derivatives.level,
        environment=asdict(swum.environment),
        instruments=asdict(instruments),
        seed=seed,
        craft_number=one,
        parameters={name: float(values[one]) for name, values in swum.parameters.items()},
        trial={"name": swum.trial.name, "kind": swum.trial.kind, "loop": swum.trial.loop, "speed": s.speed,
               "thrust": s.thrust, "current": list(swum.trial.current), "notes": [*s.notes, *notes],
               "marks": list(swum.marks[:MARKS]), "legs": len(swum.trial.legs)},
        ended=ENDINGS[int(swum.ended[one])],
        drawn={"offsets": dict(offsets), "current_mean": felt.mean(axis=0).tolist(),
               "current_std": felt.std(axis=0).tolist()},
        engine={"control_period": swum.clock.tick, "steps": swum.clock.steps},
    )  # fmt: skip


MARKS = 100
"""Most ends of legs that the provenance lists."""
ENDINGS = {
    0: "done", 1: "the motion was no longer finite", 2: "the speed ran away", 3: "an event did not come in its time",
    4: "stopped",
}  # fmt: skip
"""``towtank.engine.plan.Ended`` in words."""
