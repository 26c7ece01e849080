"""``towtank calibrate``: coefficients corrected by records of the sea."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from towtank.cli.chain import Chain, open_chain
from towtank.cli.options import Debug, Json, Out
from towtank.cli.reply import Reply, answering
from towtank.cli.study import file_hash
from towtank.errors import InputError
from towtank.parallel import cores

if TYPE_CHECKING:
    from towtank.field.calibrate.result import Calibration, HoldOut
    from towtank.field.calibrate.settings import Settings
    from towtank.field.log import SeaLog
    from towtank.model.equations import Model

StudyWord = Annotated[
    str, typer.Argument(metavar="STUDY", help="A study folder with derivatives, or a craft.", show_default=False)
]
Logs = Annotated[
    list[str],
    typer.Argument(metavar="LOG...", help="Records of the craft (towtank log, towtank sea).", show_default=False),
]
Terms = Annotated[
    str | None,
    typer.Option(
        metavar="LIST", show_default=False,
        help='Coefficients that may move, such as "Yuv,Nuv,Yur,Nur". Default: all that have an uncertainty.',
    ),
]  # fmt: skip
HoldOutOption = Annotated[
    list[str] | None,
    typer.Option(
        "--hold-out", metavar="LOG", help="A record that is foretold before and after; repeat.", show_default=False
    ),
]
Horizon = Annotated[str, typer.Option(metavar="TIME", help="Length of a prediction of the records held out.")]
Window = Annotated[
    str | None,
    typer.Option(metavar="TIME", help="Length of the windows of shooting. Default: 1 s.", show_default=False),
]
Turbulence = Annotated[
    str | None,
    typer.Option(
        metavar="SPEED", show_default=False,
        help="Standard deviation of the changing current; without it, it is taken from the records.",
    ),
]  # fmt: skip
Map = Annotated[
    str | None,
    typer.Option(
        "--map",
        metavar="MAPPING",
        show_default=False,
        help="Mapping of records that are not towtank's own.",
    ),
]
Ballasted = Annotated[
    bool, typer.Option("--ballasted", help="The craft was ballasted to neutral: its weight is its buoyancy.")
]
Pairs = Annotated[
    int,
    typer.Option(
        metavar="N", min=0, help="Draws that leave the motions open, for a short craft in strong eddies: 8 or so."
    ),
]
Doubt = Annotated[
    float,
    typer.Option(
        metavar="SHARE", min=0.0, help="Share of each chosen value by which the prior may be wrong beside it."
    ),
]


def calibrate(
    study: StudyWord,
    logs: Logs,
    terms: Terms = None,
    hold_out: HoldOutOption = None,
    horizon: Horizon = "30 s",
    window: Window = None,
    turbulence: Turbulence = None,
    doubt: Doubt = 0.0,
    pairs: Pairs = 0,
    ballasted: Ballasted = False,
    map: Map = None,
    out: Out = None,
    json: Json = False,
    debug: Debug = False,
) -> None:
    """Correct the coefficients of a study by records of the craft at sea.

    The derivatives of the study, with their covariance, are what is known before; the records, with the noise of their
    sensors, what is measured. Unknown beside are the current, the thrust and the biases of each record. What the
    records cannot tell stays and is named. Results: calibrated.json, a set of derivatives, and
    calibration.json, the tables.

    Example: towtank calibrate hokie sea-1.nc sea-2.nc --hold-out sea-3.nc
    """
    with answering("calibrate", json, debug) as reply:
        chain = open_chain(reply, study, out).keep_speed()
        reply.kept = "Nothing is written before the end; the study is as it was."
        reply.summary |= {"craft": chain.craft.name}
        model = _doubted(_afloat(chain.model(), ballasted), _words(terms), doubt)
        records = [_read(name, map, chain) for name in logs]
        held = [_read(name, map, chain) for name in hold_out or []]
        for log in (*records, *held):
            _remark(reply, log, ballasted)
        settings = replace(_settings(window, turbulence), pairs=pairs)
        from towtank.field.calibrate.calibrate import calibrate
        from towtank.quantity import si

        found = calibrate(
            model, records, terms=_words(terms), hold_out=held, settings=settings,
            horizon=si(horizon, "s", "--horizon"), progress=reply.progress, threads=cores(),
        )  # fmt: skip
        _publish(chain, found)
        _tell(reply, found)


def _words(text: str | None) -> tuple[str, ...] | None:
    return None if text is None else tuple(word.strip() for word in text.split(",") if word.strip())


def _afloat(model: Model, neutral: bool) -> Model:
    from towtank.trials.start import ballasted

    return ballasted(model) if neutral else model


def _doubted(model: Model, terms: tuple[str, ...] | None, doubt: float) -> Model:
    """``model`` whose chosen coefficients are less sure."""
    if doubt == 0.0:
        return model
    from towtank.field.calibrate.unknowns import with_errors

    names = terms or model.derivatives.names
    return model.with_derivatives(with_errors(model.derivatives, dict.fromkeys(names, doubt)))


def _settings(window: str | None, turbulence: str | None) -> Settings:
    """What is assumed, with what the user says."""
    from towtank.field.calibrate.settings import Settings
    from towtank.quantity import si

    out = Settings()
    if window is not None:
        out = replace(out, window=si(window, "s", "--window"))
    if turbulence is not None:
        out = replace(out, turbulence=si(turbulence, "m/s", "--turbulence"), learn=False)
    return out


def _remark(reply: Reply, log: SeaLog, neutral: bool) -> None:
    """What a record leaves to be assumed, and a ballast that the model has not."""
    from towtank.field.log import MEASURED

    unsaid = [name for name in log.channels if name in MEASURED and name not in log.std]
    if unsaid or log.assumed:
        reply.log(f"{log.name}: the noise of {', '.join(dict.fromkeys((*unsaid, *log.assumed)))} is assumed")
    if not neutral and "ballasted to neutral" in str(dict(log.provenance)).lower():
        reply.log(f"{log.name}: the craft was ballasted to neutral, the model is not: give --ballasted")


def _read(name: str, map: str | None, chain: Chain) -> SeaLog:
    """A record: one that towtank wrote, or a file of any format that it reads."""
    from towtank.field.reading import read_sea_log

    if not Path(name).exists():
        raise InputError(f"{name}: no such file. Name a record: towtank log makes one from a file of the craft.")
    return read_sea_log(name, map, craft=chain.source)


def _publish(chain: Chain, found: Calibration) -> None:
    from towtank.derive.files import write_derivatives
    from towtank.field.calibrate.files import write_calibration

    inputs = {**found.derivatives.provenance["inputs"], "derivatives": file_hash(chain.study.derivatives)}
    named = replace(found.derivatives, provenance={**found.derivatives.provenance, "inputs": inputs})
    found = replace(found, derivatives=named)
    folder = chain.study.root
    chain.reply.file("calibrated", write_derivatives(named, folder / "calibrated.json"))
    chain.reply.file("calibration", write_calibration(found, folder / "calibration.json"))


def _tell(reply: Reply, found: Calibration) -> None:
    tables = found.derivatives.quality["calibration"]
    reply.summary |= {
        "level": found.derivatives.level, "rounds": tables["rounds"], "settled": found.settled,
        "moves": {m.name: {"prior": m.prior, "value": m.value, "std": m.std, "sigmas": m.sigmas, "left": m.left}
                  for m in found.moves if not m.slope},
        "not_told": list(found.untold), "warnings": list(found.warnings),
        "hold_out": {h.after.log: h.ratio for h in found.hold_out},
    }  # fmt: skip
    reply.say(f"{found.derivatives.level}: {len(found.records)} records, {tables['rounds']} rounds")
    reply.say(f"{'':<10}{'before':>12}{'std':>10}{'after':>12}{'std':>10}{'moved':>8}{'left':>7}  unit")
    for m in found.moves:
        if not m.slope:
            told = "" if m.told else "  not told"
            reply.say(
                f"{m.name:<10}{m.prior:12.5g}{m.prior_std:10.2g}{m.value:12.5g}{m.std:10.2g}{m.sigmas:+8.2f}{m.left:7.3f}"
                f"  {m.unit}{told}"
            )
    reply.say("moved: in standard deviations of the prior. left: standard deviation after over before.")
    for record in found.records:
        thrust, std = record.shared["thrust"]
        north, east = record.shared["current_north"][0], record.shared["current_east"][0]
        reply.say(
            f"{record.name} ({record.level}): {record.seconds:.0f} s, thrust {thrust:.3f} +/- {std:.3f}, "
            f"current {north:+.3f} {east:+.3f} m/s, turbulence {record.noise['turbulence']:.3f} m/s"
        )
    for held in found.hold_out:
        _tell_held(reply, held)
    for words in (*found.words(), *found.warnings):
        reply.say(f"* {words}")


def _tell_held(reply: Reply, held: HoldOut) -> None:
    after, before = held.after, held.before
    reply.say(
        f"{after.log}, held out: {after.windows} predictions of {after.horizon:g} s miss {before.total:.3g} -> "
        f"{after.total:.3g} standard deviations of the sensors ({held.ratio:.2f})"
    )
    for name in after.rms:
        if name in before.rms:
            reply.say(f"  {name:<8}{before.rms[name]:11.4g} -> {after.rms[name]:<11.4g} noise {after.noise[name]:.2g}")
