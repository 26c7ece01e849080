"""A record of a craft at sea: channels over time with what is doubtful about them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from towtank.errors import InputError
from towtank.frames import Array
from towtank.trials.trajectory import Trajectory

MEASURED: Mapping[str, tuple[str, str]] = {
    "x": ("m", "north of the datum"), "y": ("m", "east of the datum"), "z": ("m", "depth"),
    "phi": ("rad", "roll"), "theta": ("rad", "pitch"), "psi": ("rad", "heading, unwrapped"),
    "u": ("m/s", "surge velocity over ground"), "v": ("m/s", "sway velocity over ground"),
    "w": ("m/s", "heave velocity over ground"),
    "ahead": ("m/s", "surge velocity through the water"), "slip": ("m/s", "sway velocity through the water"),
    "plunge": ("m/s", "heave velocity through the water"),
    "p": ("rad/s", "roll rate"), "q": ("rad/s", "pitch rate"), "r": ("rad/s", "yaw rate"),
    "speed": ("m/s", "speed over ground"),
}  # fmt: skip
"""Channels that sensors give -> unit, meaning; at the body origin, along the body axes. Names as in the engine."""

FINS = 4
"""Largest number of fins of a record; the orders of single fins are as many."""

DRIVEN: Mapping[str, tuple[str, str]] = {
    **{f"delta{i + 1}": ("rad", f"angle of fin {i + 1}, measured") for i in range(FINS)},
    **{f"command{i + 1}": ("rad", f"angle asked of fin {i + 1}") for i in range(FINS)},
    "rudder": ("rad", "virtual rudder asked for"), "elevator": ("rad", "virtual elevator asked for"),
    "aileron": ("rad", "virtual aileron asked for"),
    "throttle": ("1", "thrust as a multiple of that of the set speed"), "thrust": ("N", "thrust"),
    "revolutions": ("1/s", "propeller revolutions"),
    "heading_order": ("rad", "heading ordered"), "depth_order": ("m", "depth ordered"),
    "pitch_order": ("rad", "pitch ordered"), "turn_order": ("rad/s", "rate of turn ordered"),
    "speed_order": ("m/s", "speed ordered"),
}  # fmt: skip
"""Channels of what drove the craft -> unit, meaning."""

CHANNELS: Mapping[str, tuple[str, str]] = {**MEASURED, **DRIVEN}

FLAGS = ("gap", "repeat", "clock", "outlier", "stuck", "range", "format")
"""Kinds of doubt: a hole in time, a sample stored twice, a clock that jumps or goes back, a value far from its
neighbours, a sensor that stands still, a value out of its range, a part of the file that could not be read."""


@dataclass(frozen=True)
class Flag:
    """A doubt about ``channel`` ("time" for the clock) from ``start`` to ``end`` [s]: what was seen, in ``words``.

    count : samples concerned.   Nothing is changed by a flag: who uses the record decides.
    """

    kind: str
    channel: str
    start: float
    end: float
    count: int
    words: str


@dataclass(frozen=True)
class SeaLog:
    """N samples of a record.

    time (N,) [s], increasing, from the first sample; epoch [s, UTC] of the first sample, None when not known.
    channels : name of ``CHANNELS`` -> (N,) [SI], NaN where nothing was measured at that time.
    std, bias : channel -> standard deviation of its white noise and of an offset that lasts the record, as stated or
        assumed by who made the record (``assumed`` names those that are assumed); absent when not known.
    synthetic : True for a record that a program made up.   datum : latitude, longitude [rad] of x = y = 0, or None.
    flags : doubts.   conversions : what the reader did to the numbers of the file, in words.
    """

    name: str
    craft: str
    time: Array
    channels: Mapping[str, Array]
    std: Mapping[str, float] = field(default_factory=dict)
    bias: Mapping[str, float] = field(default_factory=dict)
    assumed: tuple[str, ...] = ()
    synthetic: bool = False
    epoch: float | None = None
    datum: tuple[float, float] | None = None
    flags: tuple[Flag, ...] = ()
    conversions: tuple[str, ...] = ()
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse what is no record."""
        time = np.asarray(self.time, dtype=float)
        if time.ndim != 1 or len(time) < 2 or not np.isfinite(time).all() or not (np.diff(time) > 0.0).all():
            raise InputError(
                f"log {self.name}: the time must be a row of two or more finite, increasing numbers. A reader orders "
                "the samples and flags what it found; give it the file."
            )
        for name, values in self.channels.items():
            if name not in CHANNELS:
                raise InputError(f"log {self.name}: no channel {name!r}. Choose from {', '.join(CHANNELS)}.")
            if np.shape(values) != time.shape or np.isinf(values).any():
                raise InputError(
                    f"log {self.name}: channel {name} has the shape {np.shape(values)} beside {len(time)} times, or an "
                    "infinite value. Give one number for each time, NaN where nothing was measured."
                )

    def __getitem__(self, name: str) -> Array:
        """Channel (N,); NaN everywhere when the record has none of this name."""
        return self.channels.get(name, np.full(len(self.time), np.nan))

    def has(self, *names: str) -> bool:
        """Whether each of ``names`` was measured at least twice."""
        return all(name in self.channels and np.isfinite(self.channels[name]).sum() > 1 for name in names)

    @property
    def level(self) -> str:
        """What the numbers are: a record of the sea, or one made up."""
        return "synthetic" if self.synthetic else "sea record"

    @property
    def fins(self) -> int:
        """Number of fins whose measured or ordered angles are held."""
        return sum(self.has(f"delta{i + 1}") or self.has(f"command{i + 1}") for i in range(FINS))


def trajectory(log: SeaLog) -> Trajectory:
    """The record in the form of a free-running trial: NaN where a channel was not measured."""

    def stack(*names: str) -> Array:
        return np.stack([log[name] for name in names], axis=-1)

    fins = [f"delta{i + 1}" if log.has(f"delta{i + 1}") else f"command{i + 1}" for i in range(FINS)]
    orders = {"heading": "heading_order", "depth": "depth_order", "turn": "turn_order", "throttle": "throttle"}
    return Trajectory(
        name=log.name, kind=log.level, loop="closed" if log.has("heading_order") or log.has("depth_order") else "open",
        craft=log.craft, level=log.level, time=log.time, position=stack("x", "y", "z"),
        attitude=stack("phi", "theta", "psi"), nu=stack("u", "v", "w", "p", "q", "r"),
        delta=stack(*fins[: max(log.fins, 1)]), command=stack("rudder", "elevator", "aileron"),
        setpoint={name: log[channel] for name, channel in orders.items() if log.has(channel)},
        provenance=dict(log.provenance),
    )  # fmt: skip
