"""Speed and trim for the least energy per metre over ground: weight residual carried, hotel power, current."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from towtank.artefact import read_json, write_json
from towtank.design.power import Drive, drive_of, electrical_power
from towtank.errors import ArtefactError, InputError
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.provenance import digest, provenance
from towtank.trials.start import ballasted, level_trim
from towtank.water import GRAVITY

SCHEMA = "towtank/cruise/1"
SPAN, COUNT = (0.3, 4.0), 40
"""Speeds looked at, over that of the closed form, and how many."""
FASTEST = 3.0
"""Largest speed over that of the captive tests: the drag coefficient of the fast tank holds to three times its Reynolds
number, and a fit at one speed knows no other."""
KILOWATT_HOUR = 3.6e6


@dataclass(frozen=True)
class Flight:
    """Level flight at constant depth.

    command : speed [m/s] whose resistance is the thrust.   u, w : through the water, body axes [m/s].
    pitch, elevator [rad].   thrust [N], and of it what lift and fins cost, induced [N].   propulsion : electrical [W].
    ground : speed over ground along the course [m/s].   energy : propulsion and hotel, per metre over ground [J/m].
    """

    command: float
    u: float
    w: float
    pitch: float
    elevator: float
    thrust: float
    induced: float
    propulsion: float
    ground: float
    energy: float

    @property
    def speed(self) -> float:
        """Through the water [m/s]."""
        return math.hypot(self.u, self.w)


@dataclass(frozen=True)
class Cruise:
    """Flights as loaded and ballasted to neutral, and the one of least energy of each.

    hotel [W], current along the course [m/s], residual : weight less buoyancy [N].   best is None where no speed
    carries the residual.   closed : optimum of a neutral craft in still water [m/s].
    energy_std : relative standard uncertainty of the least energy from that of Xuu.
    """

    craft: str
    level: str
    hotel: float
    current: float
    residual: float
    drive: Drive
    loaded: tuple[Flight, ...]
    neutral: tuple[Flight, ...]
    best: Flight | None
    best_neutral: Flight
    closed: float
    energy_std: float
    provenance: Mapping[str, Any] = field(default_factory=dict)


def closed_form_speed(resistance: float, hotel: float, efficiency: float) -> float:
    """Speed [m/s] of least energy per metre of a neutral craft in still water, (hotel eta / (2 X))^(1/3).

    resistance : X = -Xuu [kg/m].   hotel [W].   efficiency : thrust power over electrical power.

    Source     The minimum of (X u^3 / eta + hotel) / u; fossen2021 for X = -Xuu.
    Valid      Resistance as the square of the speed.
    """
    return float((0.5 * hotel * efficiency / resistance) ** (1.0 / 3.0))


def flight(model: Model, command: float, hotel: float, current: float, drive: Drive) -> Flight | None:
    """Level flight at the thrust of ``command`` [m/s]; None where the craft cannot be trimmed or makes no way.

    Source     ``towtank.trials.start.level_trim`` for the balance of forces; energy (T u / eta + hotel) / ground speed.
    """
    trim = level_trim(model, command)
    if not trim.holds:
        return None
    ground = math.hypot(trim.u, trim.w) + current
    if ground <= 0.0:
        return None
    resistance = -float(model.constants.c.Xuu)
    thrust = resistance * command * command
    screw = model.constants.screw
    if screw is not None:
        from towtank.model.algebra import MATH
        from towtank.model.thrust import thrust_load

        thrust = float(thrust_load(screw, thrust, trim.u, MATH)[0])
    power = electrical_power(model, drive, thrust, float(model.thrust(command)), trim.u)
    return Flight(
        command, trim.u, trim.w, trim.pitch, trim.elevator, thrust, thrust - resistance * trim.u**2, power, ground,
        (power + hotel) / ground,
    )  # fmt: skip


def cruise(model: Model, hotel: float, current: float = 0.0, efficiency: float | None = None) -> Cruise:
    """Speed and trim of least energy per metre, as loaded and ballasted to neutral.

    Parameters
    ----------
    hotel : power of everything but propulsion [W].   current : along the course [m/s], positive with the craft.
    efficiency : thrust power over electrical power; None takes what the craft file says, or an assumption.

    Raises
    ------
    InputError
        No hotel power, or so much of it, or so strong a current, that the derivatives do not hold at the best speed.
    """
    if not hotel > 0.0 or not math.isfinite(hotel + current):
        raise InputError(
            f"hotel {hotel:g} W: without a load beside propulsion, slower is always cheaper and there is no best "
            'speed. Give the power of computers and sensors, such as --hotel "40 W".'
        )
    drive, neutral = drive_of(model, efficiency), ballasted(model)
    closed = closed_form_speed(-float(model.constants.c.Xuu), hotel, drive.overall)
    most = FASTEST * model.derivatives.reference.speed
    low = max(SPAN[0] * closed, -1.05 * current)
    if max(low, closed) >= most:
        raise InputError(
            f"hotel {hotel:g} W, current {current:g} m/s: the best speed lies above {most:.3g} m/s, {FASTEST:g} times "
            "that of the captive tests, where the drag is not known. Give a lower power, a weaker current (against the "
            "craft it is negative), or tow at a higher --speed."
        )
    speeds = np.geomspace(low, min(max(SPAN[1] * closed, 3.0 * low, model.craft.speed), most), COUNT)
    flights, best = _curve(model, speeds, hotel, current, drive)
    still, least = _curve(neutral, speeds, hotel, current, drive)
    if least is None:
        raise InputError(
            f"current {current:g} m/s: at no speed up to {speeds[-1]:.3g} m/s does {model.craft.name} fly level, even "
            "ballasted to neutral. `towtank assess` says why."
        )
    mass = model.craft.mass
    return Cruise(
        craft=model.craft.name, level=model.derivatives.level, hotel=hotel, current=current,
        residual=(mass.mass - mass.displaced_mass) * GRAVITY, drive=drive, loaded=flights, neutral=still, best=best,
        best_neutral=least, closed=closed, energy_std=_energy_std(model, least, hotel),
        provenance=provenance(
            {"mass": digest(model.craft.mass, 16), "derivatives": digest(model.derivatives.as_dict(), 16)}
        ),
    )  # fmt: skip


def _curve(
    model: Model, speeds: Array, hotel: float, current: float, drive: Drive
) -> tuple[tuple[Flight, ...], Flight | None]:
    """Flights at ``speeds`` that can be trimmed, and the one of least energy, refined between its neighbours.

    Source     Brent's bounded minimisation.
    """
    flights = [flight(model, float(speed), hotel, current, drive) for speed in speeds]
    held = [f for f in flights if f is not None]
    if not held:
        return (), None
    least = min(held, key=lambda f: f.energy)
    i = flights.index(least)
    low, high = float(speeds[max(i - 1, 0)]), float(speeds[min(i + 1, len(speeds) - 1)])

    def energy(command: float) -> float:
        found = flight(model, float(command), hotel, current, drive)
        return least.energy * 2.0 if found is None else found.energy

    refined = flight(
        model, float(minimize_scalar(energy, bounds=(low, high), method="bounded", options={"xatol": 1e-5}).x),
        hotel, current, drive,
    )  # fmt: skip
    best = refined if refined is not None and refined.energy < least.energy else least
    return tuple(held), best


def _energy_std(model: Model, least: Flight, hotel: float) -> float:
    """Relative standard uncertainty of the energy of ``least`` by that of the resistance: the share of propulsion."""
    d = model.derivatives
    if "Xuu" not in d.names:
        return math.nan
    i = d.names.index("Xuu")
    relative = math.sqrt(max(float(d.covariance[i, i]), 0.0)) / abs(float(d.values[i]))
    return relative * least.propulsion / (least.propulsion + hotel)


def write_cruise(found: Cruise, folder: Path | str) -> Path:
    """Write ``cruise.json``: SI units, radians.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    document = {
        "schema": SCHEMA,
        **{name: getattr(found, name) for name in _PLAIN},
        "drive": vars(found.drive),
        "loaded": [vars(f) for f in found.loaded],
        "neutral": [vars(f) for f in found.neutral],
        "best": None if found.best is None else vars(found.best),
        "best_neutral": vars(found.best_neutral),
        "provenance": dict(found.provenance),
    }
    return write_json(Path(folder) / "cruise.json", document)


_PLAIN = ("craft", "level", "hotel", "current", "residual", "closed", "energy_std")


def read_cruise(path: Path | str) -> Cruise:
    """Read ``cruise.json``.

    Raises
    ------
    ArtefactError
        Missing, not of this kind, or a key is missing.
    """
    d = read_json(Path(path), SCHEMA)
    try:
        plain = {name: d[name] for name in _PLAIN}
        plain["energy_std"] = math.nan if d["energy_std"] is None else float(d["energy_std"])
        return Cruise(
            **plain, drive=Drive(**d["drive"]), loaded=tuple(Flight(**f) for f in d["loaded"]),
            neutral=tuple(Flight(**f) for f in d["neutral"]), best=None if d["best"] is None else Flight(**d["best"]),
            best_neutral=Flight(**d["best_neutral"]), provenance=d["provenance"],
        )  # fmt: skip
    except (KeyError, TypeError, ValueError) as error:
        raise ArtefactError(f"{path} is not whole ({error}). Run `towtank design --range` again.") from None
