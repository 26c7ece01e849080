"""Page section: a mission with one fin jammed."""

from __future__ import annotations

from functools import partial

import numpy as np

from towtank.figures.jammed import jammed
from towtank.report.blocks import Block, Section, Table, Text, missing, number, stated
from towtank.report.pictures import Sketchbook
from towtank.report.study import STAGES, Study
from towtank.trials.jammed import OFF_DEPTH, OFF_TRACK, JammedFins

TITLE = "A jammed fin"


def faults(study: Study, book: Sketchbook) -> Section:
    """With which jams the mission is completed, what is left off track and depth, and why the others fail."""
    it = study.jammed
    if it is None:
        return Section("faults", TITLE, (missing("No mission with jammed fins was given.", STAGES["faults"]),))
    calls = [partial(jammed, it, quantity) for quantity in ("track", "depth")]
    caption = "Rms off the track and off the depth over the angle of the jam."
    blocks: list[Block] = [
        Text(_words(it), "good" if it.completed.all() else "bad"),
        book.panels(calls, caption, (2.1,), 2),
    ]
    failed = _failed(it)
    return Section("faults", TITLE, tuple([*blocks, failed] if failed.rows else blocks))


def _words(it: JammedFins) -> str:
    angle, done = np.degrees(it.angle), int(it.completed.sum())
    notes = f" {' '.join(it.notes)}" if it.notes else ""
    return (
        f"Each of the {len(it.fins)} fins of {it.craft} was jammed at {angle.shape[1]} angles from {angle.min():.0f} "
        f"to {angle.max():.0f} deg, and the {it.mission} flown at {it.speed:g} m/s by a pilot that knows of it. It is "
        f"completed with {done} of {angle.size} jams: flown to its end, off the track by at most {OFF_TRACK:g} and off "
        f"the depth by at most {OFF_DEPTH:g} craft lengths rms.{notes}"
    )


def _failed(it: JammedFins) -> Table:
    rows = tuple(
        (fin, number(float(np.degrees(it.angle[i, j])), 3), it.why[i][j])
        for i, fin in enumerate(it.fins)
        for j in range(it.angle.shape[1])
        if it.why[i][j]
    )
    note = stated(it.level, "none: best estimate", axes=False)
    return Table("Jams with which the mission is not completed", ("Fin", "Angle [deg]", "Why"), rows, note)
