"""The package's models of craft with published coefficients, with the actuators of the publication."""

from __future__ import annotations

import math
from pathlib import Path

import published_npsauv as npsauv
import published_remus as remus
from towtank.craft.craft import Craft, Fin, Mass
from towtank.craft.hull import Ellipsoid
from towtank.derive.published import read_coefficients
from towtank.model.equations import Model, ModelOptions
from towtank.water import Water

DATA = Path(__file__).parent / "data"
NPS_SPEED = npsauv.SCREW["advance"] * 1000.0 * math.pi / 30.0
"""Speed at which the NPS AUV's propeller at 1000 rev/min balances its resistance [m/s]."""
PLUS = (0.0, 90.0, 180.0, 270.0)


def _model(name, length, density, speed, mass, buoyancy, zG, inertia, lag, limit):
    coefficients = read_coefficients(DATA / f"coefficients_{name}.toml")
    fins = tuple(
        Fin(
            f"fin{i}", math.radians(azimuth), 0.02, 0.1, 0.1, 0.1, 0.95 * length,
            max_angle=limit, max_rate=1e6, time_constant=lag,
        )
        for i, azimuth in enumerate(PLUS)
    )  # fmt: skip
    body = Mass(mass, mass + buoyancy, (0.0, 0.0, zG), inertia)
    origin = coefficients.reference.origin_from_nose
    craft = Craft(name, Ellipsoid(length, length / 7.0), fins, body, origin, speed, Water(density))
    return Model(craft, coefficients, ModelOptions(centre_of_buoyancy=(0.0, 0.0, 0.0)))


def npsauv_model():
    """NPS AUV II in the terms of the model family; resistance and drag of the planes from the published set."""
    b = npsauv.BODY
    inertia = (
        (b["Ix"], -b["Ixy"], -b["Ixz"]),
        (-b["Ixy"], b["Iy"], -b["Iyz"]),
        (-b["Ixz"], -b["Iyz"], b["Iz"]),
    )
    model = _model(
        "npsauv2", npsauv.L, npsauv.RHO, NPS_SPEED, npsauv.MASS, 0.0, npsauv.ZG, inertia, b["lag"],
        math.radians(b["fin_limit_deg"]),
    )  # fmt: skip
    # Two of the four fins carry a rudder angle: the sum of their squares is twice its square.
    return model.with_values(Xuu=-npsauv.R2 * npsauv.SCREW["Cd0"], Xuudd=0.5 * npsauv.R2 * npsauv.C.Xdrdr)


def remus_model(lift=0.0, lag=0.1):
    """REMUS 100 with the printed set; ``lift`` is buoyancy less weight [N]."""
    from towtank.water import GRAVITY

    b = remus.BODY
    inertia = ((b["Ixx"], 0.0, 0.0), (0.0, b["Iyy"], 0.0), (0.0, 0.0, b["Izz"]))
    return _model(
        "remus100", 1.33, 1030.0, remus.PRINTED["start"]["u"], remus.MASS, lift / GRAVITY, remus.ZG, inertia, lag,
        math.radians(20.0),
    )  # fmt: skip
