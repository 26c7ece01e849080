"""Which terms are fitted: what symmetry allows, what the runs excite, what they can tell apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from towtank.derive.cycles import Samples
from towtank.errors import DeriveError
from towtank.frames import Array, drift_angle, incidence_angle
from towtank.symbols import (
    FOURFOLD_ADDED_MASS,
    FOURFOLD_TIES,
    LOADS,
    OPTIONAL,
    OPTIONAL_TIES,
    PER_SPEED,
    RATES,
    REPLACED,
    STANDING,
    TERMS,
    Term,
)
from towtank.tank.run import Run

GATED = ("Kuv", "Kvv", "Kur", "Krr")
"""Roll moments that vanish by symmetry between deck and keel: identified and reported, used only when significant."""

FOURTH_ORDER_DEG = 10.0
"""Xvvvv needs steady drift beyond this angle (Xwwww incidence): below it cannot be told from Xvv."""

DEPENDENT = 1e-7
"""Share of a column left after the columns before it are taken out, below which the runs do not tell it apart."""


@dataclass(frozen=True)
class Choice:
    """Terms to be fitted.

    unknowns : independent coefficients, in order of precedence.   gated : those of them that symmetry forbids or that
    must prove themselves.   members : term of the model -> (unknown, sign).   left_out : term -> reason.
    """

    unknowns: tuple[str, ...]
    members: dict[str, tuple[str, float]]
    left_out: dict[str, str]

    @property
    def gated(self) -> tuple[str, ...]:
        """The unknowns that are gated."""
        return tuple(name for name in self.unknowns if name in GATED)

    @property
    def order(self) -> tuple[str, ...]:
        """Terms of the model in the order of ``symbols.TERMS``."""
        return tuple(name for name in TERMS if name in self.members)

    def keep(self, unknowns: Sequence[str], reasons: dict[str, str]) -> Choice:
        """The choice with the other unknowns left out for ``reasons``."""
        gone = {name: reasons[base] for name, (base, _) in self.members.items() if base in reasons}
        members = {name: pair for name, pair in self.members.items() if pair[0] in unknowns}
        return Choice(tuple(unknowns), members, self.left_out | gone)


def allowed(symmetry: str, optional: Sequence[str] = ()) -> tuple[str, ...]:
    """Terms that the symmetry of the craft leaves non-zero, the gated roll terms included.

    optional : groups of ``symbols.OPTIONAL`` that take part.

    Source     perron, eq. 2.13, 2.16, 2.18.
    Departure  The printed zero pattern of eq. 2.13 is not symmetric; here an entry stands when both its load and its
               acceleration keep the planes of symmetry (lamb1932: M_A is symmetric).
    """
    replaced = {name for group in optional for name in REPLACED.get(group, ())}
    names = (*STANDING, *(name for group in optional for name in OPTIONAL[group]))
    return tuple(
        name
        for name in names
        if name not in replaced and (not TERMS[name].is_added_mass or _entry(TERMS[name], symmetry))
    )


def _entry(term: Term, symmetry: str) -> bool:
    if symmetry in ("fourfold", "mirror"):
        return term.name in FOURFOLD_ADDED_MASS
    if symmetry == "port-starboard":
        return (term.load in "XZM") == (term.factors[0][0] in "uwq")
    return True


def choose(runs: Sequence[Run], samples: Samples, optional: Sequence[str] = ()) -> Choice:
    """Terms that the craft's symmetry allows and that the kinds of motion present excite; ``optional`` as above.

    Raises
    ------
    DeriveError
        A group of optional terms that does not exist.
    """
    if stray := [group for group in optional if group not in OPTIONAL]:
        raise DeriveError(f"derive: no optional terms {stray[0]!r}. Groups are {', '.join(OPTIONAL)}.")
    symmetry = runs[0].symmetry
    names = allowed(symmetry, optional)
    ties = FOURFOLD_TIES | OPTIONAL_TIES if symmetry == "fourfold" else {}
    reach = _reach(samples, runs)
    left_out: dict[str, str] = {}
    members: dict[str, tuple[str, float]] = {}
    missing = _no_fourth_order(samples, runs, symmetry == "fourfold")
    halves = {base for base, _ in ties.values()}
    for name in names:
        base, sign = ties.get(name, (name, 1.0))
        group = [base, *(other for other, (b, _) in ties.items() if b == base)] if base in halves else [name]
        if base in missing or name in missing:
            left_out[name] = missing.get(name, missing.get(base, ""))
        elif any(_excited(TERMS[other], reach) for other in group):
            members[name] = (base, sign)
        else:
            left_out[name] = "no run has " + " with ".join(_tokens(TERMS[name]))
    unknowns = sorted({base for base, _ in members.values()}, key=_precedence)
    return Choice(tuple(unknowns), members, left_out)


def _precedence(name: str) -> tuple[int, int]:
    """Lower orders come first, so that a higher one is dropped when the two cannot be told apart."""
    term = TERMS[name]
    if name in GATED:
        late = 3
    elif not PER_SPEED.keys().isdisjoint(term.factors):
        late = 2
    else:
        late = 0 if term.is_added_mass or "u" in name[1:] else 1
    return late, list(TERMS).index(name)


def _tokens(term: Term) -> list[str]:
    return list(dict.fromkeys(token.strip("|") for token in term.factors if token not in PER_SPEED))


def _reach(samples: Samples, runs: Sequence[Run]) -> Array:
    """Motions (N, 16) as pure numbers: u..r, udot..rdot, dr de da dd over speed, length and radian."""
    speed = np.array([run.speed for run in runs])[samples.run][:, None]
    length = np.array([[1.0, 1.0, 1.0, runs[0].length, runs[0].length, runs[0].length]])
    rate = samples.nudot * length * runs[0].length / np.maximum(speed, 1e-9) ** 2
    return np.concatenate([samples.nu * length / np.maximum(speed, 1e-9), rate, samples.control], axis=1)


def _excited(term: Term, reach: Array) -> bool:
    index = {**{r: i for i, r in enumerate(RATES)}, **{f"{r}dot": 6 + i for i, r in enumerate(RATES)}}
    index |= {"dr": 12, "de": 13, "da": 14, "dd": 15}
    product = np.prod([reach[:, index[token]] for token in _tokens(term)], axis=0)
    return bool(np.abs(product).max() > 1e-7)


def _no_fourth_order(samples: Samples, runs: Sequence[Run], tied: bool) -> dict[str, str]:
    steady = np.array([run.steady for run in runs])[samples.run]
    nu = samples.nu[steady]
    beyond = {
        "Xvvvv": bool((np.degrees(np.abs(drift_angle(nu))) > FOURTH_ORDER_DEG).any()),
        "Xwwww": bool((np.degrees(np.abs(incidence_angle(nu))) > FOURTH_ORDER_DEG).any()),
    }
    if tied and any(beyond.values()):
        return {}
    word = {"Xvvvv": "drift", "Xwwww": "incidence"}
    return {
        name: f"no steady {word[name]} beyond {FOURTH_ORDER_DEG:g} deg" for name, there in beyond.items() if not there
    }


def reciprocal(name: str) -> str:
    """The entry of M_A on the other side of the diagonal: Yrdot for Nvdot."""
    load, rate = name[0], name[1]
    return f"{LOADS[RATES.index(rate)]}{RATES[LOADS.index(load)]}dot"


def independent(matrix: Array, names: Sequence[str]) -> tuple[list[int], dict[str, str]]:
    """Columns that earlier ones do not already span, and for each of the others which ones it cannot be told from.

    matrix : (rows, n), columns in order of precedence.
    """
    norm = np.linalg.norm(matrix, axis=0)
    unit = np.asarray(np.linalg.qr(matrix / np.where(norm > 0.0, norm, 1.0), mode="r"))
    kept: list[int] = []
    reasons: dict[str, str] = {}
    basis = np.zeros((len(unit), 0))
    for j, name in enumerate(names):
        rest = unit[:, j] - basis @ (basis.T @ unit[:, j])
        rest -= basis @ (basis.T @ rest)
        size = float(np.linalg.norm(rest))
        if norm[j] > 0.0 and size > DEPENDENT:
            kept.append(j)
            basis = np.column_stack([basis, rest / size])
            continue
        share = np.linalg.lstsq(unit[:, kept], unit[:, j], rcond=None)[0] if kept else np.zeros(0)
        twins = [names[i] for i, s in zip(kept, share, strict=True) if abs(s) > 1e-6]
        reasons[name] = f"the runs cannot tell it from {', '.join(twins)}" if twins else "no run excites it"
    return kept, reasons
