"""A craft, its prior, and records of synthetic seas; each case is made once."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

import towtank as tt
from towtank.craft.library import read_craft
from towtank.derive.table import Derivatives
from towtank.engine.plan import Clock, Leg
from towtank.experiments.belief import believe
from towtank.field.log import SeaLog
from towtank.field.sea import swim, timed
from towtank.field.sea_water import Environment
from towtank.model.equations import Model
from towtank.plan.standard import standard_plan
from towtank.tank.campaign import tow
from towtank.tank.fast.tank import FastTank
from towtank.trials.start import ballasted, setting

TICK = 0.1
STD: Mapping[str, float] = {
    "x": 1.0, "y": 1.0, "z": 0.02, "phi": 3e-3, "theta": 3e-3, "psi": 9e-3, "ahead": 0.01, "slip": 0.01, "plunge": 0.01,
    "p": 9e-4, "q": 9e-4, "r": 9e-4,
}  # fmt: skip
"""White noise of the sensors: a compass of 0.5 deg, a gyro of 0.05 deg/s, a Doppler log of 1 cm/s."""
BIAS: Mapping[str, float] = {"psi": 0.017, "theta": 3e-3, "phi": 3e-3, "z": 0.02, "ahead": 5e-3}
FIX = 10
"""Ticks between fixes of the position."""


@functools.cache
def hokie() -> Model:
    """hokie with the derivatives of the fast tank, neutral."""
    craft = read_craft("hokie")
    return ballasted(Model(craft, tt.derive(tow(standard_plan(craft), FastTank(members=2)))))


def legs(model: Model, seconds: float, rng: np.random.Generator) -> list[Leg]:
    """Steps of heading, depth and thrust."""
    s, out, heading, depth, left = setting(model, None), [], 0.0, 0.0, seconds
    while left > 1e-6:
        within = min(left, round(float(rng.uniform(15.0, 40.0))))
        heading += float(rng.uniform(-1.2, 1.2))
        depth = float(np.clip(depth + rng.uniform(-3.0, 3.0), 0.0, 10.0))
        push = float(rng.choice([1.0, 1.0, 1.3, 0.8]))
        orders = s.orders(steer=1.0, heading=heading, dive=1.0, depth=depth, throttle=push)
        out.append(Leg(f"leg{len(out)}", orders, within))
        left -= within
    return out


def records(
    model: Model, seconds: float, environment: Environment, *, count: int = 1, seed: int = 0, noise: float = 1.0,
    parameters: Mapping[str, np.ndarray] | None = None,
) -> list[SeaLog]:  # fmt: skip
    """Records of ``count`` craft that swim the same orders. noise : factor of the noise and the biases."""
    trial = timed(model, legs(model, seconds, np.random.default_rng([seed, 1])))
    swum = swim(model, trial, environment, count=count, parameters=parameters, clock=Clock(TICK, 2))
    assert (swum.ended == 0).all()
    fins = {f"delta{i + 1}" for i in range(len(model.craft.fins))}
    out = []
    for i in range(count):
        rng = np.random.default_rng([seed, i, 7])
        channels = {name: values[i].copy() for name, values in swum.channels.items() if name in fins | {"thrust"}}
        for name, std in STD.items():
            values = swum.channels[name][i]
            error = std * rng.standard_normal(len(values)) + BIAS.get(name, 0.0) * rng.standard_normal()
            channels[name] = values + noise * error
            if name in "xy":
                channels[name][np.arange(len(values)) % FIX != 0] = np.nan
        out.append(
            SeaLog(f"sea{seed}-{i}", model.craft.name, swum.time, channels, std=STD, bias=BIAS if noise else {},
                   synthetic=True)
        )  # fmt: skip
    return out


def off(prior: Derivatives, shares: Mapping[str, float]) -> Derivatives:
    """``prior`` with some values wrong by a share, twins with them, and without any uncertainty."""
    tied = believe(prior).terms
    values = tied.values.copy()
    for number, share in {int(tied.index[tied.names.index(n)]): share for n, share in shares.items()}.items():
        values[number] *= 1.0 + share
    none = np.zeros_like(prior.covariance)
    return replace(
        prior, values=tied.expand(values), covariance_fit=none, covariance_mesh=none, covariance_model=none,
        quality={name: value for name, value in prior.quality.items() if name != "origin"},
    )  # fmt: skip
