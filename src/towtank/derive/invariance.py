"""What any set must obey, whatever the body: no energy out of the water, and a turn seen as a drift along the hull."""

from __future__ import annotations

import numpy as np

from towtank.derive.check import FAIL, PASS, SIGMAS, Check, Subject, absent, gathered, judge
from towtank.frames import Array
from towtank.terms import term_loads

DRIFT_GRID, TURN_GRID = np.sin(np.radians(20.0)) * np.linspace(-1.0, 1.0, 21), 0.6 * np.linspace(-1.0, 1.0, 21)
"""v/U and r L/U of the energy check: the range over which derivatives are fitted (docs/derive.md)."""


def energy(s: Subject) -> Check:
    """Power of the hydrodynamic load on the body in steady motion: the water cannot give energy to it."""
    name = "energy"
    planes = (("Yuv", "Nuv", "Yur", "Nur", 1, 5), ("Zuw", "Muw", "Zuq", "Muq", 2, 4))
    complete = [plane for plane in planes if s.has(*map(str, plane[:4]))]
    if not s.has("Xuu") or not complete:
        lacking = s.missing("Xuu", *map(str, planes[0][:4]))
        return absent(name, f"needs Xuu and the linear terms of a plane; missing {lacking}.")
    values, added = _with_axial(s)
    r = s.reference
    v, turn = (grid.ravel() for grid in np.meshgrid(DRIFT_GRID, TURN_GRID))
    states = []
    for plane in complete:
        nu = np.zeros((len(v), 6))
        nu[:, 0] = r.speed * np.sqrt(1.0 - v**2)
        nu[:, int(plane[4])], nu[:, int(plane[5])] = v * r.speed, turn * r.speed / r.length
        states.append(nu)
    nu = np.concatenate(states)
    power = _power(values, nu) / (abs(s.values["Xuu"]) * r.speed**3 or 1.0)
    at = int(np.argmax(power))
    worst, std = float(power[at]), _power_std(s, nu[at : at + 1])
    verdict = PASS if worst <= 0.0 or (std > 0.0 and worst <= SIGMAS * std) else FAIL
    words = f"largest power of the load on the body over {len(nu)} states, in units of the resistance's.{added}"
    if verdict == FAIL:
        v, w, q, yaw = nu[at, [1, 2, 4, 5]] * [1.0, 1.0, r.length, r.length] / r.speed
        words += (
            f" At v/U = {v:.2g}, w/U = {w:.2g}, q L/U = {q:.2g}, r L/U = {yaw:.2g} the water gives energy to a body in "
            "steady motion. Damping is too small for the coupling Yur + Nuv + Xvr (Zuq + Muw + Xwq): check their signs "
            "and whether Nuv holds the Munk moment twice."
        )
    return Check(name, verdict, worst, 0.0, words)


def _with_axial(s: Subject) -> tuple[dict[str, float], str]:
    """Values with Xvr, Xwq filled from M_A where they are not stated, and the words for it."""
    values, filled = dict(s.values), []
    for term, source, sign in (("Xvr", "Yvdot", -1.0), ("Xwq", "Zwdot", 1.0)):
        if term not in values and source in values:
            values[term] = sign * values[source]
            filled.append(f"{term} is taken from {source}")
    return values, f" {' and '.join(filled)}." if filled else ""


def _power(values: dict[str, float], nu: Array) -> Array:
    load = term_loads(values, nu, np.zeros_like(nu), np.zeros((len(nu), 4)))
    return np.asarray((nu * load).sum(axis=1))


def _power_std(s: Subject, nu: Array) -> float:
    """Standard uncertainty of the power in one state, in units of the resistance's."""
    one = {name: float(_power({name: 1.0}, nu)[0]) for name in s.values}
    return s.std(one) / (abs(s.values["Xuu"]) * s.reference.speed**3 or 1.0)


ONE_LIFT, ONE_LIFT_WORST = 0.30, 1.0
"""Gap of Yur and Nuv, both without their potential part, over the Munk moment. Potential flow alone gives 0. Fins stand
deeper in the wake in a drift than in a turn: 0.2 on SUBOFF with four fins (roddy1990). Judgement: half as
much again."""


def galilean(s: Subject) -> tuple[Check, ...]:
    """A turn about a far point is a drift: what lifts in one lifts in the other.

    Along the hull the incidence is (v + x r)/u. With a lift k(x) per incidence, both Nuv and Yur are -int k x dx beside
    their potential parts Yvdot - Xudot and Xudot. The gap of the two does not depend on the origin.

    Source     THEORY sections 2 and 5: lumped terms, incidence at the fins.
    """
    found = []
    for force, moment, turn, sign in (("Yvdot", "Nuv", "Yur", 1.0), ("Zwdot", "Muw", "Zuq", -1.0)):
        if not s.has(force, moment, turn) or s.values[force] == 0.0:
            continue
        drift = {moment: 1.0, force: -sign, "Xudot": sign}
        rate = {turn: 1.0, "Xudot": -sign}
        gap = {name: rate.get(name, 0.0) - drift.get(name, 0.0) for name in (*drift, *rate)}
        munk = abs(s.value({force: 1.0, "Xudot": -1.0})) or abs(s.values[force])
        size = abs(s.value(gap)) / munk
        worst = ONE_LIFT if s.value(drift) * s.value(rate) < 0.0 else ONE_LIFT_WORST
        seen = judge(size, ONE_LIFT, worst, s.value(gap), s.std(gap))
        words = (
            f"{turn} = {s.values[turn]:.4g} and {moment} = {s.values[moment]:.4g} hold {s.value(rate):.4g} and "
            f"{s.value(drift):.4g} of lift beside their potential parts."
        )
        if seen.verdict != PASS:
            words += f" The incidence of a turn is that of a drift: check the sign of {turn}, and the variant."
        found.append(Check(f"Galilean invariance: {turn}", seen.verdict, seen.value, seen.limit, words + seen.words))
    words = "a turn about a far point is a drift."
    return gathered("Galilean invariance", found, words, "needs Yvdot, Nuv, Yur or Zwdot, Muw, Zuq.")
