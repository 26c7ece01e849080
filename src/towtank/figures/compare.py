"""A record beside the model: histories with the band of drawn craft, track, errors and what they may be, spectra."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from towtank.field.comparing.result import GROWTH, Comparison, Series
from towtank.field.comparing.words import shown, unit_of, vague
from towtank.field.log import CHANNELS
from towtank.figures.paper import BAD, BAND, FIT, GREY, INK, OK, frame, head, legend, new_axes, note
from towtank.frames import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TITLES = {
    "psi": "Heading", "r": "Yaw rate", "z": "Depth", "theta": "Pitch", "phi": "Roll", "q": "Pitch rate",
    "p": "Roll rate", "u": "Surge over ground", "ahead": "Speed through the water", "speed": "Speed over ground",
    "v": "Sway over ground", "slip": "Sway through the water", "w": "Heave over ground",
    "plunge": "Heave through the water", "x": "North", "y": "East",
}  # fmt: skip
SHOWN = ("psi", "r", "z", "theta", "ahead", "speed", "u", "slip", "v", "q", "phi")
"""Channels worth a history, first ones first."""
DOTS = 1000
"""Most samples of a record that are drawn."""
NORMAL = 1.96
"""Half the 95 % interval of a standard normal variable."""


def level_line(it: Comparison) -> str:
    """Levels of both sides; a made-up record is called so."""
    record = "SYNTHETIC record" if it.record_level == "synthetic" else "sea record"
    return f"{record}; model: {it.level}"


def histories_of(it: Comparison, most: int = 6) -> tuple[str, ...]:
    """Channels of which a history is worth while: of two that tell the same, the first."""
    have = [name for name in SHOWN if name in it.series.model and np.isfinite(it.series.record[name]).any()]
    for one, others in (("ahead", ("speed", "u")), ("speed", ("u",)), ("slip", ("v",))):
        if one in have:
            have = [name for name in have if name not in others]
    fins = [name for name in sorted(it.series.model) if name.startswith("delta") and it.loop == "closed"]
    return (*have[: most - bool(fins)], *fins[:1])


def history(it: Comparison, channel: str, ax: Axes | None = None) -> Axes:
    """A channel over time [s]: samples of the record, the model, the 95 % band of the drawn craft.

    The axis fits record and model; a band that leaves it is cut.
    """
    s, unit = it.series, CHANNELS[channel][0]
    ax = new_axes(ax, width=4.6, height=2.7)
    broken = _broken(it, s)

    def line(values: Array) -> Array:
        return np.where(broken, np.nan, shown(1.0, unit) * values)

    low, high = line(s.low[channel]), line(s.high[channel])
    ax.fill_between(s.time, low, high, color=BAND, alpha=0.6, linewidth=0, label="95 % of drawn craft")
    record = shown(1.0, unit) * s.record[channel]
    held = _thinned(np.isfinite(record))
    ax.plot(s.time[held], record[held], ".", color=INK, markersize=1.4, label="record")
    ax.plot(s.time, line(s.model[channel]), color=FIT, linewidth=1.1, label="model")
    _ordered(ax, s, channel, unit)
    frame(ax, "time [s]", f"{channel} [{unit_of(unit)}]", zero=False)
    _limits(ax, np.concatenate([record[held], line(s.model[channel])]), down=channel == "z")
    head(ax, TITLES.get(channel, f"Fin {channel[5:]}"), level_line(it), _words(it))
    legend(ax, ncol=3, loc="upper left", bbox_to_anchor=(0.0, 1.0))
    return ax


def _thinned(held: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Places of at most ``DOTS`` of the samples that are there."""
    there = np.flatnonzero(held)
    return there[:: max(1, -(-len(there) // DOTS))]


def _ordered(ax: Axes, s: Series, channel: str, unit: str) -> None:
    name = {"psi": "heading_order", "z": "depth_order"}.get(channel, "")
    if name in s.record:
        ax.plot(s.time, shown(1.0, unit) * s.record[name], color=GREY, linewidth=0.8, linestyle=":", label="order")


def _broken(it: Comparison, s: Series) -> Array:
    """True at the first sample of every part but the first, so that no line joins two parts."""
    out = np.zeros(len(s.time), dtype=bool)
    for begin, _ in it.parts[1:]:
        out[min(int(np.searchsorted(s.time, begin - 1e-9)), len(out) - 1)] = True
    return out


def _limits(ax: Axes, values: Array, down: bool) -> None:
    there = values[np.isfinite(values)]
    if not len(there):
        return
    low, high = float(there.min()), float(there.max())
    room = 0.12 * (high - low) or 1.0
    bottom, top = low - room, high + 2.5 * room
    if down:
        bottom, top = high + room, low - 2.5 * room
    ax.set_ylim(bottom, top)
    ax.margins(x=0.01)


def _words(it: Comparison) -> str:
    again = f", begun again every {it.horizon:g} s" if it.horizon else ""
    return f"{it.loop} loop{again}; band of {it.samples} craft from the derivatives' covariance, no sensor noise"


def track(it: Comparison, ax: Axes | None = None) -> Axes:
    """Track [m], north upwards: record, model and, for a whole flight, the 95 % box of the drawn craft at its end."""
    from matplotlib.lines import Line2D

    s = it.series
    ax = new_axes(ax, width=4.6, height=4.0)
    held = _thinned(np.isfinite(s.record["x"]) & np.isfinite(s.record["y"]))
    ax.plot(s.record["y"][held], s.record["x"][held], ".", color=INK, markersize=1.8, label="record")
    broken = _broken(it, s)
    x, y = (np.where(broken, np.nan, s.model[name]) for name in ("x", "y"))
    ax.plot(y, x, color=FIT, linewidth=1.2, label="model")
    there = np.flatnonzero(np.isfinite(s.low["x"]) & np.isfinite(s.low["y"]))
    if len(there) and not it.horizon:
        end = there[-1]
        x0, x1, y0, y1 = s.low["x"][end], s.high["x"][end], s.low["y"][end], s.high["y"][end]
        words = f"95 % of drawn craft at the end: {x1 - x0:.3g} m north, {y1 - y0:.3g} m east"
        box = ([y0, y1, y1, y0, y0], [x0, x0, x1, x1, x0])
        # An artist, so that a box that is far wider than the track does not set the axes.
        ax.add_artist(Line2D(*box, color=BAND, linewidth=1.2, label=words))
    frame(ax, "east [m]", "north [m]", zero=False)
    ax.set_aspect("equal", adjustable="datalim")
    ax.margins(0.1)
    head(ax, "Track", level_line(it), _words(it))
    legend(ax)
    return ax


def levels(it: Comparison, ax: Axes | None = None) -> Axes:
    """E over U_val of every number: within -1 and 1 the model is validated at the level U_val.

    Open marks: U_val is as large as what the record does, so that the level says nothing.
    """
    scores = [one for one in it.scores if one.validated is not None and one.uncertainty.total > 0.0]
    ax = new_axes(ax, width=5.2, height=0.7 + 0.17 * max(len(scores), 4), bottom=0.5)
    ratio = np.array([one.error / one.uncertainty.total for one in scores])
    place = np.arange(len(scores))[::-1]
    ax.axvspan(-1.0, 1.0, color=BAND, alpha=0.45, linewidth=0)
    kept = np.clip(ratio, -4.0, 4.0)
    wide = np.array([one.name in vague(it) for one in scores], dtype=bool)
    within = np.abs(ratio) <= 1.0
    for at, colour, face in ((within & ~wide, OK, OK), (within & wide, OK, "white"), (~within, BAD, BAD)):
        ax.plot(kept[at], place[at], "o", color=colour, markerfacecolor=face, markersize=3.5)
    for value, shown_at, row in zip(ratio, kept, place, strict=True):
        if abs(value) > 4.0:
            note(ax, f"{value:.1f}", (float(shown_at), float(row)), (5 if value < 0.0 else -5, -2.5),
                 ha="left" if value < 0.0 else "right")  # fmt: skip
    frame(ax, "E / U_val [-]", "", zero=False)
    for row, one in zip(place, scores, strict=True):
        note(ax, one.name.replace("_", " "), (-7.9, float(row)), (0, -2.0))
    ax.set_yticks([])
    ax.set_xticks([-4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 4.0])
    ax.axvline(0.0, color="#aab3ba", linewidth=0.6)
    ax.set_xlim(-8.0, 4.3)
    ax.set_ylim(-0.7, len(scores) - 0.3)
    head(
        ax,
        "Errors against what they may be",
        level_line(it),
        "E = record - model; tinted: |E| <= U_val, 95 %; open: U_val as large as what the record does",
    )
    return ax


def residuals(it: Comparison, ax: Axes | None = None) -> Axes:
    """Distribution of record less model, over what it may be at each sample; dashed: normal, of unit width."""
    ax = new_axes(ax, width=4.6, height=2.7)
    edges = np.linspace(-4.0, 4.0, 41).tolist()
    noise = {one.channel: one.noise for one in it.channels}
    s = it.series
    for name in [name for name in histories_of(it) if name in noise][:4]:
        width = np.hypot((s.high[name] - s.low[name]) / (2.0 * NORMAL), noise[name])
        off = (s.record[name] - s.model[name]) / np.where(width > 0.0, width, np.nan)
        off = off[np.isfinite(off)]
        if len(off):
            ax.hist(np.clip(off, -4.0, 4.0), edges, density=True, histtype="step", linewidth=1.0, label=name)
    x = np.linspace(-4.0, 4.0, 161)
    ax.plot(x, np.exp(-0.5 * x**2) / np.sqrt(2.0 * np.pi), color=GREY, linewidth=0.8, linestyle="--", label="normal")
    frame(ax, "(record - model) / standard uncertainty [-]", "density [-]", zero=False)
    head(
        ax, "Residuals", level_line(it), "uncertainty: of the drawn craft then, and sensor noise; 4 and more stand at 4"
    )
    legend(ax, ncol=2)
    return ax


def growth(it: Comparison, ax: Axes | None = None) -> Axes:
    """Rms of record less model against the time since the begin of a part [s], over the rms that is expected."""
    ax = new_axes(ax, width=4.6, height=2.7)
    for one in it.channels:
        values = np.array(one.growth)
        if one.channel in histories_of(it) and np.isfinite(values).sum() > 1 and one.expected > 0.0:
            ax.plot(GROWTH, values / one.expected, "o-", markersize=3, linewidth=1.0, label=one.channel)
    frame(ax, "time since the begin [s]", "rms / rms expected [-]", zero=False)
    ax.set_ylim(bottom=0.0)
    parts = f"{len(it.parts)} {'begin' if len(it.parts) == 1 else 'begins'}"
    head(ax, "Error of the prediction", level_line(it), f"mean over {parts}; rms expected: of drawn craft with noise")
    legend(ax, ncol=3)
    return ax


def spectrum(it: Comparison, channel: str, ax: Axes | None = None) -> Axes:
    """Power spectral density of a channel [(deg/s)^2/Hz]: record and model, without the noise of the sensor."""
    one = next(found for found in it.spectra if found.channel == channel)
    unit = CHANNELS[channel][0]
    ax = new_axes(ax, width=4.6, height=2.7)
    scale = shown(1.0, unit) ** 2
    for values, colour, words in ((one.record, INK, "record"), (one.model, FIT, "model")):
        ax.loglog(one.frequency[1:], scale * values[1:], color=colour, linewidth=1.1, label=words)
    there = one.record[1:][one.record[1:] > 0.0]
    if len(there):
        ax.set_ylim(scale * float(there.min()) / 30.0, scale * float(there.max()) * 10.0)
    frame(ax, "frequency [Hz]", f"power [({unit_of(unit)})2/Hz]", zero=False)
    told = ", ".join(f"{value:.2f}" for value in one.coherence if np.isfinite(value)) or "not told"
    head(
        ax,
        f"Spectrum, {TITLES[channel].lower()}",
        level_line(it),
        f"coherence below 0.1, 0.5, 2 Hz: {told}; {it.loop} loop",
    )
    legend(ax)
    return ax
