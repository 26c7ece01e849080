"""Slopes at the origin of the linear terms: what the stability indices need and a wide fit does not give."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from towtank.derive.cycles import Samples
from towtank.derive.fourier import FIRST, harmonics
from towtank.frames import Array
from towtank.symbols import FOURFOLD_TIES, LOADS, RATES
from towtank.tank.run import Run

WINDOW_DEG = 8.25
"""Largest drift or incidence of the local fit."""

WINDOW_TURN = 0.305
"""Largest r' = r L / U of the local fit; the local drift half a length aft is then 8.7 deg."""


@dataclass(frozen=True)
class Origin:
    """values, std : term -> slope at the origin and its standard uncertainty. covariance (n, n) in the order of values.

    method : term -> how it was found, in words.   spread (n, members) : model-form ensemble less the nominal values.
    """

    values: dict[str, float] = field(default_factory=dict)
    std: dict[str, float] = field(default_factory=dict)
    covariance: Array = field(default_factory=lambda: np.zeros((0, 0)))
    method: dict[str, str] = field(default_factory=dict)
    spread: Array = field(default_factory=lambda: np.zeros((0, 0)))


@dataclass(frozen=True)
class _Group:
    """One plane and rate: the steady and oscillatory kinds that hold it, and the two loads."""

    steady: str
    oscillation: str
    rate: str
    loads: str

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(f"{load}u{self.rate}" for load in self.loads)


@dataclass(frozen=True)
class _Slope:
    """values (k, 1 + members), own covariance (k, k) of fit and form."""

    names: tuple[str, ...]
    values: Array
    covariance: Array
    method: str

    def tied(self) -> _Slope:
        """The same slopes in the horizontal plane of a craft with 4-fold symmetry."""
        pairs = [FOURFOLD_TIES[name] for name in self.names]
        sign = np.array([s for _, s in pairs])
        covariance = self.covariance * np.outer(sign, sign)
        return _Slope(tuple(b for b, _ in pairs), self.values * sign[:, None], covariance, f"{self.method}, tied")


_HORIZONTAL = (_Group("drift", "sway", "v", "YN"), _Group("turn", "yaw", "r", "YN"))
_VERTICAL = (_Group("incidence", "heave", "w", "ZM"), _Group("", "pitch", "q", "ZM"))


def origin_slopes(runs: Sequence[Run], samples: Samples, wide: Mapping[str, Array]) -> Origin:
    """Slopes at the origin of Yuv, Nuv, Yur, Nur, Zuw, Muw, Zuq, Muq, as far as the runs give them.

    wide : term -> (1 + members,) values of the wide fit.

    Steady runs of small angle are fitted by u x + x^3 and a constant. Without them the gentlest oscillation is used,
    less the cross-flow part of the wide fit. The standard uncertainty holds the scatter, half the change when |x| x
    stands in place of x^3, and the model-form spread.

    Source     THEORY section 4 (fit-range warning); roddy1990, appendix B, on which the choice below was made.
    Departure  On the bare-hull table of roddy1990 (Y'v -0.00595, N'v -0.01280) a three-term fit (v, v|v|, v^3) over
               18 deg gives -0.0026 and -0.0145, the plain slope within 4 deg -0.0070 and -0.0130, this one -0.0059
               and -0.0132: it is the least sensitive to the range, so it is the one used.
    """
    fourfold = runs[0].symmetry == "fourfold"
    found: list[_Slope] = []
    for across, down in zip(_HORIZONTAL, _VERTICAL, strict=True):
        tries = [_steady(across, runs, samples), _steady(down, runs, samples)]
        falls = [_oscillation(across, runs, samples, wide), _oscillation(down, runs, samples, wide)]
        if fourfold:
            options = [tries[0], tries[1] and tries[1].tied(), falls[0], falls[1] and falls[1].tied()]
            best = next((slope for slope in options if slope), None)
            found += [best, _mirrored(best)] if best else []
        else:
            found += [slope for slope in (tries[0] or falls[0], tries[1] or falls[1]) if slope]
    return _joined(found)


def _mirrored(slope: _Slope) -> _Slope:
    back = {base: (name, sign) for name, (base, sign) in FOURFOLD_TIES.items()}
    sign = np.array([back[name][1] for name in slope.names])
    names = tuple(back[name][0] for name in slope.names)
    covariance = slope.covariance * np.outer(sign, sign)
    return _Slope(names, slope.values * sign[:, None], covariance, f"tied to {', '.join(slope.names)}")


def _joined(slopes: Sequence[_Slope]) -> Origin:
    if not slopes:
        return Origin()
    names = [name for slope in slopes for name in slope.names]
    values = np.concatenate([slope.values for slope in slopes])
    covariance = np.zeros((len(names), len(names)))
    start = 0
    for slope in slopes:
        stop = start + len(slope.names)
        covariance[start:stop, start:stop] = slope.covariance
        start = stop
    spread = values[:, 1:] - values[:, :1]
    if spread.shape[1]:
        covariance += spread @ spread.T / spread.shape[1]
    std = np.sqrt(np.diag(covariance))
    return Origin(
        dict(zip(names, values[:, 0].tolist(), strict=True)),
        dict(zip(names, std.tolist(), strict=True)),
        covariance,
        {name: slope.method for slope in slopes for name in slope.names},
        spread,
    )


