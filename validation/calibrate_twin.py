"""How often the interval of a calibrated coefficient holds the truth, over synthetic seas.

In every sea the true coefficients are drawn from the prior's covariance, the craft swims orders of its own through a
current with shear and eddies, and the record gets noise and biases of its own. Run as a script, it writes
``validation/calibrate_twin.csv``: one row for each independent coefficient, one for all together, and one for what is
left of their standard deviation. ``python validation/calibrate_twin.py 20`` takes 20 seas.

Departure  The record's channels are those of ``swim`` with white noise and a constant offset, as the calibration has
           it. What the program assumes and the seas do not have: eddies that last 30 s. They last 10 to 40 s here.
"""

from __future__ import annotations

import functools
import multiprocessing
import os
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import towtank as tt
from tables import write_table
from towtank.engine.plan import Clock, Leg
from towtank.errors import InputError
from towtank.field.calibrate.fit import case_of, fit
from towtank.field.calibrate.settings import Settings
from towtank.field.calibrate.unknowns import Unknowns, unknowns
from towtank.field.calibrate.windows import windows_of
from towtank.field.log import SeaLog
from towtank.field.sea import swim, timed
from towtank.field.sea_water import Environment
from towtank.model.equations import Model
from towtank.progress import Silent
from towtank.trials.start import ballasted, setting

Array = NDArray[np.float64]
TARGET = Path(__file__).with_suffix(".csv")
CRAFT, SEAS, GROUP, SECONDS, TICK = "hokie", 200, 20, 300.0, 0.1
"""Craft; seas, of which ``GROUP`` share orders and water but for their eddies; length of a record and its tick [s]."""
STD = {
    "x": 1.0, "y": 1.0, "z": 0.02, "phi": 3e-3, "theta": 3e-3, "psi": 9e-3, "ahead": 0.01, "slip": 0.01, "plunge": 0.01,
    "p": 9e-4, "q": 9e-4, "r": 9e-4,
}  # fmt: skip
BIAS = {"psi": 0.017, "theta": 3e-3, "phi": 3e-3, "z": 0.02, "ahead": 5e-3}
FIX = 10
"""Ticks between fixes of the position."""
SPARE = 2
"""Groups more than are needed, for those that are left out."""
NORMAL = 1.959964
"""Half-width of the 95 % interval."""


@dataclass(frozen=True)
class Outcome:
    """One sea. pulls, left (n,) : error over stated standard deviation, and that over the prior's, of each value."""

    pulls: Array
    left: Array
    settled: bool


@functools.cache
def model() -> Model:
    """The craft with the derivatives of the fast tank and their covariance, neutral."""
    craft = tt.read_craft(CRAFT)
    return ballasted(tt.Model(craft, tt.derive(tt.tow(tt.standard_plan(craft), tt.FastTank()))))


@functools.cache
def free() -> Unknowns:
    """All coefficients with an uncertainty."""
    return unknowns(model().derivatives)


def names() -> tuple[str, ...]:
    """Independent coefficients, then the independent slopes at the origin."""
    u = free()
    slopes = tuple(f"{u.slopes.names[i]} at the origin" for i in u.slopes.first)
    return (*(u.terms.names[u.terms.first[i]] for i in u.chosen), *slopes)


def legs(seconds: float, rng: np.random.Generator) -> list[Leg]:
    """Steps of heading, depth and thrust."""
    s, out, heading, depth, left = setting(model(), None), [], 0.0, 0.0, seconds
    while left > 1e-6:
        within = min(left, float(round(rng.uniform(15.0, 40.0))))
        heading += float(rng.uniform(-1.2, 1.2))
        depth = float(np.clip(depth + rng.uniform(-3.0, 3.0), 0.0, 10.0))
        push = float(rng.choice([1.0, 1.0, 1.3, 0.8]))
        orders = s.orders(steer=1.0, heading=heading, dive=1.0, depth=depth, throttle=push)
        out.append(Leg(f"leg{len(out)}", orders, within))
        left -= within
    return out


