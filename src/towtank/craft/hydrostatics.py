"""Hydrostatics of a craft, and what a naval architect would ask about it before towing it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from towtank.craft.craft import Craft
from towtank.craft.integrals import centre_of_buoyancy, fin_integrals, hull_integrals, strake_integrals
from towtank.water import GRAVITY

SLENDERNESS_RANGE = (6.0, 13.0)
"""Length over diameter of the hulls on which the fast tank was compared with measurements and RANS."""
PRISMATIC_RANGE = (0.60, 0.88)
"""Prismatic coefficients about those of the same hulls: 0.667 (spheroid) to 0.83 (REMUS), widened by 0.05."""
REYNOLDS_MIN = 1e6
"""Below this the boundary layer may be laminar over much of the hull; the fast tank takes it as turbulent."""
BALANCE_WARNING, BALANCE_ERROR = 0.5, 5.0
"""Displacement against geometry, percent: above the first it spoils trim, above the second the shape is another one."""
TRIM_LIMIT = np.radians(5.0)
SLENDEREST = 0.5
"""Aspect ratio of a strake and its image up to which slender-body theory gives its lift slope within 1 % and its centre
within 0.03 lengths (tests/oracles/test_strake_lattice.py)."""


@dataclass(frozen=True)
class Hydrostatics:
    """Hull, fins and strakes at rest. Volumes [m3], areas [m2], lengths [m], masses [kg].

    ``wetted_area`` is that of hull, exposed fins and strakes; ``cb`` (3,) [m] from the origin; ``displaced_mass`` is
    volume times density; ``stated_displaced_mass`` what the file says; ``balance_percent`` how far the file is from the
    geometry; ``net_buoyancy_percent`` stated buoyancy over weight, less 100; ``trim`` [rad] the pitch angle at rest,
    bow up positive; ``restoring`` [N m/rad] the roll stiffness m g (zG - zB).
    """

    length: float
    diameter: float
    slenderness: float
    prismatic: float
    hull_volume: float
    fin_volume: float
    strake_volume: float
    volume: float
    hull_wetted_area: float
    wetted_area: float
    cb: tuple[float, float, float]
    cb_from_nose: float
    mass: float
    displaced_mass: float
    stated_displaced_mass: float
    balance_percent: float
    net_buoyancy_percent: float
    trim: float
    restoring: float
    reynolds: float


@dataclass(frozen=True)
class Finding:
    """One remark of ``check``. ``severity``: ``error``, ``warning`` or ``note``; ``where``: dotted path in the file."""

    severity: str
    where: str
    message: str


@dataclass(frozen=True)
class CraftCheck:
    """What ``check`` found, gravest first."""

    hydrostatics: Hydrostatics
    findings: tuple[Finding, ...]

    @property
    def sound(self) -> bool:
        """True when nothing of severity ``error`` was found."""
        return all(finding.severity != "error" for finding in self.findings)


def hydrostatics(craft: Craft) -> Hydrostatics:
    """Volume, centre of buoyancy, wetted area and mass balance of ``craft``, from the analytic shapes.

    Source     fossen2021, hydrostatics of submerged vehicles; perron, eq. 2.17, for the restoring moment.
    """
    hull = hull_integrals(craft.profile)
    fins = [fin_integrals(fin, craft.profile) for fin in craft.fins]
    strakes = [strake_integrals(strake, craft.profile) for strake in craft.strakes]
    volume, cb_from_nose, cb_y, cb_z = centre_of_buoyancy(craft.profile, craft.fins, craft.strakes)
    mass, displaced = craft.mass, volume * craft.water.density
    cb = (craft.origin_from_nose - cb_from_nose, cb_y, cb_z)
    ahead, below = mass.cg[0] - cb[0], mass.cg[2] - cb[2]
    return Hydrostatics(
        length=craft.length,
        diameter=hull.diameter,
        slenderness=craft.length / hull.diameter,
        prismatic=hull.volume / (0.25 * np.pi * hull.diameter**2 * craft.length),
        hull_volume=hull.volume,
        fin_volume=sum(fin.volume for fin in fins),
        strake_volume=sum(strake.volume for strake in strakes),
        volume=volume,
        hull_wetted_area=hull.wetted_area,
        wetted_area=hull.wetted_area + sum(part.wetted_area - part.footprint for part in (*fins, *strakes)),
        cb=cb,
        cb_from_nose=cb_from_nose,
        mass=mass.mass,
        displaced_mass=displaced,
        stated_displaced_mass=mass.displaced_mass,
        balance_percent=100.0 * (mass.displaced_mass / displaced - 1.0),
        net_buoyancy_percent=100.0 * (mass.displaced_mass / mass.mass - 1.0),
        trim=float(-np.arctan2(ahead, below)) if (abs(ahead) > 1e-9 or below < 0.0) else 0.0,
        restoring=mass.mass * GRAVITY * below,
        reynolds=craft.water.reynolds(craft.speed, craft.length),
    )


def check(craft: Craft) -> CraftCheck:
    """Hydrostatics of ``craft`` and everything worth knowing before it is towed, gravest first."""
    h = hydrostatics(craft)
    findings = [*_balance(h), *_stability(h), *_fins_in_wake(craft, h), *_strakes(craft), *_range(h), *_sources(craft)]
    order = ("error", "warning", "note")
    return CraftCheck(h, tuple(sorted(findings, key=lambda finding: order.index(finding.severity))))


def _balance(h: Hydrostatics) -> list[Finding]:
    off = h.balance_percent
    if abs(off) <= BALANCE_WARNING:
        return []
    severity = "error" if abs(off) > BALANCE_ERROR else "warning"
    limit, reason = (
        (BALANCE_ERROR, "beyond it hull and mass belong to two different craft")
        if severity == "error"
        else (BALANCE_WARNING, "beyond it the weight left over is as large as the lift that steers the craft")
    )
    return [
        Finding(
            severity,
            "mass",
            f"the file states a displaced mass of {h.stated_displaced_mass:.5g} kg; the shape displaces "
            f"{h.displaced_mass:.5g} kg ({h.volume:.5g} m3), {off:+.2f} % apart. The limit is {limit:g} %: {reason}. "
            "Check mass and buoyancy, the length and diameter of the hull, and the density. Flooded spaces open to "
            "the sea do not displace: state the mass with their water in it.",
        )
    ]


def _stability(h: Hydrostatics) -> list[Finding]:
    if h.restoring < 0.0:
        return [
            Finding(
                "error",
                "mass.cg",
                f"the centre of gravity lies {-h.restoring / (h.mass * GRAVITY):.4g} m above the centre of buoyancy: "
                "the craft turns over at rest. z points down; give a larger cg z.",
            )
        ]
    if h.restoring == 0.0:
        return [
            Finding(
                "warning",
                "mass.cg",
                "the centre of gravity lies at the height of the centre of buoyancy: nothing brings roll and pitch "
                "back. Captive tests are not affected; free-running trials are.",
            )
        ]
    if abs(h.trim) > TRIM_LIMIT:
        side = "up" if h.trim > 0.0 else "down"
        return [
            Finding(
                "warning",
                "mass.cg",
                f"at rest the craft floats {np.degrees(abs(h.trim)):.1f} deg bow {side}, beyond "
                f"{np.degrees(TRIM_LIMIT):g} deg: slow runs would need elevator all the time. "
                'Write cg x = "cb" for a craft trimmed level.',
            )
        ]
    return []


def _fins_in_wake(craft: Craft, h: Hydrostatics) -> list[Finding]:
    radius = 0.5 * h.diameter
    out = [fin for fin in craft.fins if fin.tip_radius > 1.001 * radius]
    if not out:
        return []
    widest = max(out, key=lambda fin: fin.tip_radius)
    names = ", ".join(fin.name for fin in out)
    return [
        Finding(
            "note",
            "fins",
            f"the tips ({names}) reach {widest.tip_radius:.4g} m from the axis, the hull {radius:.4g} m: they stand "
            "outside the wake of the hull, work in nearly free flow, and widen the craft. The wake factor of the "
            "fast tank was set on fins that end at the hull radius.",
        )
    ]


def _strakes(craft: Craft) -> list[Finding]:
    if not craft.strakes:
        return []
    short = [s.name for s in craft.strakes if 2.0 * s.area / s.length**2 > SLENDEREST]
    words = (
        f"{len(craft.strakes)} strakes, up to {craft.reach:.4g} m from the axis. The fast tank knows their load by "
        "slender-body theory; OpenFOAM meshes none. Their weight is part of the stated mass."
    )
    found = [Finding("note", "strake", words)]
    if short:
        found.append(
            Finding(
                "warning",
                "strake",
                f"{', '.join(short)}: two heights over the length is above {SLENDEREST:g}. Slender-body theory does "
                "not hold for so short a plate; describe it as a fin, or make it longer or lower.",
            )
        )
    return found


def _range(h: Hydrostatics) -> list[Finding]:
    findings = []
    for value, (low, high), where, what in (
        (h.slenderness, SLENDERNESS_RANGE, "hull", "length over diameter"),
        (h.prismatic, PRISMATIC_RANGE, "hull", "prismatic coefficient"),
    ):
        if not low <= value <= high:
            findings.append(
                Finding(
                    "warning",
                    where,
                    f"{what} is {value:.3g}; the fast tank was compared with measurements from {low:g} to {high:g} "
                    "only. Its derivatives are an extrapolation for this hull.",
                )
            )
    if h.reynolds < REYNOLDS_MIN:
        findings.append(
            Finding(
                "warning",
                "conditions.speed",
                f"Reynolds number {h.reynolds:.2g} is below {REYNOLDS_MIN:.0e}: the boundary layer may stay laminar, "
                "and the fast tank takes it as turbulent. Drag and tail lift are less certain.",
            )
        )
    return findings


def _sources(craft: Craft) -> list[Finding]:
    findings = []
    if craft.unsourced:
        findings.append(
            Finding(
                "warning",
                craft.unsourced[0].split(".")[0],
                f"without source and not marked assumed: {', '.join(craft.unsourced)}. "
                'Add source = "..." or assumed = true, in the section or at the number.',
            )
        )
    if craft.assumed:
        findings.append(
            Finding(
                "note", craft.assumed[0].split(".")[0], f"assumed, not data of the craft: {', '.join(craft.assumed)}."
            )
        )
    return findings
