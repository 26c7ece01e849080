"""Formulations of other authors as data: their term -> ours, with what is lost on the way.

A formulation is a table. Reading one (``towtank.derive.published``) is one rule for all of them: ours = factor * theirs
* U^power, with the sign of the tested side where a term of wrong parity becomes even.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from towtank.symbols import TERMS, Term


@dataclass(frozen=True)
class Entry:
    """One term of another author.

    product : what it multiplies, in factors as of ``towtank.symbols.Term``.
    term : ours; "" when the model has no room for it.
    side : rate on whose tested side an odd term becomes an even one; "" for none.
    remark : the departure, as a sentence; "" when the meaning is the same.
    """

    product: str
    term: str = ""
    factor: float = 1.0
    side: str = ""
    remark: str = ""

    def foreign(self, name: str) -> Term:
        """The term as its author means it, with unit and prime of its own."""
        return Term(name, name[0], tuple(self.product.split()), self.remark)


@dataclass(frozen=True)
class Formulation:
    """The terms of one author or school.

    entries : their name -> what becomes of it.
    implied : cross term -> the sum of our terms that the added-mass bracket puts in its place.
    filled : our terms that the formulation lacks and that follow from its M_A.
    variant : "lumped" or "split".
    """

    name: str
    words: str
    entries: Mapping[str, Entry]
    implied: Mapping[str, tuple[tuple[str, float], ...]] = field(default_factory=dict)
    filled: tuple[str, ...] = ()
    variant: str = "lumped"


def _same(*names: str) -> dict[str, Entry]:
    return {name: Entry(" ".join(TERMS[name].factors), name) for name in names}


_ADDED = [name for name, term in TERMS.items() if term.is_added_mass]
_FINS = ["Xuudd", "Yuudr", "Zuude", "Kuudroll", "Muude", "Nuudr"]

_ODD = (
    "{name} multiplies {product}, odd in {rate}: port and starboard would have opposite axial forces. Read as the even "
    "form {term}, equal to it on the tested side{speed}."
)
_LINEAR = (
    "{name} = {value:.4g} multiplies {product}, odd in {rate}: an axial force of opposite sign to port and starboard, "
    "which a craft symmetric about its centre plane cannot have. It is kept apart and not in the model."
)

PRINTED = Formulation(
    "perron-printed",
    "terms of perron eq. 2.13, 2.16 and 2.18 as printed",
    {
        **_same(*_ADDED, *_FINS, "Xuu", "Yvv", "Yuv", "Yrr", "Yur", "Zww", "Zuw", "Zqq", "Zuq", "Kvv", "Kuv"),
        **_same("Kpp", "Kup", "Krr", "Kur", "Mww", "Muw", "Mqq", "Muq", "Nvv", "Nuv", "Nrr", "Nur"),
        "Xuuvv": Entry("u u |v| v", "Xuuvv", side="v", remark=_ODD),
        "Xuuww": Entry("u u |w| w", "Xuuww", side="w", remark=_ODD),
        "Xrr": Entry("|r| r", "Xrr", side="r", remark=_ODD),
        "Xuv": Entry("u v", remark=_LINEAR),
        "Xuw": Entry("u w", remark=_LINEAR),
        "Xur": Entry("u r", remark=_LINEAR),
    },
    filled=("Xvr", "Xwq", "Xqq"),
)
"""Source     perron, eq. 2.13, 2.16, 2.18.   Departure  THEORY section 2; docs/decisions/0002."""

_BRACKET = {
    "Ywp": (("Zwdot", -1.0),), "Ypq": (("Zqdot", -1.0),), "Zvp": (("Yvdot", 1.0),), "Zrp": (("Yrdot", 1.0),),
    "Mvp": (("Nvdot", -1.0),), "Mrp": (("Kpdot", 1.0), ("Nrdot", -1.0)),
    "Nwp": (("Mwdot", 1.0),), "Npq": (("Mqdot", 1.0), ("Kpdot", -1.0)),
}  # fmt: skip

_SCREW = "{name} = {value:.4g} is the load of the propeller: it belongs to the craft and is kept apart."

PRESTERO = Formulation(
    "prestero",
    "terms of prestero2001: added-mass cross terms written out beside M_A",
    {
        **_same(*(name for name in TERMS if name not in _FINS)),
        **_same("Yuudr", "Nuudr"),
        "Zuuds": Entry("u |u| de", "Zuude"),
        "Muuds": Entry("u |u| de", "Muude"),
        **{name: Entry(f"{name[1]} {name[2]}") for name in _BRACKET},
        **{name: Entry("", remark=_SCREW) for name in ("Kprop", "Xprop")},
    },
    _BRACKET,
)
"""Source     prestero2001: equations and identities of the cross-flow and added-mass terms."""

_STANDARD = {
    "Yv": "Yuv", "Yr": "Yur", "Zw": "Zuw", "Zq": "Zuq", "Kv": "Kuv", "Kp": "Kup", "Kr": "Kur", "Mw": "Muw",
    "Mq": "Muq", "Nv": "Nuv", "Nr": "Nur", "Ydr": "Yuudr", "Ndr": "Nuudr", "Zds": "Zuude", "Mds": "Muude",
    "Yvv": "Yvv", "Zww": "Zww", "Mww": "Mww", "Nvv": "Nvv",
}  # fmt: skip
_NO_ROOM = (
    "{name} = {value:.4g} multiplies {product}; the model has no term for it. It is kept apart and not in the model."
)

STANDARD = Formulation(
    "gertler-hagen",
    "primed coefficients of the standard submarine equations: Yv multiplies u v, Zds multiplies u|u| delta_s",
    {
        **_same(*_ADDED, "Xuu", "Xvv", "Xww", "Xvr", "Xwq", "Xqq", "Xrr"),
        **{name: Entry(" ".join(TERMS[ours].factors), ours) for name, ours in _STANDARD.items()},
        "Xpp": Entry("p p", remark=_NO_ROOM),
        "Yp": Entry("u p", remark=_NO_ROOM),
        "Np": Entry("u p", remark=_NO_ROOM),
        "Kdr": Entry("u |u| dr", remark=_NO_ROOM),
    },
)
"""Source     gertlerhagen1967; roddy1990 uses these names."""

FORMULATIONS: dict[str, Formulation] = {
    item.name: item
    for item in (
        Formulation("lumped", "terms of this project, whole measured slopes in the damping terms", _same(*TERMS)),
        Formulation("split", "terms of this project, remainders beside the full C_A", _same(*TERMS), variant="split"),
        PRINTED,
        PRESTERO,
        STANDARD,
    )
}
"""Name in a coefficient file -> formulation."""

RIGHT_HAND = frozenset(_FINS) | {"Ydr", "Ndr", "Kdr", "Zds", "Mds", "Zuuds", "Muuds", "Kprop", "Xprop"}
"""Control terms: they stand on the right-hand side in every formulation, whatever the sense of the damping."""

SYMMETRIES = ("fourfold", "mirror", "port-starboard", "none")
"""As ``Run.symmetry``."""
