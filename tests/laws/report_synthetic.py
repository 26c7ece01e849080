"""A small study with known content: a few captive tests of known coefficients, trials in closed form."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from towtank.craft.craft import Craft
from towtank.craft.library import read_craft
from towtank.derive.study import Advice, FrequencyStudy, Gain, Loop, Point, Trend
from towtank.derive.table import Derivatives, Reference
from towtank.plan.kinds import CaptiveTest, Plan
from towtank.plan.motion import Drift, Sway, Yaw
from towtank.symbols import TERMS
from towtank.tank.campaign import tow
from towtank.tank.lpm import LpmTank
from towtank.tank.run import Run
from towtank.trials.trajectory import Trajectory

PRIMES = {
    "Xudot": -0.0007, "Yvdot": -0.017, "Zwdot": -0.017, "Mqdot": -0.00085, "Nrdot": -0.00085, "Kpdot": -1e-5,
    "Xuu": -0.001, "Xvv": 0.004, "Yuv": -0.011, "Yvv": -0.03, "Nuv": -0.0095, "Nvv": 0.004, "Yur": 0.0018,
    "Nur": -0.0035, "Zuw": -0.011, "Muw": 0.0095, "Zuq": -0.0018, "Muq": -0.0035, "Kup": -2e-5,
    "Yuudr": 0.006, "Nuudr": -0.0025, "Zuude": -0.006, "Muude": -0.0025, "Kuudroll": 0.0003, "Xuudd": -0.002,
}  # fmt: skip
SPREAD = (0.8, 0.9, 1.1, 1.2)
"""Factors of the four members of the ensemble on every load."""


@cache
def craft() -> Craft:
    return read_craft("hokie")


@cache
def derivatives() -> Derivatives:
    it = craft()
    density, length, speed = it.water.density, it.length, it.speed
    values = {name: prime * TERMS[name].prime_factor(density, length, speed) for name, prime in PRIMES.items()}
    v, n = np.array(list(values.values())), len(values)
    return Derivatives(
        craft=it.name, level="known coefficients", variant="lumped",
        reference=Reference(length, speed, density, it.origin_from_nose), names=tuple(values), values=v,
        covariance_fit=np.diag((0.02 * v) ** 2), covariance_mesh=np.zeros((n, n)),
        covariance_model=np.diag((0.15 * v) ** 2), origin={"Yuv": 0.6 * values["Yuv"], "Nuv": 1.05 * values["Nuv"]},
        origin_std={"Yuv": 1.0, "Nuv": 2.0}, rejected=(("sway-2", "too violent for the test of this page"),),
        quality={"condition_number": 8.0, "fins_range_deg": 20.0,
                 "sensitivity": {"Yuv": {"0": -250.0, "0.5": -245.0, "1": -240.0}}},
    )  # fmt: skip


def _tests() -> tuple[CaptiveTest, ...]:
    angles = (-16, -8, -4, 0, 4, 8, 16)
    tests = [CaptiveTest(f"drift-{a}", 1.0, Drift(1.0, np.radians(a)), (0.0,) * 4) for a in angles]
    tests += [CaptiveTest(f"sway-{i}", 1.0, Sway(1.0, 0.5 * i, 0.2), (0.0,) * 4, samples=32) for i in (1, 2)]
    tests += [CaptiveTest("yaw-1", 1.0, Yaw(1.0, 0.8, 0.25), (0.0,) * 4, samples=32)]
    mixing = craft().mixing
    for a in (5, 10, 20, 30):
        fins = tuple(float(x) for x in mixing @ np.array([np.radians(a), 0.0, 0.0]))
        tests.append(CaptiveTest(f"rudder-{a}", 1.0, Drift(1.0, 0.0), fins))
    return tuple(tests)


@cache
def plan() -> Plan:
    return Plan(craft(), 1.0, _tests())


@cache
def runs() -> tuple[Run, ...]:
    found = tow(plan(), LpmTank(derivatives().as_dict()))
    return tuple(
        replace(
            run,
            ensemble=np.stack([factor * run.loads for factor in SPREAD]),
            parts={"hull": 0.75 * run.loads, "fins": 0.25 * run.loads},
            flags=("drift beyond 15 deg: outside the range of this page's test",) if "16" in run.name else (),
        )
        for run in found
    )


TREND = {"limit": -200.0, "bend": 5.0, "growth": -900.0}
"""Yuv of ``frequency``: limit + bend w'2 + growth a'."""


@cache
def frequency() -> FrequencyStudy:
    """Six sways that follow ``TREND``, but for a rejected one 50 % off it, beside one yaw."""
    points = [
        Point(f"sway-{a}-{w}", "sway", "Yuv", w, a, TREND["limit"] + TREND["bend"] * w**2 + TREND["growth"] * a, 2.0,
              "accepted")
        for a in (0.1, 0.2) for w in (1.0, 2.0, 3.0)
    ]  # fmt: skip
    points[1] = replace(points[1], verdict="down-weighted")
    points[-1] = replace(points[-1], value=1.5 * points[-1].value, verdict="rejected")
    points.append(Point("yaw-1", "yaw", "Nur", 1.5, 0.3, -8000.0, float("nan"), "accepted"))
    nan = float("nan")
    trends = (
        Trend("sway", "Yuv", TREND["limit"], 8.0, -220.0, -180.0, TREND["bend"], TREND["growth"], 5, -210.0),
        Trend("yaw", "Nur", -8000.0, nan, nan, nan, nan, nan, 1, -7700.0),
    )
    return FrequencyStudy(
        "hokie", "known coefficients", tuple(points), trends, (Loop("yaw-1", "N", 5.0, 4.5, 0.08),),
        (Advice("sway", (0.8, 1.3, 2.0), (0.08, 0.2), "no load moves by 5 %"),),
        (Gain("third-order", "turn, mixed", 0.19, 0.02), Gain("third-order", "drift", 0.011, 0.010)), {},
    )  # fmt: skip


def stalled() -> tuple[Run, ...]:
    """The runs with the rudder force halved at 30 deg, so that the largest lies at 20 deg."""
    return tuple(
        replace(run, loads=0.5 * run.loads, ensemble=None) if run.name == "rudder-30" else run for run in runs()
    )


def flight(name: str, kind: str, heading: np.ndarray, rudder: np.ndarray, loop: str = "open", **more) -> Trajectory:
    """A level flight at 1 m/s that follows ``heading`` (N,) [rad] at 1 s intervals exactly."""
    time = np.arange(len(heading), dtype=float)
    step = np.stack([np.cos(heading), np.sin(heading), np.zeros_like(heading)], axis=1)
    position = np.concatenate([np.zeros((1, 3)), np.cumsum(0.5 * (step[1:] + step[:-1]), axis=0)])
    zero = np.zeros_like(heading)
    rate = np.gradient(heading)
    return Trajectory(
        name=name, kind=kind, loop=loop, craft="hokie", level="known coefficients", time=time, position=position,
        attitude=np.stack([zero, zero, heading], axis=1),
        nu=np.stack([zero + 1.0, zero, zero, zero, zero, rate], axis=1), delta=np.outer(rudder, [-1.0, -1.0, 1.0, 1.0]),
        command=np.stack([rudder, zero, zero], axis=1), **{"indices": {"duration": (time[-1], "s")}, **more},
    )  # fmt: skip


@cache
def trials() -> tuple[Trajectory, ...]:
    t = np.arange(241.0)
    order = np.where(np.sin(t / 15.0) >= 0.0, -1.0, 1.0) * np.radians(10.0)
    swing = np.radians(14.0) * np.sin(t / 15.0 - 0.8)
    circle = np.radians(3.0) * t
    return (
        flight("turning-15deg", "turning circle", circle, np.full_like(t, np.radians(-15.0)),
               indices={"tactical_diameter": (38.2, "m"), "advance": (19.1, "m")}),
        flight("zigzag-10-10", "zigzag, horizontal", swing, order, indices={"first_overshoot": (4.0, "deg")}),
        flight("heading-30deg", "heading step", np.radians(30.0) * (1 - np.exp(-t / 20.0)), 0.1 * np.exp(-t / 20.0),
               "closed", setpoint={"heading": np.full_like(t, np.radians(30.0)), "depth": np.full_like(t, np.nan)}),
        flight("lawnmower", "lawnmower", np.pi * (np.floor(t / 60.0) % 2), 0.05 * np.sin(t), "closed"),
    )  # fmt: skip
