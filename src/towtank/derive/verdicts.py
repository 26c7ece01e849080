"""Which runs are trusted, and how far: every run is judged by stated tests, and each verdict says why."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from towtank.derive import measure, weights
from towtank.derive.cycles import Samples, family_of, settled
from towtank.derive.identify import Method, Solved, identify
from towtank.derive.screen import name_of
from towtank.frames import Array
from towtank.tank.run import Run

KEY_TERMS = ("Yuv", "Yvv", "Nuv", "Nvv", "Yur", "Yrr", "Nur", "Nrr", "Yvdot", "Nrdot", "Zuw", "Muw", "Zuq", "Muq")
"""Derivatives whose change counts as the influence of a run: those of stability and of turns."""

INFLUENCE_FLOOR = 0.02
"""Share of a derivative below which its change is never an influence (judgement: a tenth of what derivatives of one
craft differ by between tanks)."""

KIND_SPREAD = 3.0 * 1.4826
"""What the median misfit of the other steady runs of a kind is multiplied by to give what scatter alone may show: three
standard deviations of a normal spread."""


@dataclass(frozen=True)
class Limit:
    """A test of runs: ``weigh`` and ``reject`` are the values above which a run is down-weighted, and rejected.

    unit : of both; "%" is printed for shares.   why : the reason of the limits.
    """

    weigh: float
    reject: float
    unit: str
    why: str


LIMITS: Mapping[str, Limit] = {
    "lack of fit": Limit(
        0.1, 0.3, "%",
        "share of the loads that the fit to the other runs does not hold; the model of second order is worth about a "
        "tenth of a load on these craft, and three times that is another flow (judgement)",
    ),
    "third harmonic": Limit(
        0.1, 0.3, "%",
        "third harmonic that the model does not make, over the first; |v| v alone makes a fifth of its own first "
        "(8/15pi over 8/3pi), so half of that is a cross-flow of another form (judgement)",
    ),
    "even harmonics": Limit(
        0.05, 0.15, "%",
        "mean and second harmonic over the first; port-starboard symmetry makes them zero, so what is there is a "
        "flow that has chosen a side, or a record that is not whole periods (judgement)",
    ),
    "period to period": Limit(
        0.01, 0.1, "%", "change of the loads from one period to the next; a settled cycle changes by less than 1 %"
    ),
    "local drift": Limit(
        20.0, 30.0, "deg",
        "angle between axis and undisturbed flow at the stern; fins begin to stall at 20 deg and are stalled at 30",
    ),
    "influence": Limit(
        3.0, 9.0, "std",
        "largest change of a key derivative when the run is left out, in standard deviations of such changes; beyond 3 "
        "the result is that of one run",
    ),
}  # fmt: skip
"""Tests of a run, in the order of the report.

