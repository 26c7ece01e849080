"""Carry out a Monte Carlo study: here piece by piece, or each piece once with its result on file."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from towtank.derive.covariance import root_of
from towtank.errors import InputError, TrialError
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.montecarlo.draw import NONE, Tolerances, draw
from towtank.montecarlo.fly import (
    Piece,
    Recipe,
    Study,
    Trials,
    fly_piece,
    gathered,
    hold,
    pieces,
)
from towtank.montecarlo.packed import unpacked
from towtank.montecarlo.ranks import RANKED, Ranks
from towtank.montecarlo.result import Bands, MonteCarlo, PlaneSpread, TrialSpread
from towtank.montecarlo.stable import PLANES
from towtank.progress import Progress, Silent
from towtank.provenance import VERSION, digest, provenance
from towtank.trials.ready import Ready
from towtank.verdict.many import Many, Population, TrialValues
from towtank.verdict.spread import Spread, spread_of, wilson

SAMPLES, SIZE, SEED = 1000, 500, 20
MOST = 10_000_000
"""Samples of one study: about two days of one core."""
TASK = "monte carlo"


def monte_carlo(
    model: Model,
    samples: int = SAMPLES,
    *,
    given: Tolerances = NONE,
    seed: int = SEED,
    trials: Recipe | None = None,
    progress: Progress | None = None,
    ledger: Path | str | None = None,
    where: str | None = None,
    size: int = SIZE,
    workers: int = 1,
    settings: Mapping[str, Any] | None = None,
    program: str = VERSION,
) -> MonteCarlo:
    """Trials of ``samples`` craft drawn from the uncertainty of ``model``, beside its best estimate.

    Parameters
    ----------
    given : standard uncertainties beside those of the derivatives.   seed : of the draws.
    trials : function of the model that returns (model, ready trial) pairs; the standard set when left out. A function
        of a module where a cluster is to work.
    size : craft of one piece; the draws depend on it, not on who flies them.
    ledger : folder with the result of every finished piece; asking again flies none of them. Without it the study
        stays in this process, on all cores, and an interruption returns what is finished, marked as not complete.
    where, workers, settings : see ``towtank.cluster.work.each_once``; they need a ledger.
    program : identity of the program; pieces on file of another one are not taken.

    Raises
    ------
    InputError
        No samples, no whole number of them, a size below 1, a cluster without a ledger; an uncertainty so wide that
        craft without a positive mass are drawn.
    TowtankError
        Interrupted before the first piece was finished, or with a ledger; finished pieces stay on file.
    """
    _checked(samples, size, seed, ledger, where)
    told = progress or Silent()
    study = study_of(model, given, seed, trials, told, program)
    parts = pieces(samples, size)
    if ledger is None:
        answers = _here(study, parts, told)
    else:
        answers = _on_file(study, parts, Path(ledger), where, workers, told, settings or {})
    return summed_up(study, samples, [parts[i] for i in sorted(answers)], answers, size, program)


def study_of(
    model: Model, given: Tolerances, seed: int, recipe: Recipe | None, told: Progress, program: str = VERSION
) -> Study:
    """What the pieces of a study share."""
    if recipe is None:
        from towtank.trials.standard import standard_ready

        recipe = standard_ready
    made = recipe(model)
    key = digest([_identity(model), given, seed, _trials_identity(made), program], 16)
    hold(key, made)
    return Study(model, recipe, given, seed, root_of(model.derivatives.covariance, model.derivatives.values), key, told)


def _checked(samples: int, size: int, seed: int, ledger: Path | str | None, where: str | None) -> None:
    for name, value, least, most in (("samples", samples, 1, MOST), ("size", size, 1, MOST), ("seed", seed, 0, 2**63)):
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            raise InputError(f"Monte Carlo: {name} {value!r}. Give a whole number from {least} to {most}.")
    if where is not None and ledger is None:
        raise InputError(f"Monte Carlo on {where}: the pieces need a folder. Give ledger, a folder of this machine.")


def _identity(model: Model) -> list[Any]:
    d, extra = model.derivatives, model.extra
    about = [extra.name, dict(extra.values)] if extra else []
    return [model.craft, d.variant, d.as_dict(), d.covariance, d.origin, d.origin_std, model.options, *about]


def _trials_identity(trials: Trials) -> list[Any]:
    def one(model: Model, t: Ready) -> list[Any]:
        s = t.setting
        return [t.name, _identity(model), t.legs, s.state, s.memory, s.thrust, s.pilot and _gains(s.pilot), t.interval,
                t.gauges, t.current, t.start, t.needs]  # fmt: skip

    return [one(model, trial) for model, trial in trials]


def _gains(pilot: Any) -> list[float]:
    from towtank.pilot.law import GAINS

    return [float(getattr(pilot, name)) for name in GAINS]


def _here(study: Study, parts: Sequence[Piece], told: Progress) -> dict[int, Mapping[str, Any]]:
    """Pieces flown in this process, until all are done or it is interrupted."""
    answers: dict[int, Mapping[str, Any]] = {}
    told.start(TASK, len(parts))
    try:
        for i, part in enumerate(parts):
            answers[i] = fly_piece(study, part)
            told.step(TASK, f"{part.count} craft")
    except KeyboardInterrupt:
        if not answers:
            from towtank.cluster.work import Stopped

            raise Stopped(f"stopped before the first of {len(parts)} pieces was finished. Nothing is kept.") from None
    finally:
        told.done(TASK)
    return answers


def _on_file(
    study: Study, parts: Sequence[Piece], ledger: Path, where: str | None, workers: int, told: Progress,
    settings: Mapping[str, Any],
) -> dict[int, Mapping[str, Any]]:  # fmt: skip
    from towtank.cluster.ledger import Failed
    from towtank.cluster.work import each_once

    if study.model.extra is not None:
        raise InputError(
            f"Monte Carlo with the extra load {study.model.extra.name!r}: the text of a function is no part of a "
            "piece's name, so results on file could be those of another one. Leave out the ledger."
        )
    keys = [f"{study.model.craft.name[:60]}-{digest([study.key, part], 16)}" for part in parts]
    answers: dict[int, Mapping[str, Any]] = {}
    for i, result in each_once(
        fly_piece, study, parts, keys=keys, ledger=ledger, where=where, workers=workers, progress=told,
        settings=settings, task=TASK,
    ):  # fmt: skip
        if isinstance(result, Failed):
            kind = InputError if result.kind == "InputError" else TrialError
            raise kind(f"piece {i + 1} of {len(parts)}: {result.message}")
        answers[i] = result
    return answers


def summed_up(
    study: Study,
    samples: int,
    parts: Sequence[Piece],
    answers: Mapping[int, Mapping[str, Any]],
    size: int,
    program: str = VERSION,
) -> MonteCarlo:
    """The pieces as one result. The bands are those of the first piece, the drivers those of the first 5000 craft."""
    whole, d = gathered(answers), study.model.derivatives
    columns = _drawn(study, parts)
    ranks = Ranks({name: values[1:] for name, values in columns.items()})
    return MonteCarlo(
        craft=study.model.craft.name,
        level=d.level,
        samples=samples,
        done=sum(part.count for part in parts),
        seed=study.seed,
        given=study.given,
        trials={name: _trial(name, trial, ranks) for name, trial in whole["trials"].items()},
        planes={plane: _plane(plane, whole["stability"], ranks) for plane in PLANES},
        bands={name: _bands(entry) for name, entry in whole["bands"].items()},
        population=_population(study, columns, whole["trials"]),
        provenance=provenance({"model": digest(_identity(study.model), 16)}, key=study.key, size=size, source=program),
    )


def _drawn(study: Study, parts: Sequence[Piece]) -> dict[str, Array]:
    """The parameters again, name -> (1 + N,), best estimate first, as far as they are ranked."""
    found: dict[str, list[Array]] = {}
    count = 0
    for part in parts:
        if count >= RANKED:
            break
        drawn = draw(study.model, part.count, study.given, study.seed, part.number, study.root)
        for name, values in drawn.columns.items():
            found.setdefault(name, []).append(values)
        count += part.count
    return {name: np.concatenate(values)[: RANKED + 1] for name, values in found.items()}


def _population(study: Study, columns: Mapping[str, Array], trials: Mapping[str, Any]) -> Population:
    """The craft whose parameters are at hand, with the numbers of their trials."""
    craft = Many(study.model, columns)
    values = {
        name: TrialValues(
            trial["kind"], trial["loop"], {key: (x[: len(craft)], unit) for key, (x, unit) in trial["indices"].items()}
        )
        for name, trial in trials.items()
    }
    return Population(craft, values, str(study.given))


def _trial(name: str, trial: Mapping[str, Any], ranks: Ranks) -> TrialSpread:
    ended = Counter(trial["ended"][1:])
    return TrialSpread(
        name=name,
        kind=trial["kind"],
        loop=trial["loop"],
        ended=dict(ended.most_common()),
        indices={key: _spread(values, unit, ranks) for key, (values, unit) in trial["indices"].items()},
    )


def _spread(values: Array, unit: str, ranks: Ranks) -> Spread:
    return spread_of(values, unit, ranks.drivers(values[1:]))


def _plane(plane: str, stable: Mapping[str, Array], ranks: Ranks) -> PlaneSpread:
    growth, index = stable[f"{plane}_growth"], stable[f"{plane}_index"]
    count, of = int(np.count_nonzero(growth[1:] < 0.0)), len(growth) - 1
    return PlaneSpread(
        plane, count / of, wilson(count, of), _spread(index, "", ranks), _spread(growth, "1/s", ranks)
    )  # fmt: skip


def _bands(entry: Mapping[str, Any]) -> Bands:
    many = {
        part: {name: unpacked(rows) for name, rows in entry[part].items()} for part in ("quantiles", "best", "tracks")
    }
    return Bands(time=unpacked(entry["time"]), under_way=unpacked(entry["under_way"]), **many)
