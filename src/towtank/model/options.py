"""Choices of the model that no captive test decides."""

from __future__ import annotations

from dataclasses import dataclass

from towtank.model.faults import Fault


@dataclass(frozen=True)
class ModelOptions:
    """Choices of the model that no captive test decides.

    kappa_v, kappa_r : straightening factors for drift and for turning (see ``fins.inflow_angles``); None takes those of
        the derivatives' fin curve, 0 where it has none.
    fins_apart : 1 when the derivatives are those of the hull without its fins, 0 when they hold the fins at rest.
    axisymmetric_crossflow : cross-flow terms grow with the total cross-flow (see ``damping.damping_matrix``).
    centre_of_buoyancy : (3,) [m] from the body origin; None takes it from hull and fins.
    faults : fins that are jammed, lost or limited.   faults_known : the pilot knows of them and shares its command
        among the fins that are left.
    """

    kappa_v: float | None = None
    kappa_r: float | None = None
    axisymmetric_crossflow: bool = False
    centre_of_buoyancy: tuple[float, float, float] | None = None
    fins_apart: float = 0.0
    faults: tuple[Fault, ...] = ()
    faults_known: bool = True
