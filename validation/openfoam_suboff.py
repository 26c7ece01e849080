"""OpenFOAM against the DARPA SUBOFF experiments: what each choice of the set-up is worth, one change at a time.

Run as a script, it runs what is not on file in ``bench/openfoam`` and rewrites ``validation/openfoam_suboff.csv`` and,
from it, the errors that the presets carry. Words after the script's name choose variants: ``draft sst``.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from suboff import DATA, L, U, drift_point
from tables import read_table, write_table
from towtank import read_craft
from towtank.artefact import write_json
from towtank.errors import TankError
from towtank.plan.kinds import CaptiveTest, Plan
from towtank.plan.motion import Drift, Turn
from towtank.provenance import provenance
from towtank.tank.campaign import tow
from towtank.tank.openfoam.errors import FILE, SCHEMA, SOURCE
from towtank.tank.openfoam.tank import PRESETS, OpenFoamTank
from towtank.tank.run import Run

TARGET = Path(__file__).with_suffix(".csv")
SLOPES = TARGET.with_name("openfoam_slopes.csv")
WORK = Path(__file__).parents[1] / "bench" / "openfoam"
HEAD = ("variant", "change", "cells", "test", "load", "predicted", "measured", "error_percent", "cpu_s", "ended")
RATE = 0.2
"""r' of the rotating arm whose slope is compared with the rotary derivatives."""


@dataclass(frozen=True)
class Variant:
    """One set-up. change : what differs from the draft.   angles : of drift [deg].   arm : also a turn."""

    tank: OpenFoamTank
    change: str
    angles: tuple[int, ...] = (4, 12, 18)
    arm: bool = False


def _draft(mesh: dict[str, Any] | None = None, **numerics: Any) -> OpenFoamTank:
    base_mesh, base = PRESETS["draft"]
    return OpenFoamTank(mesh=replace(base_mesh, **(mesh or {})), numerics=replace(base, **numerics))


ALL = (4, 8, 12, 16, 18)
WALL = {"y_plus": 1.0, "out": 48}
"""The wall resolved: cells out of the hull besides."""

