"""How derivatives depend on the frequency and amplitude of the motion, and which motions to use for a craft."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import stdtrit

from towtank.derive import measure
from towtank.derive.cycles import Samples, family_of, settled
from towtank.derive.fourier import DRIVEN, harmonics
from towtank.derive.identify import Method, identify
from towtank.derive.measure import driven
from towtank.derive.screen import name_of
from towtank.derive.table import Derivatives
from towtank.derive.weights import default_share, load_scale
from towtank.errors import DeriveError
from towtank.frames import Array
from towtank.plan.limits import FREQUENCY_WARNING, FREQUENCY_WARNING_ELSE
from towtank.provenance import provenance
from towtank.symbols import LOADS, OPTIONAL, RATES, TERMS
from towtank.tank.run import Run
from towtank.terms import term_loads

TOLERANCE = 0.05
"""Largest share of a derivative by which a recommended frequency may move it from its value at w' -> 0 (judgement: what
two tanks of one model agree within, so that a smaller change is not worth a longer run)."""

STEPS = (0.4, 0.65, 1.0)
"""Recommended frequencies as shares of the highest: three, over a factor of 2.5, so that a trend can be seen."""

PAIR = (0.4, 1.0)
"""Recommended amplitudes as shares of the largest: two, so that linear and quadratic damping can be told apart."""

SLOWEST = 0.3
"""Least recommended w': a cycle of 21 lengths, which costs as much as four of the standard plan."""


@dataclass(frozen=True)
class Point:
    """One derivative from one oscillation alone.

    frequency : w' = w L / U.   amplitude : peak of the driven velocity over U (of a rate, times L / U).
    value, std : in phase (added mass), or in quadrature over |u| (equivalent linear damping: its share of |v| v is not
        split off), SI; std from period to period, NaN with one settled period.   verdict : of the run.
    """

    run: str
    kind: str
    term: str
    frequency: float
    amplitude: float
    value: float
    std: float
    verdict: str


@dataclass(frozen=True)
class Trend:
    """value(w', a') = limit + bend w'2 + growth a', over the fitted runs of one kind.

    limit, std, low, high : at w' -> 0 and small amplitude, with the 95 % interval; NaN where no freedom is left.
    bend, growth : NaN where one frequency, or one amplitude, was run.   points : number of runs.
    fit : what the wide fit of all runs gives; NaN for a term it does not hold.
    """

    kind: str
    term: str
    limit: float
    std: float
    low: float
    high: float
    bend: float
    growth: float
    points: int
    fit: float

    def at(self, frequency: float, amplitude: float) -> float:
        """The derivative that an oscillation of w' = ``frequency`` and this amplitude is expected to show."""
        bend, growth = (0.0 if math.isnan(x) else x for x in (self.bend, self.growth))
        return self.limit + bend * frequency**2 + growth * amplitude


@dataclass(frozen=True)
class Loop:
    """Area of the loop of one driven load over its velocity, measured and by the model [N m/s, N m rad/s].

    misfit : root mean square of measured less modelled load, as a share of the measured variation.
    """

    run: str
    load: str
    measured: float
    modelled: float
    misfit: float


@dataclass(frozen=True)
class Advice:
    """Recommended w' and amplitudes of one kind of oscillation.   words : what decided."""

    kind: str
    frequencies: tuple[float, ...]
    amplitudes: tuple[float, ...]
    words: str


@dataclass(frozen=True)
class Gain:
    """What a group of ``symbols.OPTIONAL`` would buy in one kind of run: share of the driven loads that is missed.

    kind : as ``cycles.family_of``.   without, within : root mean square over its runs, each against the fit to others.
    """

    group: str
    kind: str
    without: float
    within: float


@dataclass(frozen=True)
class FrequencyStudy:
    """Points, trends, loops, advice and gains of one set of runs; ``level`` of evidence as in Run."""

    craft: str
    level: str
    points: tuple[Point, ...]
    trends: tuple[Trend, ...]
    loops: tuple[Loop, ...]
    advice: tuple[Advice, ...]
    gains: tuple[Gain, ...]
    provenance: Mapping[str, Any]


