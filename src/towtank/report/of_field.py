"""Page section: the model beside records of the craft at sea."""

from __future__ import annotations

from functools import partial

from towtank.field.comparing import words
from towtank.field.comparing.metrics import ERRORS, METRICS
from towtank.field.comparing.result import GROWTH, Comparison
from towtank.figures import compare
from towtank.report.blocks import Block, Section, Table, Text, missing, stated
from towtank.report.pictures import Sketchbook
from towtank.report.study import STAGES, Study

TITLE = "Comparison with sea records"


def records(study: Study, book: Sketchbook) -> Section:
    """Every record: what was flown, how far it agrees and at which level, its histories and numbers."""
    if not study.comparisons:
        return Section("compare", TITLE, (missing("No record of the sea was compared.", STAGES["compare"]),))
    blocks: list[Block] = []
    for it in study.comparisons:
        blocks += _one(it, book)
    return Section("compare", TITLE, (*blocks, _fixed()))


def _one(it: Comparison, book: Sketchbook) -> list[Block]:
    calls = [partial(compare.history, it, name) for name in compare.histories_of(it)]
    columns = 2
    caption = f"{it.name}, {it.loop} loop: {compare.level_line(it)}. The band holds no sensor noise."
    rows = -(-len(calls) // columns)
    blocks: list[Block] = [Text(words.what(it)), Text(words.verdict(it), _tone(it)), Text(words.limits(it))]
    blocks.append(Text(" ".join(f"{_sentence(word)}" for word in it.words)))
    blocks.append(book.panels(calls, caption, (2.0,) * rows, columns))
    more = [partial(compare.growth, it), partial(compare.residuals, it)]
    more += [partial(compare.spectrum, it, one.channel) for one in it.spectra[:1]]
    if {"x", "y"} <= set(it.series.model):
        more.append(partial(compare.track, it))
    blocks.append(
        book.panels(more, f"{it.name}: errors, residuals, spectrum, track.", (2.3,) * (-(-len(more) // 2)), 2)
    )
    blocks.append(book.draw(compare.levels, it, caption=f"{it.name}: E over U_val of every number."))
    return [*blocks, _channels(it), _metrics(it), _in_time(it)]


def _sentence(text: str) -> str:
    symbol = len(text.partition(",")[0].partition(":")[0]) < 2  # x, y, u: symbols keep their letter
    return f"{text if symbol else text[:1].upper() + text[1:]}".rstrip(".") + "."


def _tone(it: Comparison) -> str:
    """Good when all numbers are validated, most of them at a level that says something; bad when most are not."""
    done, known = it.validated
    if known and done == known and len(words.vague(it)) < 0.5 * known:
        return "good"
    return "bad" if done < 0.5 * known else "plain"


def _level(it: Comparison) -> str:
    return f"{compare.level_line(it)}"


def _channels(it: Comparison) -> Table:
    rows = tuple(words.channel_row(one) for one in it.channels)
    note = stated(
        _level(it), f"U_val, 95 %; inside: share within the 95 % band of {it.samples} drawn craft", axes=False
    )
    return Table(f"{it.name}: error of every channel", words.CHANNEL_HEAD, rows, note)


def _metrics(it: Comparison) -> Table:
    rows = tuple(words.metric_row(one) for one in it.metrics)
    note = stated(_level(it), "U_val and its parts, 95 %", axes=False, more="E is record less model")
    return Table(f"{it.name}: metrics", words.METRIC_HEAD, rows, note)


def _in_time(it: Comparison) -> Table:
    rows = tuple(
        (one.channel, words.unit_of(one.unit), *(words.short(words.shown(value, one.unit)) for value in one.growth))
        for one in it.channels
    )
    head = ("channel", "unit", *(f"{after:g} s" for after in GROWTH))
    note = stated(_level(it), "none: mean over the parts of the record", axes=False)
    return Table(f"{it.name}: rms error at a time after the begin of a part", head, rows, note)


def _fixed() -> Table:
    errors = tuple((name, "each", "", formula, source) for name, (formula, source) in ERRORS.items())
    rows = errors + tuple((one.name, one.channel, words.unit_of(one.unit), one.formula, one.source) for one in METRICS)
    note = "Fixed in advance; one of which a record has nothing is left out."
    return Table("Metrics", ("metric", "channel", "unit", "formula", "source"), rows, note)
