"""``towtank tune``: gains of least error and fin effort, with margins kept."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from towtank.cli.chain import Chain, open_chain
from towtank.cli.options import Debug, Json, Out, StudyArgument
from towtank.cli.pilots import Noisy, PilotWord, afloat, in_words, pilot_of, seeing, speeds_of
from towtank.cli.reply import Reply, answering
from towtank.cli.study import file_hash
from towtank.parallel import cores

if TYPE_CHECKING:
    from towtank.tuning.tune import Score, Tuned

Speeds = Annotated[
    str | None,
    typer.Option(
        metavar="LIST", show_default=False,
        help='Speeds of the trials, such as "1 m/s,1.5 m/s". Default: the craft\'s and 1.5 times it.',
    ),
]  # fmt: skip
Steps = Annotated[str, typer.Option(metavar="LIST", help="Trials: heading-step, depth-step, both (at once), hard.")]
Drawn = Annotated[int, typer.Option(metavar="N", min=0, help="Craft drawn from the uncertainty, beside the best one.")]
Seed = Annotated[int, typer.Option(metavar="N", min=0, help="Of the draws.")]
Rounds = Annotated[int, typer.Option(metavar="N", min=0, help="Most steps of the search; 0 only scores the start.")]


def tune(
    craft: StudyArgument = None,
    pilot: PilotWord = None,
    speeds: Speeds = None,
    steps: Steps = "heading-step,depth-step,both",
    drawn: Drawn = 3,
    seed: Seed = 20,
    rounds: Rounds = 30,
    noisy: Noisy = False,
    out: Out = None,
    json: Json = False,
    debug: Debug = False,
) -> None:
    """Tune a pilot: least tracking error and fin effort over trials, speeds and drawn craft.

    The search uses the exact slopes of the flown loop and keeps a factor 2 of gain and 37 deg of phase in each loop. It
    starts from --pilot and is never dearer than it. The craft needs its derivatives first. Needs python-control
    (towtank[control]). Results: pilot.json, for towtank trial --pilot, and tune.json.

    Example: towtank tune hokie --speeds "1 m/s,1.5 m/s" --pilot lqi
    """
    with answering("tune", json, debug) as reply:
        from towtank.tuning.tune import FASTER, tune

        chain = open_chain(reply, craft, out).keep_speed()
        asked = speeds_of(speeds) or (chain.craft.speed, FASTER * chain.craft.speed)
        model = afloat(chain.model(), asked, reply)
        start = seeing(pilot_of(pilot or "cascade", model, asked[0]), noisy)
        reply.resume = " The same command begins the search again."
        words = tuple(word.strip() for word in steps.split(",") if word.strip())
        found = tune(
            model, start, speeds=asked, steps=words, drawn=drawn, seed=seed, rounds=rounds, threads=cores(),
            progress=reply.progress,
        )  # fmt: skip
        _publish(chain, found)
        _tell(reply, found)


def _publish(chain: Chain, found: Tuned) -> None:
    from towtank.pilot.files import write_pilot
    from towtank.tuning.files import write_tuned

    inputs, folder = {"derivatives": file_hash(chain.study.derivatives)}, chain.study.root
    chain.reply.file("pilot", write_pilot(found.pilot, folder / "pilot.json", inputs))
    chain.reply.file("tune", write_tuned(found, folder / "tune.json", inputs))


def _tell(reply: Reply, found: Tuned) -> None:
    from towtank.tuning.files import summary

    reply.summary |= summary(found)
    old, new = found.before, found.after
    spent = f"{found.rounds} steps, {found.flights} flights, {found.seconds:.0f} s"
    reply.say(f"cost {old.cost:.4g} -> {new.cost:.4g} in {spent}")
    parts = {
        "errors": (old.price.tracking, new.price.tracking), "fin angles": (old.price.fins, new.price.fins),
        "fin speeds": (old.price.rates, new.price.rates), "lack of margin": (old.fence, new.fence),
        "sensor noise": (old.noise, new.noise),
    }  # fmt: skip
    for word, (before, after) in parts.items():
        reply.say(f"  {word:<16} {before:10.4g} -> {after:.4g}")
    _tell_flights(reply, old, new)
    reply.say("margins, half a control period of delay counted")
    for speed, one, two in zip(found.speeds, old.margins, new.margins, strict=True):
        reply.say(f"  {speed:.3g} m/s: {in_words(one)} -> {in_words(two)}")
    reply.say("gains")
    for name in (*found.moved, "pitch_order"):
        reply.say(f"  {name:<18} {getattr(found.start, name):12.5g} -> {getattr(found.pilot, name):.5g}")
    if not new.kept:
        reply.say("The margins asked for are not kept: start from another pilot, or at fewer speeds.")


def _tell_flights(reply: Reply, old: Score, new: Score) -> None:
    shown = {
        "heading": "heading deg",
        "depth": "depth m",
        "roll": "roll deg",
        "fins": "fins deg",
        "travel": "travel deg/m",
    }
    reply.say(f"{'rms':<24}" + "".join(f"{words:>20}" for words in shown.values()))
    for one, two in zip(old.flights, new.flights, strict=True):
        pairs = (f"{getattr(one, name):.3g} -> {getattr(two, name):.3g}" for name in shown)
        reply.say(f"  {one.name:<13}{one.speed:5.3g} m/s" + "".join(f"{pair:>20}" for pair in pairs))
