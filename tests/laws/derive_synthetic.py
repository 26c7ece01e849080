"""Runs made from known coefficients, without a craft or a tank: what the tests of ``derive`` are built on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from towtank.plan.history import History
from towtank.plan.motion import Drift, Heave, Incidence, Pitch, Roll, Surge, Sway, Turn, Yaw
from towtank.symbols import FOURFOLD_ADDED_MASS, FOURFOLD_TIES, STANDING, TERMS
from towtank.tank.run import Run
from towtank.terms import term_loads

LENGTH, SPEED, DENSITY = 8.0, 1.5, 1000.0
SAMPLES, PERIODS = 32, 3
ROLL = ("Kuv", "Kvv", "Kur", "Krr")
W0 = SPEED / LENGTH


def coefficients(names, seed=0) -> dict[str, float]:
    """Values of random size whose primes are 0.3 to 1 % with mixed signs; M_A symmetric."""
    rng = np.random.default_rng(seed)
    values = {
        name: TERMS[name].prime_factor(DENSITY, LENGTH, SPEED) * rng.uniform(0.003, 0.01) * rng.choice([-1.0, 1.0])
        for name in names
    }
    for i, load in enumerate("XYZKMN"):
        for j, rate in enumerate("uvwpqr"):
            a, b = f"{load}{rate}dot", f"{'XYZKMN'[j]}{'uvwpqr'[i]}dot"
            if i < j and a in values and b in values:
                values[b] = values[a]
    return values


def fourfold_coefficients(seed=0) -> dict[str, float]:
    names = [n for n in STANDING if (not TERMS[n].is_added_mass or n in FOURFOLD_ADDED_MASS) and n not in ROLL]
    values = coefficients(names, seed)
    for name, (base, sign) in FOURFOLD_TIES.items():
        values[name] = sign * values[base]
    return values


def make(name, motion, *, control=(0.0, 0.0, 0.0), kind="", symmetry="fourfold", history=None) -> Run:
    steady = motion.period == 0.0
    time = np.array([0.0, 1.0]) if steady else np.arange(PERIODS * SAMPLES + 1) * motion.period / SAMPLES
    history = motion.history(time) if history is None else history(time)
    virtual = np.array([*control, 4.0 * float(np.dot(control, control))])
    return Run(
        id=f"{name}-0", name=name, kind=kind or motion.kind, craft="synthetic", symmetry=symmetry,
        level="known coefficients", speed=SPEED, period=motion.period, periods=PERIODS, density=DENSITY, length=LENGTH,
        origin_from_nose=4.0, history=history, delta=np.full((len(time), 4), max(np.abs(control))),
        control=np.tile(virtual, (len(time), 1)), loads=np.zeros((len(time), 6)),
    )  # fmt: skip


def heave_and_pitch(time) -> History:
    """Heave velocity and pitch rate a quarter period apart in part: what separates Xwq from Xww and Xqq."""
    w = 1.5 * W0
    a, b = Heave(SPEED, 0.2 * SPEED / w, w).history(time), Pitch(SPEED, 0.05 * SPEED / w, w).history(time + 0.4 / w)
    nu, nudot = b.nu.copy(), b.nudot.copy()
    nu[:, 2], nudot[:, 2] = a.nu[:, 2], a.nudot[:, 2]
    return History(time, a.position, b.attitude, nu, nudot)


def campaign(symmetry="fourfold") -> list[Run]:
    """Runs that excite every term; loads are still zero."""
    rad = np.radians
    steady = [(f"drift-{b}", Drift(SPEED, rad(b))) for b in range(-20, 21, 4)]
    steady += [(f"turn-{r}", Turn(SPEED, r * W0)) for r in (-0.5, -0.3, -0.1, 0.1, 0.3, 0.5)]
    steady += [(f"turn-{r}-drift-{b}", Turn(SPEED, r * W0, rad(b))) for r in (-0.3, 0.3) for b in (-6, 6)]
    if symmetry != "fourfold":
        steady += [(f"incidence-{b}", Incidence(SPEED, rad(b))) for b in range(-20, 21, 4) if b]
    runs = [make(name, motion, symmetry=symmetry) for name, motion in steady]
    for which, word in enumerate(("rudder", "elevator", "aileron")):
        for angle in (-15, -8, 8, 15):
            control = [0.0, 0.0, 0.0]
            control[which] = float(rad(angle))
            runs.append(make(f"{word}-{angle}", Drift(SPEED, 0.0), control=control, kind="fins", symmetry=symmetry))
    for cls in (Sway, Heave, Surge):
        for v, w in ((0.1, 0.8), (0.3, 1.5)):
            runs.append(make(f"{cls.kind}-{v}-{w}", cls(SPEED, v * SPEED / (w * W0), w * W0), symmetry=symmetry))
    for cls in (Yaw, Pitch):
        for r, w in ((0.2, 1.0), (0.45, 2.0)):
            amplitude = r * W0 * SPEED / (w * W0) ** 2
            runs.append(make(f"{cls.kind}-{r}-{w}", cls(SPEED, amplitude, w * W0), symmetry=symmetry))
    for a, w in ((0.15, 1.0), (0.35, 2.5)):
        runs.append(make(f"roll-{a}-{w}", Roll(SPEED, a, w * W0), symmetry=symmetry))
    if symmetry != "fourfold":
        mixed = Pitch(SPEED, 0.1, 1.5 * W0)
        runs.append(make("mixed", mixed, symmetry=symmetry, history=heave_and_pitch))
    return runs


def loaded(runs, values: Mapping[str, float], noise=0.0, seed=0) -> list[Run]:
    """The runs with the loads of ``values``, and noise as a share of each load's rms in each run."""
    rng = np.random.default_rng(seed)
    out = []
    for run in runs:
        exact = term_loads(values, run.history.nu, run.history.nudot, run.control)
        sigma = noise * np.sqrt((exact**2).mean(axis=0))
        out.append(replace(run, loads=exact + sigma * rng.standard_normal(exact.shape)))
    return out
