"""Page section: what the uncertainty of the craft does to its trials."""

from __future__ import annotations

from functools import partial

from towtank.figures import montecarlo
from towtank.montecarlo.result import MonteCarlo, driven
from towtank.report.blocks import Block, Section, Table, Text, missing, number, stated
from towtank.report.pictures import Sketchbook
from towtank.report.study import STAGES, Study
from towtank.verdict.spread import Spread

TITLE = "Uncertainty of the manoeuvres"


def uncertainty(study: Study, book: Sketchbook) -> Section:
    """Probability of stability, bands of the main trials, then every index with its band."""
    it = study.mc
    if it is None:
        return Section("mc", TITLE, (missing("No Monte Carlo study was given.", STAGES["mc"]),))
    blocks: list[Block] = [Text(_intro(it)), *_stability(it), *_figures(it, book), _indices(it), _ended(it)]
    return Section("mc", TITLE, tuple(blocks))


def _intro(it: MonteCarlo) -> str:
    part = "" if it.complete else f" It was stopped; {it.samples} were asked for."
    return (
        f"{it.done} craft were drawn from the standard uncertainties of: {it.given}. All fly the same trials under the "
        f"pilot, trim and thrust of the best estimate.{part}"
    )


def _stability(it: MonteCarlo) -> list[Block]:
    out: list[Block] = []
    for plane in it.planes.values():
        low, high = plane.index.band
        which = "index G" if plane.plane == "horizontal" else "index G, which leaves the righting moment out,"
        out.append(
            Text(
                f"With fixed fins, the probability of being stable in straight flight, {plane.plane} plane, is "
                f"{plane}. Stability {which} {number(plane.index.best, 3)}, 90 % between {number(low, 3)} and "
                f"{number(high, 3)}.",
                "good" if plane.interval[0] > 0.5 else "bad" if plane.interval[1] < 0.5 else "plain",
            )
        )
    return out


def _of(it: MonteCarlo, *words: str) -> list[str]:
    return [name for name, trial in it.trials.items() if name in it.bands and all(word in trial.kind for word in words)]


def _figures(it: MonteCarlo, book: Sketchbook) -> list[Block]:
    blocks: list[Block] = []
    for name in _of(it, "circle")[:1]:
        words = f"Turning circle of drawn craft. Box and bar: of all {it.done}; tracks end where a tenth have finished."
        blocks.append(book.draw(montecarlo.circle_fan, it, name, caption=words))
    fans = [(name, "psi") for name in _of(it, "zigzag") if "vertical" not in it.trials[name].kind][:2]
    fans += [(name, "theta") for name in _of(it, "zigzag", "vertical")[:1]]
    fans += [(name, "theta") for name in _of(it, "meander")[:1]]
    fans += [(name, "psi") for name in _of(it, "heading")[:1]] + [(name, "z") for name in _of(it, "depth")[:1]]
    for i in range(0, len(fans), 2):
        calls = [partial(montecarlo.channel_fan, it, name, channel) for name, channel in fans[i : i + 2]]
        words = "Bands over time, from the first piece's craft; a band ends where a tenth of them have ended the trial."
        blocks.append(book.panels(calls, words, (2.1,), len(calls)))
    return blocks


def _indices(it: MonteCarlo) -> Table:
    rows = tuple(
        (trial.name, name.replace("_", " "), *_numbers(s), s.unit, f"{100.0 * s.share:.0f} %", driven(s) or "-")
        for trial in it.trials.values()
        for name, s in trial.indices.items()
        if name not in it.common and name.removesuffix("_lengths") not in trial.indices.keys() - {name}
    )
    head = ("Trial", "Index", "Best", "Mean", "std", "5 %", "50 %", "95 %", "Unit", "Have it", "Driven by")
    more = (
        "std marked h: heavy tails, half the 16-84 % range. Have it: share of the craft that have the index; mean, std "
        "and quantiles are theirs. Driven by: rank correlation with the parameters drawn; a slash joins tied ones"
    )
    return Table("Indices of the drawn craft", head, rows, stated(it.level, f"{it.given}; {it.done} craft", more=more))


def _numbers(s: Spread) -> tuple[str, ...]:
    std = number(s.std, 2) + ("" if not s.heavy else " h")
    return (number(s.best), number(s.mean), std, *(number(s.quantiles[i]) for i in (0, 2, 4)))


def _ended(it: MonteCarlo) -> Table:
    reasons = tuple(dict.fromkeys(reason for trial in it.trials.values() for reason in trial.ended))
    head = ("Trial", "Kind", "Loop", *(WORDS.get(reason, reason) for reason in reasons))
    rows = tuple(
        (trial.name, trial.kind, trial.loop, *(str(trial.ended.get(reason, 0)) for reason in reasons))
        for trial in it.trials.values()
    )
    words = "counts of drawn craft; one that ran away left the range of its derivatives and none of its numbers count"
    return Table("How the trials of the drawn craft ended", head, rows, stated(it.level, words, axes=False))


WORDS = {
    "done": "Finished", "not_finite": "Not finite", "too_fast": "Ran away", "late": "A mark not reached",
}  # fmt: skip
