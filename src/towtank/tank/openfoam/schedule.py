"""What runs cost, and the order that lets straight runs go on from their neighbours."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import mean, median

import numpy as np

from towtank.artefact import read_json
from towtank.craft.craft import Craft
from towtank.errors import ArtefactError
from towtank.plan.kinds import CaptiveTest
from towtank.tank.openfoam.case import read_case
from towtank.tank.openfoam.formulation import domain_of
from towtank.tank.openfoam.mesh.grid import MeshSettings
from towtank.tank.openfoam.mesh.imported import SurfaceMesh
from towtank.tank.openfoam.motion import timeline
from towtank.tank.openfoam.numerics import Numerics
from towtank.tank.openfoam.runner import SCHEMA as OUTCOME
from towtank.tank.pool import Schedule


@dataclass(frozen=True)
class Pace:
    """CPU seconds of one cell in one iteration, or in one time step; iterations until the load is flat.

    The defaults are measured, k-epsilon, one core: 0.42 and 1.4 s for 100 thousand cells on 11 to 77 thousand, 230 to
    300 iterations on straight runs of SUBOFF. ``measured`` : finished runs that it was taken from.
    """

    steady: float = 4.2e-6
    unsteady: float = 1.4e-5
    iterations: float = 270.0
    measured: int = 0

    def cpu(self, cells: float, numerics: Numerics, test: CaptiveTest) -> float:
        """CPU seconds of a run on ``cells``, from its start."""
        if test.motion.period == 0.0 and numerics.travel:
            return self.unsteady * cells * numerics.travel * numerics.steps
        if test.motion.period == 0.0:
            return self.steady * cells * min(self.iterations, numerics.iterations)
        return self.unsteady * cells * timeline(test, numerics.steps, numerics.ramp).steps


def pace_of(out: Path) -> Pace:
    """The pace of the finished cases of a study folder; what none of them tells keeps its default."""
    rates: dict[bool, list[float]] = {True: [], False: []}
    iterations: list[float] = []
    for path in sorted(Path(out).glob("runs/*/case/outcome.json")):
        try:
            outcome, case = read_json(path, OUTCOME), read_case(path.parent)
        except ArtefactError:
            continue
        if outcome["steps"] < 1 or not outcome["cpu"]:
            continue
        rates[case.steady].append(outcome["cpu"] / (case.cells * outcome["steps"]))
        if case.steady and not outcome["resumed"]:
            iterations.append(outcome["steps"])
    return Pace(
        steady=median(rates[True]) if rates[True] else Pace.steady,
        unsteady=median(rates[False]) if rates[False] else Pace.unsteady,
        iterations=mean(iterations) if iterations else Pace.iterations,
        measured=len(rates[True]) + len(rates[False]),
    )


def cells_of(craft: Craft, test: CaptiveTest, settings: MeshSettings | SurfaceMesh) -> int:
    """Cells of the mesh of a test, within a few per cent, without making it; about a surface within a third."""
    if isinstance(settings, SurfaceMesh):
        return settings.settings.estimate(craft)
    along, around, out = settings.counts()
    return along * around * out * (1 if domain_of(craft, test, settings.half).half else 2)


def schedule(
    craft: Craft, tests: Sequence[CaptiveTest], mesh: MeshSettings | SurfaceMesh, numerics: Numerics
) -> Schedule:
    """Chains of straight runs on one mesh, from the smallest angle outwards to either side; all others stand alone."""
    chains: dict[object, list[tuple[float, int]]] = defaultdict(list)
    for number, test in enumerate(tests):
        nu = test.motion.history(np.zeros(1)).nu[0]
        if test.motion.period or nu[3:].any():
            chains[number].append((0.0, number))
            continue
        domain = domain_of(craft, test, mesh.half)
        across = domain.to_mesh(nu[:3])[1:]
        fins = test.fins if any(test.fins) else ()
        chains[domain, fins, test.speed, bool((across > 0.0).any())].append((float(np.linalg.norm(across)), number))
    pace = Pace()
    costs = tuple(pace.cpu(cells_of(craft, test, mesh), numerics, test) for test in tests)
    return Schedule(tuple(tuple(number for _, number in sorted(chain)) for chain in chains.values()), costs)
