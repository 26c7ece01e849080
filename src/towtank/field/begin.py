"""Where a replay begins: the state at one moment and the current, estimated from the record itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from towtank.errors import InputError
from towtank.field.current import Current, quasi_steady
from towtank.field.drive import Drive
from towtank.field.robust import Local, parabola
from towtank.frames import Array, rotation
from towtank.model.equations import STATE

HALF = 1.0
"""Half the width [s] of the window from which the state is taken: some periods of typical sensors, and shorter than the
motions of the craft."""
WIDEST = 10.0
"""Half the width [s] to which it grows for a sensor that is read seldom."""
LEAST = 6
"""Samples of a channel that a window needs."""


@dataclass(frozen=True)
class Beginning:
    """Where a replay begins.

    state (12,) : x y z phi theta psi u v w p q r, over ground, as in ``towtank.model.equations.STATE``.
    current (3,) [m/s, NED].   state_std (12,), current_std (3,) : standard errors, 0 where none is known.
    through (3,) : True where u, v, w are known through the water, so that another current moves them over ground.
    words : what each comes from; what could not be told is said there, and is zero.
    channels (12,) : that were measured as they stand, whose bias the state has; "" for what is told otherwise.
    """

    state: Array
    current: Array
    state_std: Array
    current_std: Array
    through: tuple[bool, bool, bool] = (False, False, False)
    words: tuple[str, ...] = ()
    channels: tuple[str, ...] = ("",) * 12


def given(state: Array, current: Array | None = None) -> Beginning:
    """The beginning that is known: ``state`` (12,) and ``current`` (3,), without error.

    Raises
    ------
    InputError
        Another number of entries.
    """
    if np.shape(state) != (12,):
        raise InputError(f"beginning: a state of shape {np.shape(state)}. Give twelve numbers: {', '.join(STATE)}.")
    flow = np.zeros(3) if current is None else np.asarray(current, dtype=float)
    return Beginning(np.asarray(state, dtype=float), flow, np.zeros(12), np.zeros(3), words=("given",))


def beginning(drive: Drive, tick: int, current: Current) -> Beginning:
    """The state at ``tick`` of a record in a ``current``.

    Every channel is a parabola in time around the moment, fitted without heed to outliers. Rates that were not measured
    follow from the attitude, heave from the rate of depth; sway and heave that nothing tells are those at which the
    model has no sway and heave acceleration. What remains is zero.

    Source     huber1964 for the weights; fossen2021, ch. 2, for the rates of Euler angles.
    Valid      Motions slower than the window of 2 ``HALF`` seconds.
    """
    found = {name: _local(drive, name, tick) for name in drive.seen}
    seen = {name: fit for name, fit in found.items() if fit is not None}
    state, std, words = np.zeros(12), np.zeros(12), []
    for i, name in enumerate(STATE[:6]):
        if name in seen:
            state[i], std[i] = seen[name].value, seen[name].std
    absent = [name for name in STATE[:6] if name not in seen]
    if current.track is not None and current.track_std is not None and {"x", "y"} & set(absent):
        state[:2], std[:2] = current.track[tick], current.track_std[tick]
        absent = [name for name in absent if name not in ("x", "y")]
        words.append("x, y: reckoned from the nearest fixes")
    if absent:
        words.append(f"{', '.join(absent)}: not measured here, zero")
    _rates(state, std, seen, words)
    through = _velocities(drive, tick, current, state, std, seen, words)
    water = ("ahead", "slip", "plunge")
    names = [name if name in seen else water[i - 6] if 6 <= i < 9 else "" for i, name in enumerate(STATE)]
    own = tuple(name if name in seen else "" for name in names)
    return Beginning(state, current.flow, std, current.std, through, tuple(words), own)


def _local(drive: Drive, name: str, tick: int) -> Local | None:
    """Channel ``name`` around ``tick``: the window grows until it holds ``LEAST`` samples."""
    values, half = drive.seen[name], HALF
    while half <= WIDEST:
        reach = int(np.ceil(half / drive.clock.tick))
        part = slice(max(0, tick - reach), tick + reach + 1)
        held = np.isfinite(values[part])
        if held.sum() >= LEAST:
            return parabola(drive.time[part][held] - drive.time[tick], values[part][held])
        half *= 1.5
    return None


def _rates(state: Array, std: Array, seen: dict[str, Local], words: list[str]) -> None:
    """p, q, r as measured, or from the rates of phi, theta, psi.

    Source     fossen2021, ch. 2: omega = T(phi, theta)^-1 of the rates of the Euler angles.
    """
    phi, theta = state[3], state[4]
    turns = np.array([seen[name].slope if name in seen else 0.0 for name in STATE[3:6]])
    errors = np.array([seen[name].slope_std if name in seen else 0.0 for name in STATE[3:6]])
    T = np.array([
        [1.0, 0.0, -np.sin(theta)],
        [0.0, np.cos(phi), np.cos(theta) * np.sin(phi)],
        [0.0, -np.sin(phi), np.cos(theta) * np.cos(phi)],
    ])  # fmt: skip
    from_attitude, spread = T @ turns, np.sqrt(T**2 @ errors**2)
    for i, name in enumerate(("p", "q", "r")):
        own = seen.get(name)
        state[9 + i], std[9 + i] = (own.value, own.std) if own else (from_attitude[i], spread[i])
        if own is None:
            angle = STATE[3 + i]
            words.append(f"{name}: from the rate of {angle}" if angle in seen else f"{name}: not measured, zero")


def _velocities(
    drive: Drive, tick: int, current: Current, state: Array, std: Array, seen: dict[str, Local], words: list[str]
) -> tuple[bool, bool, bool]:
    """u, v, w over ground; True for those known through the water."""
    J = rotation(state[3:6])
    drift = J.T @ current.flow
    through = [False, False, False]
    pairs = (("u", "ahead"), ("v", "slip"), ("w", "plunge"))
    known = [False, False, False]
    for i, (ground, water) in enumerate(pairs):
        for name, more in ((ground, 0.0), (water, drift[i])):
            if not known[i] and name in seen:
                state[6 + i], std[6 + i] = seen[name].value + more, seen[name].std
                known[i], through[i] = True, name == water
    if not known[0]:
        state[6], std[6], words_of, through[0] = _ahead(drive, current, seen, J, drift)
        words.append(words_of)
    if not known[2] and "z" in seen and abs(J[2, 2]) > 0.3:
        rate = seen["z"]
        state[8] = (rate.slope - J[2, 0] * state[6] - J[2, 1] * state[7]) / J[2, 2]
        std[8], known[2] = rate.slope_std / abs(J[2, 2]), True
        words.append("w: from the rate of depth")
    if not (known[1] and known[2]):
        v, w = quasi_steady(
            drive, np.array([tick]), state[None, 6:12] - np.concatenate([drift, np.zeros(3)]), state[None, 3:6]
        )
        for i, name, value in ((1, "v", float(v[0])), (2, "w", float(w[0]))):
            if not known[i]:
                state[6 + i], through[i] = value + drift[i], True
                words.append(f"{name}: not measured, that at which the model has no acceleration along it")
    return (through[0], through[1], through[2])


def _ahead(
    drive: Drive, current: Current, seen: dict[str, Local], J: Array, drift: Array
) -> tuple[float, float, str, bool]:
    """Surge velocity over ground where no log gives it: value, standard error, words, known through the water."""
    if "speed" in seen:
        return seen["speed"].value, seen["speed"].std, "u: the speed over ground", False
    if "x" in seen and "y" in seen:
        rates = np.array([seen["x"].slope, seen["y"].slope])
        errors = np.array([seen["x"].slope_std, seen["y"].slope_std])
        along = J[:2, 0] / max(float(np.linalg.norm(J[:2, 0])), 1e-9)
        return float(along @ rates), float(np.sqrt(along**2 @ errors**2)), "u: from the rate of position", False
    speed = drive.model.craft.speed
    return speed + float(drift[0]), 0.0, f"u: not measured, the craft's own {speed:g} m/s", True