Source     THEORY sections 4 and 8; perron, chapter 1 (violent runs dropped).   Departure: the source gives no numbers.
"""


@dataclass(frozen=True)
class Tested:
    """One test of one run: its value, and what noise alone may show (0 where it is unknown)."""

    value: float
    noise: float = 0.0

    @property
    def excess(self) -> float:
        """The value less the noise, in the mean square."""
        return float(np.sqrt(max(self.value**2 - self.noise**2, 0.0)))


@dataclass(frozen=True)
class Verdict:
    """verdict : accepted, down-weighted, rejected or exploratory.   trust : factor on the weight of the run, 0 to 1.

    why : a sentence, empty when accepted.   tests : name of a test in ``LIMITS`` -> result.
    """

    verdict: str
    trust: float
    why: str = ""
    tests: Mapping[str, Tested] = field(default_factory=dict)

    def document(self) -> dict[str, Any]:
        """Plain content for files."""
        tests = {
            name: {
                "value": test.value, "noise": test.noise, "limit": LIMITS[name].weigh,
                "passed": test.excess <= LIMITS[name].weigh * (1.0 + 1e-6),
            }
            for name, test in self.tests.items()
        }  # fmt: skip
        return {"verdict": self.verdict, "trust": self.trust, "why": self.why, "tests": tests}


@dataclass(frozen=True)
class Judged:
    """runs : those that are fitted.   samples, solved, mesh (R, 6) : of them.

    verdicts : name -> verdict, of all runs given; empty when they were not judged.
    """

    runs: tuple[Run, ...]
    samples: Samples
    solved: Solved
    verdicts: Mapping[str, Verdict]
    mesh: Array | None = None

    @property
    def rejected(self) -> tuple[tuple[str, str], ...]:
        """(name, reason) of the runs that are not fitted."""
        return tuple((name, item.why) for name, item in self.verdicts.items() if item.verdict == "rejected")


def judged(runs: Sequence[Run], method: Method, mesh: Array | None = None) -> Judged:
    """Fit, test each run against the fit to the others, leave the worst of each kind out, and again until none is left.

    Then the doubtful ones are weighed down, and tested once more.

    Parameters
    ----------
    mesh (R, 6) : as in ``identify.identify``.

    A run that alone determines a direction of the fit cannot be tested against others and is kept. One of each kind at
    a time: a violent run spoils the fit of its neighbours, which may pass once it is gone. Half of a kind at most is
    rejected for lack of fit: where most runs of a kind contradict the rest, no single run is at fault.

    Raises
    ------
    DeriveError
        As ``identify``; every run of the set is rejected.
    """
    kept, lattice = list(runs), mesh
    gone: dict[str, Verdict] = {}
    trust = np.ones(len(kept))
    weighed = False
    while True:
        samples = settled(kept)
        solved = identify(kept, samples, method, trust=trust, mesh=lattice)
        tests = tested(kept, samples, solved)
        verdicts = [verdict_of(item) for item in tests]
        worst = _worst_of_kinds(kept, verdicts, Counter(map(family_of, runs)))
        if worst and len(worst) < len(kept):
            gone |= {name_of(kept[i], runs): replace(verdicts[i], trust=0.0) for i in worst}
            stay = [i for i in range(len(kept)) if i not in worst]
            kept, trust = [kept[i] for i in stay], trust[stay]
            lattice = None if lattice is None else lattice[stay]
        elif not weighed and any(item.trust < 1.0 for item in verdicts):
            trust, weighed = np.array([item.trust for item in verdicts]), True
        else:
            break
    final = [_as_weighed(item, float(t)) for item, t in zip(verdicts, trust, strict=True)]
    found = gone | {name_of(run, runs): item for run, item in zip(kept, final, strict=True)}
    ordered = {name: found[name] for name in (name_of(run, runs) for run in runs)}
    return Judged(tuple(kept), samples, solved, ordered, lattice)


def tested(runs: Sequence[Run], samples: Samples, solved: Solved) -> list[dict[str, Tested]]:
    """The tests of each run; a test that does not apply to its kind is absent."""
    out = measure.left_out(solved)
    found = measure.waves(runs, samples, solved.choice.order)
    scale = weights.load_scale(solved.system)
    fits = measure.misfits(runs, solved, out, found, scale)
    weight = measure.influence(solved, out, KEY_TERMS, INFLUENCE_FLOOR)
    ties = measure.ties_of(solved, solved.choice.order)
    kinds = [family_of(run) if run.steady else "" for run in runs]
    tests: list[dict[str, Tested]] = []
    for i, run in enumerate(runs):
        mine = {"lack of fit": Tested(float(fits[i, 0]), float(fits[i, 1]) or _kind_spread(kinds, fits, i))}
        if wave := found.get(i):
            without = solved.fit.unknowns[:, 0] + out.change[i]
            contents = measure.contents(run, wave, without, ties, scale)
            mine |= {name: Tested(*pair) for name, pair in contents.items()}
            if repeat := measure.repeatability(run, wave, scale):
                mine["period to period"] = Tested(*repeat)
        mine["local drift"] = Tested(measure.stern_angle(run, samples, i))
        mine["influence"] = Tested(float(weight[i]))
        tests.append({name: mine[name] for name in LIMITS if name in mine})
    return tests


def verdict_of(tests: Mapping[str, Tested]) -> Verdict:
    """The verdict that follows from the tests of one run; its trust is what it would have if it were kept.

    The variance of a doubtful run grows with the square of the ratio to the limit, so its trust falls with that.
    Influence alone rejects no run: the one strong run of a plan is influential and right.
    """
    ratio = {name: test.excess / LIMITS[name].weigh for name, test in tests.items()}
    failed = [name for name in tests if ratio[name] > 1.0 + 1e-6]
    if not failed:
        return Verdict("accepted", 1.0, tests=tests)
    trust = 1.0 / max(ratio[name] for name in failed) ** 2
    over = [name for name in failed if tests[name].excess > LIMITS[name].reject and name != "influence"]
    why = "; ".join(_words(name, tests[name], name in over) for name in (over or failed))
    return Verdict("rejected" if over else "down-weighted", trust, why, tests)


def _words(name: str, test: Tested, rejected: bool) -> str:
    """``lack of fit 41 %, above 30 %``."""
    limit = LIMITS[name]
    bound = limit.reject if rejected else limit.weigh
    size = 100.0 if limit.unit == "%" else 1.0
    return f"{name} {size * test.excess:.3g} {limit.unit}, above {size * bound:g} {limit.unit}"


def _as_weighed(verdict: Verdict, trust: float) -> Verdict:
    """The tests of the last fit with the trust that the fit used."""
    if trust < 1.0:
        why = verdict.why or "within the limits once it is weighed down; it fails them at full weight"
        return replace(verdict, verdict="down-weighted", trust=trust, why=why)
    return Verdict("accepted", 1.0, tests=verdict.tests)


def _worst_of_kinds(runs: Sequence[Run], verdicts: Sequence[Verdict], given: Mapping[str, int]) -> list[int]:
    """Of each kind the rejected run that passes a limit by the largest factor; ``given`` runs of each kind at first."""
    worst: dict[str, tuple[float, int]] = {}
    left = Counter(map(family_of, runs))
    for i, (run, verdict) in enumerate(zip(runs, verdicts, strict=True)):
        kind = family_of(run)
        half_gone = 2 * (given[kind] - left[kind] + 1) > given[kind]
        factors = {name: test.excess / LIMITS[name].reject for name, test in verdict.tests.items()}
        factors.pop("influence")
        if half_gone:
            factors.pop("lack of fit")
        factor = max(factors.values())
        if factor > worst.get(kind, (1.0, 0))[0]:
            worst[kind] = (factor, i)
    return sorted(i for _, i in worst.values())


def _kind_spread(kinds: Sequence[str], fits: Array, number: int) -> float:
    """What the scatter of a steady run's kind may show of it; 0 for a kind of two or less.

    kinds : that of each steady run, empty for an oscillation, of which 0 is given.
    """
    others = [fits[i, 0] for i, kind in enumerate(kinds) if i != number and kind == kinds[number]]
    return KIND_SPREAD * float(np.median(others)) if kinds[number] and len(others) > 1 else 0.0
