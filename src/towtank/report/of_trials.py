"""Page section: simulated manoeuvres with their indices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from towtank.figures import histories, tracks
from towtank.report.blocks import Block, Section, Table, Text, missing, number, stated, with_std
from towtank.report.pictures import Sketchbook
from towtank.report.study import STAGES, Study
from towtank.trials.trajectory import Trajectory


def trials(study: Study, book: Sketchbook) -> Section:
    """Figures of every kind of trial, then the indices of all of them."""
    title = "Simulated manoeuvres"
    it = _ordered(study.trajectories)
    if not it:
        return Section("trials", title, (missing("No trial was given.", STAGES["trials"]),))
    blocks: list[Block] = [_list(it)]
    blocks += _figures(study, it, book)
    common = _common(it)
    blocks.append(_indices(it, study.index, common))
    if common:
        blocks.append(_common_table(it, common))
    return Section("trials", title, tuple(blocks))


ORDER = ("straight", "acceleration", "stopping", "circle", "zigzag, h", "zigzag", "spiral", "pull", "meander", "dive",
         "heading", "depth", "lawnmower", "mission", "user")  # fmt: skip
"""Words of the kinds in the order of the page: open loop first."""


def _ordered(it: Sequence[Trajectory]) -> list[Trajectory]:
    """Trials in the order of the page; within a kind as given."""
    return sorted(it, key=lambda t: next((i for i, word in enumerate(ORDER) if word in t.kind), len(ORDER)))


def _of(it: Sequence[Trajectory], *words: str) -> list[Trajectory]:
    """Trials whose kind holds one of ``words``, spaces and hyphens aside."""
    plain = [word.replace("-", "").replace(" ", "") for word in words]
    return [t for t in it if any(word in t.kind.replace("-", "").replace(" ", "").replace("_", "") for word in plain)]


def _figures(study: Study, it: Sequence[Trajectory], book: Sketchbook) -> list[Block]:
    blocks: list[Block] = []
    for trial in _of(it, "circle")[:2]:
        blocks.append(book.draw(tracks.turning_circle, trial, caption=_caption(trial)))
    reverse = _of(it, "reversespiral")
    direct = [trial for trial in _of(it, "spiral") if trial not in reverse]
    if both := [*direct[:1], *reverse[:1]]:
        blocks.append(book.draw(histories.spiral, both, caption=" ".join(_caption(trial) for trial in both)))
    if out := _of(it, "pullout")[:4]:
        blocks.append(book.draw(histories.pull_out, out, caption=_caption(out[0])))
    steps = [*_of(it, "headingstep")[:1], *_of(it, "depthstep")[:1]]
    dives = [*_of(it, "meander")[:1], *_of(it, "steepdive")[:2]]
    pairs = ((_of(it, "zigzag")[:4], histories.zigzag), (dives, histories.pitch), (steps, histories.step))
    for some, figure in pairs:
        for i in range(0, len(some), 2):
            calls = [partial(figure, trial) for trial in some[i : i + 2]]
            words = " ".join(_caption(trial) for trial in some[i : i + 2])
            blocks.append(book.panels(calls, words, (2.1,), len(calls)))
    if changes := [*_of(it, "acceleration")[:1], *_of(it, "stopping")[:2]]:
        blocks.append(book.draw(histories.speed, changes, caption=" ".join(_caption(trial) for trial in changes)))
    missions = [*_of(it, "lawnmower")[:1], *_of(it, "mission")[:2]]
    limit = min((fin.max_angle for fin in study.craft.fins), default=None) if study.craft else None
    for trial in missions:
        blocks.append(book.draw(tracks.plan_view, trial, caption=_caption(trial)))
        blocks.append(book.draw(histories.fin_angles, trial, limit, caption="Fin angles through the mission."))
        blocks.append(book.draw(tracks.depth_profile, trial, caption="Depth through the mission."))
    for trial in _of(it, "userdefined")[:4]:
        calls = [partial(histories.course, trial), partial(histories.pitch, trial)]
        blocks.append(book.draw(tracks.plan_view, trial, caption=_caption(trial)))
        blocks.append(book.panels(calls, "Heading and rudder, pitch and elevator.", (2.0,), len(calls)))
        blocks.append(book.draw(tracks.depth_profile, trial, caption="Depth through the trial."))
    if it and not missions:
        blocks.append(book.draw(tracks.depth_profile, it[:6], caption="Depth in the trials."))
    if any(t.delta.shape[1] for t in it):
        words = (
            "How hard the fins work. Open-loop trials hold what the trial orders; closed-loop ones show the autopilot."
        )
        blocks.append(book.draw(histories.fin_effort, it, caption=words))
    return blocks


def _caption(trial: Trajectory) -> str:
    ended = "" if trial.status == "done" else f" {_sentence(trial.status)}"
    loop = "Autopilot" if trial.loop == "closed" else "Open loop"
    return f"{trial.kind.capitalize()} {trial.name}. {loop}, nominal model.{ended}"


def _sentence(status: str) -> str:
    """Why a trial ended, as a sentence that says that it did."""
    words = status if status.startswith(("ended early", "not completed")) else f"ended early: {status}"
    return words.rstrip(".") + "."


def _list(it: Sequence[Trajectory]) -> Table:
    rows = tuple(
        (t.name, t.kind, t.loop, number(float(t.time[-1] - t.time[0])), number(float(abs(t.nu[0, 0]))), t.status)
        for t in it
    )
    head = ("Trial", "Kind", "Loop", "Lasts [s]", "Speed at the start [m/s]", "Ended")
    level = " + ".join(dict.fromkeys(t.level for t in it))
    return Table("Trials", head, rows, stated(level, "nominal model; uncertainty of the indices in their own table"))


def _indices(it: Sequence[Trajectory], index: Mapping[str, Any], common: Sequence[str]) -> Table:
    recorded = {str(entry.get("name")): entry.get("indices", {}) for entry in index.get("trials", ())}
    rows: list[tuple[str, ...]] = []
    some = False
    for trial in it:
        known = recorded.get(trial.name, {})
        for name, (value, unit) in trial.indices.items():
            if name in common:
                continue
            std = known.get(name, {}).get("std") if isinstance(known.get(name), Mapping) else None
            some = some or std is not None
            mean, spread = with_std(float(value), None if std is None else float(std))
            rows.append((trial.name, name.replace("_", " "), mean, spread, unit))
    level = " + ".join(dict.fromkeys(t.level for t in it))
    words = (
        "std from the Monte Carlo study; - where less than half of its craft have the index"
        if some
        else "not computed for these trials"
    )
    more = "Angles in the unit stated; heading positive to starboard, depth downwards"
    return Table("Indices", ("Trial", "Index", "Value", "std", "Unit"), tuple(rows), stated(level, words, more=more))


def _common(it: Sequence[Trajectory]) -> list[str]:
    """Indices that every trial has; none for a single trial."""
    return [name for name in it[0].indices if all(name in t.indices for t in it)] if len(it) > 1 else []


def _common_table(it: Sequence[Trajectory], names: Sequence[str]) -> Table:
    rows = tuple((t.name, *(number(float(t.indices[name][0]), 3) for name in names)) for t in it)
    units = {name: it[0].indices[name][1] for name in names}
    head = ("Trial", *(name.replace("_", " ") + (f" [{units[name]}]" if units[name] else "") for name in names))
    level = " + ".join(dict.fromkeys(t.level for t in it))
    return Table("Numbers that every trial has", head, rows, stated(level, "not computed for these numbers"))


def headline(it: Sequence[Trajectory], index: Mapping[str, Any]) -> list[tuple[str, str, str, str]]:
    """A few indices for the summary: (words, value, std, unit)."""
    wanted = (("circle", "tactical_diameter"), ("circle", "advance"), ("zigzag", "first_overshoot"))
    recorded = {str(entry.get("name")): entry.get("indices", {}) for entry in index.get("trials", ())}
    rows = []
    for kind, key in wanted:
        for trial in _of(it, kind)[:1]:
            for name, (value, unit) in trial.indices.items():
                if name.replace(" ", "_").startswith(key):
                    pair = with_std(float(value), recorded.get(trial.name, {}).get(name, {}).get("std"))
                    rows.append((f"{name.replace('_', ' ').capitalize()}, {trial.name}", *pair, unit))
                    break
    return rows


def remarks(it: Sequence[Trajectory]) -> list[Block]:
    """One paragraph for each trial that ended early."""
    return [Text(f"Trial {t.name}: {_sentence(t.status)}", "bad") for t in it if t.status != "done"]