def _steady(group: _Group, runs: Sequence[Run], samples: Samples) -> _Slope | None:
    at = _pure(group, runs, samples)
    if not len(at):
        return None
    rate = RATES.index(group.rate)
    speed = np.array([run.speed for run in runs])[samples.run[at]]
    u, x = samples.nu[at, 0], samples.nu[at, rate]
    size = np.abs(x) * (runs[0].length if group.rate in "rq" else 1.0) / speed
    limit = WINDOW_TURN if group.rate in "rq" else math.sin(math.radians(WINDOW_DEG))
    levels = np.unique(np.round(size[size > 1e-6], 6))
    if not len(levels):
        return None
    near = levels[levels <= limit]
    used = near if len(near) > 1 else levels[: 2 if len(levels) > 1 and levels[1] <= 2.0 * limit else 1]
    keep = size <= used[-1] + 1e-6
    u, x, speed = u[keep], x[keep], speed[keep]
    load = samples.loads[:, at[keep]][:, :, [LOADS.index(name) for name in group.loads]]
    values, covariance = _local(u, x, speed, load, curved=len(used) > 1)
    reach = f"r L/U up to {used[-1]:.2f}" if group.rate in "rq" else f"{math.degrees(math.asin(used[-1])):.1f} deg"
    form = "u x, x^3" if len(used) > 1 else "u x alone"
    return _Slope(group.names, values, covariance, f"{keep.sum()} steady {group.steady} runs within {reach}, {form}")


def _pure(group: _Group, runs: Sequence[Run], samples: Samples) -> NDArray[np.intp]:
    """Samples of the steady runs that hold only the rate of the group (or nothing), fins amidships."""
    kind = np.array([run.steady and run.kind in (group.steady, "drift", "incidence") for run in runs])[samples.run]
    others = [i for i, rate in enumerate(RATES) if rate not in ("u", group.rate)]
    clean = np.all(np.abs(samples.nu[:, others]) < 1e-9, axis=1) & (samples.control[:, 3] == 0.0)
    return np.flatnonzero(kind & clean)


def _local(u: Array, x: Array, speed: Array, load: Array, curved: bool) -> tuple[Array, Array]:
    """Slopes (k, 1 + members) and their covariance (k, k) from loads (1 + members, N, k)."""

    def fit(cubic: bool) -> tuple[Array, Array]:
        terms = [u * x]
        if curved:
            terms.append(x**3 / speed if cubic else np.abs(x) * x)
        if np.any(x > 0) and np.any(x < 0) and len(x) > len(terms) + 1:
            terms.append(speed**2)
        matrix = np.stack(terms, axis=1)
        return matrix, np.linalg.pinv(matrix / np.linalg.norm(matrix, axis=0)) / np.linalg.norm(matrix, axis=0)[:, None]

    matrix, inverse = fit(True)
    values = np.einsum("n,mnk->km", inverse[0], load)
    coefficients = inverse @ load[0]
    residual = load[0] - matrix @ coefficients
    freedom = len(x) - matrix.shape[1]
    covariance = residual.T @ residual / max(freedom, 1) * float(inverse[0] @ inverse[0])
    other = fit(False)[1][0] @ load[0]
    gap = 0.5 * (values[:, 0] - other)
    return values, covariance + np.outer(gap, gap)


def _oscillation(group: _Group, runs: Sequence[Run], samples: Samples, wide: Mapping[str, Array]) -> _Slope | None:
    rate = RATES.index(group.rate)
    choices = [
        (round(float(np.abs(samples.nu[samples.run == i, rate]).max()) / run.speed, 9), 1.0 / run.period, i)
        for i, run in enumerate(runs)
        if run.kind == group.oscillation and not run.steady
    ]
    if not choices:
        return None
    number = min(choices)[2]
    at = samples.run == number
    cycles = int(samples.period[at].max()) + 1
    motion = harmonics(samples.nu[at], 1, cycles)
    drive, u = motion[1, rate], abs(float(motion[0, 0].real))
    rows, parts = [], []
    for name in group.loads:
        load = harmonics(samples.loads[:, at, LOADS.index(name)].T, 1, cycles)
        quadratic = FIRST * abs(drive) / u * np.asarray(wide.get(f"{name}{group.rate}{group.rate}", 0.0))
        rows.append((load[1] / drive).real / u - quadratic)
        parts.append(0.5 * float(np.ravel(quadratic)[0]))
    method = f"quadrature of {runs[number].name}, the gentlest {group.oscillation} run, less its cross-flow part"
    return _Slope(group.names, np.array(rows), np.outer(parts, parts), method)
