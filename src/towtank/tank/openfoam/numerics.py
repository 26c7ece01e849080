"""Numbers of a solution: turbulence model, schemes, steps, when to stop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from towtank.errors import InputError

MODELS: dict[str, tuple[str, ...]] = {
    "laminar": (),
    "kEpsilon": ("k", "epsilon", "nut"),
    "kOmegaSST": ("k", "omega", "nut"),
    "kOmegaSSTLM": ("k", "omega", "nut", "gammaInt", "ReThetat"),
}
"""Turbulence model -> its fields. The last is the gamma transition model of Langtry and Menter."""


@dataclass(frozen=True)
class Numerics:
    """How a case is solved.

    turbulence : a key of ``MODELS``.   wall : "functions", or "resolved" with the first cell inside the sublayer.
    steps : time steps in a period; raised to a multiple of the samples asked for, which then are steps.
    ramp : periods before the recorded ones in which the motion swells smoothly from rest. Multiples of a half begin
    and end where the displacement passes zero, and are smooth by one derivative more.
    scheme : of time. Euler lags the load by up to a step: at 100 steps a period it moved Y'v by 42 %.
    outer, inner : PIMPLE loops, and pressure corrections in each.
    iterations : most iterations of a steady case.   flat : it stops when the mean load changes by less than this share
    of the largest force and moment between the halves of the last ``window`` iterations.
    relax_u, relax_turbulence : equation under-relaxation of SIMPLEC.
    convection_turbulence : limited scheme of the turbulence equations: "upwind" or "limitedLinear 1".
    intensity, viscosity_ratio : turbulence of the far field.
    """

    turbulence: str = "kEpsilon"
    wall: Literal["functions", "resolved"] = "functions"
    steps: int = 120
    ramp: float = 0.5
    scheme: Literal["backward", "Euler"] = "backward"
    outer: int = 2
    inner: int = 2
    iterations: int = 600
    flat: float = 0.002
    window: int = 50
    relax_u: float = 0.7
    relax_turbulence: float = 0.5
    convection_turbulence: str = "upwind"
    intensity: float = 0.01
    viscosity_ratio: float = 10.0

    def __post_init__(self) -> None:
        if self.turbulence not in MODELS:
            raise InputError(f"turbulence {self.turbulence!r} is not known. Choose one of {', '.join(MODELS)}.")
        if self.turbulence == "kOmegaSSTLM" and self.wall != "resolved":
            raise InputError(
                'turbulence kOmegaSSTLM needs wall = "resolved" and a mesh with y+ below 1: a wall function has no '
                "laminar part whose transition it could tell."
            )
        if not 0.0 < self.ramp <= 4.0:
            raise InputError(
                f"ramp {self.ramp:g} periods is not in 0 to 4. The motion starts from rest; without a ramp its first "
                "step is a blow that the solver does not survive. Take 0.5."
            )
        for name, least in (("steps", 16), ("iterations", 10), ("window", 2), ("outer", 1), ("inner", 1)):
            if getattr(self, name) < least:
                raise InputError(f"{name} {getattr(self, name)} is below {least}. Give a larger number.")
