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
    "realizableKE": ("k", "epsilon", "nut"),
    "RNGkEpsilon": ("k", "epsilon", "nut"),
    "ShihQuadraticKE": ("k", "epsilon", "nut"),
    "LaunderSharmaKE": ("k", "epsilon", "nut"),
    "SpalartAllmaras": ("nuTilda", "nut"),
    "LRR": ("k", "R", "epsilon", "nut"),
    "SSG": ("k", "R", "epsilon", "nut"),
}
"""Turbulence model -> its fields. None corrects for curvature: v1912 holds none that does.

Source     OpenFOAM's implementations of: kEpsilon, Launder and Spalding (1974); kOmegaSST, Menter et al. (2003);
           kOmegaSSTLM, the transition model of Langtry and Menter (2009); realizableKE, Shih et al. (1995);
           RNGkEpsilon, Yakhot et al. (1992); ShihQuadraticKE, Shih, Zhu and Lumley (1993); LaunderSharmaKE, of low
           Reynolds number, Launder and Sharma (1974); SpalartAllmaras (1994); LRR and SSG, Reynolds-stress models,
           Launder, Reece and Rodi (1975), Speziale, Sarkar and Gatski (1991).
Valid      Which of them is near experiment on SUBOFF: docs/openfoam-accuracy.md.
"""

RESOLVED_ONLY = ("kOmegaSSTLM", "LaunderSharmaKE")
"""Models without a wall function."""


@dataclass(frozen=True)
class Numerics:
    """How a case is solved.

    turbulence : a key of ``MODELS``.   wall : "functions", or "resolved" with the first cell inside the sublayer.
    steps : time steps in a period; raised to a multiple of the samples asked for, which then are steps.
    ramp : periods before the recorded ones in which the motion swells smoothly from rest. Multiples of a half begin
    and end where the displacement passes zero, and are smooth by one derivative more.
    scheme : of time. Euler lags the load by up to a step: at 100 steps a period it moved Y'v by 42 %.
    outer, inner : PIMPLE loops, and pressure corrections in each.   non_orthogonal : further solutions of each pressure
    equation. SUBOFF with fins on 32 and 40 cells around diverged without one, behind the tail.
    iterations : most iterations of a steady case.   flat : it stops when the mean load changes by less than this share
    of the largest force and moment between the halves of the last ``window`` iterations.
    relax_u, relax_turbulence : equation under-relaxation of SIMPLEC.
    convection : scheme of the momentum equation.   convection_turbulence : limited scheme of the turbulence equations:
    "upwind" or "limitedLinear 1".   limiter : of the gradient of U, 1 in full, 0 none.
    travel : lengths that a straight run goes in an unsteady solution with ``steps`` in each; the loads of the last
    half are averaged. 0 : a steady one.
    intensity, viscosity_ratio : turbulence of the far field.
    """

    turbulence: str = "kEpsilon"
    wall: Literal["functions", "resolved"] = "functions"
    steps: int = 120
    ramp: float = 0.5
    scheme: Literal["backward", "Euler"] = "backward"
    outer: int = 2
    inner: int = 2
    non_orthogonal: int = 0
    iterations: int = 600
    flat: float = 0.002
    window: int = 50
    relax_u: float = 0.7
    relax_turbulence: float = 0.5
    convection: str = "linearUpwind grad(U)"
    convection_turbulence: str = "upwind"
    limiter: float = 1.0
    travel: float = 0.0
    intensity: float = 0.01
    viscosity_ratio: float = 10.0

    def __post_init__(self) -> None:
        if self.turbulence not in MODELS:
            raise InputError(f"turbulence {self.turbulence!r} is not known. Choose one of {', '.join(MODELS)}.")
        if self.turbulence in RESOLVED_ONLY and self.wall != "resolved":
            raise InputError(
                f'turbulence {self.turbulence} needs wall = "resolved" and a mesh with y+ below 1: it describes the '
                "layer at the wall that a wall function leaves out."
            )
        if self.travel and not 1.0 <= self.travel <= 100.0:
            raise InputError(
                f"travel {self.travel:g} lengths is not in 1 to 100. The wake needs a length or two to form, and only "
                "the last half is averaged. Take 6, or 0 for a steady solution."
            )
        if not 0.0 < self.ramp <= 4.0:
            raise InputError(
                f"ramp {self.ramp:g} periods is not in 0 to 4. The motion starts from rest; without a ramp its first "
                "step is a blow that the solver does not survive. Take 0.5."
            )
        for name, least in (("steps", 16), ("iterations", 10), ("window", 2), ("outer", 1), ("inner", 1)):
            if getattr(self, name) < least:
                raise InputError(f"{name} {getattr(self, name)} is below {least}. Give a larger number.")
