"""Prediction of unseen motions on the fast tank: one fit over many frequencies against single-frequency practice.

The fast tank tows random smooth motions that no captive test resembles. Each coefficient set predicts their loads, and
the rms of what it misses is compared. Run as a script, it writes ``validation/prediction.csv``.

The baseline, stated before any number was looked at: each oscillation at one frequency and one amplitude, the six pairs
of the standard plan one after the other; analysed by the Fourier formulae or by the regression, alone or with steady
drift at the usual lambda; no steady turns, which the source does not run. Beside it, for fairness, the same pair with
every steady test of the plan, turns included: what is then left is the worth of the other frequencies and amplitudes.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from tables import write_table
from towtank.craft.craft import Craft
from towtank.craft.library import read_craft
from towtank.derive.derive import derive
from towtank.derive.select import GATED, allowed
from towtank.plan.history import History
from towtank.plan.kinds import CaptiveTest
from towtank.plan.standard import standard_plan
from towtank.progress import Silent
from towtank.symbols import FOURFOLD_TIES, LOADS, RATES
from towtank.tank.campaign import tow
from towtank.tank.fast.tank import FastTank
from towtank.tank.run import Run
from towtank.terms import columns, term_loads

Array = NDArray[np.float64]
TARGET = Path(__file__).with_suffix(".csv")
CRAFTS = ("hokie", "suboff-fins")
SEEDS = range(12)
PAIRS = range(6)
OSCILLATIONS = ("surge", "sway", "yaw", "roll")
THIRD = ("third-order",)
FORMS = (("", ()), (", third order", THIRD))
LENGTHS = 32
"""Lengths travelled in one period of a free motion."""
KNOTS = (4.0, 2.0, 1.0)
"""Lengths between the knots: content up to w' = 0.8, 1.6, 3.1. A turn begins within 2 to 4 lengths of the order."""
PEAKS = {"u": 0.1, "v": math.tan(math.radians(15.0)), "w": math.tan(math.radians(15.0)), "p": 0.5, "q": 0.5, "r": 0.5}
"""Largest value at a knot: u - U, v, w over U; p, q, r times L / U."""
DRIVEN = {"horizontal": "uvr", "vertical": "uwq", "all six": "uvwpqr"}
SAMPLES = 64


@dataclass(frozen=True)
class Free:
    """Body velocities that are periodic splines through random knots.

    The tank feels velocities and accelerations; path and attitude are left at zero. ``rates`` [m/s, rad/s] at the
    knots, (knots, 6), ``period`` [s].
    """

    speed: float
    period: float
    rates: tuple[tuple[float, ...], ...]

    kind = "free"

    def history(self, time: Array) -> History:
        """Sample at ``time`` (N,) [s]."""
        values = np.array([*self.rates, self.rates[0]])
        knots = np.linspace(0.0, self.period, len(values))
        spline = make_interp_spline(knots, values, k=5, bc_type="periodic")
        inside = np.mod(time, self.period)
        still = np.zeros((len(time), 3))
        return History(time, still, still, spline(inside), spline(inside, 1))


def free_test(craft: Craft, plane: str, spacing: float, seed: int) -> CaptiveTest:
    """A random motion in ``plane`` with knots ``spacing`` lengths apart."""
    U, L = craft.speed, craft.length
    rng = np.random.default_rng([seed, int(10 * spacing), list(DRIVEN).index(plane)])
    knots = round(LENGTHS / spacing)
    rates = np.zeros((knots, 6))
    rates[:, 0] = U
    for rate in DRIVEN[plane]:
        scale = U if rate in "uvw" else U / L
        rates[:, RATES.index(rate)] += PEAKS[rate] * scale * rng.uniform(-1.0, 1.0, knots)
    motion = Free(U, LENGTHS * L / U, tuple(map(tuple, rates.tolist())))
    name = f"free-{plane}-{spacing:g}-{seed}"
    return CaptiveTest(name, U, motion, periods=1, samples=round(LENGTHS * SAMPLES / spacing))


def fourier_set(oscillations: Sequence[Run]) -> dict[str, float]:
    """Coefficients by the classical formulae of one run of each kind, with the ties of a 4-fold craft."""
    found: dict[str, float] = {}
    for run in oscillations:
        found |= derive([run], screening=False).quality["fourier"][run.name]
    values = {name: found[name] for name in allowed("fourfold") if name in found and name not in GATED}
    values["Yrdot"] = values["Nvdot"] = 0.5 * (values["Yrdot"] + values["Nvdot"])
    return values | {name: sign * values[base] for name, (base, sign) in FOURFOLD_TIES.items() if base in values}


