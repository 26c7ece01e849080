"""Correct coefficients by records of the sea."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from towtank.errors import InputError
from towtank.field.calibrate.chi import tables
from towtank.field.calibrate.corrected import corrected, log_hash
from towtank.field.calibrate.fit import Fit, case_of, fit
from towtank.field.calibrate.result import (
    Calibration,
    Direction,
    HoldOut,
    Move,
    RecordTable,
    document,
    warnings,
)
from towtank.field.calibrate.score import HORIZON, score
from towtank.field.calibrate.settings import Settings
from towtank.field.calibrate.unknowns import Unknowns, unknowns
from towtank.field.calibrate.windows import windows_of
from towtank.field.log import SeaLog
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.progress import Progress, Silent
from towtank.symbols import TERMS

PARTS = 4
"""Terms named for a combination, at most, and the least weight of one that is."""
LEAST = 0.2


def calibrate(
    model: Model, logs: Sequence[SeaLog], *, terms: Sequence[str] | None = None, hold_out: Sequence[SeaLog] = (),
    settings: Settings | None = None, horizon: float = HORIZON, progress: Progress | None = None,
    threads: int | None = None,
) -> Calibration:  # fmt: skip
    """Correct the coefficients of ``model`` by ``logs``: the most likely set, given its covariance and the records.

    Parameters
    ----------
    model : its derivatives, with their covariance, are the prior.
    logs : records of the craft. They are weighed together.
    terms : coefficients that may move, their twins by symmetry with them; all with an uncertainty when left out. The
        others count as known.
    hold_out : records that take no part and are foretold before and after, over ``horizon`` [s].
    settings : what is assumed of sensors, water and thrust.   threads : all cores when left out.

    Unknown beside the coefficients are, for each record, the current, the factor of the thrust and the biases of its
    sensors, and for each window the motion at its start. Thrust and resistance are told apart only by changes of speed.

    Returns
    -------
    Calibration, with a set of level "<prior's> + sea record" (or "+ synthetic").

    Raises
    ------
    InputError
        No record, one twice, one of another craft or already in the prior; a term the set has not; a record that says
        nothing of fins or motion.
    TowtankError
        No compiled engine, or a motion that does not stay finite.

    Source     bock1983 (multiple shooting); tremolet2006 (weak constraint); mackay1992 (variances of largest evidence);
               brysonho1975, ch. 12 (the linear case).
    Valid      Errors of measurement white, but for a constant offset; the forms of the terms are the craft's.
    """
    settings, progress = settings or Settings(), progress or Silent()
    _refuse(model, [*logs, *hold_out])
    if not logs:
        raise InputError("calibrate: no record was given. Name one log or more.")
    free = unknowns(model.derivatives, terms)
    if not len(free.chosen):
        raise InputError(
            f"calibrate: none of {', '.join(terms or ())} has an uncertainty in the prior, so no record can move it. "
            "Choose others, or state an error (towtank.field.calibrate.unknowns.with_errors)."
        )
    found = fit([case_of(windows_of(model, log, settings), free.names, settings) for log in logs], free, settings,
                progress, threads)  # fmt: skip
    out = _result(model, found, settings, tables(found, threads))
    if not hold_out:
        return out
    new = model.with_derivatives(out.derivatives)
    held = tuple(_held(model, new, log, horizon, settings, threads) for log in hold_out)
    return _with(out, held, settings)


def _held(old: Model, new: Model, log: SeaLog, horizon: float, settings: Settings, threads: int | None) -> HoldOut:
    """Both models on a record; the thrust that the throttle multiplies is that of the old one for both."""
    from towtank.field.drive import drive_of

    thrust = drive_of(old, log).thrust
    both = [score(m, log, horizon, settings=settings, thrust=thrust, threads=threads) for m in (old, new)]
    return HoldOut(*both)


def _refuse(model: Model, logs: Sequence[SeaLog]) -> None:
    used = set(model.derivatives.provenance.get("inputs", {}).values())
    seen: dict[str, str] = {}
    for log in logs:
        if log.craft and log.craft != model.craft.name:
            raise InputError(
                f"log {log.name} is of {log.craft!r}, the model of {model.craft.name!r}. One craft's record "
                "says nothing of another's derivatives. If it is the same craft, name it so in the mapping."
            )
        known = log_hash(log)
        if known in used:
            raise InputError(f"log {log.name} is in the prior already, and would count twice. Leave it out.")
        if known in seen:
            raise InputError(f"logs {seen[known]} and {log.name} are the same record. Name each once, in one list.")
        seen[known] = log.name


def _result(model: Model, found: Fit, settings: Settings, chi: tuple[dict[str, dict[str, float]], ...]) -> Calibration:
    free = found.unknowns
    moves = _moves(free, found.z, found.covariance, settings.told)
    records = tuple(_record(found, i, table) for i, table in enumerate(chi))
    said = warnings(moves, records, free.fixed, found.settled)
    logs = [case.windows.log for case in found.cases]
    told = [move.name for move in moves if move.told and not move.slope]
    new = corrected(free, found.z, found.covariance, logs, told, {})
    costs = (found.costs[0], *found.costs[1:])
    out = Calibration(
        new, model.derivatives, moves, _directions(free, found.covariance), records, costs, found.settled, tuple(said)
    )
    return _with(out, (), settings)


def _with(it: Calibration, held: tuple[HoldOut, ...], settings: Settings) -> Calibration:
    """``it`` with its hold-outs, and its tables in the quality of its set."""
    out = replace(it, hold_out=held)
    quality: dict[str, Any] = {**it.derivatives.quality, "calibration": {**document(out), "settings": asdict(settings)}}
    return replace(out, derivatives=replace(it.derivatives, quality=quality))


def _moves(free: Unknowns, z: Array, covariance: Array, told: float) -> tuple[Move, ...]:
    c = len(free.chosen)
    before, after = (
        np.sqrt(np.maximum(np.diag(free.root @ m @ free.root.T), 0.0)) for m in (np.eye(free.size), covariance)
    )
    shift = free.root @ z
    place = {int(number): i for i, number in enumerate(free.chosen)}
    out = []
    for tied, slope in ((free.terms, False), (free.slopes, True)):
        for name, index, sign in zip(tied.names, tied.index, tied.sign, strict=True):
            i = c + int(index) if slope else place.get(int(index), -1)
            if i < 0:
                continue
            was = float(sign * tied.values[index])
            std = float(before[i])
            out.append(
                Move(name, TERMS[name].unit, was, std, was + float(sign * shift[i]), float(after[i]),
                     bool(std > 0.0 and after[i] < told * std), slope)
            )  # fmt: skip
    return tuple(out)


def _directions(free: Unknowns, covariance: Array) -> tuple[Direction, ...]:
    """Independent combinations of z and what is left of each, told best first."""
    spectrum, vectors = np.linalg.eigh(covariance)
    std = np.sqrt(np.maximum((free.root**2).sum(axis=1), 0.0))
    names = [free.terms.names[free.terms.first[i]] for i in free.chosen]
    names += [f"{free.slopes.names[i]} at the origin" for i in free.slopes.first] if len(std) > len(names) else []
    out = []
    held = (free.root**2).sum(axis=0) > 0.0
    for value, vector in zip(spectrum, vectors.T, strict=True):
        if not held[np.abs(vector) > 1e-9].any():
            continue
        weights = np.divide(free.root @ vector, std, out=np.zeros_like(std), where=std > 0.0)
        order = np.argsort(-np.abs(weights))[:PARTS]
        parts = {names[i]: float(weights[i]) for i in order if abs(weights[i]) >= LEAST * np.abs(weights).max()}
        out.append(Direction(float(np.sqrt(max(value, 0.0))), parts))
    return tuple(out)


def _record(found: Fit, number: int, table: dict[str, dict[str, float]]) -> RecordTable:
    it, here, C = found.cases[number].windows, found.found[number], found.shared[number]
    std = np.sqrt(np.diag(C)[found.unknowns.size :])
    shared = {name: (float(v), float(s)) for name, v, s in zip(it.shared, here.point.shared, std, strict=True)}
    n = here.noise
    noise = {"turbulence": n.level**0.5, "turbulence_down": n.down**0.5, "push": n.push, "twist": n.twist}
    return RecordTable(
        it.log.name, it.log.level, log_hash(it.log), float(it.ticks.sum() * it.drive.clock.tick), len(it.first),
        it.left_out, it.assumed, shared, noise, table,
    )  # fmt: skip
