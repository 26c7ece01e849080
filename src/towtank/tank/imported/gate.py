"""The gate: files of others in, ``Run`` out. Behind it every load is in SI, body axes, about the body origin.

The order matters and is always the same: read, join, window, units, axes, inertial to body, half to whole, moment
centre, weight, buoyancy and inertia, scale. Each step adds a sentence to ``provenance["conversions"]``; what may
spoil a result goes into ``flags`` as well.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from towtank.craft.craft import Craft
from towtank.errors import InputError
from towtank.frames import Array
from towtank.plan.history import History
from towtank.plan.standard import slug
from towtank.provenance import digest, provenance
from towtank.symbols import LOADS
from towtank.tank.identity import wetted_shape
from towtank.tank.imported.convert import (
    DOUBLED,
    about_origin,
    axis_matrix,
    inertia_load,
    into_body,
    load_scale,
    motion_scale,
    point_in_body,
    refuse_half,
    static_load,
    turned,
    vanishing,
    weight_of,
    whole_of_half,
)
from towtank.tank.imported.mapping import Spec, Window
from towtank.tank.imported.moving import explained, history_of
from towtank.tank.imported.reading import read_mapping
from towtank.tank.imported.sampling import LAST, Record, averaged, free, in_periods, windowed
from towtank.tank.imported.source import columns_in_si, input_hashes, read_source
from towtank.tank.imported.table import Doubt, Table
from towtank.tank.run import Run


def import_runs(mapping: Path, files: Sequence[Path] = ()) -> tuple[Run, ...]:
    """Runs made elsewhere, as a mapping file describes them (``docs/import.md``).

    Parameters
    ----------
    mapping : TOML file of schema towtank/import/1.
    files : data files in place of those that it names: all of them for its one run, or one for each run.

    Raises
    ------
    InputError
        The mapping or a file cannot be used; with file, line or key, and what to do.
    """
    craft, _, specs = read_mapping(Path(mapping), tuple(Path(file) for file in files))
    runs = tuple(import_run(craft, spec) for spec in specs)
    refuse_twins(specs, runs)
    return runs


def import_run(craft: Craft, spec: Spec) -> Run:
    """One run of a mapping.

    Raises
    ------
    InputError
        See ``import_runs``.
    """
    table, time = read_source(spec)
    record, said = _record(spec, table, time)
    matrix = axis_matrix(spec.axes)
    history, moved = history_of(spec.motion, spec.speed, record, matrix, spec.name)
    control = np.tile(craft.virtual(spec.delta), (len(record.time), 1))
    loads, converted = _loads(spec, craft, table, record, history, control, matrix)
    checked = () if spec.steady or spec.motion.kind == "free" else explained(loads, record, spec.name)
    factor, scaled = _factors(spec, craft)
    hashes = input_hashes(spec)
    words = [*said, *moved, *checked, *converted, *scaled]
    content = [wetted_shape(craft), list(hashes.values()), replace(spec, name="", files=(), exploratory=False)]
    return Run(
        id=f"{slug(spec.name)}-{digest(content)}",
        name=spec.name,
        kind=_kind(spec),
        craft=craft.name,
        symmetry=craft.symmetry,
        level=spec.level,
        speed=spec.speed if spec.scale is None else spec.scale.speed,
        period=record.period * factor.time,
        periods=record.periods,
        density=craft.water.density,
        length=craft.length,
        origin_from_nose=craft.origin_from_nose,
        history=factor.of(history),
        delta=np.tile(spec.delta, (len(record.time), 1)),
        control=control,
        loads=loads * factor.loads,
        flags=tuple(str(text) for text in words if isinstance(text, Doubt)),
        exploratory=spec.exploratory,
        diameter=craft.diameter,
        provenance=provenance(
            hashes,
            tank="imported",
            format=spec.format,
            conversions=[str(text) for text in words],
            average=record.average,
            **({"mesh": dict(spec.mesh)} if spec.mesh else {}),
        ),
    )


def refuse_twins(specs: Sequence[Spec], runs: Sequence[Run]) -> None:
    """Refuse two runs that read the same columns of the same rows of the same files.

    Raises
    ------
    InputError
        Naming both.
    """
    seen: dict[str, str] = {}
    for spec, run in zip(specs, runs, strict=True):
        key = digest([list(run.provenance["inputs"].values()), spec.columns, spec.window, spec.sum], 32)
        if key in seen:
            raise InputError(
                f"{spec.name} and {seen[key]} read the same rows of the same file "
                f"({', '.join(run.provenance['inputs'])}). One of them is named wrongly; give each run its own file, "
                "columns or window."
            )
        seen[key] = spec.name


def _kind(spec: Spec) -> str:
    """Kind of the captive test; a straight run with a deflected fin is one of fins, as in a plan."""
    straight = spec.motion.kind in ("drift", "incidence") and not spec.motion.numbers.get("angle", 0.0)
    return "fins" if straight and not spec.motion.columns and any(spec.fins) else spec.motion.kind


def _record(spec: Spec, table: Table, time: str) -> tuple[Record, tuple[str, ...]]:
    """The part of the file that counts, in SI, along the file's axes; and what was done to get it."""
    columns, units = columns_in_si(spec, table, time)
    unsaid = spec.steady and spec.window == Window()
    rows = windowed(table, columns["time"], columns, Window(last=LAST) if unsaid else spec.window)
    clock = columns.pop("time")[rows]
    kept = {name: values[rows] for name, values in columns.items()}
    if spec.steady:
        record = averaged(clock, kept)
    elif spec.motion.kind == "free":
        record = free(table, rows, clock, kept)
    else:
        record = in_periods(table, rows, clock, kept, 2.0 * math.pi / spec.motion.numbers["frequency"])
    told = [f"window: {len(rows)} of {len(table.values)} rows"] if len(rows) < len(table.values) else []
    told += [f"the mapping names no window: the last {100 * LAST:g} % of a steady record are taken"] if unsaid else []
    return record, (*table.repairs, *units, *told, *record.said)


