"""Records that the model made of itself, without noise: every channel at every tick, synthetic."""

import numpy as np

from towtank.engine.plan import Clock, Leg, Log
from towtank.engine.run import fly
from towtank.engine.start import at
from towtank.field.log import MEASURED, SeaLog
from towtank.trials.start import setting

TICK = 0.1
FINS = ("delta1", "delta2", "delta3", "delta4")
CURRENT = np.array([0.11, -0.07, 0.0])


def swum(model, legs, pilot=None, current=CURRENT, ticks=None, steps=2, **orders):
    """A record without noise of ``legs`` of (orders, ticks), every channel at every tick."""
    s = setting(model, 1.0, pilot, piloted=pilot is not None)
    state = s.state.copy()
    state[6:9] += current  # heading north: the craft at rest in its water
    flights = fly(
        model, at(state, s.memory), [Leg(f"{i}", s.orders(**o), n * TICK) for i, (o, n) in enumerate(legs)],
        thrust=s.thrust, pilot=pilot, current=tuple(current), clock=Clock(TICK, steps), log=Log(),
    )  # fmt: skip
    names = (*MEASURED, *FINS, "rudder", "elevator", "aileron")
    channels = {name: flights.series(name)[0] for name in names}
    for order, channel in (("heading", "heading_order"), ("depth", "depth_order"), ("turn", "turn_order")):
        if any(order in o for o, _ in legs):
            rows = np.concatenate([np.full(n, float(o[order]) if order in o else np.nan) for o, n in legs])
            channels[channel] = np.append(rows, rows[-1])
    channels["throttle"] = np.ones(len(flights.time))
    return SeaLog("swim", "hokie", flights.time, channels, synthetic=True), state[:12]


OPEN = [({"rudder": a}, n) for a, n in ((0.0, 40), (0.2, 80), (-0.2, 120), (0.1, 60))]
CLOSED = [
    ({"steer": 1.0, "heading": 0.0, "dive": 1.0, "depth": 0.0}, 50),
    ({"steer": 1.0, "heading": 0.5, "dive": 1.0, "depth": 2.0}, 250),
]
