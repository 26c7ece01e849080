"""Derivatives about another point of the hull axis, and with another reference length."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from towtank.derive.table import Derivatives
from towtank.errors import DeriveError
from towtank.frames import Array
from towtank.symbols import LOADS, RATES, TERMS
from towtank.terms import term_loads

NOTE = (
    "Added mass, linear, fin and second-order axial terms are moved exactly (ahead, u > 0). Yvv, Nvv, Zww, Mww and "
    "Yrr, Nrr, Zqq, Mqq are those of pure sway (heave) and pure yaw (pitch) about the new point; their mixture "
    "v|r|, |v|r has no term in the model and stays behind. Xvvvv, Xwwww, Xuuvv, Xuuww, Kvv and Krr are kept. "
    "Third-order terms move exactly but for the speed they are divided by, which changes by r times the shift."
)


def about_point(d: Derivatives, from_nose: float | None = None, length: float | None = None) -> Derivatives:
    """The same hydrodynamics, seen from another point and with another reference length.

    Parameters
    ----------
    from_nose : distance of the new origin aft of the nose [m]; on the hull axis. None keeps the present one.
    length : reference length [m] of the primed values. None keeps the present one.

    Returns
    -------
    Derivatives whose ``quality["moved"]`` says how each kind of term was moved and what was left behind.

    Source     fossen2021 (system transformation, H^T M H); lamb1932; roddy1990 uses 4.261 m and a point 2.013 m aft
               of the nose.
    Departure  Quadratic terms |v| v cannot be moved exactly: see ``NOTE``. ``residual`` is the root mean square error
               this leaves over |v|/U < 0.36 and r L/U < 0.6, as a share of the load.
    Valid      u > 0, where |u| v and u v are the same.
    """
    if length is not None and not (np.isfinite(length) and length > 0.0):
        raise DeriveError(f"about_point: length {length} m is not positive. Primes are divided by powers of it.")
    if from_nose is not None and not np.isfinite(from_nose):
        raise DeriveError(f"about_point: from_nose {from_nose} m is not finite. Give the distance aft of the nose.")
    out = d if length is None else replace(d, reference=replace(d.reference, length=float(length)))
    shift = 0.0 if from_nose is None else d.reference.origin_from_nose - from_nose
    return out if shift == 0.0 else _moved(out, float(shift))


def transformation(names: Sequence[str], shift: float) -> tuple[tuple[str, ...], Array]:
    """Names of the moved set and the matrix (moved, names) that gives its values.

    shift : body x [m] of the new point from the old one, positive forward.
    """
    full = np.zeros((len(TERMS), len(TERMS)))
    index = {name: i for i, name in enumerate(TERMS)}
    for name, term in TERMS.items():
        full[index[name], index[name]] = 1.0
        if term.is_added_mass:
            _move_added_mass(full, index, name, shift)
    for new, old, factor in (*_rules(shift), *_cubic_rules(shift)):
        full[index[new], index[old]] += factor
    picked = full[:, [index[name] for name in names]]
    kept = [i for i, name in enumerate(TERMS) if np.any(picked[i] != 0.0)]
    return tuple(list(TERMS)[i] for i in kept), picked[kept]


def rigid_shift(shift: float) -> Array:
    """H (6, 6) with nu_old = H nu_new and load_new = H^T load_old, for a new point ``shift`` [m] ahead of the old.

    Source     fossen2021 (system transformation matrix).
    """
    h = np.eye(6)
    h[1, 5], h[2, 4] = -shift, shift
    return h


def _move_added_mass(full: Array, index: Mapping[str, int], name: str, shift: float) -> None:
    """M_A,new = H^T M_A H, entry by entry."""
    h = rigid_shift(shift)
    i, j = LOADS.index(name[0]), RATES.index(name[1])
    spread = np.outer(h[i], h[j])
    for a, b in np.argwhere(spread != 0.0):
        full[index[f"{LOADS[a]}{RATES[b]}dot"], index[name]] = spread[a, b]


def _rules(s: float) -> list[tuple[str, str, float]]:
    """(new term, old term, factor) beside the identity: v = v' - s r, w = w' + s q, N' = N - s Y, M' = M + s Z."""
    a = s * abs(s)
    return [
        ("Yur", "Yuv", -s), ("Nuv", "Yuv", -s), ("Nur", "Nuv", -s), ("Nur", "Yur", -s), ("Nur", "Yuv", s * s),
        ("Zuq", "Zuw", s), ("Muw", "Zuw", s), ("Muq", "Muw", s), ("Muq", "Zuq", s), ("Muq", "Zuw", s * s),
        ("Kur", "Kuv", -s),
        ("Xvr", "Xvv", -2.0 * s), ("Xrr", "Xvr", -s), ("Xrr", "Xvv", s * s),
        ("Xwq", "Xww", 2.0 * s), ("Xqq", "Xwq", s), ("Xqq", "Xww", s * s),
        ("Nuudr", "Yuudr", -s), ("Muude", "Zuude", s),
        ("Nvv", "Yvv", -s), ("Yrr", "Yvv", -a), ("Nrr", "Nvv", -a), ("Nrr", "Yrr", -s), ("Nrr", "Yvv", s * a),
        ("Mww", "Zww", s), ("Zqq", "Zww", a), ("Mqq", "Mww", a), ("Mqq", "Zqq", s), ("Mqq", "Zww", s * a),
    ]  # fmt: skip


def _cubic_rules(s: float) -> Iterator[tuple[str, str, float]]:
    """As ``_rules``, for the third-order terms: (v + t r)^(3-k) r^k about the new point; t = -s, and t = s for w, q."""
    for force, moment, a, b, t in (("Y", "N", "v", "r", -s), ("Z", "M", "w", "q", s)):
        cubes = [a * (3 - k) + b * k for k in range(4)]
        for k, old in enumerate(cubes):
            for j in range(4 - k):
                share, new = math.comb(3 - k, j) * t**j, cubes[k + j]
                if j:
                    yield f"{force}{new}", f"{force}{old}", share
                    yield f"{moment}{new}", f"{moment}{old}", share
                yield f"{moment}{new}", f"{force}{old}", t * share


def _moved(d: Derivatives, shift: float) -> Derivatives:
    names, matrix = transformation(d.names, shift)
    values = matrix @ d.values
    touched = [[d.names[j] for j in np.flatnonzero(row)] for row in matrix]
    runs = {
        name: tuple(dict.fromkeys(run for old in olds for run in d.runs.get(old, ())))
        for name, olds in zip(names, touched, strict=True)
    }
    origin, std, covariance, across = _moved_origin(d, shift, matrix)
    quality = dict(d.quality)
    quality["origin"] = {**quality.get("origin", {}), "order": list(origin), "covariance": covariance.tolist(),
                         "with_terms": across.tolist()}  # fmt: skip
    quality["moved"] = {
        "shift_forward": shift,
        "note": NOTE,
        "residual": _left_behind(d, dict(zip(names, values, strict=True)), shift),
    }
    reference = replace(d.reference, origin_from_nose=d.reference.origin_from_nose - shift)
    return replace(
        d, reference=reference, names=names, values=values, runs=runs, origin=origin, origin_std=std, quality=quality,
        covariance_fit=matrix @ d.covariance_fit @ matrix.T, covariance_mesh=matrix @ d.covariance_mesh @ matrix.T,
        covariance_model=matrix @ d.covariance_model @ matrix.T,
        fin_curve=None if d.fin_curve is None else d.fin_curve.about(d.reference.origin_from_nose, shift),
    )  # fmt: skip


def _moved_origin(d: Derivatives, shift: float, wide: Array) -> tuple[dict[str, float], dict[str, float], Array, Array]:
    """Slopes at the origin about the new point: values, std, covariance (p, p) and covariance with the terms (p, n).

    Without a stored covariance they are taken as independent. wide (moved, n) : as ``transformation`` moves the terms.

    Terms whose slope at the origin is not known stay unknown.
    """
    order = list(d.origin)
    if not order:
        return {}, {}, np.zeros((0, 0)), np.zeros((0, len(wide)))
    stored = d.quality.get("origin", {}).get("covariance")
    old = np.diag([d.origin_std.get(n, 0.0) ** 2 for n in order]) if stored is None else np.array(stored, dtype=float)
    names, matrix = transformation(order, shift)
    own = [i for i, name in enumerate(names) if name in order]
    names, matrix = tuple(names[i] for i in own), matrix[own]
    values, covariance = matrix @ np.array([d.origin[n] for n in order]), matrix @ old @ matrix.T
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    across = np.array(d.quality.get("origin", {}).get("with_terms", np.zeros((len(order), wide.shape[1]))), dtype=float)
    return (
        dict(zip(names, values.tolist(), strict=True)),
        dict(zip(names, std.tolist(), strict=True)),
        covariance,
        matrix @ across @ wide.T,
    )


def _left_behind(d: Derivatives, moved: Mapping[str, float], shift: float) -> dict[str, Any]:
    """Share of each load that the moved set misses, over mixed sway and yaw, heave and pitch within the fit range."""
    grid = np.linspace(-1.0, 1.0, 9)
    a, b = (g.ravel() for g in np.meshgrid(0.36 * grid, 0.6 * grid))
    speed, length = d.reference.speed, d.reference.length
    new = np.zeros((2 * len(a), 6))
    new[:, 0] = speed
    new[: len(a), 1], new[: len(a), 5] = a * speed, b * speed / length
    new[len(a) :, 2], new[len(a) :, 4] = a * speed, b * speed / length
    h, still, hands_off = rigid_shift(shift), np.zeros_like(new), np.zeros((len(new), 4))
    exact = term_loads(d.as_dict(), new @ h.T, still, hands_off) @ h
    error = term_loads(moved, new, still, hands_off) - exact
    size = np.sqrt((exact**2).mean(axis=0))
    return {load: float(np.sqrt((error[:, i] ** 2).mean()) / size[i]) for i, load in enumerate(LOADS) if size[i] > 0.0}
