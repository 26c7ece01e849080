"""Derivatives through the engine: gradient of a misfit, sensitivities of channels, Jacobians of the rates.

They are those of the loop as it is computed, step by step, not of the differential equation; at a kink (a limit of a
fin, a switch of the pilot) the slope is the one of the side the loop is on. Parameters are those of ``Form.names``
before the inverse of the mass matrix; each is one number of its own. What a change of mass, inertia, CG or added mass
does through the inverse is part of its derivative.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from towtank.engine.form import BY_FIN, PLAY, Form, form_of, system
from towtank.engine.library import Library, Slope, library
from towtank.engine.loop import KINEMATIC, MEMORY, channels, dynamics, load_through_water, observed, states
from towtank.engine.parameters import parameters
from towtank.engine.record import Record, record_of
from towtank.errors import InputError, TowtankError
from towtank.frames import Array, rotation
from towtank.model.algebra import product
from towtank.model.dual import DUAL, gradients, variables
from towtank.model.equations import STATE, STILL, Model
from towtank.model.kinematics import euler_matrix, quaternion_of, trig_of
from towtank.model.linear import INPUTS, LinearModel, linearise_at, with_slopes
from towtank.model.rigid_body import mass_matrix
from towtank.pilot.law import NO_PILOT, Pilot

__all__ = ["Jacobians", "Misfit", "Record", "Sensitivities", "free_names", "jacobian", "linear_at", "misfit",
           "record_of", "sensitivities"]  # fmt: skip


@dataclass(frozen=True)
class Misfit:
    """value = sum of weight (seen - measured)^2; heading differences are taken within half a turn.

    gradient : name of the parameter -> slope.   start_gradient (13 + n + 3,) : to the start's state and memory.
    seen (ticks, C) : the channels at the end of each tick.
    """

    value: float
    gradient: dict[str, float]
    start_gradient: Array
    seen: Array


@dataclass(frozen=True)
class Sensitivities:
    """Channels and their slopes at the end of each tick.

    seen (ticks, C).   tangent (ticks, C, D) : slope to each of ``names``, parameters then entries of the start.
    """

    seen: Array
    tangent: Array
    names: tuple[str, ...]


@dataclass(frozen=True)
class Jacobians:
    """Rates of the state (13 + n) at N points and their slopes, SI.

    rates (N, 13 + n).   A (N, 13 + n, 13 + n) : to the state.   B (N, 13 + n, n) : to the fin angles asked.
    G (N, 13 + n, P) : to the parameters ``names``.
    """

    rates: Array
    A: Array
    B: Array
    G: Array
    names: tuple[str, ...]


def misfit(
    model: Model, start: Sequence[float] | Array, record: Record, measured: ArrayLike, weight: ArrayLike,
    channels: Sequence[str], *, thrust: float, pilot: Pilot | None = None, current: Sequence[float] = STILL,
) -> Misfit:  # fmt: skip
    """Misfit of a run to what was measured, and its gradient to every parameter and to the start.

    Parameters
    ----------
    start : (13 + n + 3,) as for ``fly``.   measured (ticks, C), SI : at the ends of the ticks; NaN where nothing was.
    weight : (ticks, C) or what broadcasts to it, such as 1 / std^2 of each channel.   channels : (C,) names.
    thrust, pilot, current : as for ``fly``.

    Source     The discrete adjoint of the loop: one run forward, one back.
    Departure  Channels at the last tick of a leg belong to that leg's line (``along``, ``across``); in the log of
               ``fly`` they belong to the next.

    Raises
    ------
    InputError
        A start, channel, measurement or weight that cannot be used.
    TowtankError
        No library on this machine, or a run that does not stay finite.
    """
    run = _Run(model, start, record, channels, thrust, pilot or NO_PILOT, current)
    shape = run.seen.shape
    wanted = np.asarray(measured, dtype=float)
    if wanted.shape != shape:
        raise InputError(
            f"misfit: measured has the shape {wanted.shape}; {shape[0]} ticks of {shape[1]} channels make {shape}. "
            "Give one row for the end of each tick, NaN where nothing was measured."
        )
    missing = np.isnan(wanted)
    heavy = np.where(missing, 0.0, np.broadcast_to(np.asarray(weight, dtype=float), shape))
    wanted = np.where(missing, 0.0, wanted)
    if not (np.isfinite(wanted).all() and np.isfinite(heavy).all() and (heavy >= 0.0).all()):
        raise InputError(
            "misfit: a measurement is infinite, or a weight is negative or not finite. Give finite numbers, weights of "
            "0 or more, and NaN for what was not measured."
        )
    value, gradient, back = np.zeros(1), np.zeros(run.form.place["inverse00"]), np.zeros(len(run.start))
    given = {"measured": np.ascontiguousarray(wanted), "weight": np.ascontiguousarray(heavy)}
    run.call("misfit", **given, misfit=value, gradient=gradient, start_gradient=back)
    run.check(value, gradient, back)
    slopes = {name: float(gradient[run.form.place[name]]) for name in free_names(model)}
    return Misfit(float(value[0]), slopes, back[run.real], run.unwrapped())


def sensitivities(
    model: Model, start: Sequence[float] | Array, record: Record, channels: Sequence[str], names: Sequence[str], *,
    start_names: Sequence[str] = (), thrust: float, pilot: Pilot | None = None, current: Sequence[float] = STILL,
) -> Sensitivities:  # fmt: skip
    """Slopes of ``channels`` at every tick to the parameters ``names`` and the entries ``start_names`` of the start.

    Parameters
    ----------
    names : parameters, of ``free_names``.   start_names : states (``x`` ... ``delta1`` ...) or memory, as they stand in
        the start; the quaternion's entries are numbers of their own there.   The rest as for ``misfit``.

    Source     Forward tangents of the loop, as a Gauss-Newton step wants them.

    Raises
    ------
    InputError
        A start, channel or name that cannot be used.
    TowtankError
        No library on this machine, or a run that does not stay finite.
    """
    run = _Run(model, start, record, channels, thrust, pilot or NO_PILOT, current)
    able = free_names(model)
    entries = [(*states(run.form.fins), *MEMORY)[i] for i in run.real]
    places = [run.form.place[name] for name in _known("sensitivities", "parameter", names, able)]
    beginning = _known("sensitivities", "entry of the start", start_names, entries)
    places += [run.form.place["inverse00"] + int(run.real[entries.index(name)]) for name in beginning]
    tangent = np.zeros((*run.seen.shape, len(places)))
    run.call("tangents", directions=len(places), direction=np.array(places, dtype=np.int64), tangent=tangent)
    run.check(tangent)
    return Sensitivities(run.unwrapped(), tangent, (*names, *start_names))


def jacobian(
    model: Model, state: ArrayLike, asked: ArrayLike, thrust: ArrayLike, current: ArrayLike = STILL
) -> Jacobians:
    """Rates and their slopes at N points.

    Parameters
    ----------
    state (N, 13 + n) : with the quaternion.   asked (N, n) [rad].   thrust [N] and current (3,) [m/s, NED], or one for
    each point: (N,) and (N, 3).   Without a library it runs on dual numbers: the same values, slower.

    Raises
    ------
    InputError
        Shapes that do not belong together, or a number that is not finite.
    """
    form, have = _smooth(form_of(model)), len(model.craft.fins)
    x, u = np.atleast_2d(np.asarray(state, dtype=float)), np.atleast_2d(np.asarray(asked, dtype=float))
    count, names = len(x), free_names(model)
    if x.shape != (count, KINEMATIC + have) or u.shape != (count, have):
        raise InputError(
            f"jacobian: states of the shape {x.shape} with asked {u.shape}. Give (N, {KINEMATIC + have}) and "
            f"(N, {have}), one row for each point."
        )
    push = np.broadcast_to(np.asarray(thrust, dtype=float), (count,))
    drift = np.broadcast_to(np.asarray(current, dtype=float), (count, 3))
    if not all(np.isfinite(a).all() for a in (x, u, push, drift)):
        raise InputError("jacobian: a state, angle, thrust or current is not finite. Give finite numbers.")
    extra = np.zeros((count, form.fins - have))
    x = np.ascontiguousarray(np.hstack([x, extra]))
    u = np.ascontiguousarray(np.hstack([u, extra, np.ones((count, 1))]))
    p = np.tile(parameters(form, model, NO_PILOT, 0.0), (count, 1))
    p[:, form.place["thrust"]] = push
    p[:, form.place["current_north"] : form.place["current_north"] + 3] = drift
    compiled = library(form)
    make = _dual_jacobians if compiled is None else _compiled_jacobians
    rates, A, B, G = make(form, compiled, p, x, u)
    real = np.arange(KINEMATIC + have)
    free = [form.place[name] for name in names]
    return Jacobians(rates[:, real], A[:, real[:, None], real], B[:, real, :have], G[:, real][:, :, free], names)


def linear_at(
    model: Model, state: Sequence[float] | Array, thrust: float, current: Sequence[float] = STILL, slopes: str = "wide"
) -> LinearModel:
    """``towtank.model.linear.linearise_at`` from the compiled text: the same linear model, to round-off.

    state : (12 + n,) with phi, theta, psi.   The other arguments, the limits and the errors are those of
    ``linearise_at``, which is called where there is no library.

    Source     ``jacobian``, and the chain rule through the quaternion of phi, theta, psi.
    """
    x, turned_model = np.asarray(state, dtype=float), with_slopes(model, slopes)
    usable = x.shape == (len(model.states),) and bool(np.isfinite([*x, thrust, *current]).all()) and np.cos(x[4]) > 0.0
    if not usable or library(_smooth(form_of(model))) is None:
        return linearise_at(model, list(state), thrust, current, slopes)
    model = turned_model
    e = quaternion_of(variables(x[3:6]), DUAL)
    at = jacobian(model, [[*x[:3], *(part.value for part in e), *x[6:]]], [x[12:]], thrust, current)
    slope, pose, held = at.A[0], [*range(3), *range(6, 12)], [*range(3), *range(7, 13)]
    A, B, remainder = np.zeros((12, 12)), np.zeros((12, len(INPUTS))), np.zeros(12)
    A[np.ix_(pose, pose)] = slope[np.ix_(held, held)]
    A[np.ix_(pose, range(3, 6))] = slope[held, 3:7] @ gradients(e, 3)
    B[pose, :3] = slope[held, KINEMATIC:] @ np.array(model.constants.fins.mixing, dtype=float)
    B[pose, 3] = at.G[0, held, at.names.index("thrust")]
    angles = variables(x[[3, 4, 5, 9, 10, 11]])
    turning = product(euler_matrix(trig_of(angles[:3], DUAL)), angles[3:])
    A[np.ix_(range(3, 6), [3, 4, 5, 9, 10, 11])] = gradients(turning, 6)
    remainder[pose], remainder[3:6] = at.rates[0, held], [rate.value for rate in turning]
    speed = float(np.linalg.norm(x[6:9] - rotation(x[3:6]).T @ np.asarray(current, dtype=float)))
    return LinearModel(A, B, STATE, INPUTS, speed, slopes, remainder)


def free_names(model: Model) -> tuple[str, ...]:
    """Names of the parameters of ``model`` that derivatives are taken to: all before the inverse of the mass matrix.

    What only fills the compiled form is left out: fins and rows of the propeller's tables that the craft has not. So
    are the dead band and the play of the actuators: a command that stays unanswered has no slope.
    """
    form, k = form_of(model), model.constants
    fins, rows = range(len(k.fins.station), form.fins), range(len(k.screw.kt.knots) if k.screw else 0, form.rows)
    hidden = {f"{word}{i}" for word in PLAY for i in range(form.fins)}
    hidden |= {f"{word}{i}" for i in fins for word in BY_FIN} | {f"lift{i}{j}" for i in fins for j in range(2)}
    hidden |= {name for i in fins for j in range(3) for name in (f"mixing{i}{j}", f"unmixing{j}{i}")}
    hidden |= {f"screw_{word}{i}" for i in rows for word in ("knot", "kt", "kq")}
    return tuple(name for name in form.names[: form.place["inverse00"]] if name not in hidden)


class _Run:
    """One run under a record: its arrays, and the call of the library."""

    def __init__(
        self, model: Model, start: Sequence[float] | Array, record: Record, names: Sequence[str], thrust: float,
        pilot: Pilot, current: Sequence[float],
    ) -> None:  # fmt: skip
        self.form, self.record, self.names, have = form_of(model), record, tuple(names), len(model.craft.fins)
        if not self.form.smooth:
            raise InputError(
                f"craft {model.craft.name}: its pilot shares a command among damaged fins by a search, which has no "
                "slopes. Take derivatives of the sound craft, or set faults_known=False."
            )
        compiled = library(self.form)
        if compiled is None:
            raise TowtankError(
                "derivatives along a run need the compiled engine, and there is none here: on numpy a gradient would "
                "take a run for each parameter. `towtank doctor` tells why; install a C compiler and CasADi, or leave "
                "TOWTANK_ENGINE unset. `jacobian` and `linear_at` work without it."
            )
        self.compiled: Library = compiled
        if any(value for word in PLAY for value in getattr(model.constants.fins, word)):
            raise InputError(
                f"craft {model.craft.name}: its fins have a dead band or play, so a run has no slopes: a small change "
                "of the command stays unanswered. Set dead_band and backlash to zero for derivatives."
            )
        self.p = parameters(self.form, model, pilot, thrust, current)
        size = KINEMATIC + self.form.fins + len(MEMORY)
        self.real = np.array([i for i in range(size) if not KINEMATIC + have <= i < KINEMATIC + self.form.fins])
        given = np.asarray(start, dtype=float)
        if given.shape != self.real.shape or not np.isfinite([*given, thrust, *current]).all():
            raise InputError(
                f"run of {model.craft.name}: the start has the shape {given.shape}, or the start, thrust or current "
                f"is not finite. Give {len(self.real)} finite numbers; towtank.engine.start.at builds a start."
            )
        self.start = np.zeros(size)
        self.start[self.real] = given
        every = channels(self.form.fins)
        absent = {f"delta{i + 1}" for i in range(have, self.form.fins)}
        able = [name for name in every[: observed(self.form.fins)] if name not in absent]
        self.channel = np.array([every.index(name) for name in _known("run", "observed channel", names, able)])
        self.seen = np.zeros((len(record.row), len(self.names)))

    def call(self, function: str, **arrays: Any) -> None:
        """Call ``function`` of the library with the run's arrays and ``arrays``, by field of ``Slope``."""
        r = self.record
        arrays |= {"p": self.p, "start": self.start, "orders": r.orders, "row": r.row, "channel": self.channel,
                   "seen": self.seen, "ticks": len(r.row), "steps": r.clock.steps, "tick": r.clock.tick,
                   "channels": len(self.names)}  # fmt: skip
        fields = {name: value.ctypes.data if isinstance(value, np.ndarray) else value for name, value in arrays.items()}
        if getattr(self.compiled.handle, function)(ctypes.byref(Slope(**fields))):
            raise TowtankError(
                f"derivatives along a run of {len(r.row)} ticks: there is no memory for its states. Give a "
                "shorter record."
            )

    def check(self, *results: Array) -> None:
        """Raise when the run or its slopes are not finite."""
        lost = np.flatnonzero(~np.isfinite(self.seen).all(axis=1))
        if lost.size or not all(np.isfinite(result).all() for result in results):
            when = f"at {self.record.time[lost[0]]:g} s" if lost.size else "in its derivatives"
            raise TowtankError(
                f"derivatives along a run: it is no longer finite {when}. The parameters, the start or the clock let "
                "the motion grow without bound; check them with fly, or take shorter steps."
            )

    def unwrapped(self) -> Array:
        """The channels seen, with the heading carried on over whole turns as ``fly`` does."""
        out = self.seen.copy()
        e0, e1, e2, e3 = self.start[3:7]
        first = np.arctan2(2.0 * (e1 * e2 + e3 * e0), 1.0 - 2.0 * (e2 * e2 + e3 * e3))
        for i in [i for i, name in enumerate(self.names) if name == "psi"]:
            out[:, i] = np.unwrap([first, *out[:, i]])[1:]
        return out


