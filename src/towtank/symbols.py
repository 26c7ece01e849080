"""Every coefficient of the model once: its name, the load it belongs to, what multiplies it, its unit.

SNAME axes (x forward, y starboard, z down). Derivatives are natural: a term is a load ON the body, so damping and
added-mass derivatives are mostly negative. ``Yvv`` always multiplies v|v|. Factors written with bars are absolute
values: ``Yuv`` multiplies |u| v, but ``Nuv`` and ``Muw`` (which carry the Munk moment) multiply u v and u w.
"""

from __future__ import annotations

from dataclasses import dataclass

LOADS = ("X", "Y", "Z", "K", "M", "N")
"""Surge, sway, heave force [N]; roll, pitch, yaw moment [N m]."""

RATES = ("u", "v", "w", "p", "q", "r")
"""Body velocities [m/s] and rates [rad/s] that go with LOADS."""

CONTROLS = ("dr", "de", "da", "dd")
"""Virtual rudder, elevator, aileron [rad] and the sum of squared fin angles [rad2]."""

PER_SPEED = {"1/V": 1, "1/V2": 2}
"""Factors that divide by a power of the speed through the water."""

# What a factor contributes: (power of length, power of speed) in the prime system.
_SCALE = {rate: (0, 1) for rate in "uvw"} | {rate: (-1, 1) for rate in "pqr"}


@dataclass(frozen=True)
class Term:
    """One coefficient: ``load += value * product(factors)``.

    factors : tokens out of RATES, ``|u|`` and the like, ``udot`` and the like, CONTROLS, and ``1/V`` and ``1/V2`` with
        V2 = u2 + v2 + w2.
    """

    name: str
    load: str
    factors: tuple[str, ...]
    meaning: str

    @property
    def powers(self) -> tuple[int, int]:
        """Powers (a, b) such that value' = value / (0.5 rho L^a U^b)."""
        length, speed = (2 if self.load in "XYZ" else 3), 2
        for factor in self.factors:
            if factor in PER_SPEED:
                speed += PER_SPEED[factor]
            elif factor not in CONTROLS:
                base = _SCALE[factor.strip("|")[0]]
                dot = (-1, 1) if factor.endswith("dot") else (0, 0)
                length, speed = length - base[0] - dot[0], speed - base[1] - dot[1]
        return length, speed

    @property
    def unit(self) -> str:
        """SI unit of the value; a power of the metre times kg, since every term is of second order in speed."""
        length, _ = self.powers
        return {-1: "kg/m", 0: "kg", 1: "kg m", 2: "kg m2", 3: "kg m3"}[length - 3] if length >= 2 else "kg/m2"

    def prime_factor(self, density: float, length: float, speed: float) -> float:
        """What a dimensional value is divided by to give the primed one.

        Source     SNAME Bulletin 1-5 (1950); force / (0.5 rho U2 L2), moment / (0.5 rho U2 L3).
        """
        a, b = self.powers
        return float(0.5 * density * length**a * speed**b)

    @property
    def is_added_mass(self) -> bool:
        """True for the entries of M_A (perron eq. 2.13)."""
        return self.factors[0].endswith("dot")


def _t(name: str, factors: str, meaning: str) -> Term:
    return Term(name, name[0], tuple(factors.split()), meaning)


def _added_mass() -> list[Term]:
    return [
        Term(f"{load}{rate}dot", load, (f"{rate}dot",), f"added mass, {load} per acceleration {rate}dot")
        for load in LOADS
        for rate in RATES
    ]


_DAMPING = [
    _t("Xuu", "|u| u", "straight-ahead resistance"),
    _t("Xvv", "v v", "axial force due to sway, even in v"),
    _t("Xww", "w w", "axial force due to heave, even in w"),
    _t("Xvvvv", "v v v v 1/V2", "axial force due to sway, fourth order"),
    _t("Xwwww", "w w w w 1/V2", "axial force due to heave, fourth order"),
    _t("Xvr", "v r", "axial force in a drifting turn (potential: -Yvdot)"),
    _t("Xwq", "w q", "axial force in a pitching heave (potential: Zwdot)"),
    _t("Xrr", "r r", "axial force due to yaw rate"),
    _t("Xqq", "q q", "axial force due to pitch rate"),
    _t("Yuv", "|u| v", "sway force due to sway, linear"),
    _t("Yvv", "|v| v", "sway force due to sway, cross-flow"),
    _t("Yur", "|u| r", "sway force due to yaw rate, linear"),
    _t("Yrr", "|r| r", "sway force due to yaw rate, cross-flow"),
    _t("Zuw", "|u| w", "heave force due to heave, linear"),
    _t("Zww", "|w| w", "heave force due to heave, cross-flow"),
    _t("Zuq", "|u| q", "heave force due to pitch rate, linear"),
    _t("Zqq", "|q| q", "heave force due to pitch rate, cross-flow"),
    _t("Kuv", "u v", "roll moment due to sway, linear"),
    _t("Kvv", "|v| v", "roll moment due to sway, cross-flow"),
    _t("Kup", "|u| p", "roll damping, linear"),
    _t("Kpp", "|p| p", "roll damping, quadratic"),
    _t("Kur", "u r", "roll moment due to yaw rate, linear"),
    _t("Krr", "|r| r", "roll moment due to yaw rate, cross-flow"),
    _t("Muw", "u w", "pitch moment due to heave, Munk and lift"),
    _t("Mww", "|w| w", "pitch moment due to heave, cross-flow"),
    _t("Muq", "|u| q", "pitch damping, linear"),
    _t("Mqq", "|q| q", "pitch damping, cross-flow"),
    _t("Nuv", "u v", "yaw moment due to sway, Munk and lift"),
    _t("Nvv", "|v| v", "yaw moment due to sway, cross-flow"),
    _t("Nur", "|u| r", "yaw damping, linear"),
    _t("Nrr", "|r| r", "yaw damping, cross-flow"),
]

