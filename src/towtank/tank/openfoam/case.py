"""Write a case: mesh, fields, dictionaries and motion from readable templates into a fresh folder."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

from towtank.artefact import read_json, write_json, write_text
from towtank.craft.craft import Craft
from towtank.errors import ArtefactError, TankError
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import KINDS
from towtank.tank.openfoam.dictionary import take_over_field, times
from towtank.tank.openfoam.formulation import (
    Arm,
    Domain,
    Formulation,
    Moving,
    Overset,
    StillWater,
    Straight,
    Unsteady,
    domain_of,
    fastest,
    formulation_of,
    overset_of,
)
from towtank.tank.openfoam.mesh.grid import MeshSettings
from towtank.tank.openfoam.mesh.imported import SurfaceMesh
from towtank.tank.openfoam.meshing import write_case_mesh
from towtank.tank.openfoam.motion import Timeline, motion_table, pose, timeline, travelled
from towtank.tank.openfoam.numerics import MODELS, Numerics

SCHEMA = "towtank/case/1"
TEMPLATES = Path(__file__).parent / "templates"
WRITE_EVERY = 100
"""Iterations of a steady case between two times on file: what a kill loses at most."""

WRITES_PER_PERIOD = 4
"""Times on file in a period of a moving case."""

OVERSET_FIELD = """
// Merged with the patches above: the rims of the two meshes take their values from each other.
boundaryField
{
    overset         { type overset; value $internalField; }
}
"""

MARGIN_OF_TIME = 60.0
"""The control dictionary is dated this much back [s]: the solver takes a change of it for one only when it is 10 s
newer than what it read (fileModificationSkew)."""


@dataclass(frozen=True)
class Case:
    """A case on disk.

    folder : of the case.   test : what it runs.   domain, formulation : how.   numerics : as written.
    line : steps of a case that is solved in time, None for a steady one.   walls : names of the wall patches.
    cells, label : of the mesh; ``mesh`` is a hash of it.   length [m], density [kg/m3].
    ranks : processes it is cut for.
    start : where its first field comes from.
    """

    folder: Path
    test: CaptiveTest
    craft: str
    formulation: Formulation
    domain: Domain
    numerics: Numerics
    line: Timeline | None
    walls: tuple[str, ...]
    cells: int
    label: str
    mesh: str
    length: float
    density: float
    ranks: int = 1
    start: str = "uniform"

    @property
    def application(self) -> str:
        """The solver."""
        return self.formulation.application

    @property
    def steady(self) -> bool:
        """True for a steady solver."""
        return self.line is None

    @property
    def held(self) -> bool:
        """True where one load, a mean, is that of all samples."""
        return self.steady or isinstance(self.formulation, Unsteady)

    @property
    def total(self) -> int:
        """Most iterations, or steps, it takes."""
        return self.numerics.iterations if self.line is None else self.line.steps


def write_case(
    folder: Path,
    craft: Craft,
    test: CaptiveTest,
    mesh_settings: MeshSettings | SurfaceMesh,
    numerics: Numerics,
    ranks: int = 1,
    start_from: Path | None = None,
    overset: bool = False,
) -> Case:
    """Write the case of ``test`` into ``folder``; it appears whole or not at all.

    start_from : a finished steady case on the same mesh, whose last fields are the first of this one.
    overset : the body's mesh moves in a fixed one, instead of all of it in the stream.

    Raises
    ------
    ArtefactError
        The folder is not empty, or cannot be written.
    TankError
        The mesh, or the fields to start from, do not fit; the test has no overset formulation.
    """
    folder = Path(folder)
    if folder.exists() and any(folder.iterdir()):
        raise ArtefactError(
            f"{folder} is not empty. A case is written into a fresh folder, because the solver would go on from "
            "what it finds there; remove it, or name another."
        )
    part = folder.with_name(f".{folder.name}.{os.getpid()}.part")
    try:
        shutil.rmtree(part, ignore_errors=True)
        part.mkdir(parents=True)
        case = _meshed(part, craft, test, mesh_settings, numerics, ranks, overset)
        _write_text(case, craft)
        if start_from is not None:
            case = replace(case, start=_start(case, start_from))
        write_document(case)
        if folder.exists():
            folder.rmdir()
        part.replace(folder)
    except OSError as error:
        raise ArtefactError(
            f"cannot write {folder}: {error.strerror or error}. Choose a folder you may write to, or free some space; "
            "nothing half-written stays."
        ) from error
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return replace(case, folder=folder)


def _meshed(
    folder: Path,
    craft: Craft,
    test: CaptiveTest,
    mesh_settings: MeshSettings | SurfaceMesh,
    numerics: Numerics,
    ranks: int,
    overset: bool,
) -> Case:
    """The case, of which only the mesh is written yet."""
    domain = domain_of(craft, test, mesh_settings.half)
    formulation = formulation_of(test, domain, craft.length, unsteady=numerics.travel > 0.0)
    if overset:
        formulation = overset_of(test, formulation)
    line = _line(formulation, test, craft.length, numerics)
    return Case(
        folder=folder,
        test=test,
        craft=craft.name,
        formulation=formulation,
        domain=domain,
        numerics=numerics,
        line=line,
        **vars(write_case_mesh(folder, craft, test, mesh_settings, domain, formulation, line)),
        length=craft.length,
        density=craft.water.density,
        ranks=ranks,
    )


def _line(formulation: Formulation, test: CaptiveTest, length: float, numerics: Numerics) -> Timeline | None:
    """Steps of a case that is solved in time."""
    if isinstance(formulation, Unsteady):
        return travelled(test.speed, length, numerics.travel, numerics.steps)
    return timeline(test, numerics.steps, numerics.ramp) if test.motion.period else None


def write_motion(case: Case) -> None:
    """Write the table of a moving case at the steps of ``case.line``."""
    if case.line is None or isinstance(case.formulation, Unsteady):
        return
    numbers, position, turn = pose(case.test, case.domain, case.formulation, case.line)
    write_text(case.folder / "constant" / "motion.dat", motion_table(numbers, position, turn, case.line.step))


def _write_text(case: Case, craft: Craft) -> None:
    """Fields, dictionaries and motion."""
    import jinja2

    engine = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES), undefined=jinja2.StrictUndefined, keep_trailing_newline=True
    )
    values = context(case, craft.water.kinematic_viscosity)
    for name in template_names(case):
        inside = name.partition("/")[2]
        text = engine.get_template(name).render(values)
        if isinstance(case.formulation, Overset) and inside.startswith("0/"):
            text += OVERSET_FIELD
        write_text(case.folder / inside, text)
    write_motion(case)
    control = case.folder / "system" / "controlDict"
    back = time.time() - MARGIN_OF_TIME
    os.utime(control, (back, back))


def template_names(case: Case) -> list[str]:
    """Templates of the case, ``<layer>/<path in the case>``: later layers replace earlier ones, unused fields go."""
    chosen: dict[str, str] = {}
    for layer in case.formulation.templates:
        for path in sorted((TEMPLATES / layer).rglob("*")):
            if path.is_file():
                inside = path.relative_to(TEMPLATES / layer).as_posix()
                chosen[inside] = f"{layer}/{inside}"
    wanted = {*MODELS[case.numerics.turbulence], "U", "p"}
    return [
        name
        for inside, name in chosen.items()
        if not (inside.startswith("0/") and inside[2:] not in wanted)
        and not (inside == "system/decomposeParDict" and case.ranks == 1)
    ]


def context(case: Case, viscosity: float) -> dict[str, Any]:
    """Values of the templates. Viscosity [m2/s]."""
    numerics = case.numerics
    formulation = case.formulation
    speed = fastest(case.test, case.length)
    k = 1.5 * (numerics.intensity * speed) ** 2
    omega = k / (numerics.viscosity_ratio * viscosity)
    percent = 100.0 * numerics.intensity
    inflow = formulation.inflow if isinstance(formulation, Straight) else (-_stream(formulation), 0.0, 0.0)
    line = case.line
    return {
        **asdict(numerics),
        "craft": case.craft,
        "test": case.test.name,
        "application": case.application,
        "walls": "|".join(case.walls),
        "fins": len(case.walls) > 1,
        "half": case.domain.half,
        "nu": f"{viscosity:.9g}",
        "rho": f"{case.density:.9g}",
        "k": f"{k:.9g}",
        "omega": f"{omega:.9g}",
        "epsilon": f"{0.09 * k * omega:.9g}",
        "nut": f"{numerics.viscosity_ratio * viscosity:.9g}",
        "stress": f"{2.0 * k / 3.0:.9g}",
        "re_theta": f"{_re_theta(percent):.6g}",
        "inflow": _vector(inflow),
        "centre": _vector((*formulation.centre, 0.0)) if isinstance(formulation, Arm) else "",
        "rate": f"{formulation.rate:.15g}" if isinstance(formulation, Arm) else "",
        "step": "1" if line is None else f"{line.step:.15g}",
        "end": str(numerics.iterations) if line is None else f"{line.end:.15g}",
        "write_every": WRITE_EVERY if line is None else max(1, line.per_period // WRITES_PER_PERIOD),
        "ranks": case.ranks,
        "split": _vector(split(case.ranks)),
    }


def _vector(values: tuple[float, ...]) -> str:
    return "(" + " ".join(f"{value + 0.0:.15g}" for value in values) + ")"


def _stream(formulation: Formulation) -> float:
    return 0.0 if isinstance(formulation, Arm | StillWater | Straight) else formulation.speed


def _re_theta(percent: float) -> float:
    """Transition momentum-thickness Reynolds number at turbulence intensity ``percent``, no pressure gradient.

    Source     langtrymenter2009, the correlation for zero pressure gradient.
    """
    if percent <= 1.3:
        return 1173.51 - 589.428 * percent + 0.2196 / percent**2
    return float(331.5 * (percent - 0.5658) ** -0.671)


def split(ranks: int) -> tuple[int, int, int]:
    """Parts along x, y, z whose product is ``ranks``, as near to a cube as it allows, most along the hull."""
    best = (ranks, 1, 1)
    for nx in range(1, ranks + 1):
        for ny in range(1, nx + 1):
            nz, rest = divmod(ranks, nx * ny)
            if not rest and nz <= ny and nx + ny + nz < sum(best):
                best = (nx, ny, nz)
    return best


def _start(case: Case, source: Path) -> str:
    """Take the last fields of the case ``source`` for the first of this one; says where they come from."""
    other = read_case(source)
    if other.mesh != case.mesh:
        raise TankError(f"{source} is on another mesh. Start from a case of the same mesh, or from uniform flow.")
    found = times(source)
    if not found:
        raise TankError(f"{source} has no solution on file. Start from a finished case, or from uniform flow.")
    for name in ("U", "p", *MODELS[case.numerics.turbulence]):
        if not (found[-1] / name).is_file():
            raise TankError(f"{found[-1]} has no field {name}: its turbulence model differs. Start from uniform flow.")
        take_over_field(case.folder / "0" / name, found[-1] / name, case.cells)
    return other.test.name


def write_document(case: Case) -> None:
    """Write case.json: what a process needs that finds the case on file."""
    motion = {"kind": case.test.motion.kind, "values": _values(case.test.motion)}
    document = {
        "schema": SCHEMA,
        **{item.name: getattr(case, item.name) for item in fields(case) if item.name in _PLAIN},
        "test": {**_values(case.test), "motion": motion},
        "domain": asdict(case.domain),
        "formulation": {"word": case.formulation.word, "values": asdict(case.formulation)},
        "application": case.application,
        "numerics": asdict(case.numerics),
        "line": None if case.line is None else asdict(case.line),
    }
    write_json(case.folder / "case.json", document)


_PLAIN = ("craft", "walls", "cells", "label", "mesh", "length", "density", "ranks", "start")


def _values(item: Any) -> dict[str, Any]:
    return {entry.name: getattr(item, entry.name) for entry in fields(item) if entry.name != "motion"}


def read_case(folder: Path) -> Case:
    """The case written in ``folder``.

    Raises
    ------
    ArtefactError
        No case is there, or it was written by another version.
    """
    document = read_json(Path(folder) / "case.json", SCHEMA)
    try:
        return _case(Path(folder), document)
    except (KeyError, TypeError, ValueError) as error:
        raise ArtefactError(
            f"{folder}/case.json does not state a case ({error!r}). Remove the folder; the case is written again."
        ) from None


def _case(folder: Path, document: Mapping[str, Any]) -> Case:
    test = dict(document["test"])
    motion = test.pop("motion")
    test["fins"] = tuple(test["fins"])
    words: dict[str, Any] = {kind.word: kind for kind in (Straight, Unsteady, Arm, Moving, StillWater, Overset)}
    kinds: Mapping[str, Any] = KINDS
    formulation = document["formulation"]
    values = {key: tuple(v) if isinstance(v, list) else v for key, v in formulation["values"].items()}
    plain = {key: document[key] for key in _PLAIN} | {"walls": tuple(document["walls"])}
    return Case(
        folder=folder,
        test=CaptiveTest(motion=kinds[motion["kind"]](**motion["values"]), **test),
        formulation=words[formulation["word"]](**values),
        domain=Domain(**document["domain"]),
        numerics=Numerics(**document["numerics"]),
        line=None if document["line"] is None else Timeline(**document["line"]),
        **plain,
    )