def frequency_study(runs: Sequence[Run], derivatives: Derivatives) -> FrequencyStudy:
    """Study the oscillations among ``runs``, of which ``derivatives`` were identified.

    Runs that were rejected or are exploratory give points, and take no part in trends.

    Raises
    ------
    DeriveError
        No oscillation among the runs.

    Source     perron, chapter 1 (derivatives depend on frequency and amplitude); THEORY section 4 (trend in w'2).
    Valid      Odd loads of sway, heave, yaw, pitch, roll; X of surge. Small angles: u is its mean.
    """
    waving = [run for run in runs if run.kind in DRIVEN and not run.steady]
    if not waving:
        raise DeriveError("study: no oscillation among the runs. Frequency and amplitude are studied on sway, yaw, ...")
    found = derivatives.quality.get("screening", {})
    verdicts = {name_of(run, runs): found.get(name_of(run, runs), {}).get("verdict", "accepted") for run in waving}
    samples = settled(waving)
    points = tuple(
        point
        for number, run in enumerate(waving)
        for point in _points(run, samples, number, name_of(run, runs), verdicts[name_of(run, runs)])
    )
    trends = _trends(points, derivatives)
    return FrequencyStudy(
        derivatives.craft,
        derivatives.level,
        points,
        trends,
        tuple(loop for run in waving for loop in _loops(run, name_of(run, runs), derivatives)),
        tuple(
            _advice(kind, points, trends, derivatives.reference.length)
            for kind in dict.fromkeys(run.kind for run in waving)
        ),
        tuple(_gains(runs, derivatives)),
        provenance({name_of(run, runs): run.id for run in waving}),
    )


def _points(run: Run, samples: Samples, number: int, name: str, verdict: str) -> Iterator[Point]:
    at = np.flatnonzero(samples.run == number)
    cycles = int(samples.period[at].max()) + 1
    rate, w = DRIVEN[run.kind], 2.0 * math.pi / run.period
    nu, loads = samples.nu[at], samples.loads[0, at]
    motion = harmonics(nu, 1, cycles)
    drive, u = motion[1, RATES.index(rate)], abs(float(motion[0, 0].real))
    if abs(drive) == 0.0 or u == 0.0:
        return
    frequency = w * run.length / run.speed
    amplitude = float(abs(drive)) * (1.0 if rate in "uvw" else run.length) / run.speed
    whole = harmonics(loads, 1, cycles)[1] / drive
    each = [
        harmonics(part, 1, 1)[1] / harmonics(own, 1, 1)[1, RATES.index(rate)]
        for part, own in zip(np.split(loads, cycles), np.split(nu, cycles), strict=True)
    ]
    scatter = np.std([[x.real, x.imag] for x in each], axis=0, ddof=1) if cycles > 1 else np.full((2, 6), np.nan)
    for load in driven(run):
        damping = ("Xuu", 2.0 * u) if run.kind == "surge" else (f"{LOADS[load]}u{rate}", u)
        for (term, scale), value, std in (
            ((f"{LOADS[load]}{rate}dot", w), whole[load].imag, scatter[1, load]),
            (damping, whole[load].real, scatter[0, load]),
        ):
            if term in TERMS:
                yield Point(
                    name, run.kind, term, frequency, amplitude, float(value) / scale,
                    float(std) / scale / math.sqrt(cycles), verdict,
                )  # fmt: skip


def _trends(points: Sequence[Point], derivatives: Derivatives) -> tuple[Trend, ...]:
    groups: dict[tuple[str, str], list[Point]] = {}
    for point in points:
        if point.verdict in ("accepted", "down-weighted"):
            groups.setdefault((point.kind, point.term), []).append(point)
    return tuple(_trend(kind, term, own, derivatives) for (kind, term), own in groups.items())


def _trend(kind: str, term: str, own: Sequence[Point], derivatives: Derivatives) -> Trend:
    """Least squares in 1, w'2, a', as far as frequencies and amplitudes differ; the interval by Student."""
    frequency = np.array([point.frequency for point in own])
    amplitude = np.array([point.amplitude for point in own])
    value = np.array([point.value for point in own])
    varied = [_differ(frequency), _differ(amplitude)]
    columns = [np.ones(len(own)), *(x for x, there in zip((frequency**2, amplitude), varied, strict=True) if there)]
    matrix = np.stack(columns, axis=1)
    solution, _, rank, _ = np.linalg.lstsq(matrix, value, rcond=None)
    freedom = len(own) - matrix.shape[1]
    std = half = math.nan
    if freedom > 0 and rank == matrix.shape[1]:
        variance = float(((value - matrix @ solution) ** 2).sum()) / freedom
        std = math.sqrt(variance * float(np.linalg.inv(matrix.T @ matrix)[0, 0]))
        half = float(stdtrit(freedom, 0.975)) * std
    rest = iter(solution[1:].tolist())
    bend, growth = (next(rest) if there else math.nan for there in varied)
    limit = float(solution[0])
    fit = derivatives[term] if term in derivatives.names else math.nan
    return Trend(kind, term, limit, std, limit - half, limit + half, bend, growth, len(own), fit)


