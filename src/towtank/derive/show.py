"""Derivatives as a text table and as primed numbers."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from towtank.derive.convert import about_point
from towtank.derive.table import Derivatives
from towtank.errors import DeriveError
from towtank.frames import Array
from towtank.symbols import TERMS

LEVELS = {
    "semi-empirical": "semi-empirical tank: not CFD, not experiment",
    "rans": "RANS: not experiment",
    "experiment": "experiment",
    "published": "published values, not derived here",
    "known coefficients": "known coefficients evaluated: a test of identification, no statement about a hull",
}
"""Level of evidence in words."""

ROUND_OFF = 1e-13
"""Primed values below this are printed as zero; those of a craft are 1e-2 to 1e-7."""


def primes(
    d: Derivatives, length: float | None = None, about: float | None = None, speed: float | None = None
) -> dict[str, float]:
    """Term -> primed value: force / (0.5 rho U2 L2), moment / (0.5 rho U2 L3).

    Parameters
    ----------
    length : reference length [m].   about : point aft of the nose [m].   speed : reference speed [m/s]; every term of
        the model is of second order in velocity, so it has no effect on their primes. Defaults: those of ``d``.

    Source     sname1950.
    """
    moved = about_point(d, about, length)
    if speed is not None:
        if not speed > 0.0:
            raise DeriveError(f"primes: speed {speed} m/s is not positive. Primes are divided by powers of it.")
        moved = replace(moved, reference=replace(moved.reference, speed=speed))
    return {name: value / prime_factor(moved, name) for name, value in moved.as_dict().items()}


def origin_primes(d: Derivatives, length: float | None = None, about: float | None = None) -> dict[str, float]:
    """Primed slopes at the origin; arguments as in ``primes``."""
    moved = about_point(d, about, length)
    return {name: value / prime_factor(moved, name) for name, value in moved.origin.items()}


def prime_factor(d: Derivatives, name: str) -> float:
    """What the term ``name`` of ``d`` is divided by to be primed."""
    return TERMS[name].prime_factor(d.reference.density, d.reference.length, d.reference.speed)


def std_parts(d: Derivatives) -> dict[str, Array]:
    """Standard uncertainties (n,) by origin: fit, mesh, model."""
    covariances = {"fit": d.covariance_fit, "mesh": d.covariance_mesh, "model": d.covariance_model}
    return {part: np.sqrt(np.maximum(np.diag(covariance), 0.0)) for part, covariance in covariances.items()}


def pair(value: float, std: float) -> str:
    """``value +/- std`` with two figures of the uncertainty, and the value to the same place.

    At most 6 figures of the value. An uncertainty below those is written in full to two figures.
    """
    if not math.isfinite(std) or std <= 0.0 or value == 0.0 or std < 1e-6 * abs(value):
        return f"{value:.6g} +/- {std:.2g}"
    place = math.floor(math.log10(std)) - 1
    if -6 <= place <= 0:
        return f"{value:.{-place}f} +/- {std:.{-place}f}"
    if place > 0:
        return f"{round(value, -place):.0f} +/- {round(std, -place):.0f}"
    return f"{value:.6g} +/- {std:.2g}"


def table(d: Derivatives) -> str:
    """The set as plain text: term, value and standard uncertainty, unit, prime, its parts, runs it rests on."""
    rows = [("term", "value +/- std", "unit", "prime", "fit", "mesh", "model", "runs"), *_rows(d)]
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = ["  ".join(_aligned(text, widths[i], i) for i, text in enumerate(row)).rstrip() for row in rows]
    return "\n".join([*_head(d), "", lines[0], "-" * len(lines[0]), *lines[1:], "", *_foot(d)])


def _aligned(text: str, width: int, column: int) -> str:
    return text.ljust(width) if column in (0, 2, 7) else text.rjust(width)


def _rows(d: Derivatives) -> list[tuple[str, ...]]:
    parts = std_parts(d)
    total = np.sqrt(np.maximum(np.diag(d.covariance), 0.0))
    prime = [float(value) / prime_factor(d, name) for name, value in zip(d.names, d.values, strict=True)]
    return [
        (
            name,
            pair(float(d.values[i]) if abs(prime[i]) > ROUND_OFF else 0.0, float(total[i])),
            TERMS[name].unit,
            f"{prime[i]:.3e}" if abs(prime[i]) > ROUND_OFF else "0",
            *(f"{float(parts[part][i]):.2g}" for part in ("fit", "mesh", "model")),
            _runs(d.runs.get(name, ())),
        )
        for i, name in enumerate(d.names)
    ]


def _runs(names: tuple[str, ...]) -> str:
    """``6 sway, 5 drift``: counted by the word before the first digit or hyphen of the run's name."""
    kinds: dict[str, int] = {}
    for name in names:
        word = name.split("-")[0]
        kinds[word] = kinds.get(word, 0) + 1
    return ", ".join(f"{count} {word}" for word, count in kinds.items())


