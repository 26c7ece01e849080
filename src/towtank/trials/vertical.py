"""Meander, and steep dive with recovery: the vertical plane with and without the pilot."""

from __future__ import annotations

import math

import numpy as np

from towtank.engine.flights import Flights
from towtank.engine.plan import Ended, Gauge, Leg, Stat, Until
from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.model.linear import linearise
from towtank.pilot.law import Pilot
from towtank.quantity import Quantity
from towtank.trials import start
from towtank.trials.ready import PITCH, SPEED, Readings, Ready, last, run_trial
from towtank.trials.start import Setting
from towtank.trials.trajectory import Trajectory

LONGEST = 40.0
"""Lengths travelled after which a leg whose mark is not reached ends the trial."""
SWING, PERIODS = 12.0, 0.75
"""A meander ends when no further turn of the pitch comes in so many lengths or periods, whichever is more."""
SWINGS = 4
"""Turns of the pitch that are waited for."""
SLOW = 3.0
"""Time of a dive as a multiple of what the ordered pitch takes, beside ``LONGEST``."""
STEEPEST = math.radians(60.0)
DIVE_DEPTH = 2.0
"""Lengths by which the depth changes before the recovery is ordered."""
LEVELLED = 10.0
"""Lengths travelled after a recovery under the pilot, in which the pitch settles."""

_PITCH, _DEPTH = Gauge("theta"), Gauge("z")
_ORDINAL = ("first", "second", "third")


def meander(
    model: Model,
    elevator: Quantity = "10 deg",
    pitch: Quantity = "5 deg",
    speed: Quantity | None = None,
    *,
    hold_course: bool = True,
    pilot: Pilot | None = None,
) -> Trajectory:
    """Elevator put over until the pitch has changed by ``pitch``, then back at trim: the craft swings freely.

    Parameters
    ----------
    elevator : from trim; text with a unit or radians, SNAME sign: positive puts the nose down.   pitch : execute angle,
        from trim.   speed : approach speed.   hold_course : the pilot holds the heading and damps roll.

    Indices: time to the execute angle [s]; pitch overshoot beyond it [deg]; time from the neutral elevator until the
    pitch has fallen to half the execute angle, and until it is back at trim [s]; the pitch from trim where it turns:
    first, second and third excursion [deg], positive to the first side; period [s] and damping ratio; largest change of
    depth [m]; period and damping ratio of the linear model. A craft whose pitch comes back without a swing has no
    period. One whose pitch does not come back is not stable at this speed; the status says so.

    Source     arentzenmandel1960: definitive manoeuvres of submarines. The damping ratio is that of the logarithmic
               decrement of half a period, from the distances between the first three excursions.
    Departure  Distances between excursions, not from trim, since the swing is laid over a slow return of the pitch.

    Raises
    ------
    InputError
        An angle of zero, an elevator beyond the fins, a pitch beyond 60 deg, or no unit.
    """
    return run_trial(model, meander_ready(model, elevator, pitch, speed, hold_course, pilot))


def meander_ready(
    model: Model,
    elevator: Quantity = "10 deg",
    pitch: Quantity = "5 deg",
    speed: Quantity | None = None,
    hold_course: bool = True,
    pilot: Pilot | None = None,
) -> Ready:
    """The meander, ready to fly; arguments as in ``meander``."""
    control, execute = _control(model, elevator), _pitch(pitch, "pitch")
    s = start.setting(model, speed, pilot, piloted=hold_course)
    side, (period, ratio) = _side(model, control), _linear(model, s.speed)
    turn = max(SWING * s.convective, PERIODS * period if math.isfinite(period) else 0.0)
    over = s.orders(elevator=s.trim.elevator + control, steer=float(hold_course))
    free = s.orders(steer=float(hold_course))
    legs = [Leg("execute", over, LONGEST * s.convective, Until("theta", s.trim.pitch + side * execute), required=True)]
    legs += [Leg(f"swing {i + 1}", free, turn, Until("q", 0.0), required=True) for i in range(SWINGS)]
    return Ready(
        name=f"meander-{np.degrees(control):g}-{np.degrees(execute):g}", kind="meander", loop="open", setting=s,
        legs=tuple(legs), interval=s.convective / 20.0,
        gauges=(_DEPTH, Gauge("theta", s.trim.pitch), Gauge("theta", s.trim.pitch + 0.5 * side * execute)),
        read=lambda flights: _swings(flights, s, side, execute),
        status=lambda flights: _meandered(flights, s, side, execute),
        alone={"period_linear": (period, "s"), "damping_ratio_linear": (ratio, "")},
    )  # fmt: skip


