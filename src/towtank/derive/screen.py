"""Which runs are fitted: the set must fit together, and each run must lie in the range of the model."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from towtank.errors import DeriveError
from towtank.frames import drift_angle, incidence_angle
from towtank.symbols import LOADS
from towtank.tank.run import Run

DRIFT_LIMIT_DEG = 20.0
"""Largest drift or incidence of a fitted run: the range of the captive tests of perron, section 2.3."""

FIN_LIMIT_DEG = 20.0
"""Largest fin angle of a fitted run: the fin force is linear up to 15 to 20 deg (THEORY section 5)."""

_SLACK_DEG = 0.01


def screen(runs: Sequence[Run], mix_levels: bool = False) -> tuple[tuple[Run, ...], tuple[tuple[str, str], ...]]:
    """Runs to be fitted, and (name, reason) of those that are not.

    Raises
    ------
    DeriveError
        No runs, loads that are not numbers, or runs that do not belong together.
    """
    if not runs:
        raise DeriveError(
            "derive: no runs were given, and derivatives come from captive runs. "
            "Tow a plan first: tow(standard_plan(craft))."
        )
    _same_craft(runs)
    _same_level(runs, mix_levels)
    for run in runs:
        _whole(run)
    reasons = {name_of(run, runs): _outside(run) for run in runs}
    kept = tuple(run for run in runs if not reasons[name_of(run, runs)])
    rejected = tuple((name, reason) for name, reason in reasons.items() if reason)
    if not kept:
        name, reason = rejected[0]
        raise DeriveError(
            f"derive: none of the {len(runs)} runs can be fitted; {name}: {reason}. "
            f"Give runs with drift up to {DRIFT_LIMIT_DEG:g} deg that are not exploratory."
        )
    return kept, rejected


def name_of(run: Run, runs: Sequence[Run]) -> str:
    """Name of the run; its id where another run of the set has the same name."""
    return run.name if sum(other.name == run.name for other in runs) == 1 else run.id


def _outside(run: Run) -> str:
    if run.exploratory:
        return "exploratory: recorded, never fitted"
    nu = run.history.nu[run.settled]
    if not np.any(nu[:, :3]):
        return "at rest: the model has no term for it"
    for word, angle in (("drift", drift_angle(nu)), ("incidence", incidence_angle(nu))):
        peak = float(np.degrees(np.abs(angle)).max())
        if peak > DRIFT_LIMIT_DEG + _SLACK_DEG:
            return f"{word} reaches {peak:.1f} deg, beyond {DRIFT_LIMIT_DEG:g} deg, the range of the wide fit"
    fins = float(np.degrees(np.abs(run.delta)).max(initial=0.0))
    if fins > FIN_LIMIT_DEG + _SLACK_DEG:
        return f"a fin is at {fins:.1f} deg, beyond {FIN_LIMIT_DEG:g} deg, the linear range of the fin terms"
    return ""


def _same_craft(runs: Sequence[Run]) -> None:
    ids = [run.id for run in runs if name_of(run, runs) == run.id]
    if len(set(ids)) < len(ids):
        twice = Counter(ids).most_common(1)[0][0]
        raise DeriveError(f"derive: run {twice} was given twice, and would count double. Give each run once.")
    first = runs[0]
    for run in runs:
        for word, ours, theirs in (("craft", first.craft, run.craft), ("symmetry", first.symmetry, run.symmetry)):
            if ours != theirs:
                raise DeriveError(
                    f"derive: run {run.name} has {word} {theirs!r} and run {first.name} has {ours!r}. "
                    "One set of derivatives belongs to one craft; derive each craft by itself."
                )
        for word in ("length", "density", "origin_from_nose"):
            a, b = getattr(first, word), getattr(run, word)
            if not np.isclose(a, b, rtol=1e-6, atol=1e-9):
                raise DeriveError(
                    f"derive: run {run.name} has {word} {b:g} and run {first.name} has {a:g}. "
                    "Loads of one fit share water, length and origin; convert the runs first."
                )


def _same_level(runs: Sequence[Run], mix_levels: bool) -> None:
    levels = sorted({run.level for run in runs})
    if len(levels) > 1 and not mix_levels:
        raise DeriveError(
            f"derive: the runs are of {len(levels)} levels of evidence ({', '.join(levels)}). Levels are not mixed "
            "silently, because their errors differ in kind. Derive each level by itself, or ask for mix_levels=True."
        )


def _whole(run: Run) -> None:
    arrays = {"loads": run.loads, "velocities": run.history.nu, "accelerations": run.history.nudot}
    if run.ensemble is not None:
        arrays["ensemble loads"] = run.ensemble
    for word, array in arrays.items():
        if array.shape[-2:] != (len(run.history.time), 6):
            raise DeriveError(
                f"derive: run {run.name} has {word} of shape {array.shape} for {len(run.history.time)} samples. "
                "Each sample needs 6 values."
            )
        if not np.isfinite(array).all():
            sample, column = np.argwhere(~np.isfinite(array))[0][-2:]
            what = LOADS[column] if "loads" in word else f"component {column + 1}"
            raise DeriveError(
                f"derive: run {run.name} has {word} that are not finite ({what}, sample {sample}). "
                "A fit over them would be meaningless; tow the run again or leave it out."
            )