def _gains(runs: Sequence[Run], derivatives: Derivatives) -> Iterator[Gain]:
    """Fit the runs that ``derivatives`` rest on once more with each group of optional terms that these leave out."""
    out = {name for name, _ in derivatives.rejected}
    kept = [run for run in runs if name_of(run, runs) not in out]
    samples, share = settled(kept), float(derivatives.quality.get("weight_steady", default_share(kept)))
    groups = [group for group, names in OPTIONAL.items() if not set(names) & set(derivatives.names)]
    plain = _missed(kept, samples, share, ()) if groups else {}
    for group in groups:
        for kind, value in _missed(kept, samples, share, (group,)).items():
            yield Gain(group, kind, plain[kind], value)


def _missed(runs: Sequence[Run], samples: Samples, share: float, optional: tuple[str, ...]) -> dict[str, float]:
    """Kind -> share of the driven loads that the fit with ``optional`` terms misses."""
    solved = identify(runs, samples, Method(share, optional))
    found = measure.waves(runs, samples, solved.choice.order)
    fits = measure.misfits(runs, solved, measure.left_out(solved), found, load_scale(solved.system))
    families = [family_of(run) for run in runs]
    return {
        kind: float(np.sqrt(np.mean([fits[i, 0] ** 2 for i, name in enumerate(families) if name == kind])))
        for kind in dict.fromkeys(families)
    }


def _differ(values: Array) -> bool:
    return bool(np.ptp(values) > 1e-3 * np.abs(values).max())


def _loops(run: Run, name: str, derivatives: Derivatives) -> Iterator[Loop]:
    at = run.settled
    nu = run.history.nu[at]
    model = term_loads(derivatives.as_dict(), nu, run.history.nudot[at], run.control[at])
    x = nu[:, RATES.index(DRIVEN[run.kind])]
    for load in driven(run):
        measured, modelled = run.loads[at, load], model[:, load]
        variation = float(np.std(measured))
        if variation > 0.0:
            misfit = float(np.sqrt(np.mean((measured - modelled) ** 2))) / variation
            turns = max(run.periods - 1, 1)
            yield Loop(name, LOADS[load], loop_area(x, measured) / turns, loop_area(x, modelled) / turns, misfit)


def loop_area(x: Array, y: Array) -> float:
    """Area enclosed by the closed curve through the points (x, y), positive when it runs counter-clockwise."""
    return 0.5 * float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())


def _advice(kind: str, points: Sequence[Point], trends: Sequence[Trend], length: float) -> Advice:
    """Frequencies that keep every driven load within ``TOLERANCE`` of its limit; the largest accepted amplitude."""
    warned = FREQUENCY_WARNING.get(kind, FREQUENCY_WARNING_ELSE)
    own = [trend for trend in trends if trend.kind == kind]
    reach = {load: _reach(own, load, length, warned) for load in dict.fromkeys(trend.term[0] for trend in own)}
    load = min(reach, key=lambda name: reach[name], default="")
    highest = reach.get(load, warned)
    if all(math.isnan(trend.bend) for trend in own):
        words = "one frequency was run: no trend, the limit of the plan stands"
    elif highest == warned:
        words = f"no load moves by {100 * TOLERANCE:g} % up to the limit of the plan"
    else:
        words = f"{load} moves by {100 * TOLERANCE:g} % of its first harmonic at w' {highest:.2g}"
    if highest * STEPS[0] < SLOWEST:
        words += f"; not below w' {SLOWEST:g}, so the trend has to be taken out"
    tested = max((point.amplitude for point in points if point.kind == kind and point.verdict == "accepted"), default=0)
    return Advice(
        kind,
        tuple(round(max(highest * share, SLOWEST * share / STEPS[0]), 3) for share in STEPS),
        tuple(round(float(tested) * share, 3) for share in PAIR),
        words,
    )


def _reach(trends: Sequence[Trend], load: str, length: float, most: float) -> float:
    """Highest w', at most ``most``, at which the bend of the trends moves the first harmonic of ``load`` as stated.

    The two parts of the harmonic, at right angles, are the damping times U and the added mass times w = w' U / L.
    """
    inertia = next((t for t in trends if t.term[0] == load and t.term.endswith("dot")), None)
    damping = next((t for t in trends if t.term[0] == load and not t.term.endswith("dot")), None)
    frequency = np.linspace(0.0, most, 401)[1:]
    moved, size = np.zeros_like(frequency), np.zeros_like(frequency)
    for trend, scale in ((damping, np.ones_like(frequency)), (inertia, frequency / length)):
        if trend is not None:
            bend = 0.0 if math.isnan(trend.bend) else trend.bend
            moved += (bend * frequency**2 * scale) ** 2
            size += (trend.limit * scale) ** 2
    beyond = np.flatnonzero(moved > TOLERANCE**2 * size)
    return float(frequency[beyond[0]]) if len(beyond) else most
