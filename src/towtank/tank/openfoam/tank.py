"""OpenFoamTank: captive tests by RANS. Level rans."""

from __future__ import annotations

import shutil
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from towtank.craft.craft import Craft
from towtank.errors import ArtefactError, InputError, TankError
from towtank.plan.kinds import CaptiveTest
from towtank.progress import Progress
from towtank.tank.identity import run_id
from towtank.tank.openfoam.case import Case, read_case, write_case
from towtank.tank.openfoam.errors import with_model_form
from towtank.tank.openfoam.find import require
from towtank.tank.openfoam.formulation import Straight, domain_of
from towtank.tank.openfoam.mesh.fins import refuse_strakes
from towtank.tank.openfoam.mesh.grid import MeshSettings
from towtank.tank.openfoam.mesh.imported import SurfaceMesh
from towtank.tank.openfoam.mesh.snappy import SnappySettings
from towtank.tank.openfoam.mesh.stl import file_digest
from towtank.tank.openfoam.numerics import Numerics
from towtank.tank.openfoam.read import run_of
from towtank.tank.openfoam.runner import solve
from towtank.tank.openfoam.schedule import schedule
from towtank.tank.pool import Schedule
from towtank.tank.run import Run

LEVEL = "rans"
PHYSICS = 1
"""Raised when the cases change, so that runs made with the former ones are not taken for their own."""

PRESETS: dict[str, tuple[MeshSettings, Numerics]] = {
    "draft": (MeshSettings(along=60, around=16, out=32, y_plus=60.0, far=2.5), Numerics()),
    "standard": (MeshSettings(along=80, around=24, out=40, y_plus=60.0, far=2.5), Numerics(non_orthogonal=1)),
    "fine": (
        MeshSettings(along=120, around=36, out=60, y_plus=60.0, far=2.5),
        Numerics(steps=200, iterations=1500, non_orthogonal=1),
    ),
}
"""Quality -> mesh and numerics. y+ of draft and standard: the first cell of the runs that were measured."""


