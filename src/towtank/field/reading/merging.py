"""Channels with clocks of their own, on one time base."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from towtank.errors import InputError
from towtank.field.drive import nearest
from towtank.field.reading.mapping import Clock
from towtank.field.reading.values import Series
from towtank.frames import Array
from towtank.quantity import si

LARGEST = 5_000_000
"""Samples of a record; a longer one is cut first. 40 channels of them fill 1.6 GB."""


def merged(series: Mapping[str, Series], clock: Clock, said: list[str]) -> tuple[Array, dict[str, Array]]:
    """Times (N,) [s] of every sample of any channel, and channel -> values (N,), NaN where it was not measured.

    Stamps of different channels closer than ``clock.within`` are one instant. With ``clock.step`` the samples are put
    on uniform ticks, each on the nearest.

    Raises
    ------
    InputError
        More than ``LARGEST`` samples.
    """
    tables = list({id(one.time): one.time for one in series.values()}.values())
    if clock.step is not None:
        return _on_ticks(series, tables, si(clock.step, "s", "clock, step"), said)
    every = np.unique(np.concatenate(tables))
    if len(tables) == 1:
        base = every
    else:
        finest = min((float(np.diff(time).min()) for time in tables if len(time) > 1), default=np.inf)
        within = min(si(clock.within, "s", "clock, within"), 0.49 * finest / len(tables))
        base = every[np.diff(every, prepend=-np.inf) > within]
    _refuse(len(base))
    out, moved = {}, 0.0
    for name, one in series.items():
        place = np.clip(np.searchsorted(base, one.time, side="right") - 1, 0, len(base) - 1)
        moved = max(moved, float(np.abs(base[place] - one.time).max(initial=0.0)))
        values = np.full(len(base), np.nan)
        values[place] = one.values
        out[name] = values
    if len(tables) > 1:
        said.append(
            f"{len(tables)} clocks on one time base of {len(base)} instants"
            + (f"; stamps moved by at most {1e3 * moved:.3g} ms" if moved > 0.0 else "")
        )
    return base, out


def _on_ticks(
    series: Mapping[str, Series], tables: list[Array], step: float, said: list[str]
) -> tuple[Array, dict[str, Array]]:
    if step <= 0.0:
        raise InputError(f"clock, step: {step:g} s is not above zero.")
    first, last = min(float(t[0]) for t in tables), max(float(t[-1]) for t in tables)
    count = round((last - first) / step) + 1
    _refuse(count)
    base: Array = first + step * np.arange(count, dtype=float)
    out = {name: nearest(one.time, one.values, base, step) for name, one in series.items()}
    lost = {name: len(one.values) - int(np.isfinite(out[name]).sum()) for name, one in series.items()}
    words = ", ".join(f"{count} of {name}" for name, count in lost.items() if count)
    said.append(
        f"samples put on ticks of {step:g} s, each on the nearest"
        + (f"; left out where two fell on one: {words}" * bool(words))
    )
    return base, out


def stood(values: Array) -> Array:
    """Values (N,) that stand until the next one."""
    known = np.isfinite(values)
    last = np.maximum.accumulate(np.where(known, np.arange(len(values)), -1))
    return np.where(last >= 0, values[np.maximum(last, 0)], np.nan)


def _refuse(count: int) -> None:
    if count > LARGEST:
        raise InputError(
            f"clock: the log comes to {count} samples, more than {LARGEST}. One wrong stamp can do that; or cut the "
            'log, or write [clock] step = "0.1 s".'
        )