def _loads(
    spec: Spec, craft: Craft, table: Table, record: Record, history: History, control: Array, matrix: Array
) -> tuple[Array, tuple[str, ...]]:
    """Hydrodynamic loads (N, 6) in body axes about the origin, in the scale of the file."""
    samples = len(record.time)
    raw = np.stack([record.columns.get(name, np.zeros(samples)) for name in LOADS], axis=-1)
    there = np.array([name in record.columns for name in LOADS], dtype=float)
    lacking = "".join(name for name, had in zip(LOADS, turned(there, np.abs(matrix))[0], strict=True) if had < 0.5)
    said = [f"axes of the file: forward {spec.axes[0]}, starboard {spec.axes[1]}, down {spec.axes[2]}"]
    loads = turned(raw, matrix)
    if spec.frame == "inertial":
        _refuse_partial(spec, lacking, history)
        loads = into_body(loads, history.attitude)
        said.append("inertial axes turned into body axes by the attitude of the motion")
    if spec.half_model:
        _refuse_half(spec, craft, history, control)
        loads, doubled = whole_of_half(loads, spec.half_model), DOUBLED[spec.half_model]
        zero = "".join(name for name in LOADS if name not in doubled)
        lacking = "".join(name for name in lacking if name in doubled)
        said.append(f"half model cut at {spec.half_model}: {' '.join(doubled)} doubled, {' '.join(zero)} zero")
    said += _absent(spec, lacking, vanishing(history.nu, control, craft.symmetry))
    if spec.measured == "balance on craft":
        loads = -loads
        said.append("load of the balance on the craft: sign changed")
    loads, words = _moved(spec, craft, table, history, record, matrix, loads)
    loads, removed = _hydrodynamic(spec, history, loads)
    return loads, (*said, *words, *removed)


def _refuse_partial(spec: Spec, lacking: str, history: History) -> None:
    if spec.motion.kind == "turn":
        raise InputError(
            f"{spec.name}: a turn has no steady load along inertial axes. Export it in axes that turn with the craft, "
            "and "
            'write frame = "body".'
        )
    if lacking and np.any(history.attitude):
        raise InputError(
            f"{spec.name}: {' '.join(lacking)} are not mapped, and turning inertial axes into body axes needs all "
            "three forces and all three moments. Map them."
        )


def _refuse_half(spec: Spec, craft: Craft, history: History, control: Array) -> None:
    if craft.symmetry == "none" or (spec.half_model == "xy" and craft.symmetry == "port-starboard"):
        raise InputError(
            f"{spec.name}: half_model = {spec.half_model!r}, and {craft.name} is not symmetric about that plane "
            f"(symmetry {craft.symmetry!r}). A half of it does not tell the whole; correct the mapping or the craft."
        )
    refuse_half(spec.half_model, history.nu, control, spec.name)


def _absent(spec: Spec, lacking: str, zero: str) -> list[str]:
    """What is said of loads without a column; refuses one that is neither zero by symmetry nor declared."""
    unknown = [name for name in lacking if name not in zero and name not in spec.absent]
    if unknown:
        raise InputError(
            f"{spec.name}: no column for {', '.join(unknown)} (body axes), which a {spec.motion.kind} of this craft "
            f'brings about. Map it in [columns], or write absent = ["{unknown[0]}"] when it was not measured.'
        )
    quiet = [name for name in lacking if name in zero]
    declared = [name for name in lacking if name in spec.absent and name not in zero]
    said = [f"no column for {' '.join(quiet)}: zero by symmetry"] if quiet else []
    if declared:
        said.append(
            Doubt(f"{' '.join(declared)} not measured and taken as zero: coefficients that rest on them mean nothing")
        )
    return said


