"""What the fins are asked for in a trial: their range, what is left for roll, the drag of their deflection."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from towtank.frames import Array, rotation
from towtank.model.equations import Model
from towtank.trials.trajectory import Trajectory

SETTLED = 0.75
"""Share of a trial's time after which its turn or course counts as settled."""


@dataclass(frozen=True)
class FinUse:
    """Fins in one trial; NaN where the trial does not say.

    use : largest share of its limit that a fin reaches [%].   settled : the same in the trial's last quarter, mean.
    saturated : time with a fin at its limit [%].   aileron : deflection that every fin still has for roll in the last
    quarter, mean [deg].   travel [deg/m].   drag : of the deflected fins, mean over the trial [N], which is the energy
    they cost for each metre.   share : of that drag in the resistance of the hull [%].   power [W].   roll : largest
    [deg].
    """

    trial: str
    kind: str
    loop: str
    use: float
    settled: float
    saturated: float
    aileron: float
    travel: float
    drag: float
    share: float
    power: float
    roll: float


def fin_use(model: Model, trial: Trajectory) -> FinUse:
    """How ``trial`` uses the fins of ``model``.

    Power is -X u, X the surge force of deflected fins in the model (``Xuudd`` u|u| sum of the squared angles), u the
    speed ahead through the water; its mean over the mean speed is the drag. What the servos spend against the hinge
    moments is not in it: the model has none. The travel says how much they move.

    Source     ``Model.loads``; means over time by trapezia on the record.
    Valid      A record that follows the fins: the trials' own intervals are a 16th of a length or less.
    """
    limits, mixing = np.array([fin.max_angle for fin in model.craft.fins]), model.craft.mixing[:, 2]
    used = np.abs(trial.delta) / limits
    rolling = np.abs(mixing) > 1e-9
    room = ((limits - np.abs(trial.delta))[:, rolling] / np.abs(mixing[rolling])).min(axis=1)
    after = trial.time >= trial.time[0] + SETTLED * (trial.time[-1] - trial.time[0])
    ahead, force, hull = _along(model, trial)
    power, speed = _mean(trial.time, -force * ahead), _mean(trial.time, ahead)
    index = {name: value for name, (value, _) in trial.indices.items()}
    return FinUse(
        trial=trial.name, kind=trial.kind, loop=trial.loop,
        use=100.0 * float(used.max()), settled=100.0 * float(used[after].max(axis=1).mean()),
        saturated=index.get("fin_saturation", np.nan), aileron=float(np.degrees(room[after].mean())),
        travel=index.get("fin_travel", np.nan), drag=power / speed,
        share=100.0 * power / _mean(trial.time, -hull * ahead), power=power,
        roll=float(np.degrees(np.abs(trial.attitude[:, 0]).max())),
    )  # fmt: skip


def _along(model: Model, trial: Trajectory) -> tuple[Array, Array, Array]:
    """Speed ahead through the water [m/s], surge force of deflected fins and of the hull at that speed [N]; (N,)."""
    current = np.asarray(trial.provenance.get("current", (0.0, 0.0, 0.0)), dtype=float)
    nu = trial.nu.copy()
    nu[:, :3] -= current @ rotation(trial.attitude)
    state = [*np.zeros((6, len(nu))), *nu.T, *trial.delta.T]
    idle = [*state[:12], *np.zeros_like(trial.delta.T)]
    at_work, at_rest = (np.asarray(model.loads(s, 0.0)["fins"][0]) for s in (state, idle))
    u = nu[:, 0]
    return u, at_work - at_rest, model.constants.c.Xuu * u * np.abs(u)


def _mean(time: Array, values: Array) -> float:
    span = float(time[-1] - time[0])
    return float(np.trapezoid(values, time)) / span if span > 0.0 else float(np.mean(values))
