"""What is changed in a case that diverged, before it is tried again."""

from __future__ import annotations

import shutil
from dataclasses import replace

from towtank.tank.openfoam.case import Case, write_document, write_motion
from towtank.tank.openfoam.dictionary import set_entry, times
from towtank.tank.openfoam.motion import Timeline


def next_rung(case: Case) -> tuple[Case, str] | None:
    """The case with the next gentler setting, cleared to start again, and what was changed; None at the last.

    In time: half the step, then half of that with Euler. Steady: each pressure equation solved once more, which
    non-orthogonal cells may need.
    """
    if case.line is None:
        return _steady(case) if case.numerics.non_orthogonal == 0 else None
    return _in_time(case, case.line) if case.numerics.scheme != "Euler" else None


def _steady(case: Case) -> tuple[Case, str]:
    changed = replace(case, numerics=replace(case.numerics, non_orthogonal=1))
    _clear(changed)
    set_entry(case.folder / "system" / "fvSolution", "nNonOrthogonalCorrectors", "1")
    write_document(changed)
    return changed, "diverged; run with one further solution of each pressure equation"


def _in_time(case: Case, line: Timeline) -> tuple[Case, str]:
    numerics = case.numerics
    half = replace(
        line,
        step=line.step / 2,
        lead=2 * line.lead,
        recorded=2 * line.recorded,
        every=2 * line.every,
        per_period=2 * line.per_period,
    )
    first = line.per_period < 2 * max(numerics.steps, case.test.samples)
    scheme = numerics.scheme if first else "Euler"
    words = f"diverged with {line.per_period} steps a period; run with {half.per_period}"
    changed = replace(case, line=half, numerics=replace(numerics, scheme=scheme))
    _clear(changed)
    set_entry(case.folder / "system" / "controlDict", "deltaT", f"{half.step:.15g}")
    if not first:
        set_entry(case.folder / "system" / "fvSchemes", "timeScheme", "Euler")
        words += " and Euler, which is of first order in time"
    write_motion(changed)
    write_document(changed)
    return changed, words


def _clear(case: Case) -> None:
    """Remove what the solver wrote, so that the case starts from its first field."""
    for path in (*times(case.folder), *case.folder.glob("processor*"), case.folder / "postProcessing"):
        shutil.rmtree(path, ignore_errors=True)