def water(rng: np.random.Generator, seed: int) -> Environment:
    """A current of some cm/s with shear, and eddies of 0.5 to 4 cm/s that last 10 to 40 s."""
    level = float(rng.uniform(0.005, 0.04))
    return Environment(
        current=(*rng.normal(0.0, 0.1, 2).tolist(), 0.0), shear=(float(rng.normal(0.0, 0.005)), 0.0),
        turbulence=(level, level, level / 3.0), correlation=float(rng.uniform(10.0, 40.0)), piece=TICK, seed=seed,
    )  # fmt: skip


def records(group: int) -> tuple[list[SeaLog], Array]:
    """Records of ``GROUP`` craft, and their true coefficients as z (GROUP, k)."""
    rng = np.random.default_rng([41, group])
    z = rng.standard_normal((GROUP, free().size))
    true = [free().values(row) for row in z]
    swum = swim(
        model(), timed(model(), legs(SECONDS, rng)), water(rng, group), count=GROUP, clock=Clock(TICK, 2), threads=1,
        parameters={name: np.array([row[name] for row in true]) for name in free().names},
    )  # fmt: skip
    driven = [*(f"delta{i + 1}" for i in range(len(model().craft.fins))), "thrust"]
    logs = []
    for i in range(GROUP):
        noise = np.random.default_rng([43, group, i])
        channels = {name: swum.channels[name][i].copy() for name in driven}
        for name, std in STD.items():
            exact = swum.channels[name][i]
            channels[name] = (
                exact + std * noise.standard_normal(len(exact)) + BIAS.get(name, 0.0) * noise.standard_normal()
            )
            if name in "xy":
                channels[name][np.arange(len(exact)) % FIX != 0] = np.nan
        logs.append(SeaLog(f"sea-{group}-{i}", CRAFT, swum.time, channels, std=STD, bias=BIAS, synthetic=True))
    return logs, z


def outcome(log: SeaLog, z: Array) -> Outcome:
    """Calibrate on one record and compare with the truth."""
    settings, root = Settings(), free().root
    found = fit([case_of(windows_of(model(), log, settings), free().names, settings)], free(), settings, Silent(), 1)
    before, after = (np.sqrt(np.diag(root @ m @ root.T)) for m in (np.eye(free().size), found.covariance))
    return Outcome(root @ (found.z - z) / after, after / before, found.settled)


def group_of(number: int) -> list[Outcome]:
    """All seas of a group; none where a drawn craft tumbles so that its swim ends with an error."""
    try:
        logs, z = records(number)
    except InputError as error:
        sys.stderr.write(f"group {number} is left out: {error}\n")
        return []
    return [outcome(log, row) for log, row in zip(logs, z, strict=True)]


def rows(found: list[Outcome]) -> Iterator[list[str]]:
    """Coefficient ("all" for the mean over the terms), seas, coverage, mean and spread of the pulls, what is left.

    The coverage counts all seas; mean and spread are of those whose search ended by itself: one that did not says so.
    """
    pulls, left = np.array([o.pulls for o in found]), np.array([o.left for o in found])
    settled, terms = np.array([o.settled for o in found]), len(free().chosen)
    for name, a, b in (("all", pulls[:, :terms], left[:, :terms]), *zip(names(), pulls.T, left.T, strict=True)):
        inside, own = float((np.abs(a) < NORMAL).mean()), a[settled]
        yield [name, str(len(found)), f"{inside:.4f}", f"{own.mean():.3f}", f"{own.std():.3f}", f"{np.median(b):.4f}"]


def main(seas: int) -> None:
    """Swim the seas; the table is written anew after each group."""
    groups = -(-seas // GROUP) + SPARE
    head = ("coefficient", "seas", "coverage_95", "mean_pull", "std_of_pulls", "left")
    found: list[Outcome] = []
    with ProcessPoolExecutor(
        min(len(os.sched_getaffinity(0)), groups), mp_context=multiprocessing.get_context("spawn")
    ) as pool:
        for group in pool.map(group_of, range(groups)):
            found = [*found, *group][:seas]
            settled = sum(one.settled for one in found)
            made_by = f"{CRAFT}, synthetic, {len(found)} seas of {SECONDS:g} s at {1.0 / TICK:g} Hz, {settled} settled"
            write_table(TARGET, made_by, head, rows(found))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else SEAS)
