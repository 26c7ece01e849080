"""What a captive test costs, by a model of the tank it is run in."""

from __future__ import annotations

import difflib
import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from towtank.craft.craft import Craft
from towtank.errors import InputError
from towtank.frames import Array
from towtank.plan.kinds import CaptiveTest

MODELS = ("cfd", "fast", "runs")


@dataclass(frozen=True)
class CostModel:
    """Cost of a run. Only ratios matter: a budget is counted in mean runs of the standard plan.

    steady : a condition held.   step : one time step of an oscillation.
    steps_per_cycle : least steps in a period.   steps_per_length : steps in a hull length travelled.
    full_domain : factor of a run without a plane of symmetry through the hull (roll, deflected fins).
    unit : what the numbers are, in words.
    """

    steady: float
    step: float
    steps_per_cycle: float
    steps_per_length: float
    full_domain: float
    unit: str

    def of(self, test: CaptiveTest, craft: Craft) -> float:
        """Cost of ``test``. An oscillation of a long period costs by the distance travelled."""
        whole = self.full_domain if test.motion.kind == "roll" or any(test.fins) else 1.0
        if not test.motion.period:
            return whole * self.steady
        lengths = test.motion.period * test.speed / craft.length
        steps = max(self.steps_per_cycle, self.steps_per_length * lengths)
        return whole * self.step * steps * test.periods


CFD = CostModel(126.0, 1.4, 200.0, 83.0, 2.0, "CPU s for 100 000 cells of half a domain")
"""OpenFOAM on the project's structured meshes of half a hull.

Source     This project's measurements: 0.42 CPU s per iteration and 100 000 cells, 230 to 330 iterations of a steady
           drift or turn (300 here); 1.4 CPU s per time step; 200 steps in a cycle of 2.4 lengths (w' = 2.6) were
           stable in yaw, which is 83 steps per length.
Departure  A step is taken to be as long at every frequency, since the Courant number limits it: not measured at low w'.
           The whole domain has twice the cells.
Valid      Ratios between kinds of runs; the cells cancel.
"""

FAST = CostModel(1.0, 0.02, 64.0, 0.0, 1.0, "steady runs of the fast tank")
"""The fast tank with 48 members: 1.8 ms for a steady run, 9 ms for 3 periods of 64 samples."""

RUNS = CostModel(1.0, 0.0, 0.0, 0.0, 1.0, "runs")
"""Every run costs the same: a towing tank whose time goes into preparation."""


def cost_model(name: str | Path) -> CostModel:
    """The model ``cfd``, ``fast`` or ``runs``, or one read from a TOML file.

    A file holds some of the keys of ``CostModel`` and may name a model in ``base`` (cfd by default) for the others:
    ``base = "cfd"``, ``steady = 90``.

    Raises
    ------
    InputError
        An unknown word, a file that cannot be read, an unknown key, or a number that is negative or not finite.
    """
    known = {"cfd": CFD, "fast": FAST, "runs": RUNS}
    if str(name) in known:
        return known[str(name)]
    path = Path(name)
    if path.suffix != ".toml":
        raise InputError(
            f"--cost {name}: no such model of cost. Use cfd, fast or runs, or a TOML file that ends in .toml and holds "
            "steady, step, steps_per_cycle, steps_per_length, full_domain."
        )
    try:
        given = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(
            f"--cost {path} is not a readable TOML file ({error}). Write lines such as: steady = 90"
        ) from None
    base = given.pop("base", "cfd")
    if base not in known:
        raise InputError(f"--cost {path}: base {base!r} is not a model. Use one of {', '.join(MODELS)}.")
    return _changed(known[base], given, path)


def _changed(model: CostModel, given: dict[str, object], path: Path) -> CostModel:
    names = [item.name for item in fields(CostModel)]
    values: dict[str, float | str] = {}
    for key, value in given.items():
        if key not in names:
            near = difflib.get_close_matches(key, names, n=1)
            hint = f"Did you mean {near[0]!r}?" if near else f"Keys: base, {', '.join(names)}."
            raise InputError(f"--cost {path}: unknown key {key!r}. {hint}")
        if key == "unit":
            values[key] = str(value)
            continue
        number = float(value) if isinstance(value, int | float) and not isinstance(value, bool) else math.nan
        if not (math.isfinite(number) and number >= 0.0):
            raise InputError(f"--cost {path}: {key} = {value!r} is not a cost. Give a number that is not negative.")
        values[key] = number
    changed = replace(model, **values)  # type: ignore[arg-type]
    if changed.steady <= 0.0:
        raise InputError(f"--cost {path}: steady = 0 makes steady runs free, and a plan would take them all.")
    return changed


def costs(tests: Sequence[CaptiveTest], craft: Craft, model: CostModel) -> Array:
    """Cost (R,) of each test, in units of ``model``. An oscillation costs at least as much as a steady run."""
    least = model.steady
    return np.array([max(model.of(test, craft), least) for test in tests])