def steep_dive(
    model: Model,
    pitch: Quantity = "30 deg",
    depth: Quantity | None = None,
    speed: Quantity | None = None,
    *,
    elevator: Quantity | None = None,
    pilot: Pilot | None = None,
) -> Trajectory:
    """Dive at a steep pitch, then recovery: how far depth and pitch go on, and what it costs in speed.

    The pilot dives at the ordered pitch until the depth has changed by ``depth`` and then levels. With an ``elevator``
    it is the vertical overshoot test, open loop: that elevator until the pitch has changed by ``pitch``, then the
    opposite one until the depth no longer changes.

    Parameters
    ----------
    pitch : angle of the dive, text with a unit or radians: positive dives, negative climbs.   depth : change of depth
        at which the recovery is ordered, [m] or text; 2 lengths when not given.   speed : approach speed.
    elevator : angle from trim, without sign.

    Indices: time from the execute to the recovery [s]; change of depth [m] until then; pitch overshoot beyond the angle
    [deg]; depth overshoot from the order to recover until the depth no longer changes [m], in lengths, and its time
    [s]; under the pilot the pitch overshoot of the recovery [deg]; pitch reached [deg]; lowest and highest speed [m/s].

    Source     arentzenmandel1960: overshoot manoeuvre in the vertical plane.

    Raises
    ------
    InputError
        A pitch of zero or beyond 60 deg, an elevator of zero or beyond the fins, a depth that is not positive.
    """
    return run_trial(model, steep_dive_ready(model, pitch, depth, speed, elevator, pilot))


def steep_dive_ready(
    model: Model,
    pitch: Quantity = "30 deg",
    depth: Quantity | None = None,
    speed: Quantity | None = None,
    elevator: Quantity | None = None,
    pilot: Pilot | None = None,
) -> Ready:
    """The steep dive, ready to fly; arguments as in ``steep_dive``."""
    dive = start.angle(pitch, "pitch", STEEPEST, "beyond which the heading has no meaning to the pilot")
    if dive == 0.0:
        raise InputError('pitch: 0 deg is no dive. Give an angle such as "30 deg"; a negative one climbs.')
    far = DIVE_DEPTH * model.craft.length if depth is None else start.span(depth, model.craft.length, "depth")
    if far <= 0.0:
        raise InputError(f"depth {far:g} m: the change of depth before the recovery. Give a positive one.")
    control = None if elevator is None else _control(model, elevator)
    s, side = start.setting(model, speed, pilot), math.copysign(1.0, dive)
    wait = LONGEST * s.convective
    if control is None:
        legs = _piloted(s, dive, side * far, wait + SLOW * far / (s.speed * abs(math.sin(dive))))
    else:
        legs = _over(s, dive, math.copysign(control, -side * _side(model, 1.0)), wait)
    return Ready(
        name=f"steep-dive-{np.degrees(dive):g}deg" + ("" if control is None else "-open"), kind="steep dive",
        loop="closed" if control is None else "open", setting=s, legs=legs, interval=s.convective / 16.0,
        gauges=(_PITCH, _DEPTH), read=lambda flights: _dived(flights, s, dive, model.craft.length),
        status=lambda flights: _dive_status(flights, s, dive, far),
    )  # fmt: skip


def _control(model: Model, elevator: Quantity) -> float:
    control = start.angle(elevator, "elevator", start.fin_limit(model), "the limit of the fins")
    if control == 0.0:
        raise InputError('elevator: 0 deg moves nothing. Give an angle such as "10 deg".')
    return control