_FINS = [
    _t("Xuudd", "u |u| dd", "axial force of deflected fins"),
    _t("Yuudr", "u |u| dr", "sway force of the rudder"),
    _t("Zuude", "u |u| de", "heave force of the elevator"),
    Term("Kuudroll", "K", ("u", "|u|", "da"), "roll moment of the aileron"),
    _t("Muude", "u |u| de", "pitch moment of the elevator"),
    _t("Nuudr", "u |u| dr", "yaw moment of the rudder"),
]

_THIRD = [
    _t(f"{load}{''.join(product)}", f"{' '.join(product)} 1/V", f"{meaning}, third order in {' '.join(product)}")
    for loads, rates in (("YN", "vr"), ("ZM", "wq"))
    for load, meaning in zip(loads, {"Y": ("sway force", "yaw moment"), "Z": ("heave force", "pitch moment")}[loads[0]],
                             strict=True)
    for product in (rates[0] * 3, rates[0] * 2 + rates[1], rates[0] + rates[1] * 2, rates[1] * 3)
]  # fmt: skip

_EVEN = [
    _t("Xuuvv", "u u v v 1/V2", "axial force due to sway, growing with u2"),
    _t("Xuuww", "u u w w 1/V2", "axial force due to heave, growing with u2"),
]

OPTIONAL: dict[str, tuple[str, ...]] = {
    "third-order": tuple(term.name for term in _THIRD),
    "Xuuvv": tuple(term.name for term in _EVEN),
}
"""Groups of terms that a fit takes up only when asked, by the name of the group.

"third-order"  Yvvv ... Mqqq: cubes of sway and yaw, heave and pitch, over the speed, as in the expansion of Abkowitz.
               They bend the curve within the range and hold the mixed v v r that |v| v and |r| r leave out.
"Xuuvv"        The Xuuvv, Xuuww of perron eq. 2.16 in even form: u2 v2 / V2 in place of the printed u2 |v| v. They stand
               for Xvv and Xvvvv (Xww and Xwwww), whose difference they are in one plane: u2 v2 / V2 = v2 - v4 / V2.

Source     fossen2021 (third-order odd expansion); perron, eq. 2.16; THEORY section 2.
Departure  Divided by V or V2, so that each is of second order in speed, as all others are, and primes do not move.
"""

TERMS: dict[str, Term] = {term.name: term for term in [*_added_mass(), *_DAMPING, *_FINS, *_THIRD, *_EVEN]}
"""The terms of perron eq. 2.13, 2.16 and 2.18 in consistent form, plus Xvvvv, Xwwww, Xvr, Xwq and Xqq; then those of
``OPTIONAL``.

Departure  The printed Xuuvv, Xuv, Xuuww, Xuw and Xur are odd in v, w or r, so port and starboard would differ; their
           even counterparts Xvv, Xww, Xrr stand here. Xvr, Xwq and Xqq carry what the reduced bracket of eq. 2.15
           leaves out of row 1. docs/decisions/0002 gives the reasons.
"""

REPLACED: dict[str, tuple[str, ...]] = {"Xuuvv": ("Xvv", "Xvvvv", "Xww", "Xwwww")}
"""Group of ``OPTIONAL`` -> terms that it stands in for."""

STANDING = tuple(name for name in TERMS if not any(name in names for names in OPTIONAL.values()))
"""The terms that every fit takes up: ``TERMS`` less those of ``OPTIONAL``."""

FOURFOLD_TIES: dict[str, tuple[str, float]] = {
    "Zwdot": ("Yvdot", 1.0), "Zqdot": ("Yrdot", -1.0), "Mwdot": ("Nvdot", -1.0), "Mqdot": ("Nrdot", 1.0),
    "Zuw": ("Yuv", 1.0), "Zww": ("Yvv", 1.0), "Zuq": ("Yur", -1.0), "Zqq": ("Yrr", -1.0),
    "Muw": ("Nuv", -1.0), "Mww": ("Nvv", -1.0), "Muq": ("Nur", 1.0), "Mqq": ("Nrr", 1.0),
    "Xww": ("Xvv", 1.0), "Xwwww": ("Xvvvv", 1.0), "Xqq": ("Xrr", 1.0), "Xwq": ("Xvr", -1.0),
    "Zuude": ("Yuudr", -1.0), "Muude": ("Nuudr", 1.0),
}  # fmt: skip
"""Vertical-plane term -> (horizontal-plane term, sign) for a craft with 4-fold symmetry (THEORY section 3)."""

OPTIONAL_TIES: dict[str, tuple[str, float]] = {
    "Zwww": ("Yvvv", 1.0), "Zwwq": ("Yvvr", -1.0), "Zwqq": ("Yvrr", 1.0), "Zqqq": ("Yrrr", -1.0),
    "Mwww": ("Nvvv", -1.0), "Mwwq": ("Nvvr", 1.0), "Mwqq": ("Nvrr", -1.0), "Mqqq": ("Nrrr", 1.0),
    "Xuuww": ("Xuuvv", 1.0),
}  # fmt: skip
"""The same for the terms of ``OPTIONAL``."""

FOURFOLD_ADDED_MASS = (
    "Xudot",
    "Yvdot",
    "Zwdot",
    "Kpdot",
    "Mqdot",
    "Nrdot",
    "Yrdot",
    "Nvdot",
    "Zqdot",
    "Mwdot",
)
"""Entries of M_A that 4-fold symmetry leaves non-zero."""
