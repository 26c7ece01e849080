"""Plans as files: ``plan.toml`` to be read and edited, ``plan.csv`` with one row for each run to be looked at."""

from __future__ import annotations

import csv
import dataclasses
import difflib
import io
import json
import math
import tomllib
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, cast

from towtank.artefact import write_text
from towtank.craft.craft import Craft
from towtank.errors import InputError, PlanError
from towtank.plan.kinds import CaptiveTest, Motion, Plan
from towtank.plan.limits import assess
from towtank.plan.motion import KINDS
from towtank.provenance import provenance
from towtank.quantity import si

SCHEMA = "towtank/plan/1"

_HEAD = """\
# Captive tests of {name}.
# Bare numbers are SI; angles and frequencies name their unit: "4 deg", "0.5 rad/s", "0.08 Hz".
# A run with exploratory = true is recorded and never fitted; it may pass the limits of a plan.
"""
_TEST_KEYS = ("name", "kind", "speed", "fins", "periods", "samples", "exploratory")
_PLAN_KEYS = ("schema", "craft", "speed", "notes", "provenance", "test")
_UNITS = {"amplitude": "m", "frequency": "rad/s", "angle": "rad", "drift": "rad", "rate": "rad/s"}
_DEFAULT = CaptiveTest("", 1.0, cast(Motion, None))


def write_plan(plan: Plan, folder: Path) -> tuple[Path, Path]:
    """Write ``plan.toml`` and ``plan.csv`` into ``folder``; their paths.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    folder = Path(folder)
    return write_text(folder / "plan.toml", plan_text(plan)), write_text(folder / "plan.csv", plan_table(plan))


def plan_text(plan: Plan) -> str:
    """``plan`` as TOML. Reading it gives the same plan to the last bit."""
    lines = [
        _HEAD.format(name=plan.craft.name),
        f"schema = {json.dumps(SCHEMA)}",
        f"craft = {_text(plan.craft.name)}",
        f"speed = {plan.speed!r}",
        "notes = [" + "".join(f"\n  {_text(note)}," for note in plan.notes) + "\n]" if plan.notes else "notes = []",
    ]
    for test in plan.tests:
        lines += ["", "[[test]]", *(f"{key} = {value}" for key, value in _entries(plan, test))]
    block = provenance()
    lines += ["", "[provenance]", *(f"{key} = {_text(str(block[key]))}" for key in ("program", "version", "date"))]
    return "\n".join(lines) + "\n"


def plan_table(plan: Plan) -> str:
    """``plan`` as CSV: motion, largest velocities and rates without dimension, warnings."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    head = ("name", "kind", "speed_m_s", *(f"{key}_{unit.replace('/', '_')}" for key, unit in _UNITS.items()))
    writer.writerow(
        (*head, "fins_deg", "v_prime", "w_prime", "p_prime", "q_prime", "r_prime", "frequency_prime", "cycle_lengths",
         "exploratory", "warnings")
    )  # fmt: skip
    for test in plan.tests:
        size = assess(test, plan.craft)
        motion = [getattr(test.motion, key, None) for key in _UNITS]
        numbers = (size.v, size.w, size.p, size.q, size.r, size.frequency, size.cycle)
        writer.writerow(
            (
                test.name,
                test.kind,
                f"{test.speed:.6g}",
                *("" if value is None else f"{value:.6g}" for value in motion),
                " ".join(f"{math.degrees(angle):.4g}" for angle in test.fins),
                *("" if math.isinf(value) else f"{value:.4g}" for value in numbers),
                "yes" if test.exploratory else "no",
                "; ".join((*size.warnings, *(refusal.split(". ")[0] for refusal in size.refusals))),
            )
        )
    return buffer.getvalue()


def read_plan(path: Path, craft: Craft) -> Plan:
    """Read ``plan.toml`` (or the folder it lies in) for ``craft``.

    Limits are not checked here but before the tests are run.

    Raises
    ------
    PlanError
        Missing, not TOML, of another craft, an unknown key or kind, a missing or wrong number.
    """
    path = Path(path)
    path = path / "plan.toml" if path.is_dir() else path
    document = _document(path)
    _known(document, _PLAN_KEYS, str(path))
    if document.get("schema") != SCHEMA:
        raise PlanError(
            f"{path}: schema {document.get('schema')!r}, wanted {SCHEMA!r}. It is not a plan of this version."
        )
    if document.get("craft") != craft.name:
        raise PlanError(
            f"{path} is a plan of {document.get('craft')!r}, not of {craft.name!r}. Amplitudes and fin angles belong "
            "to a craft; make a plan with `towtank plan`, or correct the name if the craft was only renamed."
        )
    speed = _number(document.get("speed", craft.speed), "m/s", f"{path}: speed")
    tests = document.get("test", [])
    if not isinstance(tests, list) or not all(isinstance(entry, dict) for entry in tests):
        raise PlanError(f"{path}: tests are not a list of tables. Write each as a table headed [[test]].")
    notes = document.get("notes", [])
    if not isinstance(notes, list) or not all(isinstance(note, str) for note in notes):
        raise PlanError(f"{path}: notes are not a list of texts. Write notes = [] or a list of texts.")
    read = (_test(entry, craft, speed, f"{path}: test {i + 1}") for i, entry in enumerate(tests))
    return Plan(craft, speed, tuple(read), tuple(notes))