def _pitch(pitch: Quantity, where: str) -> float:
    execute = start.angle(pitch, where, STEEPEST, "beyond which a meander is a loop")
    if execute <= 0.0:
        raise InputError(f"{where} {pitch}: the execute angle counts from trim to either side. Give a positive one.")
    return execute


def _side(model: Model, control: float) -> float:
    """Sense of the pitch that an elevator angle gives."""
    return float(np.sign((model.derivatives["Muude"] or -1.0) * control))


def _linear(model: Model, speed: float) -> tuple[float, float]:
    """Period [s] and damping ratio of the slowest swing in the vertical plane; NaN where nothing swings.

    Source     Eigenvalues of w, q, theta in the linear model about level flight.
    """
    values = linearise(model, speed).part(("w", "q", "theta"), ("elevator",)).eigenvalues
    swinging = values[values.imag > 1e-9 * np.abs(values)]
    if not len(swinging):
        return math.nan, math.nan
    slowest = swinging[np.argmin(swinging.imag)]
    return float(2.0 * math.pi / slowest.imag), float(-slowest.real / abs(slowest))


def _swings(flights: Flights, s: Setting, side: float, execute: float) -> Readings:
    begin = flights.when("execute")
    over = flights.over(PITCH, Stat.HIGH) > STEEPEST
    first, second, third = (
        np.where(over, np.nan, side * (flights.at(f"swing {i}", "theta") - s.trim.pitch)) for i in (1, 2, 3)
    )
    depth, back, half = flights.gauges[-3:]
    with np.errstate(all="ignore"):
        decrement = np.log((first - second) / (third - second))
    depths = [np.abs(flights.over(depth, stat) - s.state[2]) for stat in (Stat.LOW, Stat.HIGH)]
    return {
        "time_to_execute": (begin, "s"),
        "pitch_overshoot": (np.degrees(np.maximum(first - execute, 0.0)), "deg"),
        "time_to_half_pitch": (flights.stat("swing 2", half, Stat.FIRST) - begin, "s"),
        "time_to_return": (flights.stat("swing 2", back, Stat.FIRST) - begin, "s"),
        **{f"{n}_excursion": (np.degrees(e), "deg") for n, e in zip(_ORDINAL, (first, second, third), strict=True)},
        "period": (np.where(over, np.nan, flights.when("swing 3") - flights.when("swing 1")), "s"),
        "damping_ratio": (decrement / np.hypot(decrement, math.pi), ""),
        "depth_excursion": (np.maximum(*depths), "m"),
    }


def _farthest(flights: Flights, leg: str, s: Setting, side: float) -> Array:
    """Largest pitch (N,) [rad] from trim to ``side`` in a leg."""
    return side * (flights.stat(leg, _PITCH, Stat.HIGH if side > 0.0 else Stat.LOW) - s.trim.pitch)


def _meandered(flights: Flights, s: Setting, side: float, execute: float) -> str | None:
    unstable = s.trim.why or f"the craft is not stable in pitch at {s.speed:g} m/s"
    if flights.over(PITCH, Stat.HIGH)[0] > STEEPEST:
        most = np.degrees(STEEPEST)
        return f"ended early: with the elevator at its trim the pitch went beyond {most:.0f} deg; {unstable}"
    if flights.ended[0] != Ended.LATE:
        return None
    stood = float(side * (last(flights, "theta")[0] - s.trim.pitch))
    late = flights.legs[int(np.count_nonzero(~np.isnan(flights.mark_time[0]))) - 1]
    if late.name == "execute":
        return (
            f"ended early: did not respond. The pitch changed by {np.degrees(stood):.2g} deg of the "
            f"{np.degrees(execute):g} deg wanted in {late.within:.0f} s; {_weak(s)}"
        )
    if stood > execute:
        return (
            f"ended early: with the elevator at its trim the pitch stood {np.degrees(stood):.3g} deg off after "
            f"{late.within:.0f} s and does not come back; {unstable}"
        )
    return None


