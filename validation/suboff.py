"""The fast tank against the DARPA SUBOFF experiments, as rows of predicted and measured values.

Run as a script, it writes ``src/towtank/report/validation.json``, which every report shows. The tests in
``tests/papers`` hold the same functions to the published bands, and ``tests/numbers`` holds the file to the code.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from towtank import read_craft
from towtank.artefact import write_json
from towtank.craft.craft import Craft
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import Drift, Turn
from towtank.progress import Silent
from towtank.provenance import provenance
from towtank.tank.fast.tank import FastTank

HERE = Path(__file__).parent
TARGET = HERE.parent / "src" / "towtank" / "report" / "validation.json"
DATA: dict[str, Any] = yaml.safe_load((HERE / "suboff.yaml").read_text(encoding="utf-8"))
U, L = 3.344, 4.261
"""Speed [m/s] and reference length [m] of the experiment."""
FITTED = {("bare", "Yv"): "tail_area", ("fins", "Yv"): "sidewash"}
"""Derivatives on which a constant of the tank was set."""
MEMBERS = 128

Array = NDArray[np.float64]


def primes(craft: Craft, test: CaptiveTest, tank: FastTank) -> Array:
    """X' Y' Z' K' M' N' of the nominal constants and of the members, (members + 1, 6)."""
    run = tank.run(craft, test, Silent())
    loads = run.loads[None, 0] if run.ensemble is None else np.concatenate([run.loads[None, 0], run.ensemble[:, 0]])
    return np.asarray(loads / (0.5 * craft.water.density * U**2 * L**2) / np.array([1, 1, 1, L, L, L]))


def slopes(craft: Craft, members: int = 0) -> dict[str, Array]:
    """Y'v, N'v, Y'r, N'r at the origin, each (members + 1,), from small steady drift and turn."""
    tank, h = FastTank(members=members), 1e-3
    drift = [primes(craft, CaptiveTest("drift", U, Drift(U, s * h)), tank) for s in (1, -1)]
    turn = [primes(craft, CaptiveTest("turn", U, Turn(U, s * h * U / L)), tank) for s in (1, -1)]
    v, r = (drift[1] - drift[0]) / (2 * h), (turn[0] - turn[1]) / (2 * h)
    return {"Yv": v[:, 1], "Nv": v[:, 5], "Yr": r[:, 1], "Nr": r[:, 5]}


def control(craft: Craft, members: int = 0) -> dict[str, Array]:
    """Y' and N' per radian of rudder, each (members + 1,), from +-5 deg."""
    tank, h = FastTank(members=members), np.radians(5.0)
    both = [
        primes(craft, CaptiveTest("rudder", U, Drift(U, 0.0), fins=tuple(craft.mixing @ [s * h, 0, 0])), tank)
        for s in (1, -1)
    ]
    slope = (both[0] - both[1]) / (2 * h)
    return {"Ydr": slope[:, 1], "Ndr": slope[:, 5]}


def drift_point(angle: float) -> tuple[float, float, float, float]:
    """Measured beta [rad], X', Y', N' near ``angle`` [deg], halves of the rows at +beta and -beta.

    The offset of the model's zero drops out of Y' and N'.
    """
    rows = np.array(DATA["drift_bare"], dtype=float)
    plus, minus = (rows[np.argmin(np.abs(rows[:, 0] - s * angle))] for s in (1, -1))
    beta = np.radians(0.5 * (plus[0] - minus[0]))
    return beta, 0.5 * (plus[1] + minus[1]), 0.5 * (plus[2] - minus[2]), 0.5 * (plus[3] - minus[3])


def _row(quantity: str, predicted: Array, measured: float, role: str, source: str) -> dict[str, Any]:
    low, high = np.percentile(predicted[1:], [2.5, 97.5])
    return {
        "quantity": quantity,
        "predicted": float(predicted[0]),
        "low": float(low),
        "high": float(high),
        "measured": measured,
        "error_percent": float(100.0 * (predicted[0] / measured - 1.0)),
        "role": role,
        "source": source,
    }


def rows() -> Iterator[dict[str, Any]]:
    """One row for each measured value; the band is the 95 % range of the model-form ensemble."""
    bare, plus = read_craft("suboff-bare"), read_craft("suboff-fins")
    tank = FastTank(members=MEMBERS)
    for craft, case, title in ((bare, "bare", "bare hull"), (plus, "fins", "hull and 4 fins")):
        for name, found in slopes(craft, MEMBERS).items():
            constant = FITTED.get((case, name))
            role = f"fitted ({constant})" if constant else "predicted"
            yield _row(f"{title}, {name[0]}'{name[1]}", found, DATA["derivatives"][case][name], role, "roddy1990")
    for name, found in control(plus, MEMBERS).items():
        measured = DATA["derivatives"]["control_with_ring_wing"][name]
        source = "roddy1990, craft with ring wing and sail: evidence to 20 %"
        yield _row(f"hull and 4 fins, {name[0]}'{name[1:]}", found, measured, "predicted", source)
    for angle in (4, 8, 12, 16, 18):
        beta, *measured_loads = drift_point(angle)
        found = primes(bare, CaptiveTest("drift", U, Drift(U, beta)), tank)
        for load, column, value in zip("XYN", (0, 1, 5), measured_loads, strict=True):
            yield _row(
                f"bare hull, {load}' at {angle} deg", found[:, column], value, "fitted (cross-flow)", "roddy1990"
            )
    for speed, measured in DATA["resistance_bare_N"]:
        run = tank.run(bare, CaptiveTest("straight", speed, Drift(speed, 0.0)), Silent())
        assert run.ensemble is not None
        found = -np.concatenate([run.loads[:1, 0], run.ensemble[:, 0, 0]])
        yield _row(f"bare hull, resistance at {speed:.2f} m/s [N]", found, measured, "predicted", "liuhuang1998")


def document() -> dict[str, Any]:
    """The content of validation.json."""
    return {
        "schema": "towtank/validation/1",
        "level": "semi-empirical",
        "reference": "primes on 4.261 m, moments about 2.013 m aft of the nose, SNAME axes; band: 95 % of the ensemble",
        "rows": list(rows()),
        "provenance": provenance(made_by="validation/suboff.py", members=MEMBERS),
    }


if __name__ == "__main__":
    write_json(TARGET, document())