VARIANTS: dict[str, Variant] = {
    "draft": Variant(OpenFoamTank("draft"), "none", ALL, arm=True),
    "standard": Variant(OpenFoamTank("standard"), "preset standard", ALL, arm=True),
    "fine": Variant(OpenFoamTank("fine"), "preset fine", arm=True),
    "sst": Variant(_draft(turbulence="kOmegaSST"), "k-omega SST, wall functions", ALL, arm=True),
    "realizable": Variant(_draft(turbulence="realizableKE"), "realizable k-epsilon, wall functions", ALL, arm=True),
    "rng": Variant(_draft(turbulence="RNGkEpsilon"), "RNG k-epsilon, wall functions", arm=True),
    "quadratic": Variant(_draft(turbulence="ShihQuadraticKE"), "quadratic k-epsilon of Shih, wall functions", arm=True),
    "spalart": Variant(_draft(turbulence="SpalartAllmaras"), "Spalart-Allmaras, wall function", arm=True),
    "stress": Variant(_draft(turbulence="SSG"), "Reynolds-stress model SSG, wall functions", arm=True),
    "stress-lrr": Variant(_draft(turbulence="LRR"), "Reynolds-stress model LRR, wall functions", (12,)),
    "finer": Variant(OpenFoamTank("draft", refinement=4.0 / 3.0), "2.4 times the cells"),
    "coarser": Variant(OpenFoamTank("draft", refinement=0.75), "0.42 times the cells"),
    "realizable-finer": Variant(
        OpenFoamTank("draft", turbulence="realizableKE", refinement=4.0 / 3.0), "realizable, 2.4 times the cells", ALL,
        arm=True,
    ),
    "realizable-finest": Variant(
        OpenFoamTank("draft", turbulence="realizableKE", refinement=16.0 / 9.0), "realizable, 5.6 times the cells",
        (4, 12), arm=True,
    ),
    "realizable-thin": Variant(
        _draft({"y_plus": 30.0}, turbulence="realizableKE"), "realizable, first cell at y+ 30", (4, 12), arm=True
    ),
    "realizable-blended": Variant(
        _draft(turbulence="realizableKE", convection="LUST grad(U)"), "realizable, U convected by LUST", (4, 12),
        arm=True,
    ),
    "realizable-limited": Variant(
        _draft(turbulence="realizableKE", convection_turbulence="limitedLinear 1"),
        "realizable, turbulence convected by limitedLinear", (4, 12), arm=True,
    ),
    "stern": Variant(_draft({"along": 90}), "1.5 times the cells along"),
    "girth": Variant(_draft({"around": 24}), "1.5 times the cells around"),
    "layers": Variant(_draft({"out": 48}), "1.5 times the cells out"),
    "limited": Variant(_draft(convection_turbulence="limitedLinear 1"), "turbulence convected by limitedLinear"),
    "blended": Variant(_draft(convection="LUST grad(U)"), "U convected by LUST"),
    "unlimited": Variant(_draft(limiter=0.0), "gradient of U not limited"),
    "thin-wall": Variant(_draft({"y_plus": 30.0}), "first cell at y+ 30"),
    "thick-wall": Variant(_draft({"y_plus": 100.0}), "first cell at y+ 100"),
    "far": Variant(_draft({"far": 5.0}), "far field at twice the distance"),
    "near": Variant(_draft({"far": 0.8}), "far field as near as the bottom of the basin"),
    "full": Variant(_draft({"half": False}), "full domain"),
    "quiet": Variant(_draft(intensity=0.001, viscosity_ratio=1.0), "inflow turbulence 0.1 %, nut/nu 1"),
    "stirred": Variant(_draft(intensity=0.03, viscosity_ratio=100.0), "inflow turbulence 3 %, nut/nu 100"),
    "unsteady": Variant(_draft(travel=6.0), "solved in time over 6 lengths", (12, 18)),
    "unsteady-full": Variant(
        _draft({"half": False}, travel=6.0, turbulence="kOmegaSST"), "k-omega SST in time, full domain", (18,)
    ),
    "resolved": Variant(
        _draft(WALL, turbulence="kOmegaSST", wall="resolved", iterations=1200), "k-omega SST to the wall, y+ 1",
        arm=True,
    ),
    "resolved-spalart": Variant(
        _draft(WALL, turbulence="SpalartAllmaras", wall="resolved", iterations=1200), "Spalart-Allmaras to the wall",
    ),
    "low-reynolds": Variant(
        _draft(WALL, turbulence="LaunderSharmaKE", wall="resolved", iterations=1200),
        "k-epsilon of Launder and Sharma to the wall", (12,),
    ),
    "transition": Variant(
        _draft(WALL, turbulence="kOmegaSSTLM", wall="resolved", iterations=1200, intensity=0.03),
        "gamma transition model to the wall", (4, 12),
    ),
}  # fmt: skip


def plan_of(variant: Variant) -> Plan:
    """Drift tests at the measured angles, and the turn."""
    craft = read_craft("suboff-bare")
    tests = [CaptiveTest(f"drift-{angle}", U, Drift(U, drift_point(angle)[0])) for angle in variant.angles]
    if variant.arm:
        tests.append(CaptiveTest("turn", U, Turn(U, RATE * U / L)))
    return Plan(craft, U, tuple(tests))


def rows(name: str, variant: Variant) -> Iterator[tuple[str, ...]]:
    """Rows of one variant: each load of each test, predicted and measured."""
    plan = plan_of(variant)
    for test in plan.tests:
        try:
            (run,) = tow(replace(plan, tests=(test,)), variant.tank, WORK / "drift")
        except TankError:
            yield (name, variant.change, "", test.name, "", "", "", "", "", "failed")
            continue
        yield from _compared(name, variant, test, run)