def _head(d: Derivatives) -> list[str]:
    r = d.reference
    levels = "; ".join(LEVELS.get(level, level) for level in d.level.split(" + "))
    return [
        f"Hydrodynamic derivatives of {d.craft}, variant {d.variant}, loads on the body, SI",
        f"Level: {levels}",
        f"Reference: L = {r.length:g} m, U = {r.speed:g} m/s, rho = {r.density:g} kg/m3, "
        f"origin {r.origin_from_nose:.4g} m aft of the nose",
        f"Standard uncertainties (1 sigma) from fit, mesh and model form; 0 in a column means not assessed: "
        f"{_unassessed(d)}",
    ]


def _unassessed(d: Derivatives) -> str:
    named = {"mesh": d.covariance_mesh, "model form": d.covariance_model}
    missing = [word for word, covariance in named.items() if not np.any(covariance)]
    return ", ".join(missing) if missing else "none"


def fin_words(d: Derivatives) -> list[str]:
    """Sentences on fin loads beyond the linear range and on the straightening factors; why there are none."""
    curve = d.fin_curve
    if curve is None:
        return [f"No fin curve: {d.quality['fin_curve']}."] if d.quality.get("fin_curve") else []
    stall, width = (math.degrees(curve.stall), math.degrees(curve.std[0])), math.degrees(curve.width)
    lines = [
        f"Fin curve ({curve.level}): {'stall' if curve.drop else 'no stall up to'} {pair(*stall)} deg, curvature "
        f"{pair(curve.curvature, curve.std[1])} /rad, drop {pair(curve.drop, curve.std[2])} over {width:.2g} deg; "
        f"residual {100.0 * curve.residual:.2g} %; {curve.source}."
    ]
    if curve.kappa_level:
        lines.append(
            f"Straightening ({curve.kappa_level}): kappa_v {pair(curve.kappa_v, curve.kappa_std[0])}, kappa_r "
            f"{pair(curve.kappa_r, curve.kappa_std[1])}; {curve.kappa_source}."
        )
    return lines


def _foot(d: Derivatives) -> list[str]:
    lines = []
    if d.origin:
        slopes = (f"{name} {pair(value, d.origin_std.get(name, 0.0))}" for name, value in d.origin.items())
        lines.append("Slopes at the origin (stability indices use these): " + "; ".join(slopes))
    q = d.quality
    if "condition_number" in q:
        lines.append(
            f"Fit over {q.get('runs')} runs, drift to {q.get('range_deg'):g} deg, fins to {q.get('fins_range_deg'):g} "
            f"deg; condition number {q['condition_number']:.3g}; steady-drift weight {q.get('weight_steady'):g}."
        )
    lines += fin_words(d)
    if d.rejected:
        lines.append(f"Not fitted: {len(d.rejected)} runs, such as {d.rejected[0][0]} ({d.rejected[0][1]}).")
    if q.get("not_excited"):
        lines.append("Not identified: " + "; ".join(f"{k} ({why})" for k, why in q["not_excited"].items()) + ".")
    if q.get("flags"):
        lines.append(f"{len(q['flags'])} runs carry validity remarks; see quality.flags.")
    if "moved" in q:
        lines.append(q["moved"]["note"])
    return lines
