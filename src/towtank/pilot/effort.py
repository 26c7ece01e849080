"""What steering costs: angle, travel and saturation of the fins."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from towtank.frames import Array


def effort(time: Array, delta: Array, velocity: Array, limits: Sequence[float]) -> dict[str, tuple[float, str]]:
    """Indices of the fins' effort over a record.

    Parameters
    ----------
    time (N,) [s]; delta (N, n_fins) [rad]; velocity (N, 3) [m/s]; limits (n_fins,) [rad].

    Returns
    -------
    fin_rms [deg] : root mean square over time and fins.   fin_largest [deg].   fin_travel [deg/m] : mean over the fins
    of the angle swept, per metre travelled.   fin_saturation [%] : time with any fin within 0.5 % of its limit.
    """
    if delta.shape[1] == 0 or len(time) < 2:
        return {}
    lasting = float(time[-1] - time[0])
    path = float(np.trapezoid(np.linalg.norm(velocity, axis=1), time))
    swept = float(np.degrees(np.abs(np.diff(delta, axis=0)).sum() / delta.shape[1]))
    full = (np.abs(delta) > 0.995 * np.asarray(limits)).any(axis=1)
    return {
        "fin_rms": (float(np.degrees(np.sqrt(np.trapezoid((delta**2).mean(axis=1), time) / lasting))), "deg"),
        "fin_largest": (float(np.degrees(np.abs(delta).max())), "deg"),
        "fin_travel": (swept / path if path > 0.0 else 0.0, "deg/m"),
        "fin_saturation": (float(100.0 * full.mean()), "%"),
    }
