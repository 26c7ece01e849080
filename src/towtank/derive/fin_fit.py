"""The fin curve of a campaign: fitted to its straight runs with deflected fins, beyond the linear range as well."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from towtank.derive.fin_curve import FinCurve
from towtank.derive.screen import FIN_LIMIT_DEG, name_of
from towtank.frames import Array
from towtank.symbols import LOADS
from towtank.tank.run import Run

FIN_TERMS = (("Y", "Yuudr", 0), ("Z", "Zuude", 1), ("K", "Kuudroll", 2), ("M", "Muude", 1), ("N", "Nuudr", 0))
"""Load, its linear coefficient, and the virtual control (rudder, elevator, aileron) it goes with."""

STEPS = 97
"""Stall angles tried between a quarter of the largest angle and the largest: steps of 0.3 deg to 40 deg."""
WIDTHS = (1.0, 0.75, 0.5, 0.25)
"""Widths of the ramp tried, over the angle between stall and the largest angle."""
ALIKE = 0.01
"""Rms of a residual, over that of the loads, within which fits are alike: loads count as known to 1 % at best, as in
``weights``. Of fits that are alike the first stall and the widest ramp are taken, so that the curve has no peak between
two runs that neither shows; where the best fit does not stall it stands."""
PURE = 1e-6
"""Largest rate, drift or incidence of a straight run, over the speed (over speed and length)."""


@dataclass(frozen=True)
class Sweep:
    """What the curve is fitted to; R runs, n fins, k members of the ensemble.

    delta (R, n) : fin angles [rad].   mix (rows, n), run (rows,) : a row is one load of one run, that of virtual angle
    mix @ delta[run].   angle (rows, 1 + k) : virtual angle [rad] that the linear coefficient would need for the load.
    """

    delta: Array
    mix: Array
    run: Array
    angle: Array
    names: tuple[str, ...]
    level: str


def straight_runs(runs: Sequence[Run]) -> list[Run]:
    """Steady straight runs ahead, deflected or not."""
    found = []
    for run in runs:
        nu = run.history.nu[0]
        small = np.abs(nu[1:]) <= PURE * run.speed / np.array([1, 1, run.length, run.length, run.length])
        if run.steady and nu[0] > 0.0 and bool(small.all()):
            found.append(run)
    return found


def virtual_of_fins(runs: Sequence[Run]) -> Array:
    """Matrix (3, n_fins) that gives the virtual angles of fin angles, from what the runs record of both."""
    delta, control = np.array([run.delta[0] for run in runs]), np.array([run.control[0, :3] for run in runs])
    return np.asarray((np.linalg.pinv(delta) @ control).T)


def acting(curve: FinCurve, runs: Sequence[Run], control: int, angle: Array) -> Array:
    """Virtual angle (a,) [rad] that acts where rudder (0), elevator (1) or aileron (2) stands at ``angle`` (a,) [rad].

    runs : straight, deflected; one of them deflects this control alone and tells how its fins share the angle.
    """
    mixing = virtual_of_fins(runs)[control]
    largest = max(runs, key=lambda run: abs(float(run.control[0, control])))
    share = largest.delta[0] / largest.control[0, control]
    return np.asarray(curve(np.multiply.outer(angle, share)) @ mixing)


def sweep_of(runs: Sequence[Run], terms: Mapping[str, Array]) -> Sweep | None:
    """The deflected straight runs as virtual angles; None where no run is deflected or no fin term is known.

    None also where the virtual angles of the runs are no linear function of their fin angles, as in made-up runs.

    terms : term -> value and those of the members (1 + k,).
    """
    straight = straight_runs(runs)
    still = [run for run in straight if not run.delta.any()]
    used = [run for run in straight if run.delta.any()]
    known = [(LOADS.index(load), terms[name], row) for load, name, row in FIN_TERMS if np.any(terms.get(name, 0.0))]
    if not used or not known:
        return None
    members = len(known[0][1]) - 1
    zero = np.mean([_loads(run, members) for run in still], axis=0) if still else np.zeros((1 + members, 6))
    mixing = virtual_of_fins(used)
    if not all(np.allclose(mixing @ run.delta[0], run.control[0, :3], atol=1e-6) for run in used):
        return None
    rows = []
    for number, run in enumerate(used):
        u = float(run.history.nu[0, 0])
        left = (_loads(run, members) - zero) / (u * abs(u))
        for load, value, control in known:
            if abs(mixing[control] @ run.delta[0]) > 1e-9:
                rows.append((mixing[control], number, left[:, load] / value))
    if not rows:
        return None
    names = tuple(name_of(run, runs) for run in used)
    level = " + ".join(sorted({run.level for run in used}))
    delta = np.array([run.delta[0] for run in used])
    mix, run_of, angle = (np.array(column) for column in zip(*rows, strict=True))
    return Sweep(delta, mix, run_of, angle, names, level)


def _loads(run: Run, members: int) -> Array:
    """Mean loads (1 + members, 6); the nominal ones for members that the run does not hold."""
    nominal = run.loads[run.settled].mean(axis=0)
    if run.ensemble is None or len(run.ensemble) != members:
        return np.tile(nominal, (1 + members, 1))
    return np.vstack([nominal, run.ensemble[:, run.settled].mean(axis=1)])


def fit_fin_curve(runs: Sequence[Run], terms: Mapping[str, Array]) -> tuple[FinCurve | None, str]:
    """The curve of the deflected straight runs of a campaign, or None and why; no reason where none is deflected.

    Parameters
    ----------
    runs : of one craft; those to be left out are left out by the caller.
    terms : term -> its value and those of the model-form ensemble (1 + k,), as fitted over the linear range.

    Source     THEORY section 5. Least squares of the loads over their linear coefficients; for each stall angle and
               width on a grid the two other parameters are linear.
    Departure  Uncertainty: jackknife over runs and spread of the ensemble, added in squares.
    Valid      To the largest angle of the runs. A curve that has not fallen by then gets drop 0.
    """
    sweep = sweep_of(runs, terms)
    if sweep is None:
        return None, ""
    sizes = np.unique(np.round(np.degrees(np.abs(sweep.delta)), 3))
    beyond = sizes[sizes > FIN_LIMIT_DEG + 0.01]
    if len(beyond) < 2:
        return None, (
            f"{len(beyond)} fin angles beyond {FIN_LIMIT_DEG:g} deg among the straight runs; a stall needs two"
        )
    best = _fitted(sweep)
    nominal, members, without = best[:, 0], best[:4, 1 : sweep.angle.shape[1]], best[:4, sweep.angle.shape[1] :]
    count = len(sweep.names)
    scatter = np.sqrt((count - 1) / count * ((without - without.mean(axis=1)[:, None]) ** 2).sum(axis=1))
    form = np.sqrt(((members - nominal[:4, None]) ** 2).mean(axis=1)) if members.size else np.zeros(4)
    std = np.hypot(scatter, form)
    largest = float(np.radians(sizes[-1]))
    reached = "" if nominal[2] > 0.0 else f"; no stall to {sizes[-1]:g} deg"
    return FinCurve(
        stall=float(nominal[0]),
        curvature=float(nominal[1]),
        drop=float(nominal[2]),
        width=float(nominal[3]),
        source=f"{len(sweep.names)} straight runs with deflected fins, to {sizes[-1]:g} deg{reached}",
        runs=sweep.names,
        level=sweep.level,
        std=(float(std[0]), float(std[1]), float(std[2]), float(std[3])),
        residual=float(np.sqrt(nominal[4] / (sweep.angle[:, 0] ** 2).sum())),
        largest=largest,
    ), ""


def _fitted(sweep: Sweep) -> Array:
    """Stall, curvature, drop, width and sum of squares (5, 1 + k + R): nominal, members, and without each run in turn.

    On a grid of g stall angles and widths; for each the two other parameters follow from sums over the rows.
    """
    largest = float(np.abs(sweep.delta).max())
    stalls = np.linspace(0.25 * largest, largest, STEPS)
    stall, share = (grid.ravel() for grid in np.meshgrid(stalls, WIDTHS, indexing="ij"))
    width = share * (largest - stall)
    delta = sweep.delta[sweep.run]
    size, signed = np.abs(delta)[None], (sweep.mix * np.sign(delta))[None]
    m = np.minimum(size, stall[:, None, None])
    ramp = np.clip((size - stall[:, None, None]) / np.maximum(width, 1e-9)[:, None, None], 0.0, 1.0)
    straight, curved, fallen = ((signed * part).sum(axis=2) for part in (m, m * m, -ramp))
    fallen = np.where(width[:, None] > 1e-9, fallen, 0.0)
    angle, nominal = sweep.angle, sweep.angle[:, 0]
    owner = np.eye(len(sweep.names))[sweep.run]

    def summed(a: Array, b: Array) -> Array:
        """Sums of the products of ``a``, ``b`` (g, rows) less ``straight`` where b is the load: (g, 1 + R)."""
        product = a * b
        total = product.sum(axis=1)[:, None]
        return np.hstack([total, total - product @ owner])

    def with_members(of_runs: Array, members: Array) -> Array:
        return np.hstack([of_runs[:, :1], members, of_runs[:, 1:]])

    none = np.zeros((len(stall), angle.shape[1] - 1))
    left, more = nominal - straight, angle[:, 1:]
    rest = (straight * straight).sum(axis=1)[:, None]
    cc, cf, ff = (with_members(part, none + part[:, :1]) for part in (
        summed(curved, curved), summed(curved, fallen), summed(fallen, fallen)))  # fmt: skip
    lc, lf = (with_members(summed(part, left), part @ more - (part * straight).sum(axis=1)[:, None])
              for part in (curved, fallen))  # fmt: skip
    ll = with_members(summed(left, left), (more * more).sum(axis=0) - 2.0 * straight @ more + rest)
    b, drop, squares = _solved((cc, cf, ff), (lc, lf, ll), stall[:, None])
    power = with_members(summed(np.ones((len(stall), 1)), nominal**2), (more * more).sum(axis=0) + none)
    column, best = np.arange(squares.shape[1]), squares.argmin(axis=0)
    alike = (squares <= squares.min(axis=0) + ALIKE**2 * power[0]).argmax(axis=0)
    pick = np.where(drop[best, column] > 0.0, alike, best), column
    shown = np.where(width > 1e-9, width, stall)
    return np.vstack([stall[pick[0]], b[pick], drop[pick], shown[pick[0]], squares[pick]])


def _solved(
    design: tuple[Array, Array, Array], load: tuple[Array, Array, Array], stall: Array
) -> tuple[Array, Array, Array]:
    """Curvature, drop and sum of squares (g, columns) of the best fit within the limits of ``FinCurve``.

    load = b curved + e fallen, where e is the drop times the load at the stall, stall (1 + b stall).
    design : sums of curved^2, curved fallen, fallen^2.   load : of load curved, load fallen, load^2.   stall (g, 1).
    """
    (cc, cf, ff), (lc, lf, ll) = design, load
    least = -0.5 / stall
    det = cc * ff - cf * cf
    able = det > 1e-12 * cc * ff
    safe = np.where(able, det, 1.0)
    edge = np.broadcast_to(least, cc.shape)
    options = (
        ((ff * lc - cf * lf) / safe, (cc * lf - cf * lc) / safe, able),
        (np.maximum(lc / cc, least), np.zeros_like(cc), np.ones_like(able)),
        (edge, np.clip((lf - least * cf) / np.maximum(ff, 1e-300), 0.0, 0.5 * stall), ff > 0.0),
    )
    best = tuple(np.full_like(cc, np.inf) for _ in range(3))
    for b, e, usable in options:
        drop = e / (stall * (1.0 + np.maximum(b, least) * stall))
        squares = ll - 2.0 * (b * lc + e * lf) + b * b * cc + 2.0 * b * e * cf + e * e * ff
        better = usable & (b >= least - 1e-12) & (drop >= 0.0) & (drop <= 1.0) & (squares < best[2])
        best = tuple(np.where(better, new, old) for new, old in zip((b, drop, squares), best, strict=True))
    return best[0], best[1], best[2]