def _document(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise PlanError(f"{path} does not exist. Write it with `towtank plan CRAFT`.") from None
    except (OSError, ValueError) as error:
        raise PlanError(f"{path} is not a readable TOML file ({error}). Correct it, or make a new plan.") from None


def _entries(plan: Plan, test: CaptiveTest) -> list[tuple[str, str]]:
    """Keys and TOML values of one test; what is the default is left out."""
    entries = [("name", _text(test.name)), ("kind", _text(test.motion.kind))]
    if test.speed != plan.speed:
        entries.append(("speed", repr(test.speed)))
    for item in dataclasses.fields(cast(Any, test.motion)):
        value = getattr(test.motion, item.name)
        if item.name != "speed" and value != item.default:
            entries.append((item.name, _quantity(value, _unit(item.name, test.motion.kind))))
    if test.fins:
        angles = (f"{_text(fin.name)} = {_quantity(angle, 'rad')}" for fin, angle in _fin_angles(plan.craft, test))
        entries.append(("fins", "{ " + ", ".join(angles) + " }"))
    entries += [
        (key, repr(getattr(test, key)))
        for key in ("periods", "samples")
        if getattr(test, key) != getattr(_DEFAULT, key)
    ]
    return [*entries, ("exploratory", "true")] if test.exploratory else entries


def _fin_angles(craft: Craft, test: CaptiveTest) -> Any:
    return zip(craft.fins, test.fins, strict=True)


def _unit(key: str, kind: str) -> str:
    return "rad" if key == "amplitude" and kind == "roll" else _UNITS[key]


def _text(text: str) -> str:
    """A TOML basic string; JSON escapes are TOML escapes."""
    return json.dumps(text, ensure_ascii=False)


def _quantity(value: float, unit: str) -> str:
    """``value`` as TOML, in degrees where that is exact and bare where the unit is not an angle."""
    if unit not in ("rad", "rad/s"):
        return repr(value)
    degrees = f"{math.degrees(value):.12g} deg"
    exact = unit == "rad" and si(degrees, "rad") == value
    return _text(degrees if exact else f"{value!r} {unit}")


def _test(entry: Mapping[str, Any], craft: Craft, plan_speed: float, where: str) -> CaptiveTest:
    name = entry.get("name")
    if not isinstance(name, str) or not name:
        raise PlanError(f'{where} has no name. Give each its own, for example name = "sway-slow".')
    where = f"{where} ({name})"
    kind = entry.get("kind")
    if kind not in KINDS:
        raise PlanError(f"{where}: kind {kind!r} is not a captive test. {_closest(str(kind), KINDS)}")
    motion_keys = [item.name for item in dataclasses.fields(KINDS[kind]) if item.name != "speed"]
    _known(entry, (*_TEST_KEYS, *motion_keys), where)
    needed = [item.name for item in dataclasses.fields(KINDS[kind]) if item.default is dataclasses.MISSING]
    for key in needed:
        if key not in entry and key != "speed":
            raise PlanError(f"{where}: {kind} needs {key}. Add {key} with its unit.")
    speed = _number(entry.get("speed", plan_speed), "m/s", f"{where}, speed")
    numbers = {key: _number(entry[key], _unit(key, kind), f"{where}, {key}") for key in motion_keys if key in entry}
    make = cast(Any, KINDS[kind])
    try:
        motion = make(speed, **numbers)
    except PlanError as error:
        raise PlanError(f"{where}: {error}") from None
    return CaptiveTest(
        name,
        speed,
        motion,
        _fins(entry.get("fins", {}), craft, where),
        periods=_count(entry, "periods", where),
        samples=_count(entry, "samples", where),
        exploratory=_flag(entry.get("exploratory", False), where),
    )


def _fins(given: Any, craft: Craft, where: str) -> tuple[float, ...]:
    names = [fin.name for fin in craft.fins]
    if not isinstance(given, dict):
        raise PlanError(
            f'{where}: fins is not a table. Write fins = {{ "{names[0] if names else "fin"}" = "10 deg" }}.'
        )
    if not given:
        return ()
    for name in given:
        if name not in names:
            raise PlanError(f"{where}: {craft.name} has no fin {name!r}. {_closest(name, names)}")
    return tuple(_number(given.get(name, 0.0), "rad", f"{where}, fin {name}") for name in names)


def _number(value: Any, unit: str, where: str) -> float:
    """SI number of a value with its unit."""
    try:
        return si(value, unit, where)
    except InputError as error:
        raise PlanError(str(error)) from None


def _count(entry: Mapping[str, Any], key: str, where: str) -> int:
    value = entry.get(key, getattr(_DEFAULT, key))
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise PlanError(f"{where}: {key} {value!r} is not a whole number above zero.")
    return value


def _flag(value: Any, where: str) -> bool:
    if not isinstance(value, bool):
        raise PlanError(f"{where}: exploratory {value!r} is neither true nor false.")
    return value


def _known(entry: Mapping[str, Any], keys: Collection[str], where: str) -> None:
    for key in entry:
        if key not in keys:
            raise PlanError(f"{where}: unknown key {key!r}. {_closest(key, keys)}")


def _closest(word: str, words: Collection[str]) -> str:
    near = difflib.get_close_matches(word, words, n=1, cutoff=0.5)
    return f"Did you mean {near[0]!r}?" if near else f"Known: {', '.join(words) or 'none'}."
