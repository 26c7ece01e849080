"""SUBOFF with and without fins in OpenFOAM: slopes at the origin, what the fins add, added mass, resistance.

Run as a script, it runs what is not on file in ``bench/openfoam`` and rewrites ``validation/openfoam_slopes.csv``.
Words after the script's name choose set-ups: ``draft realizable``.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from openfoam_suboff import RATE, SLOPES, WORK, write_errors
from suboff import DATA, L, U
from tables import read_table, write_table
from towtank import read_craft
from towtank.frames import Array
from towtank.plan.kinds import CaptiveTest, Plan
from towtank.plan.motion import Drift, Sway, Turn, Yaw
from towtank.tank.campaign import tow
from towtank.tank.openfoam.tank import PRESETS, OpenFoamTank
from towtank.tank.run import Run

HEAD = ("setup", "craft", "quantity", "predicted", "measured", "error_percent", "of_fins", "cpu_s")
SMALL = np.radians(2.0)
"""Drift [rad] whose load over v' is taken for a slope."""

PMM = 2.22
"""Frequency [rad/s] of the oscillations in roddy1990, those at rest and those under way."""

SWING = 0.07
"""v/U of the sway, and r' of the yaw: about 4 deg of drift."""

CREEP = 0.02
"""Tow [m/s] of the oscillations for added mass, which were made at rest."""

CRAFTS = {"bare": "suboff-bare", "fins": "suboff-fins", "x": "suboff-x"}


CHORD = {"along": 72, "chord": 18}
"""Twice the cells on the chord of the fins."""


def _like(turbulence: str = "kEpsilon", **mesh: Any) -> OpenFoamTank:
    chosen, numerics = PRESETS["draft"]
    return OpenFoamTank(mesh=replace(chosen, **mesh), numerics=replace(numerics, turbulence=turbulence))


GIRTH = replace(PRESETS["draft"][1], non_orthogonal=1)
"""Twice the cells around need it."""

SETUPS: dict[str, OpenFoamTank] = {
    "draft": OpenFoamTank("draft"),
    "standard": OpenFoamTank("standard"),
    "fine": OpenFoamTank("fine"),
    "sst": _like("kOmegaSST"),
    "realizable": _like("realizableKE"),
    "chord": _like(**CHORD),
    "chord-sst": _like("kOmegaSST", **CHORD),
    "chord-realizable": _like("realizableKE", **CHORD),
    "girth": OpenFoamTank(mesh=replace(PRESETS["draft"][0], along=80, around=32, chord=12), numerics=GIRTH),
    "girth-sst": OpenFoamTank(
        mesh=replace(PRESETS["draft"][0], along=80, around=32, chord=12),
        numerics=replace(GIRTH, turbulence="kOmegaSST"),
    ),
}


def tests(setup: str, craft: str) -> list[CaptiveTest]:
    """Drift and turn for every set-up; the draft also swings, and the bare hull is towed straight."""
    if craft == "x" and setup not in ("draft", "chord"):
        return []
    out = [CaptiveTest("drift", U, Drift(U, SMALL)), CaptiveTest("turn", U, Turn(U, RATE * U / L))]
    if setup == "draft" and craft != "x":
        sway, yaw = SWING * U / PMM, SWING * U / L * U / PMM**2
        out += [CaptiveTest("sway", U, Sway(U, sway, PMM), periods=2, samples=60),
                CaptiveTest("yaw", U, Yaw(U, yaw, PMM), periods=2, samples=60),
                CaptiveTest("sway-rest", CREEP, Sway(CREEP, sway, PMM), periods=2, samples=120,
                            exploratory=True)]  # fmt: skip
    if setup in ("draft", "realizable") and craft == "bare":
        out += [CaptiveTest(f"straight-{speed:.2f}", speed, Drift(speed, 0.0))
                for speed, _ in DATA["resistance_bare_N"]]  # fmt: skip
    return out


def primes(run: Run, loads: Array) -> Array:
    """Loads (..., 6) on U and L."""
    return np.asarray(loads / (0.5 * run.density * U**2 * L**2) / np.array([1, 1, 1, L, L, L]))


def parts(run: Run) -> dict[str, Array]:
    """Loads (N, 6) in primes of the whole craft, its hull and its fins."""
    return {"": primes(run, run.loads)} | {name: primes(run, loads) for name, loads in (run.parts or {}).items()}


