"""How far a solution can be trusted: a verdict on each run, and short remarks where a limit is passed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towtank.frames import Array
from towtank.tank.openfoam.case import Case
from towtank.tank.openfoam.measure import kept
from towtank.tank.openfoam.monitor import load_scale
from towtank.tank.openfoam.runner import Outcome

WALL_FUNCTION = (20.0, 300.0)
"""Mean y+ that wall functions are made for. Judgement on the lower end: the log law holds from about 30, and the mean
over a patch includes its ends."""

RESOLVED = 1.5
"""Largest mean y+ of a resolved wall: the first cell stays well inside the sublayer, which ends near 5."""

COURANT = 30.0
"""Judgement: backward held at 21 and failed at 50 on the meshes tried; above it the time scheme damps what it should
carry."""

PERIODS = 0.02
"""Judgement: difference of the last two periods, as a share of the size of the load, above which the wake has not
settled; it is what the analysis takes for noise."""

RESIDUAL = 0.05
"""Judgement: share of a load outside its mean and first three harmonics. Smooth runs had 0.005, runs with a sawtooth
from the motion 0.045."""

SMALL = 0.05
"""Loads whose variation is below this share of the largest are not judged: they vanish by symmetry."""


NOISE = 1e-3
"""Loads that vary by less than this share of the mean load are not judged either: in roll the drag varied by 0.0006 of
itself, which is what the equations are solved to."""


@dataclass(frozen=True)
class Health:
    """What was found; shares without dimension.

    ended, steps, cpu [s], wall [s], change, courant_max, retries : as in ``Outcome``.
    scatter (6,) : standard deviation of a steady load over its window, as a share of its largest.
    y_plus : patch -> least, largest, mean.   periods : largest difference of the last two periods; 0 when steady.
    residual : largest share outside the first three harmonics; 0 when steady.
    distribution : shares of y+ and Courant number in bins, as in ``Distribution.document``; empty for a case that was
    solved before they were kept. No limit is set on them: see ``docs/openfoam.md``.
    """

    ended: str
    steps: int
    cpu: float
    wall: float
    change: float
    courant_max: float
    retries: tuple[str, ...]
    scatter: tuple[float, ...]
    y_plus: Mapping[str, tuple[float, float, float]]
    periods: float
    residual: float
    start: str
    distribution: Mapping[str, Any] = field(default_factory=dict)

    def document(self) -> dict[str, Any]:
        """For the provenance of the run."""
        return asdict(self)


def health_of(case: Case, outcome: Outcome, loads: Array) -> Health:
    """Verdict on a solution; loads (N, 6) are the last window of a steady case, the samples of a moving one."""
    return Health(
        ended=outcome.ended,
        steps=outcome.steps,
        cpu=outcome.cpu,
        wall=outcome.wall,
        change=outcome.change,
        courant_max=outcome.courant_max,
        retries=outcome.retries,
        scatter=tuple(float(v) for v in loads.std(axis=0) / load_scale(loads.mean(axis=0), case.length))
        if case.held
        else (),
        y_plus=y_plus(case.folder),
        periods=0.0 if case.held else period_difference(loads, case.test.samples, case.length),
        residual=0.0 if case.held else harmonic_residual(loads, case.test.samples, case.length),
        start=case.start,
        distribution=kept(case.folder),
    )


def remarks(case: Case, health: Health) -> tuple[str, ...]:
    """Short sentences, each with the limit that is passed; empty when nothing is."""
    found = list(health.retries)
    share = case.numerics.flat
    if case.steady and health.ended == "last step":
        found.append(
            f"mean load still changes by {100 * health.change:.2g} % over {case.numerics.window} iterations, "
            f"limit {100 * share:.2g} %, after {health.steps} iterations"
        )
    if not case.steady and case.numerics.scheme == "Euler":
        found.append("Euler in time: first order, damping and added mass mix; not for derivatives unless it must be")
    if health.courant_max > COURANT:
        found.append(f"Courant number {health.courant_max:.0f} above {COURANT:.0f}")
    if not case.held and np.isnan(health.periods):
        found.append("fewer than two periods after the first: whether the wake has settled is not known")
    if health.periods > PERIODS:
        found.append(f"last two periods differ by {100 * health.periods:.1f} %, limit {100 * PERIODS:.0f} %")
    if health.residual > RESIDUAL:
        found.append(
            f"{100 * health.residual:.1f} % of a load lies outside its first three harmonics, "
            f"limit {100 * RESIDUAL:.0f} %"
        )
    return tuple([*found, *_wall_remarks(case, health)])


def _wall_remarks(case: Case, health: Health) -> list[str]:
    found = []
    least, most = WALL_FUNCTION
    for patch, (_, _, mean) in health.y_plus.items():
        if case.numerics.wall == "functions" and not least <= mean <= most:
            found.append(
                f"mean y+ {mean:.3g} on {patch} outside {least:.0f} to {most:.0f}, the range of wall functions"
            )
        elif case.numerics.wall == "resolved" and mean > RESOLVED:
            found.append(f"mean y+ {mean:.3g} on {patch} above {RESOLVED:g}: the wall is not resolved")
    return found


def y_plus(folder: Path) -> dict[str, tuple[float, float, float]]:
    """Patch -> least, largest and mean y+ at the last time on file; empty where none was written."""
    out: dict[str, tuple[float, float, float]] = {}
    files = (folder / "postProcessing" / "yPlus").glob("*/yPlus*.dat")
    for path in sorted(files, key=lambda item: float(item.parent.name)):
        for line in path.read_text(encoding="utf-8").splitlines():
            cells = line.split()
            if len(cells) == 5 and not line.startswith("#"):
                out[cells[1]] = (float(cells[2]), float(cells[3]), float(cells[4]))
    return out


def _judged(loads: Array, length: float) -> NDArray[np.intp]:
    """Columns whose variation is a fair share of what forces, or moments, of this size amount to."""
    size = loads.std(axis=0)
    held = NOISE * load_scale(np.abs(loads.mean(axis=0)), length)
    large = size > SMALL * load_scale(size, length)
    return np.flatnonzero(large & ((size > held) | np.isinf(held)))


def period_difference(loads: Array, samples: int, length: float) -> float:
    """Largest root mean square difference of the last two periods, as a share of the load's standard deviation.

    NaN where fewer than two periods follow the first, which carries the start-up of the wake.
    """
    if len(loads) < 3 * samples + 1:
        return float("nan")
    last, before = loads[-samples:], loads[-2 * samples : -samples]
    columns = _judged(last, length)
    difference = np.sqrt(((last - before) ** 2).mean(axis=0))
    return float((difference[columns] / last.std(axis=0)[columns]).max(initial=0.0))


def harmonic_residual(loads: Array, samples: int, length: float) -> float:
    """Largest share of a load's variation in the last period outside its mean and first three harmonics."""
    last = loads[-samples:]
    columns = _judged(last, length)
    orders = np.fft.rfft(last, axis=0)
    orders[:4] = 0.0
    rest = np.fft.irfft(orders, n=len(last), axis=0)
    return float((rest.std(axis=0)[columns] / last.std(axis=0)[columns]).max(initial=0.0))