def _piloted(s: Setting, dive: float, depth: float, within: float) -> tuple[Leg, ...]:
    """Dive at the pitch until the depth has changed, level until it no longer changes, and on.

    The pilot's elevator trim holds the trimmed pitch, from which an order counts.
    """
    down = s.orders(steer=1.0, dive=1.0, pitching=1.0, pitch=-dive)
    level = s.orders(steer=1.0, dive=1.0, pitching=1.0, pitch=0.0)
    return (
        Leg("dive", down, within, Until("z", depth), required=True),
        Leg("recover", level, LONGEST * s.convective, Until("sink", 0.0), required=True),
        Leg("level", level, LEVELLED * s.convective),
    )


def _over(s: Setting, dive: float, elevator: float, within: float) -> tuple[Leg, ...]:
    """Elevator over until the pitch is reached, then the opposite one until the depth no longer changes."""
    down, up = (s.orders(steer=1.0, elevator=s.trim.elevator + sign * elevator) for sign in (1.0, -1.0))
    return (
        Leg("dive", down, within, Until("theta", s.trim.pitch - dive), required=True),
        Leg("recover", up, within, Until("sink", 0.0), required=True),
    )


def _dived(flights: Flights, s: Setting, dive: float, length: float) -> Readings:
    side = math.copysign(1.0, dive)
    names = [leg.name for leg in flights.legs]
    steepest = np.fmax.reduce([_farthest(flights, name, s, -side) for name in ("dive", "recover")])
    at = side * (flights.at("dive", "z") - s.state[2])
    on = side * (flights.at("recover", "z") - flights.at("dive", "z"))
    out: dict[str, tuple[Array, str]] = {
        "time_to_execute": (flights.when("dive"), "s"),
        "depth_of_dive": (at, "m"),
        "pitch_reached": (np.degrees(steepest), "deg"),
        "pitch_overshoot": (np.degrees(np.maximum(steepest - abs(dive), 0.0)), "deg"),
        "depth_overshoot": (on, "m"),
        "depth_overshoot_lengths": (on / length, ""),
        "time_to_check_depth": (flights.when("recover") - flights.when("dive"), "s"),
    }
    if "level" in names:
        beyond = np.fmax.reduce([_farthest(flights, name, s, side) for name in ("recover", "level")])
        out["recovery_pitch_overshoot"] = (np.degrees(np.maximum(beyond, 0.0)), "deg")
    slow, fast = (flights.over(SPEED, stat) for stat in (Stat.LOW, Stat.HIGH))
    return {**out, "lowest_speed": (slow, "m/s"), "highest_speed": (fast, "m/s")}


def _dive_status(flights: Flights, s: Setting, dive: float, far: float) -> str | None:
    if flights.ended[0] != Ended.LATE:
        return None
    late = flights.legs[int(np.count_nonzero(~np.isnan(flights.mark_time[0]))) - 1]
    side = math.copysign(1.0, dive)
    pitch = float(-side * np.degrees(last(flights, "theta")[0] - s.trim.pitch))
    depth = float(side * (last(flights, "z")[0] - s.state[2]))
    why = _weak(s)
    if depth < 0.0 and s.trim.holds:
        why += ", and the depth changes the other way: the speed is below the inversion speed of the elevator"
    if late.name == "dive":
        wanted = f" of {far:.3g} m" if s.pilot and flights.legs[0].orders.pitching else ""
        return (
            f"ended early: did not respond. After {late.within:.0f} s the pitch is {pitch:.3g} deg of the "
            f"{abs(np.degrees(dive)):g} deg ordered and the depth has changed by {depth:.3g} m{wanted}; {why}"
        )
    return (
        f"ended early: did not recover. {late.within:.0f} s after the order the depth has changed by {depth:.3g} m and "
        f"still changes at a pitch of {pitch:.3g} deg; {s.trim.why or 'the elevator does not level the craft'}"
    )


def _weak(s: Setting) -> str:
    """Why an elevator does not turn a craft, in words."""
    return s.trim.why or "the elevator is too weak against the righting moment"
