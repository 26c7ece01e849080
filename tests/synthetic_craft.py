"""A craft of Hokie's size with SUBOFF-like derivatives, built without any file, for tests of trials and verdict.

Linear primes: Roddy configurations 5 and 2 (published). Non-linear, roll and axial terms, planform: assumed. A second
set, with larger fins in effect, is directionally stable.
"""

from __future__ import annotations

import numpy as np

from towtank.craft.craft import Craft, Fin, Mass
from towtank.derive.table import Derivatives, Reference
from towtank.model.equations import Model
from towtank.model.options import ModelOptions

SUBOFF = {
    "Xudot": -0.0004, "Yvdot": -0.014711, "Nvdot": 0.000415, "Yrdot": 0.000415, "Nrdot": -0.000744, "Kpdot": -2e-6,
    "Xuu": -0.0013, "Xvv": 0.0, "Xvr": 0.014711, "Xrr": -0.0005,
    "Yuv": -0.010494, "Yvv": -0.060, "Yur": 0.006324, "Yrr": 0.0,
    "Nuv": -0.011254, "Nvv": 0.010, "Nur": -0.003064, "Nrr": -0.0040, "Kup": -1.2e-5, "Kpp": 0.0,
    "Xuudd": -0.004, "Yuudr": 0.005929, "Nuudr": -0.002217, "Kuudroll": 0.0005,
}  # fmt: skip
STABLE = {**SUBOFF, "Yuv": -0.020, "Nuv": -0.0060, "Yur": 0.0090, "Nur": -0.0045}


class Cylinder:
    """A profile without shape: trials need the length only."""

    length = 8.15
    kind = "offsets"

    def radius(self, x):
        x = np.asarray(x, dtype=float)
        return np.where((x >= 0.0) & (x <= self.length), 0.4725, 0.0)


def craft(net_buoyancy=0.0, zg=0.0508, rate=30.0, limit=25.0, speed=1.0, lag=0.2):
    fins = tuple(
        Fin(
            f"fin{i}", np.radians(a), 0.1, 0.5, 0.47, 0.3, 8.0,
            max_angle=np.radians(limit), max_rate=np.radians(rate), time_constant=lag,
        )
        for i, a in enumerate((225.0, 315.0, 135.0, 45.0))
    )  # fmt: skip
    mass = 4857.12
    inertia = ((542.0, 0.0, 0.0), (0.0, 18900.0, 0.0), (0.0, 0.0, 18900.0))
    body = Mass(mass, mass * (1.0 + net_buoyancy / 100.0), (0.0, 0.0, zg), inertia)
    return Craft("synthetic", Cylinder(), fins, body, 3.83, speed)


def values(primes, craft):
    from towtank.symbols import FOURFOLD_TIES, TERMS

    tied = dict(primes)
    tied |= {name: sign * primes[twin] for name, (twin, sign) in FOURFOLD_TIES.items() if twin in primes}
    return {n: v * TERMS[n].prime_factor(craft.water.density, craft.length, 1.0) for n, v in tied.items()}


def model(primes=SUBOFF, std=0.0, **kwargs):
    boat = craft(**kwargs)
    terms = values(primes, boat)
    numbers = np.array(list(terms.values()))
    zero = np.zeros((len(terms), len(terms)))
    reference = Reference(boat.length, boat.speed, boat.water.density, boat.origin_from_nose)
    return Model(
        boat,
        Derivatives(
            boat.name,
            "published",
            "lumped",
            reference,
            tuple(terms),
            numbers,
            np.diag((std * numbers) ** 2),
            zero,
            zero,
        ),
        ModelOptions(centre_of_buoyancy=(0.0, 0.0, 0.0)),  # the profile is a stand-in; the origin is the CB
    )
