"""``towtank plan``: which captive tests."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from towtank.cli.chain import Chain, open_chain
from towtank.cli.options import Debug, Json, Out, Speed, StudyArgument
from towtank.cli.reply import Reply, answering
from towtank.errors import InputError

if TYPE_CHECKING:
    from towtank.experiments.optimal import Optimal

LISTED = 12
"""Wanted values printed; optimal.json has all."""

Best = Annotated[bool, typer.Option("--optimal", help="Choose the runs that leave the least uncertainty.")]
Budget = Annotated[
    int | None,
    typer.Option(
        metavar="N", help="With --optimal: N runs, no dearer than N mean runs of the standard plan.", show_default=False
    ),
]
Aim = Annotated[
    str | None,
    typer.Option(
        "--for", metavar="LIST", help='With --optimal: "Yuv,Nuv", "index" or "all". Default: all.', show_default=False
    ),
]
Cost = Annotated[
    str | None,
    typer.Option(
        metavar="MODEL", help="With --optimal: cfd, fast, runs, or a TOML file. Default: cfd.", show_default=False
    ),
]
Criterion = Annotated[
    str | None, typer.Option(metavar="D|A", help="With --optimal: D (volume) or A (mean variance).", show_default=False)
]
Rehearse = Annotated[
    int | None,
    typer.Option(
        metavar="N", help="With --optimal: carry both plans out N times on known coefficients.", show_default=False
    ),
]

Export = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR",
        help="Write motion tables, a STAR-CCM+ macro and the mapping to import its runs.",
        show_default=False,
    ),
]


def plan(
    craft: StudyArgument = None,
    speed: Speed = None,
    optimal: Best = False,
    budget: Budget = None,
    aim: Aim = None,
    cost: Cost = None,
    criterion: Criterion = None,
    rehearse: Rehearse = None,
    export: Export = None,
    out: Out = None,
    json: Json = False,
    debug: Debug = False,
) -> None:
    """Lay out the captive tests.

    Writes plan.toml to edit and plan.csv to read. An edited plan.toml is used as it is. With --optimal the runs are
    chosen for what they tell of the derivatives named by --for, and optimal.json says what that saves.

    Example: towtank plan hokie --speed "1 m/s"

    Example: towtank plan hokie --optimal --budget 30 --for "Yuv,Nuv,Yur,Nur"
    """
    with answering("plan", json, debug) as reply:
        given = {"--budget": budget, "--for": aim, "--cost": cost, "--criterion": criterion, "--rehearse": rehearse}
        if not optimal and (stray := [name for name, value in given.items() if value is not None]):
            raise InputError(f"{', '.join(stray)} belong to --optimal. Add --optimal, or leave them out.")
        if optimal and budget is None:
            raise InputError("--optimal needs the number of runs that may be spent. Add --budget 30.")
        chain = open_chain(reply, craft, out, speed)
        chain.prepare()
        if optimal and budget is not None:
            words = {
                "budget": budget,
                "aim": "all" if aim is None else aim,
                "cost": cost or "cfd",
                "criterion": criterion or "D",
            }
            _tell_optimal(reply, _optimal(chain, words | {"rehearse": rehearse}))
        else:
            chain.make_plan()
        _tell(reply, chain)
        if export is not None:
            _export(reply, chain, export)


def _export(reply: Reply, chain: Chain, folder: Path) -> None:
    import os

    from towtank.tank.imported.export import write_export

    craft = Path(os.path.relpath(chain.study.craft, folder)).as_posix()
    for noun, path in write_export(chain.plan(), folder, craft).items():
        reply.file(noun, path)
        reply.say(f"{path}")


def _tell(reply: Reply, chain: Chain) -> None:
    made = chain.plan()
    kinds = Counter(test.kind for test in made.tests)
    reply.summary |= {
        "tests": len(made.tests),
        "kinds": dict(kinds),
        "speed": made.speed,
        "notes": list(made.notes),
    }
    reply.say(f"{len(made.tests)} captive tests at {made.speed:g} m/s")
    for kind, number in kinds.items():
        reply.say(f"  {kind:<10} {number:4d}")
    reply.say(f"{chain.study.plan}")


def _optimal(chain: Chain, words: dict[str, Any]) -> dict[str, Any]:
    """The content of optimal.json, from file when the same was asked before."""
    from dataclasses import asdict

    from towtank.cli.study import file_hash, program_hash
    from towtank.errors import ArtefactError
    from towtank.experiments.cost import cost_model
    from towtank.experiments.files import own_plan, read_optimal, write_optimal
    from towtank.experiments.rehearsal import check_campaigns
    from towtank.provenance import digest

    if words["rehearse"] is not None:
        check_campaigns(words["rehearse"])
    study, path = chain.study, chain.study.root / "optimal.json"
    model = cost_model(words["cost"])
    asked = words | {"cost": asdict(model), "derivatives": file_hash(study.derivatives), "program": program_hash()}
    asked |= {"craft": digest(chain.craft, 16)}
    ours = own_plan(study.root)
    chain.reply.file("plan", study.plan)
    chain.reply.file("optimal", path)
    try:
        if ours and (found := read_optimal(path))["asked"] == asked:
            chain.reply.log("plan     already done")
            return found
    except ArtefactError:
        chain.reply.log(f"{path} cannot be read and is made again")
    best = _choose(chain, words)
    rehearsals = _rehearsals(best, words["rehearse"])
    if not ours and (aside := study.put_aside(study.plan)) is not None:
        chain.reply.log(f"{study.plan} was edited since it was written; the edited file is kept as {aside.name}")
    write_optimal(best, study.root, asked, rehearsals)
    return read_optimal(path)


def _choose(chain: Chain, words: dict[str, Any]) -> Optimal:
    from towtank.experiments.cost import cost_model
    from towtank.experiments.optimal import optimal_plan

    known = chain.derivatives() if chain.study.derivatives.exists() else None
    return optimal_plan(
        chain.craft,
        words["budget"],
        aim=tuple(word.strip() for word in words["aim"].split(",") if word.strip()),
        criterion=words["criterion"],
        cost=cost_model(words["cost"]),
        known=known,
    )


def _rehearsals(best: Optimal, campaigns: int | None) -> dict[str, Any]:
    from towtank.experiments.rehearsal import rehearse

    if campaigns is None or best.problem is None:
        return {}
    sets = {"chosen": best.chosen, "equal_cost": best.equal, "standard_bearing": best.bearing}
    return {name: rehearse(best.problem, best.problem.numbers(runs.runs), campaigns) for name, runs in sets.items()}


def _tell_optimal(reply: Reply, found: dict[str, Any]) -> None:
    from towtank.experiments.files import saving

    keys = ("aim", "criterion", "budget", "loads", "saves", "equal_cost", "least", "least_size", "rehearsal")
    reply.summary["optimal"] = {
        key: found[key] for key in (*keys, "chosen", "standard", "standard_bearing", "not_determined")
    }
    chosen, bearing, equal, least = (found[key] for key in ("chosen", "standard_bearing", "equal_cost", "least"))
    reply.say(f"{found['criterion']}-optimal among {found['candidates']} runs; loads from {found['loads']}.")
    reply.say("Cost in mean runs of the standard plan. Standard deviation as a share of that by the standard plan:")
    sets = {"this plan": chosen, "standard": bearing, "equal cost": equal} | ({"least": least} if least else {})
    reply.say(f"  {'':<12}" + "".join(f"{name:>12}" for name in sets))
    reply.say(f"  {'runs':<12}" + "".join(f"{item['number']:12d}" for item in sets.values()))
    reply.say(f"  {'cost':<12}" + "".join(f"{item['cost']:12.1f}" for item in sets.values()))
    base = found["standard"]["std"]
    for name in found["aim"][:LISTED]:
        reply.say(f"  {name:<12}" + "".join(f"{_share(item['std'][name], base[name]):>12}" for item in sets.values()))
    if len(found["aim"]) > LISTED:
        reply.say(f"  and {len(found['aim']) - LISTED} more in {reply.files['optimal']}")
    reply.say(saving(found))
    if found["not_determined"]:
        reply.say(f"Not determined by this plan: {', '.join(found['not_determined'])}.")
    for name, done in found["rehearsal"].items():
        shares = [done["std"][n] / done["predicted"][n] for n in found["aim"] if done["predicted"][n]]
        reply.say(
            f"Rehearsed {done['campaigns']} times, {name.replace('_', ' ')}: scatter found over predicted "
            f"{min(shares):.2f} to {max(shares):.2f}."
        )


def _share(value: float | None, base: float | None) -> str:
    return "-" if value is None or not base else f"{value / base:.2f}"
