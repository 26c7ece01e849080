"""Part of a page section: how derivatives depend on the frequency and amplitude of the motion."""

from __future__ import annotations

import math
from functools import partial

from towtank.derive.study import FrequencyStudy, Loop
from towtank.derive.study_files import WORTH
from towtank.figures import frequency as figures
from towtank.report.blocks import Block, Table, Text, missing, number, stated
from towtank.report.pictures import Sketchbook
from towtank.report.study import STAGES, Study
from towtank.symbols import TERMS

DRAWN = ("Yuv", "Nuv", "Nur", "Zuw", "Muw", "Muq", "Yur", "Kup", "Xuu")
"""Terms in the order in which they are drawn, those of stability first."""
MOST = 3
"""Terms drawn, each against frequency and against amplitude."""


def frequencies(study: Study, book: Sketchbook) -> list[Block]:
    """The key terms against frequency and amplitude, trends, loops, recommended motions, gain by optional terms."""
    it = study.frequency
    if it is None:
        return [missing("Frequency and amplitude were not studied.", STAGES["frequency"])]
    blocks: list[Block] = []
    inputs = it.provenance.get("inputs", {})
    if study.runs and not set(inputs.values()) <= {run.id for run in study.runs}:
        blocks.append(Text(f"The frequency study was made from other runs than these. {STAGES['frequency']}", "bad"))
    several = {trend.term for trend in it.trends if trend.points > 1}
    terms = [term for term in DRAWN if term in several][:MOST]
    if terms:
        calls = [partial(figures.against_frequency, it, term) for term in terms]
        calls += [partial(figures.against_amplitude, it, term) for term in terms]
        words = (
            "Derivatives of single oscillations against frequency and amplitude. Damping is equivalent linear: the "
            "share of the quadratic term grows with amplitude. Open marks are not fully trusted, crosses not fitted."
        )
        columns = max(len(terms), 2)
        blocks.append(book.panels(calls, words, (2.2,) * (len(calls) // columns), columns))
    return [*blocks, _trends(it), *_loops(it), _advice(it), *_gains(it)]


def _trends(it: FrequencyStudy) -> Table:
    """Limits beside the wide fit, and what the range of frequencies and amplitudes that was run does to them."""
    rows = []
    for t in it.trends:
        if t.points < 2:
            continue
        own = [point for point in it.points if point.term == t.term and point.verdict in ("accepted", "down-weighted")]
        frequency, amplitude = (max(getattr(point, name) for point in own) for name in ("frequency", "amplitude"))
        interval = f"{number(t.low)} to {number(t.high)}" if math.isfinite(t.low) else "-"
        rows.append((
            t.kind, f"{t.term} [{TERMS[t.term].unit}]", str(t.points), number(t.limit), interval, number(t.fit),
            _share(t.fit - t.limit, t.limit), f"{_share(t.bend * frequency**2, t.limit)} at {frequency:.2g}",
            f"{_share(t.growth * amplitude, t.limit)} at {amplitude:.2g}",
        ))  # fmt: skip
    head = ("Kind", "Term", "Runs", "Limit", "95 % interval", "Wide fit", "off [%]", "w' adds [%]", "a' adds [%]")
    more = (
        "value = limit + bend w'2 + growth a', of kinds with more than one run; per cent of the limit, at the largest "
    )
    more += "w' and amplitude a' that were fitted"
    note = stated(it.level, "intervals of 95 % by Student", more=more)
    return Table("Trends with frequency and amplitude", head, tuple(rows), note)


def _share(part: float, whole: float) -> str:
    """``part`` as signed per cent of ``whole``; "-" when there is none."""
    share = 100.0 * part / whole if whole != 0.0 else math.nan
    return f"{round(share, 1) + 0.0:+.1f}" if math.isfinite(share) else "-"


def _loops(it: FrequencyStudy) -> list[Block]:
    """Of each kind and load the loop that the model misses most."""
    kinds = {point.run: point.kind for point in it.points}
    groups: dict[tuple[str, str], list[Loop]] = {}
    for loop in it.loops:
        groups.setdefault((kinds.get(loop.run, "-"), loop.load), []).append(loop)
    rows = []
    for (kind, load), own in groups.items():
        worst = max(own, key=lambda loop: loop.misfit)
        unit = ("N" if load in "XYZ" else "N m") + (" m/s" if kind in ("surge", "sway", "heave") else " rad/s")
        rows.append((kind, load, str(len(own)), number(100.0 * worst.misfit, 2), worst.run, number(worst.measured, 3),
                     number(worst.modelled, 3), unit))  # fmt: skip
    if not rows:
        return []
    head = ("Kind", "Load", "Loops", "Largest misfit [%]", "in run", "area measured", "area modelled", "Unit")
    more = "Misfit: root mean square of measured less modelled, of the measured variation. Area: load over velocity"
    note = stated(it.level, "misfit is not uncertainty", more=more)
    return [Table("Loops that the model misses most", head, tuple(rows), note)]


def _advice(it: FrequencyStudy) -> Table:
    rows = tuple(
        (a.kind, ", ".join(f"{x:g}" for x in a.frequencies), ", ".join(f"{x:g}" for x in a.amplitudes),
         figures.VELOCITY[a.kind], a.words)
        for a in it.advice
    )  # fmt: skip
    head = ("Kind", "w' = w L / U", "Amplitude", "of", "What decides")
    return Table("Recommended oscillations", head, rows, stated(it.level, "none stated", axes=False))


def _gains(it: FrequencyStudy) -> list[Block]:
    """What the fit misses with and without each group of optional terms, where it makes a difference."""
    rows = tuple(
        (g.group, g.kind, f"{100.0 * g.without:.1f}", f"{100.0 * g.within:.1f}")
        for g in it.gains
        if g.without - g.within > WORTH
    )
    groups = ", ".join(dict.fromkeys(g.group for g in it.gains))
    if not groups:
        return []
    if not rows:
        return [Text(f"Optional terms ({groups}) would lower the misfit of no kind of run by {100 * WORTH:g} %.")]
    head = ("Optional terms", "Kind of run", "missed without [%]", "missed with [%]")
    more = f"Each run against the fit to the others; left out where the gain is below {100 * WORTH:g} %. Take them up "
    more += "with `towtank derive --with GROUP`"
    return [Table("What optional terms would buy", head, rows, stated(it.level, "none stated", axes=False, more=more))]
