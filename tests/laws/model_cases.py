"""Crafts and coefficient sets for the tests of the model; numbers are invented but of a real craft's size."""

from __future__ import annotations

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st

from towtank.craft.craft import Craft, Fin, Mass, Propeller
from towtank.craft.hull import Ellipsoid
from towtank.model.equations import Model
from towtank.model.options import ModelOptions
from towtank.symbols import FOURFOLD_TIES, LOADS, RATES

FEW = settings(max_examples=20, deadline=None)
"""Every example solves the whole model; 20 directions in state space find a wrong sign."""

AT_ORIGIN = ModelOptions(centre_of_buoyancy=(0.0, 0.0, 0.0))

HORIZONTAL = {
    "Xudot": -30.0, "Yvdot": -900.0, "Kpdot": -3.0, "Nrdot": -1000.0, "Yrdot": 50.0, "Nvdot": 50.0,
    "Xuu": -15.0, "Xvv": 60.0, "Xvvvv": 200.0, "Xvr": 880.0, "Xrr": -40.0,
    "Yuv": -300.0, "Yvv": -900.0, "Yur": 300.0, "Yrr": 20.0,
    "Nuv": -500.0, "Nvv": 50.0, "Nur": -900.0, "Nrr": -150.0, "Kup": -10.0, "Kpp": -5.0,
    "Xuudd": -20.0, "Yuudr": 200.0, "Nuudr": -400.0, "Kuudroll": 60.0,
}  # fmt: skip
FOURFOLD = HORIZONTAL | {
    name: sign * HORIZONTAL[twin] for name, (twin, sign) in FOURFOLD_TIES.items() if twin in HORIZONTAL
}
ROLLING = {"Kuv": 3.0, "Kvv": -2.0, "Kur": 1.5, "Krr": -4.0, "Yrr": 20.0, "Ypdot": 2.0, "Kvdot": 2.0, "Zudot": 1.0,
           "Xwdot": 1.0, "Npdot": -1.5, "Krdot": -1.5, "Mudot": 4.0, "Xqdot": 4.0}  # fmt: skip
"""Terms a craft without top-bottom symmetry also has."""


def craft(azimuths=(225.0, 315.0, 135.0, 45.0), cg=(0.0, 0.0, 0.0), balance=1.0, inertia=None, propeller=None):
    fins = tuple(Fin(f"fin{i}", np.radians(a), 0.1, 0.4, 0.4, 0.3, 4.8) for i, a in enumerate(azimuths))
    inertia = inertia or ((20.0, 0.0, 0.0), (0.0, 1200.0, 0.0), (0.0, 0.0, 1200.0))
    body = Mass(900.0, 900.0 * balance, cg, inertia)
    return Craft("case", Ellipsoid(5.0, 0.6), fins, body, 2.5, 1.5, propeller=propeller or Propeller())


def model(values=FOURFOLD, options=AT_ORIGIN, variant="lumped", **kwargs):
    return Model.from_values(craft(**kwargs), values, variant=variant, options=options)


def numbers(size, limit):
    return st.lists(st.floats(-limit, limit, allow_subnormal=False), min_size=size, max_size=size)


velocities = numbers(6, 2.0)
attitudes = numbers(3, 1.2)
angles = numbers(4, 0.3)


def ahead(nu):
    """The same velocity with the craft going ahead."""
    return [0.2 + abs(nu[0]), *nu[1:]]


@st.composite
def symmetric_added_mass(draw):
    """Any symmetric positive -M_A, by name."""
    root = np.array(draw(numbers(36, 10.0))).reshape(6, 6)
    matrix = -(root @ root.T + np.eye(6))
    return {f"{load}{rate}dot": matrix[i, j] for i, load in enumerate(LOADS) for j, rate in enumerate(RATES)}


def array(matrix):
    return np.array(matrix, dtype=float)
