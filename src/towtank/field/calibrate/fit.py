"""The most likely coefficients, motions and waters of several records together: Gauss-Newton on all unknowns."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import TypeVar

import numpy as np

from towtank.errors import InputError, TowtankError
from towtank.field.calibrate.noise import Links, Noise, learned, links_of, noise_of
from towtank.field.calibrate.normal import (
    Equations,
    Prior,
    cost,
    counted,
    equations,
    expected,
    missed,
    prior_of,
    spread,
)
from towtank.field.calibrate.settings import Settings
from towtank.field.calibrate.shoot import CHUNK, Engine, Piece, Point
from towtank.field.calibrate.unknowns import Unknowns
from towtank.field.calibrate.windows import Windows
from towtank.frames import Array
from towtank.parallel import cores
from towtank.progress import Progress, Silent

T = TypeVar("T")
HALVINGS = 8
"""Times that a step is halved before the search ends where it is."""
SETTLED = 0.2
"""Step of the noise, as a share of what the records tell of it, below which it is found."""
LOOKS = 4
"""Steps of the noise in a round of the search, which cost less than to fly the windows once."""
MEANS, DRAW_SEED = 6, 20
"""Most steps with drawn motions, and the seed of these."""
CLOSE, FAR = 0.1, 0.05
"""Step that is still to come, in standard deviations of all coefficients together, at which the last one ends; and the
share of a step by which its own linear forecast may be off."""
TERMS = 4
"""Steps forecast at a time."""
PILOTS, MANY = 2, 4
"""Of ``MANY`` records or more the first ``PILOTS`` are searched alone, and the search of all begins where that ends."""
SUMMED = ("gg", "g", "square")
"""Fields of ``Piece`` that are sums over the windows."""


@dataclass(frozen=True)
class Case:
    """A record ready to be fitted."""

    windows: Windows
    engine: Engine
    links: Links
    prior: Prior


@dataclass(frozen=True)
class Found:
    """Where a search stands in one record."""

    point: Point
    noise: Noise
    piece: Piece
    equations: Equations


@dataclass(frozen=True)
class Fit:
    """The most likely unknowns.

    z (k,), covariance (k, k) : of the coefficients, in the scale of ``Unknowns``.   found : of each record.
    shared : record -> covariance (G, G) of z and what lasts the record.   costs : after each round.
    gain : what the next step was expected to take off.   settled : whether the search ended by itself.
    """

    unknowns: Unknowns
    cases: tuple[Case, ...]
    z: Array
    covariance: Array
    found: tuple[Found, ...]
    shared: tuple[Array, ...]
    costs: tuple[float, ...]
    gain: float
    settled: bool


def case_of(windows: Windows, names: tuple[str, ...], settings: Settings) -> Case:
    """``windows`` with the engine that flies them. names : parameters of the engine that move."""
    return Case(windows, Engine(windows, names), links_of(windows, settings), prior_of(windows, settings))


class Crew:
    """Threads that share the windows of all records; the engine and the products run outside Python."""

    def __init__(self, threads: int | None = None) -> None:
        self.pool = ThreadPoolExecutor(threads or cores())

    def each(self, works: Sequence[Callable[[], T]]) -> list[T]:
        """Results of ``works``, in order. After an interruption those not begun are dropped."""
        futures = [self.pool.submit(work) for work in works]
        try:
            return [future.result() for future in futures]
        except BaseException:
            for future in futures:
                future.cancel()
            raise

    def close(self) -> None:
        """Let the threads go."""
        self.pool.shutdown(wait=True, cancel_futures=True)


def gathered(crew: Crew, cases: Sequence[Case], unknowns: Unknowns, z: Array, points: Sequence[Point]) -> list[Piece]:
    """The pieces of all records about ``points``."""
    columns, values = unknowns.columns, unknowns.values(z)
    works: list[Callable[[], Piece]] = []
    counts = []
    for case, point in zip(cases, points, strict=True):
        common = case.engine.common(values)
        spans = [slice(a, min(a + CHUNK, len(point.states))) for a in range(0, len(point.states), CHUNK)]
        counts.append(len(spans))
        works += [partial(case.engine.gather, common, point, span, columns) for span in spans]
    parts, out = crew.each(works), []
    for count in counts:
        out.append(_joined(parts[:count]))
        parts = parts[count:]
    return out


def _joined(parts: Sequence[Piece]) -> Piece:
    def one(name: str) -> Array:
        arrays = [getattr(part, name) for part in parts]
        return np.asarray(sum(arrays)) if name in SUMMED else np.concatenate(arrays)

    return Piece(**{field.name: one(field.name) for field in fields(Piece)})


class Search:
    """A search under way: where it is, and the noise of each record."""

    def __init__(
        self, cases: Sequence[Case], unknowns: Unknowns, settings: Settings, crew: Crew, begun: Fit | None = None
    ) -> None:
        """``begun`` : of some of the records, where the search begins: their coefficients, the mean of their noise."""
        self.cases, self.unknowns, self.settings, self.crew = tuple(cases), unknowns, settings, crew
        self.z = begun.z if begun else np.zeros(unknowns.size)
        self.points = [Point(c.windows.guess.copy(), c.prior.centre.copy()) for c in cases]
        self.first = noise_of(settings)
        scales = [np.log(one.noise.scales) for one in begun.found] if begun else [np.log(self.first.scales)]
        self.noise = [Noise(*np.exp(np.mean(scales, axis=0)).tolist())] * len(cases)
        self.learning = [settings.learn] * len(cases)
        self.pieces = gathered(crew, cases, unknowns, self.z, self.points)

    def cost(self, z: Array, points: Sequence[Point], pieces: Sequence[Piece]) -> float:
        """Cost of all records and of the prior of the coefficients."""
        return float(z @ z) + sum(
            cost(c.windows, c.links, noise, c.prior, point, piece.end, piece.square)
            for c, noise, point, piece in zip(self.cases, self.noise, points, pieces, strict=True)
        )

    def equations(self, known: Mapping[int, Equations] | None = None) -> list[Equations]:
        """Normal equations of each record, solved for its windows.

        known : number of a record -> its equations, where they still hold.
        """

        def one(i: int) -> Equations:
            if known and i in known:
                return known[i]
            case, k = self.cases[i], self.unknowns.size
            out = equations(case.windows, case.links, self.noise[i], case.prior, self.points[i], self.pieces[i], k)
            _ = out.told  # solved here, in this thread
            return out

        return self.crew.each([partial(one, i) for i in range(len(self.cases))])

    def step(self, all_of: Sequence[Equations]) -> tuple[Array, list[tuple[Array, Array]], float]:
        """Gauss-Newton step of z and of each record, and half of what it is expected to take off the cost."""
        k = self.unknowns.size
        a, b = np.eye(k), -self.z
        for it in all_of:
            a, b = a + it.told[0], b + it.told[1]
        dz = np.asarray(np.linalg.solve(a, b))
        backs = [it.back(dz) for it in all_of]
        gain = -float(self.z @ dz)
        for it, (shared, states) in zip(all_of, backs, strict=True):
            gain += float(it.g @ np.concatenate([dz, shared])) + float((it.s * states).sum())
        return dz, backs, gain

    def advance(self, dz: Array, backs: Sequence[tuple[Array, Array]], now: float) -> float | None:
        """Take the step, or the largest half of it that lowers the cost; the new cost, None where none does."""
        share = 1.0
        for _ in range(HALVINGS):
            z = self.z + share * dz
            points = [
                Point(point.states + share * states, point.shared + share * shared)
                for point, (shared, states) in zip(self.points, backs, strict=True)
            ]
            try:
                pieces = gathered(self.crew, self.cases, self.unknowns, z, points)
                value = self.cost(z, points, pieces)
            except (TowtankError, np.linalg.LinAlgError):
                value = np.inf
            if value <= now * (1.0 + 1e-12):
                self.z, self.points, self.pieces = z, points, pieces
                return value
            share *= 0.5
        return None

    def learn(self, all_of: Sequence[Equations]) -> list[Equations]:
        """Take the noise of each record from what its links are expected to miss after the step; the equations then.

        A record whose noise is found keeps it.
        """
        k = self.unknowns.size
        covariance = np.asarray(np.linalg.inv(np.eye(k) + sum(it.told[0] for it in all_of)))
        dz, backs, _ = self.step(all_of)

        def one(i: int) -> tuple[Noise, float]:
            case, point, piece, noise, it = self.cases[i], self.points[i], self.pieces[i], self.noise[i], all_of[i]
            shared, states = backs[i]
            gone = missed(case.windows, case.links, point, piece.end)
            gone = expected(case.windows, case.links, gone, piece, states, np.concatenate([dz, shared]))
            found = spread(case.windows, case.links, piece, it, shared_of(it, covariance))
            counts = counted(case.windows, case.links, noise, gone, point.states + states, found)
            return learned(noise, self.first, *counts)

        open_ones = [i for i, learning in enumerate(self.learning) if learning]
        for i, (noise, moved) in zip(open_ones, self.crew.each([partial(one, i) for i in open_ones]), strict=True):
            self.noise[i], self.learning[i] = noise, moved >= SETTLED
        return self.equations({i: it for i, it in enumerate(all_of) if i not in open_ones})

    def centre(self, all_of: Sequence[Equations]) -> list[Equations]:
        """Go from the largest density of all unknowns together to that of z with the motions left open.

        Source     The slope of the density of z alone is the mean, over the motions that the record leaves open, of the
                   slope at fixed motions (louis1982). The mean is taken over pairs of draws on both sides of the most
                   likely motion, and the same draws serve until the end.
        """
        for _ in range(MEANS):
            rng = np.random.default_rng(DRAW_SEED)
            info = np.eye(self.unknowns.size) + sum(it.told[0] for it in all_of)
            draws = [[it.drawn(rng) for it in all_of] for _ in range(self.settings.pairs)]
            sides = [self._drawn(drawn, side) for drawn in draws for side in (-1.0, 1.0)]
            mean = self.crew.each([partial(averaged, pair) for pair in zip(*sides, strict=True)])
            dz, rest = onwards(self.step(mean)[0], info, np.eye(len(info)) + sum(it.told[0] for it in mean))
            self.z = self.z + dz
            self.points = [
                Point(point.states + states, point.shared + shared)
                for point, (shared, states) in zip(self.points, [it.back(dz) for it in mean], strict=True)
            ]
            self.pieces = gathered(self.crew, self.cases, self.unknowns, self.z, self.points)
            all_of = self.equations()
            if max(rest, FAR * float(np.sqrt(dz @ info @ dz))) < CLOSE:
                break
        return list(all_of)

    def _drawn(self, drawn: Sequence[tuple[Array, Array]], side: float) -> list[Equations]:
        """The equations at the motions ``drawn``, on one side of the most likely ones."""
        points = [
            Point(point.states + side * states, point.shared + side * shared)
            for point, (states, shared) in zip(self.points, drawn, strict=True)
        ]
        pieces = gathered(self.crew, self.cases, self.unknowns, self.z, points)
        return [
            equations(c.windows, c.links, noise, c.prior, point, piece, self.unknowns.size)
            for c, noise, point, piece in zip(self.cases, self.noise, points, pieces, strict=True)
        ]


def onwards(dz: Array, told: Array, whole: Array) -> tuple[Array, float]:
    """The steps that would follow ``dz`` (k,) too, and the size of the first that is left out.

    told, whole (k, k) : information on z with the motions left open, and with them fixed. A step goes told / whole of
    the way, so that steps form a geometric series.

    Source     louis1982, summed to ``TERMS`` terms in place of the inverse, so that it never goes too far.
    """
    out: Array = np.zeros_like(dz)
    term: Array = dz
    for _ in range(TERMS):
        out = out + term
        term = np.asarray(term - np.linalg.solve(whole, told @ term))
    return out, max(float(term @ told @ term), 0.0) ** 0.5


def averaged(both: Sequence[Equations]) -> Equations:
    """Means of the parts of some equations, solved."""
    names = [field.name for field in fields(Equations) if field.name != "k"]
    out = Equations(**{n: np.mean([getattr(it, n) for it in both], axis=0) for n in names}, k=both[0].k)
    _ = out.told  # solved here, in this thread
    return out


def shared_of(it: Equations, covariance: Array) -> Array:
    """Covariance (G, G) of z and what lasts a record, from that of z (k, k)."""
    a, _ = it.reduced
    k = it.k
    own = np.linalg.inv(a[k:, k:])
    gain = own @ a[k:, :k]
    cross = -gain @ covariance
    return np.block([[covariance, cross.T], [cross, own + gain @ covariance @ gain.T]])


def fit(
    cases: Sequence[Case], unknowns: Unknowns, settings: Settings, progress: Progress, threads: int | None = None
) -> Fit:
    """The most likely unknowns of ``cases`` together.

    Source     bock1983 (multiple shooting), with weights on what the windows miss of each other: the maximum a
               posteriori of a model with process noise (weak constraint, tremolet2006).
    Departure  Windows are eliminated before the coefficients (Schur complement), each record apart.
    """
    if not cases:
        raise InputError("calibrate: no record was given. Name one log or more.")
    crew = Crew(threads)
    progress.start("calibration", settings.rounds)
    try:
        begun = None
        if len(cases) >= MANY:
            alone = replace(settings, pairs=0)
            begun = _searched(Search(cases[:PILOTS], unknowns, alone, crew), alone, Silent())
        found = _searched(Search(cases, unknowns, settings, crew, begun), settings, progress)
    finally:
        crew.close()
    progress.done("calibration")
    return found


def _searched(search: Search, settings: Settings, progress: Progress) -> Fit:
    costs = [search.cost(search.z, search.points, search.pieces)]
    settled, gain = False, np.inf
    for number in range(settings.rounds + 1):
        all_of = search.equations()
        dz, backs, gain = search.step(all_of)
        # Not before the first step: until then, what is missed is the guess's own.
        for _ in range(LOOKS if number > 0 else 0):
            if any(search.learning):
                all_of = search.learn(all_of)
                dz, backs, gain = search.step(all_of)
        settled = gain < settings.tolerance and not any(search.learning)
        if settled or number == settings.rounds:
            break
        value = search.advance(dz, backs, search.cost(search.z, search.points, search.pieces))
        if value is None:
            break
        costs.append(value)
        progress.step("calibration", f"cost {value:.6g}")
    if settings.pairs:
        all_of = search.centre(all_of)
    covariance = np.asarray(np.linalg.inv(np.eye(search.unknowns.size) + sum(it.told[0] for it in all_of)))
    return Fit(
        search.unknowns, search.cases, search.z, 0.5 * (covariance + covariance.T),
        tuple(
            Found(*parts) for parts in zip(search.points, search.noise, search.pieces, all_of, strict=True)
        ),
        tuple(shared_of(it, covariance) for it in all_of), tuple(costs), gain, settled,
    )  # fmt: skip