def _smooth(form: Form) -> Form:
    """The form with the same parameters and rates that has slopes: how a pilot shares commands is no part of it."""
    return replace(form, damaged=False)


def _known(where: str, what: str, names: Sequence[str], able: Sequence[str]) -> Sequence[str]:
    """``names``, all of which are in ``able``."""
    for name in names:
        if name not in able:
            raise InputError(f"{where}: no {what} {name!r}. Choose from {', '.join(able)}.")
    return names


def _compiled_jacobians(form: Form, compiled: Library | None, p: Array, x: Array, u: Array) -> tuple[Array, ...]:
    """Rates and their slopes to the state, the angles asked and the parameters before the inverse, at N points."""
    assert compiled is not None
    count, nx, free = len(x), x.shape[1], form.place["inverse00"]
    out = [np.zeros((count, nx)), *(np.zeros((count, nx, size)) for size in (nx, u.shape[1], free))]
    compiled.handle.jacobians(count, p.ctypes.data, p.shape[1], *(a.ctypes.data for a in (x, u, *out)))
    return tuple(out)


def _dual_jacobians(form: Form, compiled: Library | None, p: Array, x: Array, u: Array) -> tuple[Array, ...]:
    """As ``_compiled_jacobians``, on dual numbers."""
    nx, nu, free = x.shape[1], u.shape[1], form.place["inverse00"]
    rates, slopes = [], []
    for row, state, asked in zip(p, x, u, strict=True):
        v = variables(np.concatenate([state, asked, row[:free]]))
        inverse = row[free:].tolist()
        s = system(form, [*v[nx + nu :], *inverse])
        moved = dynamics(s, v[:nx], v[nx : nx + nu], DUAL)
        slope = gradients(moved, len(v))
        # W M = 1, so that dW load = -W dM (W load).
        held = np.array(inverse).reshape(6, 6) @ [part.value for part in load_through_water(s, v[:nx], 1.0, DUAL)]
        mass = [
            [a - b for a, b in zip(*pair, strict=True)]
            for pair in zip(mass_matrix(s.constants.body), s.constants.added, strict=True)
        ]
        slope[7:13] -= np.array(inverse).reshape(6, 6) @ gradients(product(mass, held.tolist()), len(v))
        rates.append([part.value for part in moved])
        slopes.append(slope)
    whole = np.array(slopes)
    return np.array(rates), whole[:, :, :nx], whole[:, :, nx : nx + nu], whole[:, :, nx + nu :]
