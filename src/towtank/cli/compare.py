"""``towtank compare``: a record of the sea beside the model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from towtank.cli.chain import Chain, open_chain
from towtank.cli.options import Debug, Json, Out, Speed
from towtank.cli.pilots import PilotWord, pilot_of
from towtank.cli.reply import Reply, answering
from towtank.errors import InputError

if TYPE_CHECKING:
    from towtank.field.comparing.result import Comparison
    from towtank.field.log import SeaLog
    from towtank.model.equations import Model

StudyWord = Annotated[
    str, typer.Argument(metavar="STUDY", help="A study folder, or a craft whose folder is here.", show_default=False)
]
Record = Annotated[
    Path, typer.Argument(metavar="LOG", help="A record of towtank log, or any log that it reads.", show_default=False)
]
Map = Annotated[
    str | None,
    typer.Option("--map", metavar="MAPPING", show_default=False, help="As for towtank log. Default: told by the file."),
]
Closed = Annotated[
    bool | None,
    typer.Option(
        "--closed/--open", show_default=False,
        help="Fly the orders through a pilot, or the fin angles. Default: the angles, where the record has them.",
    ),
]  # fmt: skip
Horizon = Annotated[
    float | None,
    typer.Option(
        "--horizon", metavar="S", show_default=False,
        help="Begin again from the record every S seconds; 0 for never. Default: 30 in open loop, never in closed.",
    ),
]  # fmt: skip
Samples = Annotated[int, typer.Option("--samples", metavar="N", help="Craft drawn for the band.")]
Ballasted = Annotated[
    bool, typer.Option("--ballasted", help="Ballast the craft to neutral first, as the standard trials do.")
]
Align = Annotated[
    bool | None,
    typer.Option(
        "--align/--no-align", show_default=False,
        help="Take out the lag between record and model. Default: when above half a tick and plain.",
    ),
]  # fmt: skip


def compare(
    study: StudyWord,
    log: Record,
    mapping: Map = None,
    closed: Closed = None,
    horizon: Horizon = None,
    pilot: PilotWord = None,
    speed: Speed = None,
    samples: Samples = 200,
    align: Align = None,
    ballasted: Ballasted = False,
    out: Out = None,
    json: Json = False,
    debug: Debug = False,
) -> None:
    """Lay a record of the sea beside the model: errors, metrics, the band of the model, the level of validation.

    The model flies with the fin angles of the record (open loop) or with its orders through a pilot (closed loop). The
    craft needs its derivatives first. Results: compare.json, figures in compare/, and a section of the report.

    Example: towtank compare hokie survey.nc

    Example: towtank compare hokie survey.nc --closed --pilot cascade --samples 500
    """
    with answering("compare", json, debug) as reply:
        chain = open_chain(reply, study, out).keep_speed()
        record = _read(log, mapping, reply)
        model = _model(chain, record, ballasted)
        found = _compared(reply, model, record, closed, horizon, pilot, speed, samples, align)
        _write(chain, found)
        _tell(reply, found)


def _read(path: Path, mapping: str | None, reply: Reply) -> SeaLog:
    """A record of towtank, or a log of another form through the readers; what is doubtful is remarked."""
    from towtank.field.reading import read_sea_log

    record = read_sea_log(path, mapping)
    for flag in record.flags:
        reply.log(f"  {flag.kind} of {flag.channel}, {flag.start:.4g} to {flag.end:.4g} s: {flag.words}")
    return record


def _model(chain: Chain, log: SeaLog, ballasted: bool) -> Model:
    """The model of the study, ballasted where that is asked for; a remark where it cannot fly level as it is."""
    from towtank.trials.start import ballasted as neutral
    from towtank.trials.start import level_trim

    model = chain.model()
    if ballasted:
        chain.reply.log("ballasted to neutral: asked for")
        return neutral(model)
    trim = level_trim(model, model.craft.speed)
    if not trim.holds:
        chain.reply.log(f"  note: {trim.why}. If the craft of {log.name} was ballasted to neutral, add --ballasted.")
    return model


def _compared(
    reply: Reply, model: Model, log: SeaLog, closed: bool | None, horizon: float | None, word: str | None,
    speed: str | None, samples: int, align: bool | None,
) -> Comparison:  # fmt: skip
    from towtank.field.comparing.compare import compare as lay_beside
    from towtank.field.course import OPEN_HORIZON
    from towtank.quantity import si

    n = len(model.craft.fins)
    fins = log.fins == n or log.has("rudder", "elevator")
    if closed is None:
        closed = word is not None or not fins
        reply.log(
            f"{'closed' if closed else 'open'} loop: {'a pilot is named' if word else 'by what the record holds'}"
        )
    if word is not None and not closed:
        raise InputError("--pilot flies orders in closed loop, and --open replays the fins. Leave one of them out.")
    U = None if speed is None else si(speed, "m/s", "--speed")
    if U is not None and not U > 0.0:
        raise InputError(f"--speed {speed}: the thrust of the record belongs to a speed ahead. Give one above zero.")
    U = model.craft.speed if U is None and closed else U
    after = (None if closed else OPEN_HORIZON) if horizon is None else horizon or None
    pilot = pilot_of(word or "cascade", model, U) if closed and U is not None else None
    return lay_beside(
        model, log, pilot=pilot, horizon=after, samples=samples, align=align, speed=U,
        pilot_name=word or "cascade", progress=reply.progress,
    )  # fmt: skip


def _write(chain: Chain, found: Comparison) -> None:
    from towtank.field.comparing.files import FOLDER, stem, write_comparison

    document, series = write_comparison(found, chain.study.root)
    chain.reply.file("compare", document)
    chain.reply.file("series", series)
    for name, path in _drawn(found, chain.study.root / FOLDER / stem(found)).items():
        chain.reply.file(name, path)


def _drawn(found: Comparison, at: Path) -> dict[str, Path]:
    """Figures as PNG beside the series: histories one below the other, then one file each."""
    from towtank.figures import compare as figures

    files = {}
    for name in figures.histories_of(found):
        files[name] = _saved(figures.history(found, name), at.with_name(f"{at.name}-{name}.png"))
    more: dict[str, Any] = {"levels": figures.levels, "growth": figures.growth, "residuals": figures.residuals}
    if {"x", "y"} <= set(found.series.model):
        more["track"] = figures.track
    for name, figure in more.items():
        files[name] = _saved(figure(found), at.with_name(f"{at.name}-{name}.png"))
    for one in found.spectra:
        drawn = figures.spectrum(found, one.channel)
        files[f"spectrum_{one.channel}"] = _saved(drawn, at.with_name(f"{at.name}-spectrum-{one.channel}.png"))
    return files


def _saved(axes: Any, path: Path) -> Path:
    from towtank.artefact import replace_file

    def write(part: Path) -> None:
        axes.get_figure(root=True).savefig(part, format="png", dpi=150)

    return replace_file(path, write)


def _tell(reply: Reply, found: Comparison) -> None:
    from towtank.field.comparing import words

    done, known = found.validated
    reply.summary |= {
        "record": found.name, "record_level": found.record_level, "level": found.level, "loop": found.loop,
        "horizon": found.horizon, "validated": {"within": done, "of": known, "at_no_level": words.vague(found)},
        "lag_s": found.lag.seconds,
        "lag_applied": found.lag.applied, "current": found.current, "current_std": found.current_std,
        "channels": {
            one.channel: {
                "unit": one.unit, "bias": one.bias.record, "U_val": one.bias.uncertainty.total, "rms": one.rms,
                "rms_expected": one.expected, "inside": one.inside, "inside_with_noise": one.inside_with_noise,
            }
            for one in found.channels
        },
        "metrics": {
            one.name: {
                "unit": one.unit, "record": one.record, "model": one.model, "error": one.error,
                "U_val": one.uncertainty.total, "validated": one.validated,
            }
            for one in found.metrics
        },
    }  # fmt: skip
    reply.tell(words.what(found))
    reply.say("")
    _table(reply, words.CHANNEL_HEAD, [words.channel_row(one) for one in found.channels])
    if found.metrics:
        reply.say("")
        _table(reply, words.METRIC_HEAD, [words.metric_row(one) for one in found.metrics])
    reply.say("")
    reply.tell(f"{words.verdict(found)}\n\n{words.limits(found)}")
    for word in found.words:
        reply.log(f"  note: {word}")


def _table(reply: Reply, head: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
    widths = [max(len(cell) for cell in column) for column in zip(head, *rows, strict=True)]
    for row in (head, *rows):
        cells = [
            f"{cell:<{w}}" if i < 2 else f"{cell:>{w}}" for i, (cell, w) in enumerate(zip(row, widths, strict=True))
        ]
        reply.say("  " + "  ".join(cells).rstrip())
