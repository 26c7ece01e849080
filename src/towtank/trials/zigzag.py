"""Zigzag, in the horizontal plane with the rudder or in the vertical plane with the elevator."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from towtank.errors import InputError
from towtank.model.equations import Model
from towtank.pilot.helm import Helm
from towtank.pilot.law import Pilot
from towtank.quantity import Quantity
from towtank.trials import start
from towtank.trials.integrate import Event, Flight, Leg, free_run
from towtank.trials.outcome import crossing, peak, trajectory
from towtank.trials.trajectory import Trajectory

LONGEST = 25.0
"""Lengths travelled after which a leg whose execute angle is not reached ends the trial."""
EXECUTES = 4


@dataclass(frozen=True)
class _Plane:
    """What swings: column of its angle in the state, the control that swings it, the derivative, the word for it."""

    column: int
    control: str
    effect: str
    word: str


_PLANES = {
    "horizontal": _Plane(5, "rudder", "Nuudr", "heading"),
    "vertical": _Plane(4, "elevator", "Muude", "pitch"),
}


@dataclass(frozen=True)
class _Swing:
    """The trial in numbers: control angle, execute angle, trimmed control and angle [rad], side of the first swing."""

    plane: _Plane
    control: float
    execute: float
    neutral: float
    trimmed: float
    side: float


def zigzag(
    model: Model,
    angle: Quantity = "10 deg",
    heading: Quantity = "10 deg",
    speed: Quantity | None = None,
    *,
    plane: str = "horizontal",
    hold_depth: bool = True,
    pilot: Pilot | None = None,
) -> Trajectory:
    """Control put over to alternate sides each time the heading (or pitch) has swung to the execute angle.

    Parameters
    ----------
    angle : rudder or elevator; text with a unit or radians. SNAME sign: the first execute is to port (or nose down)
        when positive.   heading : execute angle of heading, or of pitch from its trimmed value.
    plane : "horizontal" or "vertical"; the elevator angle counts from trim.
    hold_depth : in the horizontal plane, depth held and roll damped by the pilot; see ``turning_circle``. In the
        vertical plane the heading is held by the pilot instead.

    Indices: first and second overshoot [deg], initial turning time (execute to the execute angle), time to check the
    first swing, reach, period [s]. NaN where the craft did not get that far; the status then says why.

    Source     ittc75040201, zigzag test.

    Raises
    ------
    InputError
        Another plane; an angle of zero, beyond the fins, or without a unit.
    """
    if plane not in _PLANES:
        raise InputError(f'plane {plane!r}: a zigzag is "horizontal" (rudder) or "vertical" (elevator).')
    swings = _PLANES[plane]
    control = start.angle(angle, "angle", start.fin_limit(model), "the limit of the fins")
    execute = start.angle(heading, "heading", np.radians(60.0), "beyond which a zigzag is a turning circle")
    if control == 0.0 or execute <= 0.0:
        raise InputError(f"zigzag {angle}/{heading}: both angles must differ from zero, the execute angle positive.")
    s = start.setting(model, speed, pilot, piloted=hold_depth)
    vertical = plane == "vertical"
    effect = model.derivatives[swings.effect] or -1.0
    swing = _Swing(
        swings,
        control,
        execute,
        s.trim.elevator if vertical else 0.0,
        s.trim.pitch if vertical else 0.0,
        float(np.sign(effect * control)),
    )
    if vertical:
        base = replace(s.helm, heading=0.0 if hold_depth else None)
    else:
        base = replace(s.helm, depth=0.0 if hold_depth else None)
    base = base if hold_depth else replace(base, pilot=None)
    flight = free_run(
        model, s.state, _legs(swing, base, LONGEST * s.convective), thrust=s.thrust, interval=s.convective / 20.0
    )
    name = f"zigzag-{abs(np.degrees(control)):g}-{np.degrees(execute):g}" + ("-vertical" if vertical else "")
    return trajectory(
        model, s, flight, name=name, kind=f"zigzag, {plane}", loop="open",
        indices=_indices(swing, flight), status=_status(swing, flight),
    )  # fmt: skip


def _legs(swing: _Swing, base: Helm, within: float) -> list[Leg]:
    """One leg per execute; the last ends when the angle is back at its start."""
    legs = []
    for i in range(EXECUTES + 1):
        sign = -1.0 if i % 2 else 1.0
        order = swing.neutral + sign * swing.control
        helm = replace(base, rudder=order) if swing.plane.control == "rudder" else replace(base, elevator=order)
        goal = swing.trimmed + (0.0 if i == EXECUTES else sign * swing.side * swing.execute)
        legs.append(Leg(f"swing {i + 1}", helm, within, passing(swing.plane.column, goal), required=True))
    return legs


def passing(column: int, level: float) -> Event:
    """Event when a state passes ``level``."""

    def event(y: Sequence[float]) -> float:
        return y[column] - level

    return event


def _status(swing: _Swing, flight: Flight) -> str | None:
    late = next((i for i in range(EXECUTES + 1) if flight.mark(f"swing {i + 1}") is None), None)
    if late is None:
        return None
    inside = flight.within(f"swing {late + 1}")
    values = np.degrees(flight.state[inside, swing.plane.column] - swing.trimmed)
    far = values[np.argmax(np.abs(values))] if len(values) else 0.0
    word, wanted = swing.plane.word, np.degrees(swing.execute)
    if late == 0:
        return (
            f"ended early: did not respond. {word} changed by {far:.2g} deg of the {wanted:g} deg wanted in "
            f"{LONGEST:g} lengths; the {swing.plane.control} is too weak against the craft's own moments"
        )
    return (
        f"ended early: after execute {late + 1} the {word} stood at {values[-1]:.3g} deg and did not come back in "
        f"{LONGEST:g} lengths; the craft does not answer this {swing.plane.control} angle"
    )


def _indices(swing: _Swing, flight: Flight) -> dict[str, tuple[float, str]]:
    """Times [s] from the first execute, overshoots [deg]."""
    marks = [flight.mark(f"swing {i + 1}") for i in range(EXECUTES + 1)]
    angle = np.degrees(flight.state[:, swing.plane.column] - swing.trimmed) * swing.side
    wanted = float(np.degrees(swing.execute))
    nan = float("nan")
    out: dict[str, tuple[float, str]] = {"initial_turning_time": (marks[0].time if marks[0] else nan, "s")}
    for i, word in ((0, "first"), (1, "second")):
        begin, end = marks[i], marks[i + 1]
        height, time = nan, nan
        if begin is not None and end is not None:
            inside = flight.within(f"swing {i + 2}")
            time, height = peak(flight.time[inside], (-angle if i else angle)[inside])
        out[f"{word}_overshoot"] = (max(height - wanted, 0.0) if height == height else nan, "deg")
        out[f"time_to_check_{word}"] = (time - begin.time if begin and time == time else nan, "s")
    back = flight.within("swing 2")
    out["reach"] = (crossing(flight.time[back], angle[back], 0.0) if marks[1] else nan, "s")
    out["period"] = (marks[3].time - marks[1].time if marks[1] and marks[3] else nan, "s")
    return out
