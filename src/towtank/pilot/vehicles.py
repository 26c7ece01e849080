"""Gains of real and reference vehicles as pilots of a craft, for comparison."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from importlib.resources import files
from typing import Any

import numpy as np

from towtank.errors import InputError
from towtank.model.equations import Model
from towtank.pilot.design import speed_of
from towtank.pilot.law import Pilot
from towtank.pilot.loops import judged

PID = tuple[float, float, float]


@dataclass(frozen=True)
class TorqueCascade:
    """Nested PID loops that ask for torques; fields and units as in ``gains.toml``."""

    title: str
    source: str
    depth: PID
    pitch: PID
    heading: PID
    heading_rate: PID
    roll: PID
    effect: tuple[float, float, float]
    moving: tuple[float, float, float]
    pitch_limit: float
    turn_limit: float
    assumed: tuple[str, ...]

    def gains(self, model: Model) -> dict[str, float]:
        """Gains of the law: torque = effect * moving fins * angle, the rudder to port and the elevator bow down.

        A derivative of the heading joins the rate of turn: r_ref = P e - D r.

        Source     LSTS/dune, Control/AUV/Attitude and Allocator.
        """
        roll, pitch, yaw = (1.0 / (e * n) for e, n in zip(self.effect, self.moving, strict=True))
        share, rate = 1.0 + self.heading[2], self.heading_rate[0]
        return {
            "yaw_rate": -rate * share * yaw,
            "heading": self.heading[0] / share,
            "heading_integral": -rate * self.heading[1] * yaw,
            "turn_limit": float(np.radians(self.turn_limit)) / share,
            "pitch_rate": -self.pitch[2] * pitch,
            "pitch": -self.pitch[0] * pitch,
            "pitch_order": -self.pitch[0] * pitch,
            "depth": self.depth[0],
            "depth_rate": self.depth[2],
            "depth_integral": self.pitch[0] * pitch * self.depth[1],
            "pitch_limit": float(np.radians(self.pitch_limit)),
            "roll": self.roll[0] * roll,
            "roll_rate": self.roll[2] * roll,
        }

    def missing(self) -> tuple[str, ...]:
        """Integrals of pitch, roll and rate of turn, and the derivative of the rate of turn."""
        integrals = {"pitch": self.pitch[1], "roll": self.roll[1], "rate of turn": self.heading_rate[1]}
        out = [f"no integral of {name} ({value:g})" for name, value in integrals.items() if value]
        out += [f"no derivative of the rate of turn ({self.heading_rate[2]:g})"] if self.heading_rate[2] else []
        return (*out, "the limit of the depth integral is the law's own, and roll gets what yaw and pitch leave")


@dataclass(frozen=True)
class PolePlacement:
    """Pitch by natural frequency and damping, heading by a Nomoto model; fields and units as in ``gains.toml``."""

    title: str
    source: str
    frequency: float
    damping: float
    integral: float
    depth: float
    depth_time: float
    pitch_limit: float
    nomoto_gain: float
    nomoto_time: float
    turn_pole: float
    turn_gain: float
    turn_limit: float
    assumed: tuple[str, ...]

    def gains(self, model: Model) -> dict[str, float]:
        """Gains of the law with M55 = Iyy - Mqdot of the craft.

        elevator = M55 (w^2 (theta - theta_ref) + 2 zeta w q),  theta_ref = K (z - z_ref) (1 + integral / T)
        rudder = (T (2 l r + l^2 e) + 2 l e + l^2 I + K_d (r + 2 l e + l^2 I)) / K,  e = psi - psi_ref, I its integral

        Source     fossen2021, ch. 15 (pole placement) and 16 (integral sliding mode, its linear part); MSS.
        Departure  The source takes the torque [N m] for an angle [rad]; so does this.
        """
        inertia = float(np.linalg.inv(np.asarray(model.constants.mass_inverse, dtype=float))[4, 4])
        pitch, pole, K = inertia * self.frequency**2, self.turn_pole, self.nomoto_gain
        rate = (2.0 * pole * self.nomoto_time + self.turn_gain) / K
        error = (self.nomoto_time * pole**2 + 2.0 * pole * (1.0 + self.turn_gain)) / K
        return {
            "yaw_rate": -rate,
            "heading": error / rate,
            "heading_integral": -(pole**2) * (1.0 + self.turn_gain) / K,
            "turn_limit": float(np.radians(self.turn_limit)),
            "pitch_rate": -2.0 * self.damping * self.frequency * inertia,
            "pitch": -pitch,
            "pitch_order": -pitch,
            "depth": self.depth,
            "depth_integral": pitch * self.depth / self.depth_time,
            "pitch_limit": float(np.radians(self.pitch_limit)),
        }

    def missing(self) -> tuple[str, ...]:
        """The integral of pitch, reference filters, roll."""
        return (
            f"no integral of pitch ({self.integral:g} of its gain times its frequency)",
            "no filters of the ordered depth and heading; a limit of the rate of turn stands for that of heading",
            "roll is left to the righting moment",
        )


Scheme = TorqueCascade | PolePlacement
"""A published set of gains."""

SCHEMES: Mapping[str, type[Scheme]] = {
    "torque_cascade": TorqueCascade,
    "pole_placement": PolePlacement,
}
"""Table of ``gains.toml`` -> its type."""


def vehicles() -> dict[str, Scheme]:
    """Name -> published gains, sorted by name."""
    text = (files("towtank.pilot") / "gains.toml").read_text(encoding="utf-8")
    found = {
        name: _scheme(SCHEMES[table], entry)
        for table, entries in tomllib.loads(text).items()
        for name, entry in entries.items()
    }
    return dict(sorted(found.items()))


def _scheme(kind: type[Scheme], entry: Mapping[str, Any]) -> Scheme:
    values: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in entry.items()}
    return kind(**{field.name: values[field.name] for field in fields(kind)})


def load_pilot(name: str, model: Model, speed: float | None = None) -> Pilot:
    """The gains called ``name`` (``vehicles``) as a pilot of ``model``, judged at ``speed`` [m/s], the craft's own.

    Fin angles are those of the vehicle's own allocator, with its constant effects of fins: nothing is scaled to the
    craft, and the gains are not scheduled with speed (``scheduled`` 0). ``notes`` say what the law has no place for.

    Raises
    ------
    InputError
        No such name, or a speed that is not positive.
    TrialError
        The craft has no fins.
    """
    shelf = vehicles()
    if name not in shelf:
        near = difflib.get_close_matches(name, shelf, n=1, cutoff=0.5)
        hint = f"Did you mean {near[0]}? " if near else ""
        raise InputError(f"no vehicle {name!r} among the published gains. {hint}Choose from {', '.join(shelf)}.")
    scheme, speed = shelf[name], speed_of(model, speed)
    gains: dict[str, Any] = scheme.gains(model)
    wide = gains["pitch_limit"] / gains["depth"]
    notes = (
        f"Gains of {scheme.title} ({scheme.source}), as virtual angles of this craft, constant over speed.",
        f"Not as on the vehicle: {'; '.join(scheme.missing())}.",
        *((f"Assumed, not in the source: {', '.join(scheme.assumed)}.",) if scheme.assumed else ()),
    )
    pilot = Pilot(
        craft=model.craft.name, speed=speed, scheduled=0.0, unwind=2.0 * model.craft.length / speed,
        heading_band=float(np.pi), depth_band=wide, notes=notes, **gains,
    )  # fmt: skip
    return judged(model, pilot)