def _compared(name: str, variant: Variant, test: CaptiveTest, run: Run) -> Iterator[tuple[str, ...]]:
    load = run.loads[0] / (0.5 * run.density * U**2 * L**2) / np.array([1, 1, 1, L, L, L])
    measured = _measured(test)
    health, mesh = run.provenance["health"], run.provenance["mesh"]
    scale = RATE if test.kind == "turn" else 1.0
    for letter, value in measured.items():
        found = load["XYZKMN".index(letter)] / scale
        yield (
            name, variant.change, str(mesh["cells"]), test.name, f"{letter}'" + ("r" if test.kind == "turn" else ""),
            f"{found:.6g}", f"{value:.6g}", f"{100.0 * (found / value - 1.0):.1f}", f"{health['cpu']:.0f}",
            str(health["ended"]),
        )  # fmt: skip


def _measured(test: CaptiveTest) -> dict[str, float]:
    if test.kind == "turn":
        known = DATA["derivatives"]["bare"]
        return {"Y": known["Yr"], "N": known["Nr"]}
    _, x, y, n = drift_point(int(test.name.split("-")[1]))
    return {"X": x, "Y": y, "N": n}


RANGES = (6.0, 14.0, 20.0)
"""Ends [deg] of the ranges of drift for which the error of a preset is stated."""


def preset_errors(table: Sequence[dict[str, str]], slopes: Sequence[dict[str, str]]) -> dict[str, list[dict[str, Any]]]:
    """Bias and scatter of each preset by load and range of angles; the rotary slopes are one number each.

    ``slopes`` : rows of ``openfoam_slopes``, for the hull with fins, whose drift of 2 deg stands for the first range.
    """
    out: dict[str, list[dict[str, Any]]] = {}
    for preset in PRESETS:
        for load in "XYN":
            low = 0.0
            for high in RANGES:
                own = [row for row in table if row["variant"] == preset and row["load"] == f"{load}'"]
                angles = {row["test"]: float(row["test"].split("-")[1]) for row in own}
                errors = [float(row["error_percent"]) for row in own if low < angles[row["test"]] <= high]
                _add(out, preset, ("translation", load, high), errors)
                low = high
            slope = [row for row in table if row["variant"] == preset and row["load"] == f"{load}'r"]
            _add(out, preset, ("rotation", load, 90.0), [float(row["error_percent"]) for row in slope])
        for quantity, family, up_to in (("v", "translation", RANGES[0]), ("r", "rotation", 90.0)):
            for load in "YN":
                own = [row for row in slopes if (row["setup"], row["craft"]) == (preset, "fins")]
                errors = [float(row["error_percent"]) for row in own if row["quantity"] == load + quantity]
                _add(out, preset, (family, load, up_to), errors, fins=True)
    return out


def _add(
    out: dict[str, list[dict[str, Any]]],
    preset: str,
    what: tuple[str, str, float],
    errors: list[float],
    fins: bool = False,
) -> None:
    if errors:
        share = np.array(errors) / 100.0
        family, load, up_to = what
        entry = {"family": family, "load": load, "up_to": up_to, "bias": float(round(share.mean(), 4)),
                 "scatter": float(round(share.std(), 4)), "points": len(errors), "fins": fins}  # fmt: skip
        out.setdefault(preset, []).append(entry)


def main(wanted: Sequence[str]) -> None:
    """Run the variants named, or all, and keep the rows of the others."""
    chosen = list(wanted) or list(VARIANTS)
    kept = {}
    if TARGET.exists():
        for row in read_table(TARGET):
            kept.setdefault(row["variant"], []).append(tuple(row[key] for key in HEAD))
    for name in chosen:
        kept[name] = list(rows(name, VARIANTS[name]))
        for row in kept[name]:
            print(*row)
        ordered = [row for known in VARIANTS for row in kept.get(known, ())]
        write_table(TARGET, "bare hull of DARPA SUBOFF, primes on 4.261 m about 2.013 m aft of the nose", HEAD, ordered)
    write_errors()


def write_errors() -> None:
    """Rewrite the errors that the presets carry, from the tables on file."""
    tables = [read_table(table) if table.exists() else [] for table in (TARGET, SLOPES)]
    document = {"schema": SCHEMA, "source": SOURCE, "presets": preset_errors(*tables)}
    write_json(FILE, {**document, "provenance": provenance(made_by="validation/openfoam_suboff.py")})


if __name__ == "__main__":
    main(sys.argv[1:])
