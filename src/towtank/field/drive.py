"""What drove the craft in a record, as orders of the engine tick by tick; and the record on the same ticks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towtank.engine.plan import Clock
from towtank.engine.record import Record
from towtank.errors import InputError
from towtank.field.log import FINS, MEASURED, SeaLog
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.pilot.orders import ORDERS, Orders

Mask = NDArray[np.bool_]

LONGEST_HOLD = 1.0
"""Longest hole [s] in what drove the craft that is bridged by a straight line; a longer one parts the record."""
WIDE = 1e3
"""Limits of fins [rad, rad/s] that follow measured angles: none."""


@dataclass(frozen=True)
class Drive:
    """A record on uniform ticks and the orders that drive the model through it.

    model : with fins that follow measured angles exactly where the record holds them.   measured : were they measured.
    time (N + 1,) [s] : ends of the ticks, from the first.   orders (N, len(ORDERS)) : of each tick.
    thrust [N] : of the run; the throttle multiplies it.   delta (N + 1, n) [rad] : fin angles, NaN where not measured.
    seen : channel of ``MEASURED`` -> (N + 1,), the sample nearest to each tick, NaN where there is none.
    whole (N,) : ticks in which everything that drove the craft is known.   clock : of the ticks.
    """

    model: Model
    measured: bool
    time: Array
    orders: Array
    thrust: float
    delta: Array
    seen: Mapping[str, Array]
    whole: Mask
    clock: Clock

    def record(self, first: int, last: int) -> Record:
        """Orders of the ticks ``first`` to ``last`` (left out)."""
        return Record(self.orders[first:last], np.arange(last - first), self.clock)

    def start(self, first: int, state: Array) -> Array:
        """Start (13 + n + 3,) of the engine at tick ``first`` from x y z phi theta psi u v w p q r (12,)."""
        from towtank.engine.start import at

        n = len(self.model.craft.fins)
        delta = self.delta[first] if self.measured else self.orders[first, _places(n)]
        return at(np.concatenate([state, np.nan_to_num(delta)]))


def drive_of(model: Model, log: SeaLog, *, speed: float | None = None, steps: int | None = None) -> Drive:
    """The record ``log`` as orders to ``model``, fins first: measured angles, else angles asked, else virtual angles.

    Parameters
    ----------
    speed [m/s] : set speed, whose thrust the throttle multiplies; when left out the median of the
        speed ordered, else of that measured.
    steps : RK4 steps in a tick; as many as keep a step below the model's usual one when left out.

    Source     Fins that follow the record exactly: the angle asked in a tick undoes the lag of the actuator,
               a = (d1 - g d0) / (1 - g), where g is the RK4 factor of the lag over the tick.

    Raises
    ------
    InputError
        The record holds nothing that drove the fins, or another number of them than the craft has.
    """
    tick = float(f"{_usual_step(log):.9g}")
    time = log.time[0] + tick * np.arange(round((log.time[-1] - log.time[0]) / tick) + 1)
    n = len(model.craft.fins)
    names, measured = _fins_of(log, n)
    asked, whole = _asked(model, log, names, time)
    driven = _following(model) if measured else model
    clock = Clock(tick, steps or _steps(model, tick))
    angles = np.full((len(time), n), np.nan)
    if measured:
        angles, asked = asked, _undone(model, asked, clock)
    thrust, throttle, known = _thrust(model, log, time, speed)
    orders = np.tile(np.array([float(getattr(Orders(), name)) for name in ORDERS]), (len(time) - 1, 1))
    orders[:, _places(n)] = asked[: len(time) - 1]
    orders[:, ORDERS.index("throttle")] = throttle[:-1]
    good = whole & known
    seen = {name: nearest(log.time, log[name], time, tick) for name in MEASURED if log.has(name)}
    return Drive(driven, measured, time, orders, thrust, angles, seen, good[:-1] & good[1:], clock)


def nearest(time: Array, values: Array, at: Array, tick: float) -> Array:
    """Of ``values`` (N,) at ``time`` (N,), those nearest to ``at`` (M,) within half a ``tick``, else NaN."""
    held = np.isfinite(values)
    out = np.full(len(at), np.nan)
    if not held.any():
        return out
    own, kept = time[held], values[held]
    place = np.rint((own - at[0]) / tick).astype(int)
    place = np.clip(place, 0, len(at) - 1)
    off = np.abs(own - at[place])
    order = np.argsort(-off, kind="stable")
    inside = off[order] <= 0.5 * tick * (1.0 + 1e-6)
    out[place[order][inside]] = kept[order][inside]
    return out


def bridged(time: Array, values: Array, at: Array, hold: float = LONGEST_HOLD) -> tuple[Array, Mask]:
    """``values`` (N,) at ``at`` (M,) by straight lines, and whether samples at most ``hold`` [s] apart are around."""
    held = np.isfinite(values)
    own, kept = time[held], values[held]
    if len(own) < 2:
        return np.zeros(len(at)), np.zeros(len(at), dtype=bool)
    after = np.clip(np.searchsorted(own, at), 1, len(own) - 1)
    near = np.minimum(np.abs(at - own[after]), np.abs(at - own[after - 1])) < 1e-9
    apart = (own[after] - own[after - 1] <= hold) & (at >= own[0] - hold) & (at <= own[-1] + hold)
    return np.interp(at, own, kept), apart | near


def _usual_step(log: SeaLog) -> float:
    """Median time [s] between the samples of the channel that has most of them; several clocks make a finer union.

    Orders that are held until the next one stand at every sample and do not count.
    """
    fins = [f"{word}{i + 1}" for word in ("delta", "command") for i in range(FINS)]
    own = [name for name in (*MEASURED, *fins) if log.has(name)]
    steps = [float(np.median(np.diff(log.time[np.isfinite(log[name])]))) for name in own]
    return min(steps, default=float(np.median(np.diff(log.time))))


def _fins_of(log: SeaLog, n: int) -> tuple[tuple[str, ...], bool]:
    """Channels that drove the ``n`` fins, and whether they are measured angles."""
    if n > FINS:
        raise InputError(f"log {log.name}: the craft has {n} fins, and a record is replayed on up to {FINS}.")
    for word, measured in (("delta", True), ("command", False)):
        names = tuple(f"{word}{i + 1}" for i in range(n))
        if n and log.has(*names):
            return names, measured
        if any(log.has(f"{word}{i + 1}") for i in range(FINS)):
            held = [f"{word}{i + 1}" for i in range(FINS) if log.has(f"{word}{i + 1}")]
            raise InputError(
                f"log {log.name}: it holds {', '.join(held)}; the craft has {n} fins, so {', '.join(names) or 'none'} "
                "are needed. Map one column to each fin, in the order of the craft file."
            )
    if log.has("rudder") and log.has("elevator"):
        return ("rudder", "elevator", "aileron"), False
    raise InputError(
        f"log {log.name}: it says nothing of the fins. Replay needs delta1 ... (measured), command1 ... (asked), or "
        "rudder and elevator. Name their columns in the mapping; towtank log --template shows how."
    )


def _asked(model: Model, log: SeaLog, names: tuple[str, ...], time: Array) -> tuple[Array, Mask]:
    """Angles (N + 1, n) of the fins in the record, and where they are known (N + 1,)."""
    pairs = [bridged(log.time, log[name], time) for name in names if name != "aileron" or log.has(name)]
    values, whole = np.stack([a for a, _ in pairs], axis=-1), np.all([b for _, b in pairs], axis=0)
    if names[0] == "rudder":
        values = values @ np.asarray(model.craft.mixing, dtype=float)[:, : values.shape[1]].T
    return values, whole


def _following(model: Model) -> Model:
    """``model`` with fins that go where they are told: no limit of angle or rate, no dead band, no play."""
    free: dict[str, Any] = {"max_angle": WIDE, "max_rate": WIDE, "dead_band": 0.0, "backlash": 0.0}
    fins = tuple(replace(fin, **free) for fin in model.craft.fins)
    return replace(model, craft=replace(model.craft, fins=fins))


def _undone(model: Model, angles: Array, clock: Clock) -> Array:
    """Angles (N, n) to ask for in each tick so that the fins pass through ``angles`` (N + 1, n) at its ends."""
    z = -clock.tick / clock.steps / np.array([fin.time_constant for fin in model.craft.fins])
    g = (1.0 + z + z**2 / 2.0 + z**3 / 6.0 + z**4 / 24.0) ** clock.steps
    return np.asarray((angles[1:] - g * angles[:-1]) / (1.0 - g))


def _steps(model: Model, tick: float) -> int:
    from towtank.engine.clock import clock_of

    usual = clock_of(model, model.craft.speed)
    return max(1, int(np.ceil(tick / (usual.tick / usual.steps) - 1e-9)))


def _thrust(model: Model, log: SeaLog, time: Array, speed: float | None) -> tuple[float, Array, Mask]:
    """Thrust of the run [N], its multiple at each of ``time``, and where the record says so (all, if it never does)."""
    base = float(model.thrust(speed if speed is not None else _median_speed(model, log)))
    everywhere, screw = np.ones(len(time), dtype=bool), model.constants.screw
    if log.has("thrust"):
        values, known = bridged(log.time, log["thrust"], time)
        return base, values / base, known
    if log.has("throttle"):
        return base, *bridged(log.time, log["throttle"], time)
    if log.has("revolutions"):
        n, known = bridged(log.time, log["revolutions"], time)
        usual = base / screw.force_per_square if screw else float(np.median(n * np.abs(n)))
        return base, n * np.abs(n) / (usual or 1.0), known
    if log.has("speed_order"):
        ordered, known = bridged(log.time, log["speed_order"], time)
        return base, np.array([float(model.thrust(one)) for one in ordered]) / base, known
    return base, np.ones(len(time)), everywhere


def _median_speed(model: Model, log: SeaLog) -> float:
    """Median of the speed ordered, else of the speed measured [m/s]; that of the craft where the record has neither."""
    for name in ("speed_order", "ahead", "u", "speed"):
        if log.has(name):
            return float(np.nanmedian(log[name]))
    return float(model.craft.speed)


def _places(n: int) -> list[int]:
    return [ORDERS.index(f"fin{i + 1}") for i in range(n)]