@dataclass(frozen=True)
class OpenFoamTank:
    """RANS run by OpenFOAM on this machine: on a structured mesh of the craft, or about an imported surface.

    quality : a key of ``PRESETS``.   turbulence : model in its place, a key of ``numerics.MODELS``.
    refinement : factor on the cells each way: meshes of one family.   cores : processes of one case.
    mesh, numerics : settings in place of the preset's.
    where : study folder; cases lie in ``runs/<id>/case``. Without it they are made in a temporary folder and removed.
    formulation : "own" is chosen for each test; "overset" moves the body's mesh in a fixed one, for oscillations only,
    to compare with sources that do so.
    from_neighbour : straight runs start from the nearest one that is solved on the same mesh, where there is one.
    stop : when it is set, the run under way ends; its files stay.
    surface : STL file in place of hull and fins, in metres, body axes, about the body origin.   snappy : its mesh.
    """

    quality: str = "draft"
    turbulence: str | None = None
    refinement: float = 1.0
    cores: int = 1
    mesh: MeshSettings | None = None
    numerics: Numerics | None = None
    where: Path | None = None
    formulation: Literal["own", "overset"] = "own"
    from_neighbour: bool = True
    stop: threading.Event | None = field(default=None, compare=False, repr=False)
    surface: Path | str | None = None
    snappy: SnappySettings | None = None

    def __post_init__(self) -> None:
        if self.quality not in PRESETS:
            raise InputError(
                f"OpenFoamTank: quality {self.quality!r} is not known. Choose one of {', '.join(PRESETS)}."
            )
        if not 0.2 <= self.refinement <= 8.0:
            raise InputError(
                f"OpenFoamTank: refinement {self.refinement:g} is outside 0.2 to 8. Below it the mesh loses the hull, "
                "above it it has 500 times the cells. Give a number near 1."
            )
        if self.surface is not None and self.mesh is not None:
            raise InputError(
                "OpenFoamTank: mesh sets the structured mesh of the craft's own hull, and a surface is meshed by "
                "snappy = SnappySettings(...). Give one of them."
            )
        if self.surface is None and self.snappy is not None:
            raise InputError('OpenFoamTank: snappy is for a surface, and none is given. Add surface = "hull.stl".')

        if self.formulation not in ("own", "overset"):
            raise InputError(
                f'OpenFoamTank: formulation {self.formulation!r} is not known. Give "overset", or leave it at "own", '
                "which is chosen for each test."
            )
        if self.formulation == "overset" and self.surface is not None:
            raise InputError(
                "OpenFoamTank: an overset mesh is made of the craft's own hull, and a surface has none. Leave out one."
            )
        if self.formulation == "overset" and self.cores > 1:
            raise InputError(
                f"OpenFoamTank: overset on {self.cores} cores was never tried. Give cores = 1; several tests can run "
                "side by side."
            )

    @property
    def level(self) -> str:
        """Level of evidence."""
        return LEVEL

    @property
    def mesh_settings(self) -> MeshSettings | SurfaceMesh:
        """Mesh of the preset or as given, refined; about the surface where there is one."""
        if self.surface is not None:
            path = Path(self.surface)
            store = None if self.where is None else Path(self.where) / "meshes"
            settings = (self.snappy or SnappySettings()).refined(self.refinement)
            return SurfaceMesh(path, file_digest(path), settings, store, self.stop)
        chosen = PRESETS[self.quality][0] if self.mesh is None else self.mesh
        return replace(chosen, refinement=chosen.refinement * self.refinement)

    @property
    def solution(self) -> Numerics:
        """Numerics of the preset or as given, with the turbulence model asked for."""
        chosen = PRESETS[self.quality][1] if self.numerics is None else self.numerics
        return chosen if self.turbulence is None else replace(chosen, turbulence=self.turbulence)

    @property
    def measured_as(self) -> str:
        """The preset whose measured errors hold; empty when something in it was changed."""
        own = self.turbulence or self.mesh or self.numerics or self.surface
        changed = own or self.refinement != 1.0 or self.formulation != "own"
        return "" if changed else self.quality

    def settings(self) -> dict[str, Any]:
        """Everything that decides the result beside craft and test. Cores and folders do not."""
        installation, mesh = require(), self.mesh_settings
        return {
            "tank": "openfoam",
            "physics": PHYSICS,
            "quality": self.quality,
            "mesh": mesh.identity() if isinstance(mesh, SurfaceMesh) else asdict(mesh),
            "numerics": asdict(self.solution),
            "openfoam": f"{installation.version} {installation.kind}",
            **({} if self.formulation == "own" else {"formulation": self.formulation}),
        }

    def below(self, study: Path) -> OpenFoamTank:
        """The same tank with its cases in the folder ``study``."""
        return self if self.where is not None else replace(self, where=study)

    def ended_by(self, stop: threading.Event) -> OpenFoamTank:
        """The same tank, whose runs end when ``stop`` is set."""
        return replace(self, stop=stop)

    def schedule(self, craft: Craft, tests: Sequence[CaptiveTest]) -> Schedule:
        """Order of a campaign in this tank: straight runs go on from their neighbours.

        Raises
        ------
        InputError
            The craft has strakes, the surface is not the craft, or a test cannot be run about it.
        """
        refuse_strakes(craft)
        if isinstance(self.mesh_settings, SurfaceMesh):
            self.mesh_settings.check(craft, tests)
        return schedule(craft, tests, self.mesh_settings, self.solution)

    def able(self, test: CaptiveTest) -> bool:
        """False for a test that turns fins when they are part of a surface."""
        return self.surface is None or not any(test.fins)

    def run(self, craft: Craft, test: CaptiveTest, progress: Progress) -> Run:
        """Run one captive test: write its case, or go on with the one on file, solve and read it.

        Raises
        ------
        TankError
            OpenFOAM is missing, or the solver failed; what is on file stays for the next call.
        InputError
            The craft has strakes.
        """
        refuse_strakes(craft)
        installation = require()
        with self._folder(craft, test) as folder:
            task = f"mesh {test.name}"
            progress.start(task, 1)
            try:
                case = self._case(folder, craft, test)
            finally:
                progress.done(task)
            case, outcome = solve(case, installation, progress, stop=self.stop)
            return with_model_form(run_of(case, craft, test, self, outcome), self.measured_as)

    @contextmanager
    def _folder(self, craft: Craft, test: CaptiveTest) -> Iterator[Path]:
        if self.where is not None:
            yield Path(self.where) / "runs" / run_id(craft, test, self) / "case"
            return
        with tempfile.TemporaryDirectory(prefix="towtank-") as folder:
            yield Path(folder) / "case"

    def _case(self, folder: Path, craft: Craft, test: CaptiveTest) -> Case:
        """The case on file, or a fresh one."""
        if folder.exists():
            try:
                return read_case(folder)
            except ArtefactError:
                shutil.rmtree(folder)
        overset = self.formulation == "overset"
        start = self._neighbour(craft, test) if self.from_neighbour and not overset else None
        if start is not None:
            with suppress(TankError):  # solved on another mesh, or its fields are gone: the uniform flow serves
                return write_case(folder, craft, test, self.mesh_settings, self.solution, self.cores, start)
        return write_case(folder, craft, test, self.mesh_settings, self.solution, self.cores, overset=overset)

    def _neighbour(self, craft: Craft, test: CaptiveTest) -> Path | None:
        """The solved straight case of the same mesh whose inflow is nearest."""
        if self.where is None or test.motion.period or test.motion.history(np.zeros(1)).nu[0, 5]:
            return None
        domain = domain_of(craft, test, self.mesh_settings.half)
        nu = test.motion.history(np.zeros(1)).nu[0, :3]
        found: list[tuple[float, Path]] = []
        for done in sorted((Path(self.where) / "runs").glob("*/case/outcome.json")):
            try:
                other = read_case(done.parent)
            except ArtefactError:
                continue
            alike = (
                isinstance(other.formulation, Straight)
                and other.domain == domain
                and other.numerics == self.solution
                and other.craft == craft.name
                and other.test.speed == test.speed
                and (other.test.fins or (0.0,) * len(craft.fins)) == (test.fins or (0.0,) * len(craft.fins))
            )
            if alike and isinstance(other.formulation, Straight):
                inflow = domain.to_body(np.array(other.formulation.inflow))
                found.append((float(np.linalg.norm(inflow + nu)), done.parent))
        return min(found)[1] if found else None
