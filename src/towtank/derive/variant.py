"""What separates the variants of a set: products of perron eq. 2.15 that "lumped" holds in its damping terms."""

from __future__ import annotations

SHARES: dict[str, tuple[tuple[str, float], ...]] = {
    "Xvr": (("Yvdot", -1.0),),
    "Xrr": (("Yrdot", -1.0),),
    "Xwq": (("Zwdot", 1.0),),
    "Xqq": (("Zqdot", 1.0),),
    "Yur": (("Xudot", 1.0),),
    "Zuq": (("Xudot", -1.0),),
    "Muw": (("Xudot", 1.0), ("Zwdot", -1.0)),
    "Muq": (("Zqdot", -1.0),),
    "Nuv": (("Yvdot", 1.0), ("Xudot", -1.0)),
    "Nur": (("Yrdot", 1.0),),
}
"""Term -> what the products left out of eq. 2.15 contribute to it: lumped = split + sum(factor * added mass)."""
