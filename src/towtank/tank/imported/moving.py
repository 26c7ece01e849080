"""The motion of an imported run: from its definition, or from columns of the file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, cast

import numpy as np

from towtank.errors import InputError
from towtank.frames import Array, rotation
from towtank.plan.history import History
from towtank.plan.kinds import Motion as Moved
from towtank.plan.motion import KINDS
from towtank.symbols import LOADS, RATES
from towtank.tank.imported.convert import turned, turned_attitude
from towtank.tank.imported.mapping import Motion
from towtank.tank.imported.sampling import Record
from towtank.tank.imported.table import Doubt

HARMONICS = 8
"""Highest harmonic of a measured motion that is differentiated. The path of a PMM is a sinusoid; at a heading of 20 deg
the ninth harmonic of the heading is below 1e-6 of the first, and noise above it would be multiplied."""

PHASE_REFUSED = math.radians(20.0)
"""Departure of a measured from a stated phase [rad] beyond which one of them is wrong: a third of the damping
would pass into added mass."""

PHASE_SAID = math.radians(1.0)
"""Departure of a measured from a stated phase [rad] that is remarked on: 2 % of an added-mass load in the damping."""

AMPLITUDE_SAID, AMPLITUDE_REFUSED = 0.02, 0.2
"""Departure of a measured from a stated amplitude, as a share, that is remarked on, and that is refused."""

EXPLAINED_REFUSED, EXPLAINED_SAID = 0.2, 0.8
"""Share of the variance of the largest load that harmonics 0 to 4 of the stated frequency explain: below the first the
frequency is taken for wrong, below the second it is remarked on."""

_DRIVEN = {"surge": "x", "sway": "y", "yaw": "y", "heave": "z", "pitch": "z", "roll": "phi"}
_DOTS = tuple(f"{rate}dot" for rate in RATES)


def defined(motion: Motion, speed: float) -> Moved:
    """The motion of ``plan.motion`` that the mapping defines, in the scale of the file."""
    make = cast(Any, KINDS[motion.kind])
    return cast(Moved, make(speed, **motion.numbers))


def history_of(
    motion: Motion, speed: float, record: Record, matrix: Array, where: str
) -> tuple[History, tuple[str, ...]]:
    """History (N samples) in body axes, in the scale of the file, and what was found and done.

    matrix (3, 3) : from the file's axes to body axes.

    Raises
    ------
    InputError
        Columns that do not determine a motion, or contradict the one stated.
    """
    if motion.columns:
        return _from_columns(motion, speed, record, matrix, where)
    moved = defined(motion, speed)
    if moved.period == 0.0:
        return moved.history(record.time), ()
    shift = motion.phase / (2.0 * math.pi) * moved.period
    said = _compared(motion, record, matrix, where)
    return moved.history(record.time + shift), said


def _compared(motion: Motion, record: Record, matrix: Array, where: str) -> tuple[str, ...]:
    """Compare the stated sinusoid with a column of the driven displacement, where the file has one."""
    name = _DRIVEN[motion.kind]
    axis = "xyz".index(name) if name in "xyz" else 0
    source = int(np.argmax(np.abs(matrix[axis])))
    key, sign = ("xyz"[source] if name in "xyz" else ("phi", "theta", "psi")[source]), float(matrix[axis, source])
    if key not in record.columns or (name == "x" and motion.place == "water"):
        return (f"phase {math.degrees(motion.phase):.4g} deg taken as stated: no column of {key} to compare it with",)
    w = 2.0 * math.pi / record.period
    first = sign * 2.0 * np.mean(record.columns[key][:-1] * np.exp(-1j * w * record.time[:-1]))
    stated = motion.numbers["amplitude"] * np.exp(1j * (motion.phase - 0.5 * math.pi))
    if abs(first) == 0.0:
        raise InputError(f"{where}: the column of {key} does not move, and the mapping states a {motion.kind} of it.")
    turn, size = float(np.angle(first / stated)), float(abs(first) / abs(stated)) - 1.0
    words = (
        f"measured {key}: phase {math.degrees(turn):+.3g} deg and amplitude {100 * size:+.3g} % of the stated motion"
    )
    if abs(turn) > PHASE_REFUSED or abs(size) > AMPLITUDE_REFUSED:
        raise InputError(
            f"{where}: {words}. Beyond {math.degrees(PHASE_REFUSED):.0f} deg or {100 * AMPLITUDE_REFUSED:.0f} % "
            "damping and added mass are mixed up; correct phase, amplitude, axes or unit, or take the motion from "
            "columns."
        )
    if abs(turn) <= PHASE_SAID and abs(size) <= AMPLITUDE_SAID:
        return (words,)
    limits = f"limits {math.degrees(PHASE_SAID):g} deg, {100 * AMPLITUDE_SAID:g} %"
    return (Doubt(f"{words} ({limits}): the stated motion is used"),)


def explained(loads: Array, record: Record, where: str) -> tuple[str, ...]:
    """Check the stated frequency against the largest load: ``loads`` (N, 6) of an oscillation.

    Raises
    ------
    InputError
        The loads do not vary, or do not follow the stated frequency.
    """
    varying = loads[:-1] - loads[:-1].mean(axis=0)
    power = (varying**2).sum(axis=0)
    if not power.max() > 1e-24 * max(float((loads**2).sum()), 1e-300):
        raise InputError(
            f"{where}: no load varies over {record.periods} periods of {record.period:.5g} s. The file is of a steady "
            "run, or columns of other quantities are mapped."
        )
    largest = int(np.argmax(power))
    values = varying[:, largest]
    spectrum = np.abs(np.fft.rfft(values)) ** 2
    spectrum[1 : (len(values) + 1) // 2] *= 2.0
    at = record.periods * np.arange(1, 5)
    share = float(spectrum[at[at < len(spectrum)]].sum() / spectrum.sum())
    words = f"harmonics of {record.period:.5g} s explain {100 * share:.3g} % of the variance of {LOADS[largest]}"
    if share < EXPLAINED_REFUSED:
        raise InputError(
            f"{where}: {words}, less than {100 * EXPLAINED_REFUSED:.0f} %. The loads do not follow the stated "
            "frequency: check rad/s against Hz, the unit of time, and that the file is of this run."
        )
    return (Doubt(f"{words} (limit {100 * EXPLAINED_SAID:.0f} %)") if share < EXPLAINED_SAID else words,)


def _from_columns(
    motion: Motion, speed: float, record: Record, matrix: Array, where: str
) -> tuple[History, tuple[str, ...]]:
    columns, said = record.columns, ["motion taken from columns"]
    attitude = turned_attitude(_stack(columns, ("phi", "theta", "psi"), len(record.time)), matrix)
    position = _position(columns, motion, speed, record, matrix)
    if not set(RATES) & set(columns):
        if position is None and not np.any(attitude):
            raise InputError(f"{where}: columns of accelerations only. Map velocities, or positions and angles.")
        if set(_DOTS) & set(columns):
            raise InputError(f"{where}: columns of accelerations without velocities. Map the velocities too.")
        position = np.outer(record.time * speed, [1.0, 0.0, 0.0]) if position is None else position
        nu = _velocities(position, attitude, speed, record, motion.kind)
        said.append("velocities and accelerations are time derivatives of positions and angles")
        return _moved(record, position, attitude, nu, _derivative(nu, record, motion.kind)), tuple(said)
    along = _stack(columns, RATES, len(record.time))
    ahead = int(np.argmax(np.abs(matrix[0])))
    if RATES[ahead] not in columns:
        along[:, ahead] = speed * matrix[0, ahead]
        said.append(f"no column of the speed ahead: u = {speed:g} m/s")
    nu = turned(along, matrix)
    if not {"phi", "theta", "psi"} & set(columns) and bool(np.any(nu[:, 3:])):
        attitude = _integrated_angles(nu, record, where)
        said.append("attitude integrated from the rates about a mean of zero")
    if position is None:
        position = _integral(np.einsum("nij,nj->ni", rotation(attitude), nu[:, :3]), record.time)
        said.append("position integrated from the velocities")
    dots = _derivative(along, record, motion.kind)
    for i, name in enumerate(_DOTS):
        dots[:, i] = columns.get(name, dots[:, i])
    if differentiated := [rate for rate in RATES if rate in columns and f"{rate}dot" not in columns]:
        said.append(f"accelerations are time derivatives of {', '.join(differentiated)}")
    return _moved(record, position, attitude, nu, turned(dots, matrix)), tuple(said)


def _moved(record: Record, position: Array, attitude: Array, nu: Array, nudot: Array) -> History:
    """A history; that of a steady record has no accelerations."""
    return History(record.time, position, attitude, nu, nudot if record.period else np.zeros_like(nudot))


def _stack(columns: Mapping[str, Array], names: tuple[str, ...], samples: int) -> Array:
    return np.stack([columns.get(name, np.zeros(samples)) for name in names], axis=-1)


def _position(
    columns: Mapping[str, Array], motion: Motion, speed: float, record: Record, matrix: Array
) -> Array | None:
    """Position (N, 3) [m] of the origin in water at rest, NED, or None without columns of it."""
    if not {"x", "y", "z"} & set(columns):
        return None
    position = _stack(columns, ("x", "y", "z"), len(record.time)) @ matrix.T
    if motion.place == "carriage":
        position[:, 0] += speed * record.time
    return np.asarray(position)


def _velocities(position: Array, attitude: Array, speed: float, record: Record, kind: str) -> Array:
    """Body velocities (N, 6) of a measured path; the steady way ahead is taken off before it is expanded."""
    ahead = np.array([speed, 0.0, 0.0])
    velocity = _derivative(position - np.outer(record.time, ahead), record, kind) + ahead
    phi, theta, _ = attitude.T
    dphi, dtheta, dpsi = _derivative(attitude, record, kind).T
    rates = np.stack(
        [
            dphi - dpsi * np.sin(theta),
            dtheta * np.cos(phi) + dpsi * np.cos(theta) * np.sin(phi),
            dpsi * np.cos(theta) * np.cos(phi) - dtheta * np.sin(phi),
        ],
        axis=-1,
    )
    return np.concatenate([np.einsum("nji,nj->ni", rotation(attitude), velocity), rates], axis=1)


def _derivative(values: Array, record: Record, kind: str) -> Array:
    """Time derivative (N, k): of a Fourier series over whole periods, or of a quintic spline for a free motion."""
    if record.period == 0.0:
        return np.zeros_like(values)
    if kind == "free":
        from scipy.interpolate import make_interp_spline

        return np.asarray(make_interp_spline(record.time, values, k=5).derivative()(record.time))
    count = len(values) - 1
    spectrum = np.fft.rfft(values[:-1], axis=0)
    order = np.arange(len(spectrum))
    w = 2.0 * math.pi / (record.periods * record.period)
    keep = (order <= HARMONICS * record.periods) & (order < count / 2)
    series = np.fft.irfft(spectrum * (1j * w * order * keep)[:, None], n=count, axis=0)
    return np.concatenate([series, series[:1]])


def _integral(values: Array, time: Array) -> Array:
    steps = 0.5 * (values[1:] + values[:-1]) * np.diff(time)[:, None]
    return np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(steps, axis=0)])


def _integrated_angles(nu: Array, record: Record, where: str) -> Array:
    """Angles (N, 3) [rad] whose rate is that of the one axis the body turns about."""
    turning = np.flatnonzero(np.abs(nu[:, 3:]).max(axis=0) > 0.0)
    if len(turning) > 1:
        raise InputError(
            f"{where}: the body turns about {len(turning)} axes and no column holds its attitude. Map phi, theta, psi."
        )
    angles = _integral(nu[:, 3:], record.time)
    return np.asarray(angles - (0.0 if record.period == 0.0 else angles[:-1].mean(axis=0)))
