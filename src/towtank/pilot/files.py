"""``pilot.json``: the gains of a pilot or of a schedule of pilots, written whole, read back equal."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from towtank.artefact import read_json, write_json
from towtank.errors import ArtefactError, InputError
from towtank.pilot.law import GAINS, Pilot
from towtank.pilot.scheduled import PilotSchedule
from towtank.pilot.sensors import Reading, Sensors
from towtank.provenance import provenance

SCHEMA, SCHEDULE = "towtank/pilot/1", "towtank/pilot-schedule/1"

UNITS: Mapping[str, str] = {
    "speed": "m/s", "yaw_rate": "s", "heading": "1/s", "heading_integral": "1/s", "turn_limit": "rad/s",
    "pitch_rate": "s", "pitch": "", "pitch_order": "", "depth": "rad/m", "depth_rate": "rad s/m",
    "depth_integral": "rad/(m s)", "pitch_limit": "rad", "roll": "", "roll_rate": "s", "sway": "rad s/m",
    "heave": "rad s/m", "scheduled": "", "unwind": "s",
    "heading_band": "rad", "depth_band": "m", "reversal": "m/s",
}  # fmt: skip
"""Unit of each of ``GAINS``."""

_LATER = ("sway", "heave", "scheduled")
"""Gains that files of earlier versions lack; they take the default of ``Pilot``."""

_MARGINS = ("largest_gain_factor", "smallest_gain_factor", "phase_margin")


def write_pilot(pilot: Pilot, path: str | Path, inputs: Mapping[str, str] | None = None) -> Path:
    """Write ``pilot`` as JSON, schema ``towtank/pilot/1``; SI units, radians. A margin without limit is null.

    inputs : name -> hash of what the gains were made from.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    return write_json(Path(path), {"schema": SCHEMA, **_content(pilot), "provenance": provenance(inputs)})


def write_schedule(schedule: PilotSchedule, path: str | Path, inputs: Mapping[str, str] | None = None) -> Path:
    """Write ``schedule`` as JSON, schema ``towtank/pilot-schedule/1``: its pilots as ``write_pilot`` writes one.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    pilots = [_content(pilot) for pilot in schedule.pilots]
    return write_json(Path(path), {"schema": SCHEDULE, "pilots": pilots, "provenance": provenance(inputs)})


def _content(pilot: Pilot) -> dict[str, Any]:
    return {
        "craft": pilot.craft,
        "gains": {name: {"value": getattr(pilot, name), "unit": UNITS[name]} for name in GAINS},
        "eigenvalues": {loop: [[s.real, s.imag] for s in values] for loop, values in pilot.eigenvalues.items()},
        "margins": {loop: dict(zip(_MARGINS, values, strict=True)) for loop, values in pilot.margins.items()},
        "sensors": asdict(pilot.sensors),
        "notes": list(pilot.notes),
    }


def read_pilot(path: str | Path) -> Pilot:
    """Read a pilot written by ``write_pilot``.

    Raises
    ------
    ArtefactError
        Missing, not JSON, another schema, a gain that is missing or not a finite number, a speed that is not positive.
    """
    path = Path(path)
    return _pilot(read_json(path, SCHEMA), path)


def read_schedule(path: str | Path) -> PilotSchedule:
    """Read what ``write_schedule`` or ``write_pilot`` wrote; one pilot is a table of one.

    Raises
    ------
    ArtefactError
        As ``read_pilot``, or pilots that make no table.
    """
    path = Path(path)
    try:
        document = read_json(path, SCHEDULE)
    except ArtefactError:
        return PilotSchedule((read_pilot(path),))
    try:
        return PilotSchedule(tuple(_pilot(entry, path) for entry in document["pilots"]))
    except (KeyError, TypeError, InputError) as error:
        raise ArtefactError(f"{path} is not a whole pilot schedule ({error}). Write it again.") from None


def _pilot(document: Mapping[str, Any], path: Path) -> Pilot:
    try:
        return Pilot(
            craft=str(document["craft"]),
            **_gains(document["gains"]),
            eigenvalues={
                loop: tuple(complex(float(re), float(im)) for re, im in values)
                for loop, values in document["eigenvalues"].items()
            },
            margins={loop: _margins(values) for loop, values in document["margins"].items()},
            sensors=Sensors(**{name: Reading(**reading) for name, reading in document.get("sensors", {}).items()}),
            notes=tuple(str(note) for note in document["notes"]),
        )
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise ArtefactError(
            f"{path} is not a whole pilot ({type(error).__name__}: {error}). Every gain must be a finite number, the "
            "speed above zero, because the gains are scheduled with (speed / u)^2. Write it again with write_pilot."
        ) from None


def _gains(entries: Mapping[str, Mapping[str, Any]]) -> dict[str, float]:
    held = [name for name in GAINS if name in entries or name not in _LATER]
    gains = {name: getattr(Pilot("", 1.0), name) for name in _LATER} | {
        name: float(entries[name]["value"]) for name in held
    }
    bad = [name for name, value in gains.items() if not math.isfinite(value)]
    bad += [name for name in ("speed", "unwind") if not gains[name] > 0.0]
    if bad:
        raise ValueError(f"{', '.join(bad)} cannot be used")
    wrong = [name for name in held if entries[name]["unit"] != UNITS[name]]
    if wrong:
        raise ValueError(f"unit of {', '.join(wrong)}")
    return gains


def _margins(entries: Mapping[str, Any]) -> tuple[float, float, float]:
    up, down, phase = (math.inf if entries[name] is None else float(entries[name]) for name in _MARGINS)
    return up, down, phase