def _moved(
    spec: Spec, craft: Craft, table: Table, history: History, record: Record, matrix: Array, loads: Array
) -> tuple[Array, tuple[str, ...]]:
    """Moments moved to the body origin."""
    point = spec.moment
    if point.about_origin:
        return loads, ("moments are about the body origin in the file",)
    if spec.steady and (point.fixed == "water" or (point.fixed == "carriage" and spec.motion.kind == "turn")):
        raise InputError(
            f"{spec.name}, moment_point: a {spec.motion.kind} leaves a point fixed in the {point.fixed} behind, and "
            "an average "
            'of its moments means nothing. Take moments about a point of the craft, and write fixed = "body".'
        )
    origin = craft.origin_from_nose / (1.0 if spec.scale is None else spec.scale.length)
    if point.from_nose is not None:
        place = np.array([origin - point.from_nose, point.y, point.z])
    else:
        stated = point.point or table.moment_point
        if stated is None:
            raise InputError(
                f"{spec.name}, moment_point: no point is given and {table.title} names none. Write point = [x, y, z] "
                "in the coordinates of the file, beside nose."
            )
        place = matrix @ (np.array(stated) - np.array(point.nose)) + np.array([origin, 0.0, 0.0])
    words = (
        f"moments moved from ({place[0]:.5g}, {place[1]:.5g}, {place[2]:.5g}) m, {origin - place[0]:.5g} m aft of the "
        f"nose, to the origin, {origin:.5g} m aft of the nose"
    )
    if point.fixed == "body":
        return about_origin(loads, place), (words,)
    start = history.time[0] - record.time[0] if point.fixed == "water" else history.time
    displacement = history.position - np.outer(spec.speed * np.broadcast_to(start, history.time.shape), [1.0, 0.0, 0.0])
    arm = point_in_body(place, history.attitude, displacement)
    return about_origin(loads, arm), (f"{words}; the point is fixed in the {point.fixed}",)


def _hydrodynamic(spec: Spec, history: History, loads: Array) -> tuple[Array, tuple[str, ...]]:
    """Weight, buoyancy and inertia of the body taken out, where the file includes them."""
    body = spec.body
    if body is None:
        return loads, ()
    weight = weight_of(body.mass) if "weight" in spec.includes else 0.0
    buoyancy = weight_of(body.displaced_mass) if "buoyancy" in spec.includes else 0.0
    loads = loads - static_load(history.attitude, weight, np.array(body.cg), buoyancy, np.array(body.cb))
    if "inertia" in spec.includes:
        loads = loads + inertia_load(history.nu, history.nudot, body.mass, np.array(body.cg), np.array(body.inertia))
    return loads, (f"taken out: {', '.join(spec.includes)} of a body of {body.mass:.6g} kg",)


@dataclass(frozen=True)
class Factors:
    """From the scale of the file to full size: time, length, loads (6,), velocities (6,), accelerations (6,)."""

    time: float
    length: float
    loads: Array
    velocity: Array
    acceleration: Array

    def of(self, history: History) -> History:
        """The motion at full size."""
        return History(
            history.time * self.time,
            history.position * self.length,
            history.attitude,
            history.nu * self.velocity,
            history.nudot * self.acceleration,
        )


def _factors(spec: Spec, craft: Craft) -> tuple[Factors, tuple[str, ...]]:
    """Factors to full size and to the water of the craft, at equal prime values."""
    water = craft.water.density / spec.density
    length = 1.0 if spec.scale is None else spec.scale.length
    speed = 1.0 if spec.scale is None else spec.scale.speed / spec.speed
    time, velocity, acceleration = motion_scale(length, speed)
    loads = load_scale(length, speed, water)
    said: list[str] = []
    if spec.scale is not None:
        said.append(
            Doubt(
                f"model 1:{length:.6g} at {spec.speed:.6g} m/s brought to {spec.scale.speed:.6g} m/s at equal primes: "
                f"Reynolds number {length * speed:.4g} times that of the model in the same water; its effect is left "
                "out"
            )
        )
    if abs(water - 1.0) > 1e-9 or spec.scale is not None:
        said.append(
            f"density {spec.density:.6g} to {craft.water.density:.6g} kg/m3; forces times {loads[0]:.6g}, moments "
            f"times {loads[3]:.6g}"
        )
    return Factors(time, length, loads, velocity, acceleration), tuple(said)
