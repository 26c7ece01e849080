"""What a pilot is tuned on: steps of heading and depth at some speeds, of the craft and of a few drawn like it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from towtank.engine.clock import clock_of
from towtank.engine.plan import Leg, Log
from towtank.engine.record import Record, record_of
from towtank.engine.run import fly
from towtank.engine.slopes import sensitivities
from towtank.engine.start import at
from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.algebra import MATH
from towtank.model.equations import Model
from towtank.model.linear import elevator_reversal_speed
from towtank.montecarlo.draw import draw
from towtank.pilot.design import CONTROL_SHARE, DEPTH_ERROR, HEADING_ERROR, ROLL_ERROR
from towtank.pilot.law import Pilot, schedule
from towtank.pilot.sensors import EXACT
from towtank.trials.start import Setting, setting

SEEN = ("psi", "z", "phi")
"""Channels that should follow their order; the fins come after them."""


ASKEW = np.radians(1.0)
"""Error [rad] of rudder and elevator that the trims do not know at the start: a misaligned fin, a wrong ballast. It is
what the integrals are for; its sign changes from craft to craft."""
QUICK = 0.25
"""Lengths travelled in which fins that move by a third of their range count one."""


@dataclass(frozen=True)
class Step:
    """New orders of heading [rad] and depth [lengths], flown over ``lengths``."""

    heading: float
    depth: float
    lengths: float


STEPS: dict[str, Step] = {
    "heading-step": Step(np.radians(30.0), 0.0, 25.0),
    "depth-step": Step(0.0, 1.0 / 3.0, 45.0),
    "both": Step(np.radians(-20.0), -1.0 / 3.0, 45.0),
    "hard": Step(np.radians(90.0), 1.0, 45.0),
}
"""Trials on offer: the standard steps, one of both together, and one of both that takes fins to their limits."""
USUAL = ("heading-step", "depth-step", "both")
"""Trials flown unless told otherwise."""


@dataclass(frozen=True)
class Case:
    """One flight of one craft.

    name, speed [m/s], craft : what it is; craft 0 is the best estimate.   model, setting, record : of the flight.
    wanted (3 + n,) : orders of ``SEEN`` and fin angles of level flight.   scale (3 + n,) : sizes that count one each.
    rate [rad/s] : speed of a fin that counts one.
    """

    name: str
    speed: float
    craft: int
    model: Model
    setting: Setting
    record: Record
    leg: Leg
    wanted: Array
    scale: Array
    rate: float

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels looked at (3 + n,)."""
        return (*SEEN, *(f"delta{i + 1}" for i in range(len(self.model.craft.fins))))

    def start(self, pilot: Pilot) -> Array:
        """Start (13 + n + 3,) in level flight, with trims that carry what ``pilot`` asks for, but for ``ASKEW``."""
        s, error = self.setting, ASKEW * (-1.0) ** self.craft
        carried = s.trim.elevator + pilot.pitch * self.tilt[0] + pilot.heave * self.tilt[1]
        return at(s.state, (error, carried + error, 0.0))

    @property
    def tilt(self) -> tuple[float, float]:
        """Elevator's trim per gain of pitch and of heave [rad, m/s], by the schedule of the case's own pilot."""
        s = self.setting
        factor = 1.0 if s.pilot is None else float(schedule(s.pilot, s.trim.u, MATH))
        return factor * s.trim.pitch, factor * s.trim.w

    def fly(self, pilot: Pilot) -> Array:
        """Channels (ticks, 3 + n) at the ends of the ticks, seen exactly; NaN after the motion ran away."""
        flown = fly(
            self.model, self.start(pilot), [self.leg], thrust=self.setting.thrust, pilot=replace(pilot, sensors=EXACT),
            clock=self.record.clock, log=Log(self.channels), threads=1,
        )  # fmt: skip
        return np.asarray(flown.log[0, 1:])

    def slopes(self, pilot: Pilot, gains: Sequence[str]) -> tuple[Array, Array]:
        """Channels (ticks, 3 + n) and their slopes (ticks, 3 + n, len(gains)) to gains of ``pilot``.

        Raises
        ------
        TowtankError
            No compiled engine, or a motion that does not stay finite.
        """
        found = sensitivities(
            self.model, self.start(pilot), self.record, self.channels, [f"pilot_{name}" for name in gains],
            start_names=("trim_elevator",), thrust=self.setting.thrust, pilot=pilot,
        )  # fmt: skip
        slope, trim = found.tangent[:, :, :-1].copy(), found.tangent[:, :, -1]
        for name, share in zip(("pitch", "heave"), self.tilt, strict=True):
            if name in gains:
                slope[:, :, list(gains).index(name)] += share * trim
        return found.seen, slope


