"""The report: one HTML page that needs no network and no other file."""

from __future__ import annotations

import datetime
import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import resources
from pathlib import Path
from typing import Any

from towtank.artefact import write_text
from towtank.figures.paper import level_words
from towtank.parallel import each
from towtank.provenance import VERSION
from towtank.report import (
    of_craft,
    of_design,
    of_field,
    of_fit,
    of_grid,
    of_jammed,
    of_model,
    of_montecarlo,
    of_tests,
    of_trials,
    of_trust,
    of_verdict,
)
from towtank.report.blocks import Section, View
from towtank.report.pictures import Sketchbook
from towtank.report.study import Study, gather, read_study

SECTIONS: tuple[Callable[[Study, Sketchbook], Section], ...] = (
    of_verdict.summary,
    of_craft.craft,
    of_tests.matrix,
    of_grid.mesh,
    of_tests.forces_section,
    of_model.model,
    of_fit.fit,
    of_trials.trials,
    of_montecarlo.uncertainty,
    of_jammed.faults,
    of_field.records,
    of_verdict.verdict,
    of_design.design,
    of_verdict.validation,
    of_trust.sensitivity,
    of_trust.limits,
    of_trust.constants,
    of_trust.provenance,
    of_tests.appendix,
)
"""In the order of ITTC 7.5-02-06-02 and 7.5-02-06-03, with the summary before and the run list after."""

MOST_DRAWN = (of_tests.forces_section, of_fit.fit, of_trials.trials, of_craft.craft)
"""Sections worth starting first when several processes share the work."""


def report(path: str | Path, *things: Any, title: str = "") -> Path:
    """Write one self-contained HTML page about ``things``.

    Parameters
    ----------
    path : file to be written.
    things : Craft, Plan, Run, GridStudy, Derivatives, FrequencyStudy, Model, Trajectory, MonteCarlo, JammedFins,
        Comparison, Verdict, DesignStudy, Cruise, or sequences of them, in any order. A stage that is not given is
        named on it.
    title : of the page; the craft's own when left out.

    Returns
    -------
    The path.

    Raises
    ------
    InputError
        Something that cannot be shown.   ArtefactError : the file cannot be written.
    """
    return write_text(Path(path), page(gather(things), title))


def report_study(folder: str | Path, path: str | Path | None = None, title: str = "", workers: int = 1) -> Path:
    """Write the report of a study folder, by default as ``report.html`` in it. A missing stage is named in the page.

    workers : processes that share the drawing (see ``towtank.parallel``).

    Raises
    ------
    ArtefactError
        The folder does not exist, or the file cannot be written.
    """
    return write_text(Path(path) if path else Path(folder) / "report.html", page(read_study(folder), title, workers))


def page(study: Study, title: str = "", workers: int = 1) -> str:
    """The HTML text of a study."""
    import jinja2

    queue = sorted(range(len(SECTIONS)), key=lambda i: SECTIONS[i] not in MOST_DRAWN)
    drawn = dict(zip(queue, each(_section, study, queue, workers), strict=True))
    sections = [drawn[i] for i in range(len(SECTIONS))]
    moving = any(isinstance(block, View) for section in sections for block in section.blocks)
    environment = jinja2.Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    return environment.from_string(_text("page.html.j2")).render(
        title=title or _title(study),
        level="; ".join(level_words(level) for level in study.levels) or "no results yet",
        date=datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M UTC"),
        version=VERSION,
        sections=sections,
        css=_text("page.css"),
        three=_text("vendor/three.min.js") if moving else "",
        viewer=_text("viewer.js"),
    )


def _section(study: Study, number: int) -> Section:
    with _collector_at_rest():
        return SECTIONS[number](study, Sketchbook(f"s{number}"))


@contextmanager
def _collector_at_rest() -> Iterator[None]:
    """Stop the cyclic collector: passes over the million small objects of the figures take a tenth of the time."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def _title(study: Study) -> str:
    if study.craft is not None:
        return study.craft.title or study.craft.name
    named = [run.craft for run in study.runs] + [trial.craft for trial in study.trajectories]
    named += [study.derivatives.craft] if study.derivatives else []
    return named[0] if named else "Unnamed craft"


def _text(name: str) -> str:
    """A file of the page, shipped with the package."""
    return (resources.files("towtank.report") / name).read_text(encoding="utf-8")