def slopes(run: Run) -> dict[str, float]:
    """Quantity -> value, from one run; the parts carry their name behind a colon.

    Oscillations: least squares of the last period on velocity and acceleration, which are a quarter period apart.
    """
    out = {}
    nu, nudot = run.history.nu, run.history.nudot
    for name, load in parts(run).items():
        tail = f":{name}" if name else ""
        for letter, column in (("Y", 1), ("N", 5)):
            if run.kind in ("drift", "turn"):
                word, value = ("v", nu[0, 1] / U) if run.kind == "drift" else ("r", nu[0, 5] * L / U)
                out[f"{letter}{word}{tail}"] = float(load[0, column] / value)
                continue
            axis, word, scale = (1, "v", U) if run.kind == "sway" else (5, "r", U / L)
            last = run.settled
            x = np.column_stack([nu[last, axis] / scale, nudot[last, axis] / scale * L / U, np.ones(len(last))])
            rate, inertia, _ = np.linalg.lstsq(x, load[last, column], rcond=None)[0]
            out |= {f"{letter}{word} VPMM{tail}": float(rate), f"{letter}{word}dot{tail}": float(inertia)}
    return out


def rows(setup: str) -> Iterator[tuple[str, ...]]:
    """Rows of one set-up: each craft, then what the fins add to the bare hull."""
    found: dict[str, dict[str, float]] = {}
    for craft, name in CRAFTS.items():
        wanted = tests(setup, craft)
        known = DATA["derivatives"]["bare" if craft == "bare" else "fins"]
        found[craft] = {}
        if not wanted:
            continue
        for run in tow(Plan(read_craft(name), U, tuple(wanted)), SETUPS[setup], WORK / "slopes"):
            cpu = f"{run.provenance['health']['cpu']:.0f}"
            if run.name.startswith("straight"):
                resistance = dict((f"straight-{u:.2f}", n) for u, n in DATA["resistance_bare_N"])[run.name]
                speed = run.name.removeprefix("straight-")
                yield _row(setup, craft, f"R at {speed} m/s [N]", -run.loads[0, 0], resistance, "", cpu)
                continue
            values = slopes(run)
            at_rest = run.name == "sway-rest"
            for quantity, value in values.items():
                if ":" in quantity or (at_rest and not quantity.endswith("dot")):
                    continue
                share = f"{values[f'{quantity}:fins'] / value:.3f}" if f"{quantity}:fins" in values else ""
                name_of = f"{quantity} at rest" if at_rest else quantity
                found[craft][name_of] = value
                yield _row(setup, craft, name_of, value, known.get(quantity.split()[0]), share, cpu)
    bare, fins = (DATA["derivatives"][key] for key in ("bare", "fins"))
    for quantity, value in found["fins"].items():
        if quantity in found["bare"]:
            key = quantity.split()[0]
            measured = fins[key] - bare[key] if key in fins else None
            yield _row(setup, "fins less bare", quantity, value - found["bare"][quantity], measured, "", "")


def _row(
    setup: str, craft: str, quantity: str, value: float, measured: float | None, share: str, cpu: str
) -> tuple[str, ...]:
    told = ("", "") if measured is None else (f"{measured:.6g}", f"{100.0 * (value / measured - 1.0):.1f}")
    return (setup, craft, quantity, f"{value:.6g}", *told, share, cpu)


def main(wanted: Sequence[str]) -> None:
    """Run the set-ups named, or all, and keep the rows of the others."""
    kept: dict[str, list[tuple[str, ...]]] = {}
    if SLOPES.exists():
        for row in read_table(SLOPES):
            kept.setdefault(row["setup"], []).append(tuple(row[key] for key in HEAD))
    for setup in list(wanted) or list(SETUPS):
        kept[setup] = list(rows(setup))
        for row in kept[setup]:
            print(*row, flush=True)
        ordered = [row for known in SETUPS for row in kept.get(known, ())]
        write_table(SLOPES, "DARPA SUBOFF, primes on 4.261 m about 2.013 m aft of the nose", HEAD, ordered)
    write_errors()


if __name__ == "__main__":
    main(sys.argv[1:])
