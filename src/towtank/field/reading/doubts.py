"""Doubts about the values of a record: outliers, sensors that stand still, values out of range. Nothing is changed."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from towtank.field.log import MEASURED, Flag
from towtank.field.reading.geodesy import SEMI_MAJOR
from towtank.frames import Array

HALF_WINDOW = 5
"""Neighbours on each side that a value is compared with."""
SCALE_HALF = 25
"""Neighbours on each side from which the scale of the deviations is taken."""
SIGMAS = 6.0
"""Robust standard deviations from its neighbours beyond which a value is an outlier: one in 5e8 of Gaussian noise."""
MAD = 1.4826
"""Median absolute deviation to the standard deviation of Gaussian noise."""
FEW = 3 * (2 * HALF_WINDOW + 1)
"""Samples below which nothing is said of outliers."""
STUCK_FOR, STUCK_SAMPLES, STUCK_RATIO = 3.0, 10, 5.0
"""A run of equal values is a sensor that stands still when it lasts at least 3 s and 10 samples, and 5 times as many
samples as 95 % of the runs of the channel. Judgement: noise and motion change a reading sooner."""
LIMITS: Mapping[str, tuple[float, float]] = {
    "x": (-SEMI_MAJOR, SEMI_MAJOR), "y": (-SEMI_MAJOR, SEMI_MAJOR), "z": (-10.0, 11000.0),
    "phi": (-np.pi, np.pi), "theta": (-0.5 * np.pi, 0.5 * np.pi),
    **dict.fromkeys(("u", "v", "w", "ahead", "slip", "plunge", "speed_order"), (-20.0, 20.0)), "speed": (0.0, 20.0),
    **dict.fromkeys(("p", "q", "r", "turn_order"), (-10.0, 10.0)), "pitch_order": (-0.5 * np.pi, 0.5 * np.pi),
    **dict.fromkeys([f"{word}{i}" for word in ("delta", "command") for i in range(1, 5)], (-0.5 * np.pi, 0.5 * np.pi)),
    **dict.fromkeys(("rudder", "elevator", "aileron"), (-0.5 * np.pi, 0.5 * np.pi)),
    "revolutions": (-200.0, 200.0), "throttle": (-20.0, 20.0), "depth_order": (-10.0, 11000.0),
}  # fmt: skip
"""Channel -> what it can be for any craft [SI]; a mapping states closer limits."""
_TESTED = (*MEASURED, "delta1", "delta2", "delta3", "delta4")
Mask = NDArray[np.bool_]


def doubts_of(
    time: Array, channels: Mapping[str, Array], limits: Mapping[str, tuple[float, float]]
) -> tuple[Flag, ...]:
    """Flags on the values of ``channels`` (N,) [SI]; ``limits`` [SI] come before those of any craft."""
    flags: list[Flag] = []
    for name, column in channels.items():
        known = np.flatnonzero(np.isfinite(column))
        if not len(known):
            continue
        at, values = time[known], column[known]
        low, high = limits.get(name, LIMITS.get(name, (-np.inf, np.inf)))
        out = (values < low - 1e-9) | (values > high + 1e-9)
        if out.any():
            words = f"{int(out.sum())} values of {name} from {values[out].min():.4g} to {values[out].max():.4g} are "
            flags.append(_flag("range", name, at[out], words + f"out of {low:.4g} to {high:.4g}"))
        if name in MEASURED:
            flags += _still(name, at, values)
        if name in _TESTED and len(values) >= FEW:
            odd = outliers(values)
            if odd.any():
                worst = int(np.argmax(np.where(odd, np.abs(values - np.median(values)), -1.0)))
                words = f"{int(odd.sum())} values of {name} are beyond {SIGMAS:g} robust standard deviations of their "
                flags.append(_flag("outlier", name, at[odd], words + f"neighbours, such as {values[worst]:.4g}"))
    return tuple(flags)


def outliers(values: Array) -> Mask:
    """Which of ``values`` (N,) are far from their neighbours.

    Source     hampel1974; pearson2002: the median of a moving window, and the median absolute deviation as scale.
    Departure  Two medians must be missed: that of the window, which a step does not miss, and that of the means of the
               pairs at equal distances before and after, which a straight motion does not miss. The scale is that of
               the second in a window of 51 samples, and not below the noise of the whole row, from its second
               differences, nor below its smallest step.
    Valid      ``FEW`` samples or more; motions of more than 20 samples a period.
    """
    padded = np.pad(values, HALF_WINDOW, mode="reflect", reflect_type="odd")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * HALF_WINDOW + 1)
    pairs = 0.5 * (windows[:, :HALF_WINDOW] + windows[:, : -HALF_WINDOW - 1 : -1])
    off = np.abs(values - np.median(pairs, axis=-1))
    around = np.lib.stride_tricks.sliding_window_view(np.pad(off, SCALE_HALF, mode="reflect"), 2 * SCALE_HALF + 1)
    # The second difference of white noise has six times its variance.
    noise = MAD * float(np.median(np.abs(np.diff(values, 2)))) / np.sqrt(6.0)
    steps = np.abs(np.diff(values))
    smallest = float(steps[steps > 0.0].min()) if (steps > 0.0).any() else 0.0
    floor = max(noise, smallest)
    scale = np.maximum(MAD * np.median(around, axis=-1), floor)
    far = np.abs(values - np.median(windows, axis=-1)) > SIGMAS * floor
    return np.asarray(far & (off > SIGMAS * scale) & (scale > 0.0))


def _still(name: str, time: Array, values: Array) -> list[Flag]:
    """Runs of equal values that are too long, and values that each stand several times."""
    starts = np.flatnonzero(np.concatenate([[True], values[1:] != values[:-1]]))
    lengths = np.diff(np.append(starts, len(values)))
    ends = starts + lengths - 1
    usual = max(float(np.quantile(lengths, 0.95)), 1.0) if len(lengths) > 1 else 1.0
    lasting = time[ends] - time[starts]
    stuck = (lengths >= max(STUCK_SAMPLES, STUCK_RATIO * usual)) & (lasting >= STUCK_FOR)
    out = [
        Flag(
            "stuck", name, float(time[starts[i]]), float(time[ends[i]]), int(lengths[i]),
            f"{name} stands at {values[starts[i]]:.6g} for {lasting[i]:.4g} s ({lengths[i]} samples)",
        )
        for i in np.flatnonzero(stuck)
    ]  # fmt: skip
    often = float(np.median(lengths[~stuck])) if (~stuck).any() else 1.0
    if often >= 2.0:
        again = int((lengths[~stuck] - 1).sum())
        words = (
            f"each value of {name} stands {often:g} times: the sensor is slower than the log, {again} samples are no "
        )
        out.append(Flag("repeat", name, float(time[0]), float(time[-1]), again, words + "new ones (held = true)"))
    return out


def _flag(kind: str, name: str, at: Array, words: str) -> Flag:
    return Flag(kind, name, float(at[0]), float(at[-1]), len(at), words)
