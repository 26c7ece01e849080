"""The stages of a study in order, each done once: what goes in is hashed, what is done is kept."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from towtank.cli import fitting, judging, towing
from towtank.cli.reply import Remarks, Reply
from towtank.cli.scatter import asked, spread
from towtank.cli.study import Study, file_hash, program_hash
from towtank.errors import ArtefactError, CraftError, InputError
from towtank.parallel import cores
from towtank.provenance import digest

if TYPE_CHECKING:
    from towtank.craft.craft import Craft
    from towtank.derive.table import Derivatives
    from towtank.model.equations import Model
    from towtank.plan.kinds import Plan
    from towtank.tank.run import Run
    from towtank.tank.tank import Tank
    from towtank.trials.trajectory import Trajectory

BESIDE = ("grid", "design", "cruise", "compare")
"""Files that the report shows and that no stage of the chain writes."""
STAGES = ("craft", "plan", "tow", "derive", "trials", "mc", "faults", "verdict", "report")


def open_chain(reply: Reply, craft: str | None, out: Path | None, speed: str | None = None) -> Chain:
    """The chain of a study: from a library name, a craft file, a study folder, or nothing when ``out`` is one.

    Raises
    ------
    InputError
        No craft is named and there is no study folder to take it from.
    """
    from towtank.craft.library import read_craft

    named = Path(craft) if craft is not None else (out or Path())
    inside = (named / "craft.toml").is_file()
    if craft is None and not inside:
        raise InputError(f"{named.resolve()} holds no craft.toml. Name a craft, or a study folder with --out DIR.")
    source = str(named / "craft.toml") if inside else str(craft)
    read = _at_speed(read_craft(source), speed)
    if inside:
        reply.log(f"craft from {source}")
    study = Study(out or (named if inside else Path(read.name)))
    if study.ledger_broken:
        reply.log(f"{study.root / 'study.json'} cannot be read; every stage is checked again. Whole runs are kept.")
    reply.file("study", study.root)
    return Chain(study, read, source, reply, speed)


def _at_speed(craft: Craft, speed: str | None) -> Craft:
    from towtank.quantity import si

    if speed is None:
        return craft
    value = si(speed, "m/s", "--speed")
    if value <= 0.0:
        raise InputError(f"--speed {speed}: the craft must move ahead. Give a speed above zero.")
    return replace(craft, speed=value)


@dataclass
class Chain:
    """One study under way. ``speed`` as the user wrote it; None is the craft's own.

    drawing : what the user asked of the Monte Carlo study, as in ``cli.scatter.DRAWING``; None: what the study has.
    fitting : what the user asked of the fit, as in ``cli.fitting.FITTING``; None: what the study has.
    towing : what the user asked of the tank, as in ``cli.towing.TOWING``; None: what the study has.
    jobs : runs under way at a time; None: as many as the tank makes use of.
    requirements : file, or ``cli.judging.STANDARD``; None: what the study has.
    """

    study: Study
    craft: Craft
    source: str
    reply: Reply
    speed: str | None = None
    drawing: dict[str, str] | None = None
    fitting: dict[str, str] | None = None
    towing: dict[str, str] | None = None
    jobs: int | None = None
    requirements: str | None = None
    wall: dict[str, float] = field(default_factory=dict)
    _runs: tuple[Run, ...] | None = None
    _told: dict[str, dict[str, Any]] = field(default_factory=dict)

    def keep_speed(self) -> Chain:
        """Take the speed of the plan that the study already holds, when none was given."""
        if self.speed is None:
            self.speed = self.study.stages().get("plan", {}).get("inputs", {}).get("speed") or None
            self.craft = _at_speed(self.craft, self.speed)
        return self

    def tank(self) -> Tank:
        """The tank the campaign runs in."""
        return towing.tank(self)

    def inputs(self, stage: str) -> dict[str, str]:
        """Name -> hash of what ``stage`` depends on, as things stand."""
        files = {name: digest(record.get("files", {}), 16) for name, record in self.study.stages().items()}
        study, craft = self.study, {"program": program_hash(), "craft": digest(self.craft, 16)}
        match stage:
            case "craft":
                return craft
            case "plan":
                return craft | {"speed": self.speed or ""}
            case "tow":
                return craft | {"plan": file_hash(study.plan)} | towing.inputs(self)
            case "derive":
                return craft | {"runs": files.get("tow", "")} | fitting.inputs(self)
            case "trials" | "faults":
                return craft | {"derivatives": file_hash(study.derivatives)}
            case "mc":
                return craft | {"derivatives": file_hash(study.derivatives)} | asked(self)
            case "verdict":
                # The index of the trials holds what the verdict does not use: the spread of the indices.
                flown = self.study.stages().get("trials", {}).get("files", {})
                flown = {name: known for name, known in flown.items() if name.endswith(".nc")}
                flown_by = {"derivatives": file_hash(study.derivatives), "trials": digest(flown, 16)}
                return craft | flown_by | judging.inputs(self)
        known = ("plan", "tow", "derive", "trials", "mc", "faults", "verdict")
        beside = {name: file_hash(study.root / f"{name}.json") for name in BESIDE}
        return craft | {name: files.get(name, "") for name in known} | beside

    def done(self, stage: str) -> bool:
        """True when ``stage`` need not be done again."""
        return self.study.current(stage, self.inputs(stage))

    def do(self, stage: str, work: Callable[[], Sequence[Path]]) -> None:
        """Do ``work`` for ``stage``, which gives the files it wrote, unless it is done; record it."""
        if self.done(stage):
            self.reply.log(f"{stage:<8} already done")
            return
        started = time.perf_counter()
        inputs = self.inputs(stage)
        files = work()
        wall = time.perf_counter() - started
        self.study.record(stage, inputs, files, wall, self._told.get(stage))
        self.wall[stage] = round(wall, 3)
        self.reply.log(f"{stage:<8} {wall:6.1f} s")

    def replacing(self, path: Path) -> Path:
        """``path``, after a file that somebody edited was put aside."""
        aside = self.study.put_aside(path)
        if aside is not None:
            self.reply.log(f"{path} was edited since it was written; the edited file is kept as {aside.name}")
        return path

    def prepare(self) -> None:
        """Put the craft file and its solid into the study folder."""
        self.do("craft", self._write_craft)
        self.reply.file("craft", self.study.craft)

    def _write_craft(self) -> Sequence[Path]:
        from towtank.craft.library import craft_text, write_craft_copy
        from towtank.craft.solid import write_glb, write_stl

        self._check()
        own = self.study.craft
        if Path(self.source) != own:
            if self.study.edited(own) and own.read_text(encoding="utf-8") != craft_text(self.source):
                raise InputError(
                    f"{own} is not the craft {self.source} and was not copied from it. To use it: towtank run "
                    f"{self.study.root}. To start from {self.source}, move it away or choose another folder with --out."
                )
            write_craft_copy(self.source, self.study.root)
        stl, glb = (self.study.root / f"{self.craft.name}.{kind}" for kind in ("stl", "glb"))
        write_stl(self.craft, stl)
        write_glb(self.craft, glb)
        return own, stl, glb

    def _check(self) -> None:
        from towtank.craft.hydrostatics import check

        findings = check(self.craft).findings
        for finding in findings:
            if finding.severity == "warning":
                self.reply.log(f"  warning: {finding.where}: {finding.message}")
        if errors := [f"{item.where}: {item.message}" for item in findings if item.severity == "error"]:
            raise CraftError(f"{self.source}: " + "\n".join(errors))

    def make_plan(self) -> None:
        """Lay out the captive tests, unless the user edited the plan of the study: then that one holds."""
        if self.study.imported:
            raise InputError(
                f"{self.study.root} holds imported runs and no plan. A plan would put them aside; go on with towtank "
                "derive, trial, assess and report, or choose another folder with --out DIR."
            )
        if self.study.edited(self.study.plan):
            self.plan()
            self.reply.log(f"plan     edited by hand, used as it is (remove {self.study.plan} for the standard one)")
        else:
            self.do("plan", self._write_plan)
        self.reply.file("plan", self.study.plan)

    def _write_plan(self) -> Sequence[Path]:
        from towtank.plan.files import write_plan
        from towtank.plan.standard import standard_plan

        plan = standard_plan(self.craft)
        for note in plan.notes:
            self.reply.log(f"  note: {note}")
        write_plan(plan, self.study.root)
        return self.study.plan, self.study.root / "plan.csv"

    def plan(self) -> Plan:
        """The captive tests of the study."""
        from towtank.plan.files import read_plan

        return read_plan(self.study.plan, self.craft)

    def tow(self) -> None:
        """Run the captive tests that are not done yet."""
        self.reply.kept = f"Finished runs are kept in {self.study.runs}."
        towing.keep(self)
        self.do("tow", self._tow)
        self.reply.file("runs", self.study.runs)
        self.reply.kept = f"What is done is kept in {self.study.root}."

    def _tow(self) -> Sequence[Path]:
        from towtank.tank.files import run_path

        runs = self.runs()
        flags = Counter(flag for run in runs for flag in run.flags)
        self._told["tow"] = {"runs": len(runs), "levels": sorted({run.level for run in runs}), "flags": dict(flags)}
        return [run_path(self.study.root, run.id) for run in runs]

    def runs(self) -> tuple[Run, ...]:
        """The runs of the plan, or of the runs folder when the study has no plan."""
        from towtank.tank.campaign import tow
        from towtank.tank.files import read_runs

        if self._runs is None:
            if self.study.plan.exists():
                told, jobs = Remarks(self.reply), towing.jobs(self)
                self._runs = tow(towing.plan(self), self.tank(), self.study.root, told, jobs=jobs)
            elif self.study.runs.is_dir():
                self._runs = tuple(read_runs(self.study.runs))
            else:
                raise ArtefactError(f"{self.study.root} has no plan and no runs. First: towtank tow {self.source}")
        return self._runs

    def derive(self) -> None:
        """Derivatives and model from the runs."""
        self.do("derive", lambda: fitting.write(self))
        self.reply.file("derivatives", self.study.derivatives)
        self.reply.file("model", self.study.model)

    def write_model(self) -> Path:
        """Write the self-contained model."""
        from towtank.model.files import write_model

        write_model(self.model(), self.study.model)
        return self.study.model

    def derivatives(self) -> Derivatives:
        """The derivatives of the study, from whatever source."""
        from towtank.derive.files import read_derivatives

        if not self.study.derivatives.exists():
            raise ArtefactError(f"{self.study.derivatives} does not exist. First: towtank derive {self.source}")
        return read_derivatives(self.study.derivatives)

    def model(self) -> Model:
        """The model of the craft with the derivatives of the study."""
        from towtank.model.equations import Model

        return Model(self.craft, self.derivatives())

    def try_out(self) -> None:
        """The standard trials."""
        self.do("trials", self._trials)
        self.reply.file("trials", self.study.trials)

    def _trials(self) -> Sequence[Path]:
        from towtank.trials.standard import standard_trials

        return self._write_trials(standard_trials(self.model(), self.reply.progress))

    def add_trial(self, trajectory: Trajectory) -> None:
        """Write one more trial beside those of the study."""
        standard_done = self.done("trials")
        files = self._write_trials((trajectory,))
        if standard_done:
            self.study.record("trials", self.inputs("trials"), files, self.wall.get("trials", 0.0))

    def _write_trials(self, trajectories: Sequence[Trajectory]) -> Sequence[Path]:
        from towtank.trials.files import write_index

        names = {item.name for item in trajectories}
        everything = (*trajectories, *(item for item in self.trajectories() if item.name not in names))
        index = write_index(everything, self.study.trials, spread(self, everything))
        return [index, *(self.study.trials / f"{item.name}.nc" for item in everything)]

    def trajectories(self) -> tuple[Trajectory, ...]:
        """The trials that the study holds."""
        from towtank.trials.files import read_trajectory

        return tuple(read_trajectory(path) for path in sorted(self.study.trials.glob("*.nc")))

    def judge(self) -> None:
        """The verdict."""
        self.do("verdict", lambda: judging.judge(self))
        self.reply.file("verdict", self.study.verdict)

    def verdict(self) -> dict[str, Any]:
        """What the verdict of the study says: level, speed, both planes, elevator reversal, words."""
        from towtank.artefact import read_json

        document = read_json(self.study.verdict, "towtank/verdict/1")
        keys = ("level", "speed", "horizontal", "vertical", "elevator_reversal_speed", "words")
        return {key: document[key] for key in keys}

    def publish(self) -> None:
        """The report of everything the study holds."""
        self.do("report", self._publish)
        self.reply.file("report", self.study.report)

    def _publish(self) -> Sequence[Path]:
        from towtank.report.build import report_study

        report_study(self.study.root, self.study.report, workers=cores())
        return (self.study.report,)
