"""``towtank design``: which change makes a craft stable, what it costs, and the speed of least energy per metre."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from towtank.cli.chain import Chain, open_chain
from towtank.cli.options import Debug, Json, Out, Speed, StudyArgument
from towtank.cli.reply import Reply, answering
from towtank.cli.study import program_hash
from towtank.errors import InputError
from towtank.parallel import cores, prepare

if TYPE_CHECKING:
    from towtank.design.cruise import Cruise
    from towtank.design.goal import Goal
    from towtank.design.study import DesignStudy
    from towtank.model.equations import Model

Vary = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAME=LOW:HIGH[:N]",
        help='A range to search, such as "fin_span=1:2.5", and N values of it to draw. Give it once per axis; the '
        "first two are drawn as contours. Names are those of towtank sweep. Default: fin_span, strake_height, "
        "fin_chord, strake_taper, strake_length.",
        show_default=False,
    ),
]
Target = Annotated[str, typer.Option(metavar="P", help='Probability of course stability asked for, such as "95 %".')]
Reach = Annotated[
    str | None,
    typer.Option(metavar="LENGTH", help="Nothing further from the axis than this.", show_default=False),
]
Requirements = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Requirements (TOML) to meet, as of towtank assess.", show_default=False),
]
Range = Annotated[bool, typer.Option("--range", help="Only the speed and trim of least energy per metre.")]
Hotel = Annotated[
    str | None,
    typer.Option(metavar="POWER", help='Power of everything but propulsion, such as "40 W".', show_default=False),
]
Current = Annotated[
    str, typer.Option(metavar="SPEED", help="With --range: current along the course; against the craft is negative.")
]
Efficiency = Annotated[
    str | None,
    typer.Option(
        metavar="ETA",
        help="Thrust power over electrical power. Default: from the propeller table, or 0.5, assumed.",
        show_default=False,
    ),
]
Members = Annotated[int, typer.Option(metavar="N", help="Size of the tank's model-form ensemble; it makes P(stable).")]
Evaluations = Annotated[int, typer.Option(metavar="N", help="Variants that the search may ask for.", min=1)]
Workers = Annotated[int | None, typer.Option(metavar="N", help="Processes. Default: all cores.", min=1)]


def design(
    craft: StudyArgument = None,
    vary: Vary = None,
    target: Target = "95 %",
    reach: Reach = None,
    requirements: Requirements = None,
    range_: Range = False,
    hotel: Hotel = None,
    current: Current = "0 m/s",
    efficiency: Efficiency = None,
    speed: Speed = None,
    members: Members = 48,
    evaluations: Evaluations = 50,
    workers: Workers = None,
    out: Out = None,
    json: Json = False,
    debug: Debug = False,
) -> None:
    """Find the change of a craft that makes it stable for the least drag, or its speed of least energy per metre.

    Every axis is drawn alone, the first two together; then the least drag that meets the goals is searched within the
    ranges. Finished variants are kept: after Ctrl-C the same command goes on. Results: design.json, design.png. With
    --range: cruise.json, cruise.png. The report shows both.

    Example: towtank design hokie

    Example: towtank design hokie --vary fin_span=1:2 --vary "strake_height=0:25 cm" --reach "60 cm"

    Example: towtank design hokie --requirements mine.toml

    Example: towtank design hokie --range --hotel "40 W" --current "0.2 m/s"
    """
    with answering("design", json, debug) as reply:
        from towtank.quantity import si

        power = si(hotel, "W", "--hotel") if hotel else 0.0
        if power < 0.0:
            raise InputError(f"--hotel {hotel}: a power that is used is positive. Give 0 or more.")
        share = si(efficiency, "", "--efficiency") if efficiency else None
        along = si(current, "m/s", "--current")
        if along and not range_:
            raise InputError("--current belongs to --range: stability does not depend on a uniform current.")
        chain = open_chain(reply, craft, out, speed).keep_speed()
        if range_:
            if not hotel:
                raise InputError('--range needs the hotel power, such as --hotel "40 W": without it slower is cheaper.')
            _range(chain, power, along, share)
            return
        if cores() > 1 and (workers or 2) > 1:
            prepare("towtank.design.point")
        _publish(
            chain,
            _study(
                chain, vary or [], target, reach, requirements, power, share, members, evaluations, workers or cores()
            ),
        )


def _study(
    chain: Chain, vary: list[str], target: str, reach: str | None, requirements: Path | None, hotel: float,
    efficiency: float | None, members: int, evaluations: int, workers: int,
) -> DesignStudy:  # fmt: skip
    from towtank.design.goal import reach_goal, stability_goals
    from towtank.design.needs import goals_of, needed
    from towtank.design.point import Question
    from towtank.design.run import LEDGER, axes_of, run_design
    from towtank.quantity import si
    from towtank.sweep.point import model_of
    from towtank.tank.fast.tank import FastTank
    from towtank.verdict.needs import read_requirements

    wanted = si(target, "", "--target")
    goals: tuple[Goal, ...] = stability_goals(chain.craft, wanted)
    if reach is not None:
        goals = (*goals, reach_goal(si(reach, "m", "--reach")))
    needs = read_requirements(requirements) if requirements is not None else ()
    if needs:
        model = model_of(chain.craft, FastTank(members=members))
        asked = goals_of(needs, needed(model, needs), chain.craft, wanted)
        told = {goal.column for goal in asked}
        goals = (*asked, *(goal for goal in goals if goal.column not in told))
        if shares := [need.name for need in needs if need.share is not None]:
            chain.reply.log(f"for the best estimate only, not for a share of drawn craft: {', '.join(shares)}")
    question = Question(chain.craft, wanted, members, efficiency, hotel, needs)
    axes = axes_of(chain.craft, vary)
    chain.prepare()
    chain.reply.kept = f"Finished variants are kept in {chain.study.root / LEDGER}."
    return run_design(
        question, axes, goals, chain.study.root, workers=workers, evaluations=evaluations,
        progress=chain.reply.progress, program=program_hash(),
    )  # fmt: skip


def _publish(chain: Chain, study: DesignStudy) -> None:
    from towtank.artefact import replace_file
    from towtank.design.files import write_design
    from towtank.figures.design import design_sheet

    root, reply = chain.study.root, chain.reply
    reply.file("design", write_design(study, root))
    figure = design_sheet(study)
    picture = replace_file(root / "design.png", lambda part: figure.savefig(part, format="png", dpi=150))
    reply.file("figure", picture)
    _tell(reply, study)


def _tell(reply: Reply, study: DesignStudy) -> None:
    from towtank.design.words import candidates, percent, verdict

    words = verdict(study)
    reply.summary |= {
        "craft": study.craft,
        "level": study.level,
        "target": study.target,
        "best": None if study.best is None else _numbers(study, study.best),
        "as_given": _numbers(study, study.base),
        "alone": {name: None if p is None else _numbers(study, p) for name, p in study.alone.items()},
        "variants": len(study.points),
        "failed": len(study.points) - len(study.done),
        "words": words,
    }
    reply.tell("\n\n".join(part for part in words if part))
    reply.say("")
    heads = ("", "P(stable) h", "P(stable) v", "G_h", "drag [N]", "drag", "range")
    reply.say(f"  {heads[0]:<22}" + "".join(f"{head:>13}" for head in heads[1:]))
    for name, point in candidates(study):
        v = point.values
        cells = (f"{v['P_stable_h']:.3f}", f"{v['P_stable_v']:.3f}", f"{v['G_h']:.3g}", f"{v['drag']:.4g}",
                 percent(study.drag_rise(point)), percent(study.range_change(point)))  # fmt: skip
        reply.say(f"  {name:<22}" + "".join(f"{cell:>13}" for cell in cells))
    for reason in dict.fromkeys(point.failed for point in study.points if point.failed):
        reply.log(f"  not built: {reason}")


def _numbers(study: DesignStudy, point: Any) -> dict[str, Any]:
    return {
        "changes": dict(point.changes),
        "words": point.words(study.axes),
        "values": dict(point.values),
        "drag_rise": study.drag_rise(point),
        "range_change": study.range_change(point),
    }


def _range(chain: Chain, hotel: float, current: float, efficiency: float | None) -> None:
    from towtank.artefact import replace_file
    from towtank.design.cruise import cruise, write_cruise
    from towtank.figures.design import cruise_energy

    found = cruise(_model(chain), hotel, current, efficiency)
    chain.prepare()
    root, reply = chain.study.root, chain.reply
    reply.file("cruise", write_cruise(found, root))
    figure = cruise_energy(found).get_figure(root=True)
    assert figure is not None
    reply.file("figure", replace_file(root / "cruise.png", lambda part: figure.savefig(part, format="png", dpi=160)))
    _tell_range(reply, found)


def _model(chain: Chain) -> Model:
    """The model of the study, or of the craft in the fast tank where the study has no derivatives."""
    if chain.study.derivatives.exists():
        return chain.model()
    from towtank.sweep.point import model_of

    chain.reply.log("derivatives from the standard plan in the fast tank, since the study has none")
    return model_of(chain.craft)


def _tell_range(reply: Reply, found: Cruise) -> None:
    from towtank.design.words import cruise_words

    reply.summary |= {
        "craft": found.craft,
        "level": found.level,
        "hotel": found.hotel,
        "current": found.current,
        "drive": vars(found.drive),
        "closed_form_speed": found.closed,
        "as_loaded": None if found.best is None else vars(found.best),
        "neutral": vars(found.best_neutral),
        "words": cruise_words(found),
    }
    reply.tell("\n\n".join(cruise_words(found)))
    reply.say(f"\n  efficiency {found.drive.overall:.2f}: {found.drive.origin}")
