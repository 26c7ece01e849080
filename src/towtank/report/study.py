"""What a report is made from: the nouns of a study, given as objects or read from a study folder."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

from towtank.artefact import read_json
from towtank.craft.craft import Craft
from towtank.derive.table import Derivatives
from towtank.errors import ArtefactError, InputError, TowtankError
from towtank.grid.study import GridStudy
from towtank.plan.kinds import Plan
from towtank.tank.run import Run
from towtank.trials.trajectory import Trajectory

if TYPE_CHECKING:
    from towtank.derive.study import FrequencyStudy
    from towtank.design.cruise import Cruise
    from towtank.design.study import DesignStudy
    from towtank.field.comparing.result import Comparison
    from towtank.model.equations import Model
    from towtank.montecarlo.result import MonteCarlo
    from towtank.trials.jammed import JammedFins
    from towtank.verdict.table import Verdict

STAGES = {
    "craft": "Pass the Craft, or run `towtank new`.",
    "plan": "Pass the Plan, or run `towtank plan`.",
    "runs": "Pass the runs, or run `towtank tow`.",
    "derivatives": "Pass the Derivatives, or run `towtank derive`.",
    "frequency": "Pass the FrequencyStudy, or run `towtank derive` on runs that oscillate.",
    "trials": "Pass trajectories, or run `towtank trial`.",
    "mc": "Pass the MonteCarlo, or run `towtank mc`.",
    "faults": "Pass the JammedFins, or run `towtank faults`.",
    "compare": "Pass the Comparison, or run `towtank compare` with a record.",
    "verdict": "Pass the Verdict, or run `towtank assess`.",
    "design": "Pass the DesignStudy, or run `towtank design`.",
    "grid": "Pass the GridStudy, or run `towtank grid`.",
    "validation": "Run `make validate`, which compares the fast tank with published tests.",
}
"""Stage -> what to do when it has left nothing."""
SEVERAL = ("runs", "trajectories", "comparisons")
"""Parts of a study of which there may be several."""


@dataclass(frozen=True)
class Study:
    """Everything a report may show; any part may be absent.

    index, optimal, validation : documents as in trials/index.json, optimal.json, validation.json.
    problems : (stage, message) of files that exist and cannot be read.
    remarks : what the reader must know about where a part came from.
    """

    craft: Craft | None = None
    plan: Plan | None = None
    runs: tuple[Run, ...] = ()
    derivatives: Derivatives | None = None
    frequency: FrequencyStudy | None = None
    model: Model | None = None
    trajectories: tuple[Trajectory, ...] = ()
    mc: MonteCarlo | None = None
    jammed: JammedFins | None = None
    comparisons: tuple[Comparison, ...] = ()
    verdict: Verdict | None = None
    design: DesignStudy | None = None
    cruise: Cruise | None = None
    index: Mapping[str, Any] = field(default_factory=dict)
    grid: GridStudy | None = None
    optimal: Mapping[str, Any] = field(default_factory=dict)
    validation: Mapping[str, Any] = field(default_factory=dict)
    problems: tuple[tuple[str, str], ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def levels(self) -> tuple[str, ...]:
        """Every level of evidence met, in the order of the chain."""
        found = [run.level for run in self.runs]
        found += [self.derivatives.level] if self.derivatives else []
        found += [trial.level for trial in self.trajectories]
        found += [one.record_level for one in self.comparisons]
        found += [self.verdict.level] if self.verdict else []
        return tuple(dict.fromkeys(found))

    @property
    def absent(self) -> tuple[str, ...]:
        """Stages that left nothing."""
        held = {
            "craft": self.craft, "plan": self.plan, "runs": self.runs, "derivatives": self.derivatives,
            "trials": self.trajectories, "mc": self.mc, "verdict": self.verdict, "grid": self.grid,
            "validation": self.validation,
        }  # fmt: skip
        return tuple(stage for stage, content in held.items() if not content)


def gather(things: Iterable[Any]) -> Study:
    """Sort ``things`` into a Study: nouns such as Craft, Run, Model, MonteCarlo, or sequences of them.

    Raises
    ------
    InputError
        Something that is none of these, or two of what there can be one of.
    """
    held: dict[str, Any] = {name: [] for name in SEVERAL}
    for thing in _flat(things):
        name = _part(thing)
        if name in SEVERAL:
            held[name].append(thing)
        elif name in held and held[name] is not thing:
            raise InputError(
                f"report: two things are a {name}. A report is about one craft and one set of coefficients."
            )
        else:
            held[name] = thing
    study = Study(**{**held, **{name: tuple(held[name]) for name in SEVERAL}})
    return completed(study)


def completed(study: Study) -> Study:
    """Fill what follows from the rest: craft and derivatives of a model, craft of a plan, the shipped validation."""
    craft, derivatives, remarks = study.craft, study.derivatives, study.remarks
    if study.model is not None:
        craft, derivatives = craft or study.model.craft, derivatives or study.model.derivatives
    if craft is None and study.plan is not None:
        craft = study.plan.craft
    if craft is None and study.runs:
        craft = _from_library(study.runs[0])
        if craft is not None:
            words = "The craft was not given; the library's craft of the same name, length, origin and water is shown."
            remarks = (*remarks, words)
    study = replace(study, craft=craft, derivatives=derivatives, remarks=remarks)
    if study.model is None and craft is not None and derivatives is not None:
        study = _with_model(study, craft, derivatives)
    return study if study.validation else replace(study, validation=shipped_validation())


def _with_model(study: Study, craft: Craft, derivatives: Derivatives) -> Study:
    from towtank.model.equations import Model

    try:
        return replace(study, model=Model(craft, derivatives))
    except TowtankError as error:
        return replace(study, problems=(*study.problems, ("model", str(error))))


def _from_library(run: Run) -> Craft | None:
    from towtank.craft.library import library_names, read_craft

    if run.craft not in library_names():
        return None
    craft = read_craft(run.craft)
    same = (craft.length, craft.origin_from_nose, craft.water.density) == (
        run.length, run.origin_from_nose, run.density,
    )  # fmt: skip
    return craft if same else None


def _flat(things: Iterable[Any]) -> Iterator[Any]:
    for thing in things:
        if isinstance(thing, list | tuple):
            yield from _flat(thing)
        elif thing is not None:
            yield thing


def _part(thing: Any) -> str:
    plain: tuple[tuple[type, str], ...] = (
        (Craft, "craft"), (Plan, "plan"), (Run, "runs"), (Derivatives, "derivatives"), (Trajectory, "trajectories"),
        (GridStudy, "grid"),
    )  # fmt: skip
    for kind, name in plain:
        if isinstance(thing, kind):
            return name
    from towtank.derive.study import FrequencyStudy
    from towtank.design.cruise import Cruise
    from towtank.design.study import DesignStudy
    from towtank.field.comparing.result import Comparison
    from towtank.model.equations import Model
    from towtank.montecarlo.result import MonteCarlo
    from towtank.trials.jammed import JammedFins
    from towtank.verdict.table import Verdict

    late: tuple[tuple[type, str], ...] = (
        (FrequencyStudy, "frequency"), (Model, "model"), (MonteCarlo, "mc"), (JammedFins, "jammed"),
        (Verdict, "verdict"), (DesignStudy, "design"), (Cruise, "cruise"), (Comparison, "comparisons"),
    )  # fmt: skip
    for of, name in late:
        if isinstance(thing, of):
            return name
    raise InputError(
        f"report: a {type(thing).__name__} cannot be shown. Give Craft, Plan, Run, GridStudy, Derivatives, "
        "FrequencyStudy, Model, Trajectory, MonteCarlo, JammedFins, Comparison, Verdict, DesignStudy, Cruise, or "
        "sequences of them."
    )


def shipped_validation() -> Mapping[str, Any]:
    """The validation table that ships with the package; empty when it holds none."""
    path = Path(str(resources.files("towtank.report"))) / "validation.json"
    return read_json(path, "towtank/validation/1") if path.exists() else {}


def read_study(folder: Path | str) -> Study:
    """Read what a study folder holds; a stage that is absent or unreadable is named in the page, not fatal.

    Raises
    ------
    ArtefactError
        The folder does not exist.
    """
    root = Path(folder)
    if not root.is_dir():
        raise ArtefactError(f"{root} is not a folder. Give the study folder that `towtank run` wrote, with --out DIR.")
    problems: list[tuple[str, str]] = []

    def attempt(stage: str, there: Path, read: Callable[[], Any], empty: Any = None) -> Any:
        if not there.exists():
            return empty
        try:
            return read()
        except TowtankError as error:
            problems.append((stage, str(error)))
            return empty

    from towtank.craft.library import read_craft
    from towtank.experiments.files import own_plan
    from towtank.plan.files import read_plan

    files = {name: root / name for name in ("craft.toml", "plan.toml", "trials")}
    craft = attempt("craft", files["craft.toml"], lambda: read_craft(files["craft.toml"]))
    plan = attempt("plan", files["plan.toml"], lambda: read_plan(files["plan.toml"], craft)) if craft else None
    study = Study(
        craft=craft,
        plan=plan,
        runs=_in_plan(plan, _runs(root, attempt)),
        trajectories=attempt("trials", files["trials"], lambda: _trajectories(files["trials"]), ()),
        index=attempt("trials", files["trials"] / "index.json", lambda: _index(files["trials"]), {}),
        **_results(root, attempt),
    )
    if study.optimal and not own_plan(root):
        words = "plan.toml is not the plan of optimal.json, which is left out."
        study = replace(study, optimal={}, remarks=(*study.remarks, words))
    return completed(
        replace(
            study, problems=tuple(problems), remarks=(*study.remarks, *_of_another_craft(study), *_of_others(study))
        )
    )


def _results(root: Path, attempt: Callable[..., Any]) -> dict[str, Any]:
    """Parts of the study that are one file each."""
    from towtank.derive.files import read_derivatives
    from towtank.derive.study_files import read_frequencies
    from towtank.design.cruise import read_cruise
    from towtank.design.files import read_design
    from towtank.experiments.files import read_optimal
    from towtank.field.comparing.files import read_comparisons
    from towtank.grid.files import read_grid
    from towtank.montecarlo.files import read_mc
    from towtank.trials.jammed_files import read_jammed
    from towtank.verdict.files import read_verdict

    known: tuple[tuple[str, str, str, Callable[[Path], Any]], ...] = (
        ("derivatives", "derivatives", "derivatives.json", read_derivatives),
        ("frequency", "frequency", "frequency.json", read_frequencies),
        ("mc", "mc", "mc.json", lambda path: read_mc(path.parent)),
        ("jammed", "faults", "faults.json", read_jammed),
        ("verdict", "verdict", "verdict.json", read_verdict),
        ("design", "design", "design.json", read_design),
        ("cruise", "design", "cruise.json", read_cruise),
        ("grid", "grid", "grid.json", read_grid),
    )
    found = {part: attempt(stage, root / name, partial(read, root / name)) for part, stage, name, read in known}
    found["comparisons"] = attempt("compare", root / "compare.json", partial(read_comparisons, root), ())
    optimal = root / "optimal.json"
    return found | {"optimal": attempt("plan", optimal, partial(read_optimal, optimal), {})}


def _of_another_craft(study: Study) -> list[str]:
    """What is to be said of a design study whose craft is not the one of the report, but of the same name or not."""
    from towtank.provenance import digest

    if study.design is None or study.craft is None:
        return []
    was = study.design.provenance.get("inputs", {}).get("craft")
    if was == digest(replace(study.craft, speed=study.design.speed), 16):
        return []
    return ["design.json was made of another craft, or of this one before its file was changed. Run `towtank design`."]


def _of_others(study: Study) -> list[str]:
    """What is to be said of comparisons with records that were made with other derivatives than those of the report."""
    from towtank.provenance import digest

    if study.derivatives is None:
        return []
    own = digest(study.derivatives.as_dict(), 16)
    old = [one.name for one in study.comparisons if one.provenance.get("inputs", {}).get("derivatives") != own]
    words = "compare.json was made with other derivatives than these, for {}. Run `towtank compare` again."
    return [words.format(", ".join(dict.fromkeys(old)))] if old else []


def _runs(root: Path, attempt: Callable[..., Any]) -> tuple[Run, ...]:
    """Every whole run of the campaign; of two with one name the file written last. A broken one becomes a problem.

    A folder may hold runs of other tanks and settings, which the campaign recorded last does not count.
    """
    from towtank.tank.files import read_run

    latest: dict[str, Run] = {}
    recorded = _recorded(root)
    found = (path for path in root.glob("runs/*/run.nc") if not recorded or path.parent.name in recorded)
    for path in sorted(found, key=lambda path: path.stat().st_mtime):
        run = attempt("runs", path, partial(read_run, path))
        if run is not None:
            latest[run.name] = run
    return tuple(latest.values())


def _recorded(root: Path) -> set[str]:
    """Folder names of the runs that the study's ledger gives to its campaign; none where there is no ledger."""
    from towtank.artefact import read_json

    try:
        stages = read_json(root / "study.json", "towtank/study/1").get("stages", {})
    except ArtefactError:
        return set()
    return {Path(name).parent.name for name in stages.get("tow", {}).get("files", {})}


def _in_plan(plan: Plan | None, runs: tuple[Run, ...]) -> tuple[Run, ...]:
    """Runs in the order of the plan; those of no test of it come last."""
    if plan is None:
        return tuple(runs)
    order = {test.name: i for i, test in enumerate(plan.tests)}
    return tuple(sorted(runs, key=lambda run: order.get(run.name, len(order))))


def _index(folder: Path) -> dict[str, Any]:
    return read_json(folder / "index.json", "towtank/trials/1")


def _trajectories(folder: Path) -> tuple[Trajectory, ...]:
    from towtank.trials.files import read_trajectory

    return tuple(read_trajectory(path) for path in sorted(folder.glob("*.nc")))