def cases(
    model: Model, pilot: Pilot, speeds: Sequence[float], steps: Sequence[str], drawn: int, seed: int
) -> tuple[Case, ...]:
    """All flights: every step at every speed [m/s], of the best estimate and of ``drawn`` craft.

    The fins have neither dead band nor play, and the pilot sees exactly.

    Raises
    ------
    InputError
        An unknown step, no step or speed, a speed that is not positive or at which the elevator acts reversed.
    """
    unknown = [name for name in steps if name not in STEPS]
    if unknown or not steps or not speeds or drawn < 0:
        raise InputError(
            f"tuning: steps {', '.join(steps) or 'none'} at {len(speeds)} speeds with {drawn} drawn craft. Choose one "
            f"step or more from {', '.join(STEPS)}, one speed or more, and zero drawn craft or more."
        )
    turn = elevator_reversal_speed(model, "wide") or 0.0
    for speed in speeds:
        if (speed < 1.05 * turn) if pilot.speed > turn else (speed > turn):
            raise InputError(
                f"tuning at {speed:g} m/s: below {turn:.3g} m/s the elevator of {model.craft.name} acts reversed, and "
                f"this pilot is for {pilot.speed:g} m/s. One for above follows depth from {1.05 * turn:.3g} m/s on, "
                "one for below must stay below. Give speeds on the pilot's side, and tune one pilot for each side."
            )
    # A command that stays unanswered has no slope.
    fins = tuple(replace(fin, dead_band=0.0, backlash=0.0) for fin in model.craft.fins)
    smooth = replace(model, craft=replace(model.craft, fins=fins))
    models = (smooth, *_drawn(smooth, drawn, seed))
    return tuple(
        _case(name, speed, i, one, pilot) for speed in speeds for name in steps for i, one in enumerate(models)
    )


def _drawn(model: Model, count: int, seed: int) -> tuple[Model, ...]:
    """Craft with derivatives drawn from their covariance."""
    if count == 0:
        return ()
    columns = draw(model, count, seed=seed).columns
    names = model.derivatives.names
    return tuple(model.with_values(**{name: float(columns[name][i]) for name in names}) for i in range(1, count + 1))


def _case(name: str, speed: float, craft: int, model: Model, pilot: Pilot) -> Case:
    step, length = STEPS[name], model.craft.length
    s, clock = setting(model, speed, pilot), clock_of(model, speed)
    if not s.trim.holds:
        raise InputError(
            f"tuning of {model.craft.name} at {speed:g} m/s: {s.trim.why}. Give a higher speed, or ballast the craft "
            "(towtank.trials.start.ballasted)."
        )
    ticks = round(step.lengths * s.convective / clock.tick)
    deep = step.depth * length
    leg = Leg(name, s.orders(steer=1.0, dive=1.0, heading=step.heading, depth=deep), ticks * clock.tick)
    fins = model.craft.fins
    angle, rate = fin_size(model, speed)
    return Case(
        name, speed, craft, model, s, record_of([leg], clock), leg,
        wanted=np.array([step.heading, deep, 0.0, *s.state[12:]]),
        scale=np.array([HEADING_ERROR, DEPTH_ERROR * length, ROLL_ERROR, *[angle] * len(fins)]),
        rate=rate,
    )  # fmt: skip


def fin_size(model: Model, speed: float) -> tuple[float, float]:
    """Angle [rad] and speed [rad/s] of one fin that count one when all fins have them, at ``speed`` [m/s]."""
    fins = model.craft.fins
    angle = CONTROL_SHARE * min(float(fin.max_angle) for fin in fins) * float(np.sqrt(len(fins)))
    return angle, angle * speed / (QUICK * model.craft.length)
