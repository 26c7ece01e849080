"""A coefficient set as a belief: independent unknowns, and what a run of another tank says about them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from towtank.derive.check import size
from towtank.derive.covariance import root_of
from towtank.derive.cycles import Samples
from towtank.derive.origin import WINDOW_DEG, WINDOW_TURN
from towtank.derive.select import reciprocal
from towtank.derive.table import Derivatives
from towtank.derive.verdicts import LIMITS
from towtank.derive.weights import FLOOR
from towtank.experiments.errors import ErrorModel
from towtank.experiments.evidence import ROUND_OFF
from towtank.frames import Array
from towtank.symbols import FOURFOLD_TIES, LOADS, OPTIONAL_TIES, RATES, TERMS
from towtank.tank.run import Run
from towtank.terms import columns, term_loads

SAME = 1e-9
"""Relative gap below which two values of a set are one value that a tie or symmetry has written twice."""

BEND = 0.25
"""Standard deviation of the cubic part of a load at the end of the window of the local fit, over its linear part there.
Judgement: the two forms of the bend that ``derive.origin`` compares, x^3 and |x| x, differ by about that much."""


@dataclass(frozen=True)
class Tied:
    """Values that ties and symmetry leave independent: values (k,); names[i] has sign[i] * values[index[i]].

    first (k,) : place in ``names`` of each independent value.
    """

    names: tuple[str, ...]
    index: NDArray[np.intp]
    sign: Array
    first: NDArray[np.intp]
    values: Array

    def expand(self, values: Array) -> Array:
        """Independent values (k,) as those of ``names`` (n,)."""
        return np.asarray(self.sign * values[self.index])

    def spread(self, covariance: Array) -> Array:
        """Covariance (k, k) of the independent values as that of ``names`` (n, n), tied without round-off."""
        return np.asarray(covariance[np.ix_(self.index, self.index)] * np.outer(self.sign, self.sign))

    def fold(self, matrix: Array) -> Array:
        """Regressors (..., n) of ``names`` as those of the independent values (..., k)."""
        out = np.zeros((*matrix.shape[:-1], len(self.first)))
        for i, (number, sign) in enumerate(zip(self.index, self.sign, strict=True)):
            out[..., number] += sign * matrix[..., i]
        return out


def tied(values: Mapping[str, float], variance: Array) -> Tied:
    """The ties that ``values`` with ``variance`` (n,) obey, out of those of a 4-fold craft and of M_A."""
    names = tuple(values)
    table = FOURFOLD_TIES | OPTIONAL_TIES
    edges = [(name, base, sign) for name, (base, sign) in table.items()]
    edges += [(name, reciprocal(name), 1.0) for name in names if TERMS[name].is_added_mass]
    index: list[int] = []
    sign: list[float] = []
    first: list[int] = []
    for i, name in enumerate(names):
        for a, b, way in [*edges, *((b, a, way) for a, b, way in edges)]:
            if a != name or b not in names[:i]:
                continue
            j = names.index(b)
            alike = np.isclose(variance[i], variance[j], rtol=1e-6, atol=0.0)
            if alike and np.isclose(values[name], way * values[b], rtol=SAME, atol=0.0):
                index.append(index[j])
                sign.append(way * sign[j])
                break
        else:
            index.append(len(first))
            sign.append(1.0)
            first.append(i)
    at = np.array(first, dtype=np.intp)
    return Tied(names, np.array(index, dtype=np.intp), np.array(sign), at, np.array(list(values.values()))[at])


@dataclass(frozen=True)
class Belief:
    """Terms and slopes at the origin as centre + root @ z, z of unit variance and independent.

    terms, slopes : k and p independent values.   root (k + p, k + p).   parts : "fit", "mesh", "model" -> covariance
    (k, k) of the terms.   scale (6,) : size of each load in a lively manoeuvre [N, N m].
    misfit : run, or label of runs -> load -> root mean square of what the model does not hold of it [N, N m], at the
    speed of ``prior``.
    """

    prior: Derivatives
    terms: Tied
    slopes: Tied
    root: Array
    parts: Mapping[str, Array]
    scale: Array
    misfit: Mapping[str, Mapping[str, float]]

    @property
    def joint(self) -> bool:
        """True where the set says how its slopes at the origin go with its terms."""
        return bool(len(self.slopes.names)) and bool(
            self.root[len(self.terms.values) :, : len(self.terms.values)].any()
        )


def believe(prior: Derivatives, doubt: float = 0.0) -> Belief:
    """``prior`` as a belief. doubt : share of each value by which it may be wrong beside its stated covariance.

    The fit and mesh errors of terms and slopes at the origin are taken as independent of each other; what they share
    through the ensemble is in ``quality["origin"]["with_terms"]``.
    """
    terms = tied(prior.as_dict(), np.diag(prior.covariance))
    told = prior.quality.get("origin", {})
    order = tuple(told.get("order", ())) if "covariance" in told else ()
    own = np.array(told["covariance"], dtype=float).reshape(len(order), -1) if order else np.zeros((0, 0))
    slopes = tied({name: prior.origin[name] for name in order}, np.diag(own))
    across = np.zeros((len(order), len(prior.names)))
    if order and "with_terms" in told:
        across = np.array(told["with_terms"], dtype=float).reshape(across.shape)
    a, b = terms.first, slopes.first
    parts = {
        "fit": prior.covariance_fit[np.ix_(a, a)] + np.diag((doubt * terms.values) ** 2),
        "mesh": prior.covariance_mesh[np.ix_(a, a)], "model": prior.covariance_model[np.ix_(a, a)],
    }  # fmt: skip
    shared = across[np.ix_(b, a)]
    down = own[np.ix_(b, b)] + np.diag((doubt * slopes.values) ** 2)
    total = np.block([[sum(parts.values()), shared.T], [shared, down]])
    root = root_of(total, np.concatenate([terms.values, slopes.values]))
    return Belief(prior, terms, slopes, root, parts, _scale(prior), _misfit(prior))


def _scale(prior: Derivatives) -> Array:
    """Size (6,) of each load in the lively manoeuvre of ``derive.check``: root of the sum of squares of its terms."""
    r = prior.reference
    out = np.zeros(6)
    for name, value in prior.as_dict().items():
        term = TERMS[name]
        unit = 0.5 * r.density * r.speed**2 * r.length ** (2 if term.load in "XYZ" else 3)
        out[LOADS.index(term.load)] += (
            size(term) * value / term.prime_factor(r.density, r.length, r.speed) * unit
        ) ** 2
    return np.sqrt(out)


def label(name: str) -> str:
    """Name of a run without its numbers: ``turn-drift`` for ``turn-p0.20-drift-m06``."""
    return "-".join(word for word in name.split("-") if not any(letter.isdigit() for letter in word))


def _misfit(prior: Derivatives) -> dict[str, dict[str, float]]:
    """Residuals of ``prior`` by run, and by label: root of the mean square over the runs of that label."""
    told = {name: {k: v["rms"] for k, v in loads.items()} for name, loads in prior.quality.get("residuals", {}).items()}
    groups: dict[str, list[dict[str, float]]] = {}
    for name, loads in told.items():
        groups.setdefault(label(name), []).append(loads)
    by_label = {
        name: {k: math.sqrt(sum(item.get(k, 0.0) ** 2 for item in items) / len(items)) for k in LOADS}
        for name, items in groups.items()
    }
    return by_label | told


def misfit_of(belief: Belief, run: Run, rms: Array) -> Array:
    """What the model does not hold (6,) of the loads of ``run``, whose root mean square is ``rms`` (6,) [N, N m].

    The residual that the prior's own fit left: of the run of the same name for an oscillation, of all runs with the
    same label for a steady one, which alone may lie where the residual crosses zero. It grows with the speed squared.
    Where the prior has no such run, a tenth of the load: the limit of ``derive.verdicts`` for lack of fit.
    """
    names = (label(run.name),) if run.steady else (run.name, label(run.name))
    found = next((belief.misfit[name] for name in names if name in belief.misfit), None)
    if found is None:
        return np.asarray(LIMITS["lack of fit"].weigh * rms)
    grown = (run.speed / belief.prior.reference.speed) ** 2
    return grown * np.array([found.get(load, 0.0) for load in LOADS])


@dataclass(frozen=True)
class Layout:
    """Places in the state x: z, then a bend and a constant of each slope, then errors that runs share.

    values : k + p.   slopes : p.   groups : kinds whose runs share an error, six loads each.
    members : of the ensemble.
    """

    values: int
    slopes: int
    groups: tuple[str, ...] = ()
    members: int = 0

    @property
    def size(self) -> int:
        """Length of x."""
        return self.values + 2 * self.slopes + 6 * len(self.groups) + self.members

    @property
    def mesh(self) -> slice:
        """Places of the shared errors of kinds."""
        start = self.values + 2 * self.slopes
        return slice(start, start + 6 * len(self.groups))

    @property
    def form(self) -> slice:
        """Places of the members of the ensemble."""
        return slice(self.size - self.members, self.size)


@dataclass(frozen=True)
class Told:
    """What a run says of the state x, added up over its rows a of unit error.

    square (x, x) : a times a.   right (x,) : a times what the belief leaves of the load.
    terms (x, k) : a times the regressors of the terms.
    """

    square: Array
    right: Array
    terms: Array

    @cached_property
    def rows(self) -> Array:
        """Rows (r, x) whose square is ``square``, as few as its rank."""
        values, vectors = np.linalg.eigh(self.square)
        kept = values > ROUND_OFF * max(float(values[-1]), 0.0)
        return np.asarray((vectors[:, kept] * np.sqrt(values[kept])).T)


def told(
    belief: Belief, layout: Layout, run: Run, samples: Samples, mesh: Array, error: ErrorModel, *, local: bool
) -> Told:
    """What one run says. samples : of it alone.   mesh (6,) : standard uncertainty of its loads shared by its kind.

    A run counts once, however finely it was sampled: rows are means over its samples, and each load has one error.
    local : steady runs of small angle speak of the slopes at the origin in place of the terms.
    """
    count, loads = len(samples.nu), samples.loads[0]
    rms = np.sqrt((loads**2).mean(axis=0))
    parts = belief.terms.fold(columns(belief.prior.names, samples.nu, samples.nudot, samples.control))
    k = len(belief.terms.values)
    rows = np.zeros((count, 6, layout.size))
    rows[..., : layout.values] = parts @ belief.root[:k]
    left = loads - parts @ belief.terms.values
    scale = belief.scale * (run.speed / belief.prior.reference.speed) ** 2
    # The smallest share of a load that is believed is that of the fit, on top of the error of the tank.
    misfit = np.maximum(misfit_of(belief, run, rms), FLOOR * rms)
    sigma = error.sigma(rms, scale, misfit)
    if local:
        plain = error.sigma(rms, scale, np.zeros(6))
        for load, row, rest in _local(belief, layout, run, samples):
            rows[:, load], left[:, load], parts[:, load], sigma[load] = row, rest, 0.0, plain[load]
    if run.kind in layout.groups:
        share = np.divide(mesh, rms, out=np.zeros(6), where=rms > 0.0)
        start = layout.mesh.start + 6 * layout.groups.index(run.kind)
        rows[:, range(6), range(start, start + 6)] = share * loads
    if layout.members:
        rows[..., layout.form] = np.moveaxis(samples.loads[1:] - loads, 0, -1) / math.sqrt(layout.members)
    weight = 1.0 / (math.sqrt(count) * sigma)
    white = (rows * weight[:, None]).reshape(-1, layout.size)
    right = white.T @ (left * weight).ravel()
    return Told(white.T @ white, right, white.T @ (parts * weight[:, None]).reshape(-1, k))


def _local(belief: Belief, layout: Layout, run: Run, samples: Samples) -> list[tuple[int, Array, float]]:
    """(load, row (x,), what the belief leaves of it) of a steady run of small angle, for each slope that it sees.

    load = u x slope + x^3 / U bend + U^2 constant. The bend is expected to meet the wide fit at the end of the window.
    """
    nu, U, length = samples.nu[0], run.speed, run.length
    if not run.steady or samples.control[0].any():
        return []
    out = []
    for i, name in enumerate(belief.slopes.names):
        at, load, size_of = RATES.index(name[2]), LOADS.index(name[0]), length if name[2] in "qr" else 1.0
        others = [j for j in range(1, 6) if j != at]
        end = (WINDOW_TURN if name[2] in "qr" else math.sin(math.radians(WINDOW_DEG))) * U / size_of
        x = float(nu[at])
        if np.any(np.abs(nu[others]) > 1e-9 * U) or not 1e-6 * U / size_of < abs(x) <= end * (1.0 + 1e-6):
            continue
        number, sign = int(belief.slopes.index[i]), float(belief.slopes.sign[i])
        slope = sign * float(belief.slopes.values[number])
        bend = (_wide_load(belief.prior, U, at, end)[load] - slope * U * end) * U / end**3
        row = np.zeros(layout.size)
        row[: layout.values] = sign * nu[0] * x * belief.root[len(belief.terms.values) + number]
        place = layout.values + 2 * number
        row[place] = sign * BEND * abs(slope) * U**2 / end**2 * x**3 / U
        row[place + 1] = sign * FLOOR * belief.scale[load] * (U / belief.prior.reference.speed) ** 2
        out.append((load, row, float(samples.loads[0, 0, load] - slope * nu[0] * x - bend * x**3 / U)))
    return out


def _wide_load(prior: Derivatives, speed: float, rate: int, value: float) -> Array:
    """Loads (6,) of ``prior`` in steady motion with one rate."""
    nu = np.zeros((1, 6))
    nu[0, 0], nu[0, rate] = speed, value
    return np.asarray(term_loads(prior.as_dict(), nu, np.zeros((1, 6)), np.zeros((1, 4)))[0])


def each(samples: Samples, runs: int) -> Sequence[Samples]:
    """The samples of each run."""
    edges = np.searchsorted(samples.run, np.arange(runs + 1))
    return [
        Samples(
            samples.nu[a:b], samples.nudot[a:b], samples.control[a:b], samples.loads[:, a:b], samples.run[a:b],
            samples.period[a:b],
        )
        for a, b in itertools.pairwise(edges)
    ]  # fmt: skip
