"""The parameters of a model and its pilot as one vector, and how the derived ones follow when some are changed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from towtank.engine.form import ADDED, BEND, BODY, BY_FIN, DAMPING, INFLOW, Form
from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.equations import STILL, Constants, Model
from towtank.model.rigid_body import Body, mass_matrix
from towtank.pilot.law import GAINS, Pilot

Places = NDArray[np.int64]
"""Places in the vector of parameters."""

_POSITIVE = ("max_angle", "max_rate", "time_constant", "fin_stall", "fin_width")

MASS = (*BODY, *ADDED)
"""Parameters that change the mass matrix or may: those for which its inverse must be taken again."""


def parameters(form: Form, model: Model, pilot: Pilot, thrust: float, current: Sequence[float] = STILL) -> Array:
    """The vector (len(form.names),) of ``model`` under ``pilot`` at ``thrust`` [N] in ``current`` (3,) [m/s, NED]."""
    k = model.constants
    values: dict[str, float] = {name: float(getattr(k.body, name)) for name in BODY}
    values |= {name: float(getattr(k.c, name)) for name in form.damping}
    values |= dict(zip(ADDED, np.asarray(k.added, dtype=float).ravel().tolist(), strict=True))
    values |= {"thrust": float(thrust)}
    values |= dict(zip(("current_north", "current_east", "current_down"), map(float, current), strict=True))
    values |= _fins(form, k) | _screw(form, k)
    if form.extra and k.extra:
        values |= {f"extra_{name}": float(value) for name, value in k.extra.values.items()}
    values |= {f"pilot_{name}": float(getattr(pilot, name)) for name in GAINS}
    inverse = np.asarray(k.mass_inverse, dtype=float)
    values |= {f"inverse{i}{j}": float(inverse[i, j]) for i in range(6) for j in range(6)}
    return np.array([values[name] for name in form.names])


def _fins(form: Form, k: Constants) -> dict[str, float]:
    """The craft's fins, then fins that never move and have no effect."""
    have = len(k.fins.station)
    out = {f"mixing{i}{j}": 0.0 for i in range(form.fins) for j in range(3)}
    out |= {f"unmixing{j}{i}": 0.0 for i in range(form.fins) for j in range(3)}
    for i in range(have):
        for j in range(3):
            out[f"mixing{i}{j}"], out[f"unmixing{j}{i}"] = float(k.fins.mixing[i][j]), float(k.fins.unmixing[j][i])
    for word in BY_FIN:
        values, none = getattr(k.fins, word), float(word in _POSITIVE)
        out |= {f"{word}{i}": float(values[i]) if i < have else none for i in range(form.fins)}
    for i in range(form.fins):
        lift = k.fins.lift[i] if i < have else (0.0, 0.0)
        out |= {f"lift{i}0": float(lift[0]), f"lift{i}1": float(lift[1])}
    out |= {f"fin_{word}": float(getattr(k.fins.bend, word)) for word in BEND}
    return out | {word: float(getattr(k.fins, word)) for word in INFLOW} | {"fin_share": 1.0 / max(have, 1)}


def _screw(form: Form, k: Constants) -> dict[str, float]:
    """The propeller; its tables are carried on with the last knot and zero slopes."""
    if not form.rows or k.screw is None:
        return {}
    s = k.screw
    names = ("density", "diameter", "wake", "deduction", "torque", "force_per_square")
    out = {f"screw_{name}": float(getattr(s, name)) for name in names}
    knots = [*s.kt.knots, *[s.kt.knots[-1]] * (form.rows - len(s.kt.knots))]
    out |= {f"screw_knot{i}": float(x) for i, x in enumerate(knots)}
    for word, table in (("kt", s.kt), ("kq", s.kq)):
        column = [table.first, *table.slopes]
        column += [0.0] * (form.rows - len(column))
        out |= {f"screw_{word}{i}": float(x) for i, x in enumerate(column)}
    return out


def varied(form: Form, base: Array, columns: Mapping[str, Array], count: int) -> tuple[Places, Array]:
    """Places (m,) and values (N, m) of the parameters that differ between N = ``count`` trajectories.

    columns : name -> (N,).   When a mass, an inertia, a CG or an added mass is among them, the inverse of the mass
    matrix of every trajectory is taken as well.

    Raises
    ------
    InputError
        A name that this form does not have, a column that is not (N,), a value that is not finite, or a mass matrix
        that is not positive definite.
    """
    table = {name: np.asarray(values, dtype=float) for name, values in columns.items()}
    unknown = [name for name in table if name not in form.place or name.startswith("inverse")]
    if unknown:
        raise InputError(
            f"ensemble: no parameter {unknown[0]!r}. Choose from derivatives ({DAMPING[0]}, {DAMPING[9]}, {ADDED[0]}, "
            f"...), the body ({', '.join(BODY[:5])}, ...), thrust, current_north, current_east, current_down, "
            "pilot_<gain>, max_angle0, ... (towtank.engine.form.Form.names lists all)."
        )
    for name, values in table.items():
        if values.shape != (count,):
            raise InputError(
                f"ensemble of {count}: {name} has the shape {values.shape}. Give one number for each trajectory, "
                f"({count},)."
            )
        if not np.all(np.isfinite(values)):
            raise InputError(f"ensemble: {name} has a value that is not finite. Give finite numbers.")
        if name.startswith(_POSITIVE) and not np.all(values > 0.0):
            raise InputError(f"ensemble: {name} has a value of {values.min():g}. Limits and lags of fins are positive.")
    if set(table) & set(MASS):
        inverse = np.linalg.inv(_mass_matrices(form, base, table, count))
        table |= {f"inverse{i}{j}": inverse[:, i, j] for i in range(6) for j in range(6)}
    places = np.array([form.place[name] for name in table], dtype=np.int64)
    return places, np.ascontiguousarray(np.stack(list(table.values()), axis=1))


def _mass_matrices(form: Form, base: Array, table: Mapping[str, Array], count: int) -> Array:
    def column(name: str) -> Array:
        return table.get(name, np.full(count, base[form.place[name]]))

    rigid = mass_matrix(Body(*(column(name) for name in BODY)))  # type: ignore[arg-type]
    added = np.stack([column(name) for name in ADDED], axis=1).reshape(count, 6, 6)
    mass = np.stack([np.stack([np.broadcast_to(a, (count,)) for a in row], axis=-1) for row in rigid], axis=1) - added
    smallest = np.linalg.eigvalsh(0.5 * (mass + mass.transpose(0, 2, 1))).min()
    if not smallest > 0.0:
        raise InputError(
            f"ensemble: a mass matrix M_RB - M_A is not positive definite (smallest eigenvalue {smallest:.3g}). The "
            "spread of the added masses, the mass or the CG is too large for this craft: narrow it."
        )
    return np.asarray(mass)