def sets_of(runs: Sequence[Run]) -> Iterator[tuple[str, str, dict[str, float]]]:
    """Practice, number of the pair of amplitude and frequency, and the coefficients, from the runs of a plan."""
    yield "many frequencies", "", derive(runs).as_dict()
    yield "many frequencies, unscreened", "", derive(runs, screening=False).as_dict()
    yield "many frequencies, third order", "", derive(runs, optional=THIRD).as_dict()
    drift = [run for run in runs if run.kind == "drift"]
    turns = [run for run in runs if run.kind == "turn"]
    for k in PAIRS:
        pair = [[run for run in runs if run.kind == kind][k] for kind in OSCILLATIONS]
        steady = [*pair, *drift, *turns]
        yield "one pair, Fourier", str(k + 1), fourier_set(pair)
        yield "one pair", str(k + 1), derive(pair, screening=False).as_dict()
        yield "one pair and drift", str(k + 1), derive([*pair, *drift], screening=False).as_dict()
        yield "one pair and all steady", str(k + 1), derive(steady, screening=False).as_dict()
        third = derive(steady, screening=False, optional=THIRD).as_dict()
        yield "one pair and all steady, third order", str(k + 1), third


def bound(runs: Sequence[Run], optional: Sequence[str] = ()) -> dict[str, float]:
    """The terms of the model fitted to the unseen runs themselves, each load over its rms: what the form can hold."""
    names = [name for name in allowed("fourfold", optional) if name not in GATED and "uud" not in name]
    nu, nudot, control, loads = stacked(runs)
    size = rms(loads)
    seen = size > 1e-9 * size.max()
    matrix = (columns(names, nu, nudot, control)[:, seen] / size[seen, None]).reshape(-1, len(names))
    norm = np.linalg.norm(matrix, axis=0)
    there = np.flatnonzero(norm > 0.0)
    aim = (loads[:, seen] / size[seen]).ravel()
    values = np.linalg.lstsq(matrix[:, there] / norm[there], aim, rcond=1e-9)[0] / norm[there]
    return {names[i]: float(value) for i, value in zip(there, values, strict=True)}


def stacked(runs: Sequence[Run]) -> tuple[Array, Array, Array, Array]:
    """nu, nudot, control and loads of all samples of ``runs``."""
    parts = [(run.history.nu, run.history.nudot, run.control, run.loads) for run in runs]
    nu, nudot, control, loads = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    return nu, nudot, control, loads


def rms(values: Array) -> Array:
    """Root mean square over the samples."""
    return np.asarray(np.sqrt((values**2).mean(axis=0)))


def missed(values: Mapping[str, float], runs: Sequence[Run]) -> dict[str, float]:
    """Load -> rms of what ``values`` do not predict, over the rms of the load; "all" for the rms of these shares."""
    nu, nudot, control, loads = stacked(runs)
    size = rms(loads)
    error = rms(term_loads(values, nu, nudot, control) - loads)
    shares = {load: float(error[i] / size[i]) for i, load in enumerate(LOADS) if size[i] > 1e-9 * size.max()}
    return shares | {"all": float(np.sqrt(np.mean(np.square(list(shares.values())))))}


def unseen(craft: Craft, tank: FastTank, plane: str, spacing: float, seeds: Sequence[int] = SEEDS) -> list[Run]:
    """The runs to be predicted."""
    return [tank.run(craft, free_test(craft, plane, spacing, seed), Silent()) for seed in seeds]


def rows() -> Iterator[list[str]]:
    """Craft, plane, knot spacing, practice, pair, and what is missed of each load and of all."""
    tank = FastTank(members=0)
    for name in CRAFTS:
        craft = read_craft(name)
        sets = list(sets_of(tow(standard_plan(craft), tank)))
        for plane, spacing in itertools.product(DRIVEN, KNOTS):
            runs = unseen(craft, tank, plane, spacing)
            own = [(f"fitted to the unseen{word}", "", bound(runs, group)) for word, group in FORMS]
            for practice, pair, values in (*sets, *own):
                found = missed(values, runs)
                shares = [f"{found[load]:.4f}" if load in found else "" for load in (*LOADS, "all")]
                yield [name, plane, f"{spacing:g}", practice, pair, *shares]


if __name__ == "__main__":
    made_by = f"fast tank, {len(SEEDS)} seeds of {LENGTHS} lengths; rms missed over rms of the load"
    write_table(TARGET, made_by, ("craft", "plane", "knots", "practice", "pair", *LOADS, "all"), rows())
