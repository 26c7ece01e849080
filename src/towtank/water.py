"""The water: density and viscosity. Gravity beside it, because buoyancy needs both."""

from __future__ import annotations

from dataclasses import dataclass

GRAVITY = 9.80665
"""Standard gravity [m/s2] (ISO 80000-3). perron prints 9.8066."""


@dataclass(frozen=True)
class Water:
    """Unbounded water at rest.

    density [kg/m3], kinematic_viscosity [m2/s].
    """

    density: float = 997.56
    kinematic_viscosity: float = 8.909e-7

    def reynolds(self, speed: float, length: float) -> float:
        """Reynolds number of ``speed`` [m/s] over ``length`` [m]."""
        return speed * length / self.kinematic_viscosity

    def dynamic_pressure(self, speed: float) -> float:
        """0.5 rho U^2 [Pa]."""
        return 0.5 * self.density * speed * speed


FRESH_25C = Water(density=997.56, kinematic_viscosity=8.909e-7)
"""Fresh water near 25 C: the pair that gives the Reynolds number perron quotes (9e6) at 1 m/s over 8.15 m."""
