"""Crafts and runs for the checks of the compiled engine; what is added to the synthetic craft is invented."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

import synthetic_craft as synthetic
from towtank.craft.craft import Propeller
from towtank.derive.fin_curve import FinCurve
from towtank.engine.plan import Clock, Gauge, Leg, Until
from towtank.engine.start import at
from towtank.model.equations import Model
from towtank.model.values import to_variant
from towtank.pilot.design import design_pilot
from towtank.pilot.orders import Orders

SPEED = 1.0
SCREW = Propeller(0.4, 2.5, 0.2, 0.1, ((0.0, 0.45, 0.07), (0.4, 0.3, 0.05), (0.8, 0.1, 0.02), (1.0, -0.05, 0.0)), 1.0)
X_FINS, Y_FINS = (225.0, 315.0, 135.0, 45.0), (180.0, 300.0, 60.0)
CROSS = {"Kuv": 3.0, "Kvv": -2.0, "Kur": 1.5, "Krr": -4.0, "Kpp": -200.0, "Kvdot": 9.0, "Ypdot": 9.0, "Zudot": 5.0,
         "Xwdot": 5.0, "Npdot": -7.0, "Krdot": -7.0, "Mudot": 4.0, "Xqdot": 4.0}  # fmt: skip
"""Terms of a craft without planes of symmetry, SI."""
OPTIONAL = {"Xuuvv": 40.0, "Yvvv": -300.0, "Yvvr": 200.0, "Yvrr": -150.0, "Yrrr": 90.0, "Nvvv": 120.0, "Nvrr": -400.0,
            "Nrrr": -900.0, "Zwww": -300.0, "Zwqq": -150.0, "Mwwq": -210.0, "Mqqq": -900.0}  # fmt: skip
"""Some terms that a fit takes up only when asked, SI."""
CURVE = FinCurve(0.6, 0.0, 0.3, 0.2, "invented", kappa_v=0.4, kappa_r=0.8, station_from_nose=5.0)
"""A fin that stalls beyond the runs' angles; the derivatives hold half of its load in drift and turning."""
CASES = ("lumped", "split", "screw", "three fins", "optional")


@cache
def model(name):
    """One craft for each form of the text; the CG lies off the axis and the fins differ, so that nothing cancels."""
    plain = synthetic.model(synthetic.STABLE)
    azimuths = Y_FINS if name == "three fins" else X_FINS
    fins = tuple(
        replace(
            plain.craft.fins[0], name=f"fin{i}", azimuth=np.radians(azimuth), max_angle=np.radians(25.0 + i),
            max_rate=np.radians(30.0 + i), time_constant=0.2 + 0.01 * i,
        )
        for i, azimuth in enumerate(azimuths)
    )  # fmt: skip
    inertia = ((542.0, 20.0, -30.0), (20.0, 18900.0, 40.0), (-30.0, 40.0, 18950.0))
    mass = replace(plain.craft.mass, cg=(0.0005, 0.0003, 0.0508), inertia=inertia)
    craft = replace(plain.craft, fins=fins, mass=mass, propeller=SCREW if name == "screw" else plain.craft.propeller)
    d = plain.derivatives
    values = {name: d[name] for name in d.names} | CROSS | (OPTIONAL if name == "optional" else {})
    made = Model.from_values(craft, values, options=plain.options)
    made = replace(made, derivatives=replace(made.derivatives, fin_curve=CURVE)).with_options(fins_apart=0.5)
    return replace(made, derivatives=to_variant(made.derivatives, "split")) if name == "split" else made


@cache
def pilot():
    return design_pilot(synthetic.model(synthetic.STABLE))


def start(craft, u=SPEED, attitude=(0.02, -0.03, 0.4), memory=(0.001, -0.002, 0.0)):
    fins = [0.01 * (i + 1) for i in range(len(craft.craft.fins))]
    return at([1.0, -2.0, 3.0, *attitude, u, 0.02, -0.01, 0.001, 0.002, -0.001, *fins], memory)


def shared(craft, current=(0.1, -0.05, 0.01)):
    return {"thrust": float(craft.thrust(SPEED)), "pilot": pilot(), "current": current}


HELD = Orders(piloted=1.0, steer=1.0, heading=0.4, dive=1.0, depth=3.0)


def legs(turn=0.15, depth=3.4, lasting=5.0):
    """Three legs that end by time: hold, turn and dive, follow a line."""
    line = Orders(
        piloted=1.0, track=1.0, course=0.3, north=5.0, east=1.0, lookahead=8.0, drift=0.02, dive=1.0, depth=3.1
    )
    change = Orders(piloted=1.0, steer=1.0, heading=0.4 + turn, dive=1.0, depth=depth)
    return [Leg("hold", HELD, 2.0), Leg("turn", change, lasting), Leg("line", line, lasting)]


def figure():
    """100 s closed loop with legs, events and limits that bind."""
    turn = {"piloted": 1.0, "dive": 1.0, "depth": 3.5}
    line = Orders(**turn, track=1.0, course=0.5, north=60.0, east=30.0, lookahead=8.0, drift=0.02)
    return [
        Leg("hold", HELD, 10.03),
        Leg("turn", Orders(rudder=-0.42, **turn), 60.0, Until("psi", 0.9), required=True),
        Leg("check", Orders(rudder=0.42, **turn), 60.0, Until("psi", 0.6), required=True),
        Leg("dive", Orders(**{**turn, "depth": 6.0}, steer=1.0, heading=0.6), 40.0, Until("z", 4.7)),
        Leg("line", line, 20.0),
    ]


WATCHED = (
    Gauge("r", 0.02),
    Gauge("phi", 0.01, absolute=True),
    Gauge("z", 4.0),
    Gauge("fin_square"),
    Gauge("speed", 1.4),
)
CLOCK = Clock(0.1, 2)
