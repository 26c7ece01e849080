"""Derivatives through the engine against differences of runs, against CasADi's own, and against dual numbers."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from engine_cases import CASES, CLOCK, figure, legs, model, shared, start

from towtank.engine.form import form_of
from towtank.engine.library import CHOICE, library
from towtank.engine.loop import MEMORY, channels, observed, states
from towtank.engine.parameters import MASS, parameters
from towtank.engine.plan import Clock, Leg, Log
from towtank.engine.reference import SHARE
from towtank.engine.run import Ensemble, fly
from towtank.engine.slopes import (
    Record,
    free_names,
    jacobian,
    linear_at,
    misfit,
    record_of,
    sensitivities,
)
from towtank.engine.start import at
from towtank.engine.trace import traced
from towtank.errors import InputError, TowtankError
from towtank.model.linear import linearise_at
from towtank.model.options import ModelOptions
from towtank.pilot.orders import Orders

SEEN = ("x", "y", "z", "phi", "theta", "psi", "u", "v", "w", "p", "q", "r", "delta1", "delta3", "speed", "drift",
        "turn", "sink", "level_speed", "ahead", "along", "across", "fin_square", "fin_largest")  # fmt: skip
KINKS = ("max_angle", "max_rate", "mixing", "unmixing", "stuck")
"""Where several fins reach a limit together, round-off says which of them binds: only the sum over them is definite."""

assert library(form_of(model("lumped"))) is not None, "these tests need a compiled engine"


def noise(shape, seed=1):
    return np.random.default_rng(seed).normal(size=shape)


def run_of(name):
    craft = model(name)
    return craft, start(craft), record_of(legs(), CLOCK), shared(craft)


def apart(craft, begin, names, step, given, flown):
    """Channels (2, D, ticks, C) of runs with each of ``names`` moved by +-step (D,), on the loop that ``fly`` runs."""
    form, places = form_of(craft), len(names)
    base = parameters(form, craft, given["pilot"], given["thrust"], given["current"])
    columns = {}
    for d, name in enumerate(names):
        values = np.full((2, places), base[form.place[name]])
        values[:, d] += np.array([step[d], -step[d]])
        columns[name] = values.ravel()
    log = fly(craft, begin, flown, clock=CLOCK, log=Log(SEEN), ensemble=Ensemble(2 * places, columns), **given).log
    return log[:, 1:].reshape(2, places, -1, len(SEEN))


def differences(craft, begin, names, size, given, flown):
    """Central differences (D, ticks, C), extrapolated from two steps (Richardson)."""
    one, two = (
        (rows[0] - rows[1]) / (2.0 * step[:, None, None])
        for step in (size, 2.0 * size)
        for rows in [apart(craft, begin, names, step, given, flown)]
    )
    return (4.0 * one - two) / 3.0


def within(craft, along, wanted_at, names, given):
    """True (C, D) where tangents are the differences of runs, for one of two sizes of step.

    A difference of runs of magnitude y with a step h is known to some 1e-14 y / h; a small step stays clear of kinks.
    """
    form, largest, typical = form_of(craft), np.abs(along.tangent).max(axis=0), np.abs(along.seen).max(axis=0)
    base = parameters(form, craft, given["pilot"], given["thrust"], given["current"])
    value = np.abs([base[form.place[name]] for name in names])
    good = np.zeros(largest.shape, dtype=bool)
    for share in (1e-4, 1e-5):
        size = np.minimum(share / np.maximum((largest / typical[:, None]).max(axis=0), 1e-12), 1e3)
        size = np.where(value > 0.0, np.minimum(size, 1e-2 * value), size)
        error = np.abs(along.tangent - wanted_at(size).transpose(1, 2, 0)).max(axis=0)
        good |= error <= 1e-7 * largest + 2e-14 * typical[:, None] / size
    return good


@pytest.mark.parametrize("name", CASES)
def test_tangents_are_the_differences_of_runs_for_every_parameter(name):
    """All parameters of the form; the mass, CG, inertia and added mass move the inverse, which the runs take again."""
    craft, begin, _, given = run_of(name)
    flown, names = legs()[:2], free_names(craft)
    along = sensitivities(craft, begin, record_of(flown, CLOCK), SEEN, names, **given)
    good = within(craft, along, lambda size: differences(craft, begin, names, size, given, flown), names, given)
    assert {(SEEN[c], names[d]) for c, d in zip(*np.nonzero(~good), strict=True)} == set()
    # Not for nothing: most parameters move most channels, those of the inverse among them.
    moves = np.abs(along.tangent).max(axis=0)
    assert (moves > 0.0).mean() > 0.6
    assert all(moves[0, names.index(each)] > 0.0 for each in MASS if each not in ("xB", "yB", "g", "b"))


def test_fins_at_their_limits_share_a_slope_that_only_their_sum_shows():
    craft, begin, _, given = run_of("lumped")
    flown = [Leg("turn", replace(legs()[1].orders, heading=1.4, depth=6.0), 6.0)]
    record = record_of(flown, CLOCK)
    names = free_names(craft)
    along = sensitivities(craft, begin, record, SEEN, names, **given)
    assert np.abs(along.seen[:, SEEN.index("fin_largest")]).max() > 0.4
    good = within(craft, along, lambda size: differences(craft, begin, names, size, given, flown), names, given)
    bad = {names[d] for d in np.nonzero(~good)[1]}
    assert all(each.startswith(KINKS) for each in bad), bad
    weight = noise(along.seen.shape) ** 2
    back = misfit(craft, begin, record, 0.0 * weight, weight, SEEN, **given).gradient
    forward = dict(zip(names, 2.0 * np.einsum("kc,kc,kcd->d", weight, along.seen, along.tangent), strict=True))
    scale = max(abs(value) for value in forward.values())
    for each in [n for n in names if not n.startswith(KINKS)]:
        assert back[each] == pytest.approx(forward[each], rel=1e-9, abs=1e-12 * scale)
    for word in ("max_angle", "max_rate"):
        a, b = (sum(value for each, value in table.items() if each.startswith(word)) for table in (back, forward))
        assert a == pytest.approx(b, rel=1e-9)


@pytest.mark.parametrize("name", CASES)
def test_the_adjoint_is_the_sum_of_the_tangents(name):
    craft, begin, record, given = run_of(name)
    entries = ("x", "e0", "e3", "u", "r", "delta2", *MEMORY)
    along = sensitivities(craft, begin, record, SEEN, free_names(craft), start_names=entries, **given)
    measured, weight = along.seen + 0.01 * noise(along.seen.shape), noise(along.seen.shape, 2) ** 2
    measured[3::7, 2] = np.nan
    found = misfit(craft, begin, record, measured, weight, SEEN, **given)
    off = np.where(np.isnan(measured), 0.0, weight * (along.seen - measured))
    wanted = 2.0 * np.einsum("kc,kcd->d", off, along.tangent)
    assert found.value == pytest.approx(np.nansum(weight * (along.seen - measured) ** 2), rel=1e-12)
    size = 2.0 * np.einsum("kc,kcd->d", np.abs(off), np.abs(along.tangent))
    slots = [*states(len(craft.craft.fins)), *MEMORY]
    got = np.array([*found.gradient.values(), *(found.start_gradient[slots.index(each)] for each in entries)])
    assert list(found.gradient) == list(free_names(craft))
    assert along.names == (*found.gradient, *entries)
    assert np.abs(got - wanted).max() <= 1e-11 * size.max()
    assert np.all(np.abs(got - wanted) <= 1e-11 * size + 1e-14 * size.max())
    assert len(found.start_gradient) == len(begin)
    np.testing.assert_allclose(found.seen, along.seen, rtol=0, atol=1e-13)


@pytest.mark.parametrize("name", ["lumped", "three fins"])
def test_the_gradient_to_the_start_is_the_difference_of_misfits(name):
    craft, begin, record, given = run_of(name)
    measured = 0.05 * noise((len(record.row), 3))
    channels_ = ("y", "z", "psi")

    def at_start(i, step):
        moved = begin.copy()
        moved[i] += step
        return misfit(craft, moved, record, measured, (1.0, 2.0, 3.0), channels_, **given)

    found = at_start(0, 0.0)
    for i in range(len(begin)):
        one, two = ((at_start(i, h).value - at_start(i, -h).value) / (2.0 * h) for h in (1e-4, 2e-4))
        wanted = (4.0 * one - two) / 3.0
        assert found.start_gradient[i] == pytest.approx(wanted, rel=1e-7, abs=1e-9 * found.value / 1e-4), i


@pytest.mark.parametrize("name", CASES)
def test_a_run_under_a_record_is_the_run_of_fly(name):
    """Headings past half a turn, a current, three legs."""
    craft, begin, _, given = run_of(name)
    round_ = [Leg("turn", Orders(piloted=1.0, rudder=-0.4, dive=1.0, depth=3.5), 150.0), *legs()]
    record = record_of(round_, CLOCK)
    seen = ("x", "y", "z", "phi", "theta", "psi", "u", "v", "r", "delta2", "turn", "sink", "ahead", "fin_square")
    done = fly(craft, begin, round_, clock=CLOCK, log=Log(seen), **given)
    found = misfit(craft, begin, record, done.log[0, 1:], 1.0, seen, **given)
    np.testing.assert_allclose(found.seen, done.log[0, 1:], rtol=0, atol=1e-10)
    np.testing.assert_allclose(record.time, done.time[1:], rtol=1e-12)
    assert found.value <= 1e-16
    assert np.abs(done.log[0, :, 5]).max() > np.pi
    whole = done.log[0, 1:] + 2.0 * np.pi * (np.array(seen) == "psi")
    assert misfit(craft, begin, record, whole, 1.0, seen, **given).value <= 1e-16


def casadi_misfit(craft, begin, record, given, places, measured, weight):
    """CasADi's own value and gradient of the misfit of the loop, with the inverse of the mass matrix part of it."""
    form = form_of(craft)
    trace, free = traced(form), form_of(craft).place["inverse00"]
    f, inner = trace.functions, trace.symbols
    mass = ca.Function("mass", [inner.p], [trace.expressions.mass])
    theta, s0 = ca.MX.sym("theta", free), ca.MX.sym("s", len(begin))
    inverse = ca.inv(mass(ca.vertcat(theta, ca.MX.zeros(36))))
    p = ca.vertcat(theta, ca.vec(inverse.T))
    n, tick, steps = 13 + form.fins, record.clock.tick, record.clock.steps
    x, m, total = s0[:n], s0[n:], 0.0
    for k, row in enumerate(record.row):
        ref = record.orders[row]
        _, asked, rates, _ = f["steer"](p, f["observe"](p, x, ref), m, ref)
        m = m + tick * rates
        for _ in range(steps):
            h, now = tick / steps, x
            stages = []
            for to in (0.0, 0.5, 0.5, 1.0):
                stages.append(f["dynamics"](p, x + (h * to * stages[-1] if stages else 0.0), asked))
            for share, stage in zip(SHARE, stages, strict=True):
                now = now + h * share * stage
            x = now
        off = f["observe"](p, x, ref)[places] - measured[k]
        total = total + ca.dot(weight[k], off * off)
    value = ca.Function("misfit", [theta, s0], [total, ca.gradient(total, theta),
                                               ca.gradient(total, s0)])  # fmt: skip
    base = parameters(form, craft, given["pilot"], given["thrust"], given["current"])[:free]
    return [np.array(part).ravel() for part in value(base, begin)]


@pytest.mark.parametrize("name", ["lumped", "split", "screw"])
def test_the_gradient_is_the_one_casadi_takes_of_the_same_loop(name):
    craft, begin, _, given = run_of(name)
    record = record_of([legs()[1], legs()[2]], CLOCK)
    record = Record(record.orders, record.row[[*range(10), *range(-10, 0)]], record.clock)
    assert len(record.row) == 20
    every = channels(4)
    measured, weight = 0.1 * noise((20, len(SEEN))), noise((20, len(SEEN)), 3) ** 2
    found = misfit(craft, begin, record, measured, weight, SEEN, **given)
    value, gradient, back = casadi_misfit(
        craft, begin, record, given, [every.index(each) for each in SEEN], measured, weight
    )
    assert found.value == pytest.approx(value[0], rel=1e-12)
    names = form_of(craft).names
    known = np.array([found.gradient.get(each, np.nan) for each in names[: len(gradient)]])
    hidden = np.isnan(known)
    assert hidden.sum() == (20 if name == "screw" else 8)
    np.testing.assert_allclose(known[~hidden], gradient[~hidden], rtol=1e-10, atol=1e-12 * np.abs(gradient).max())
    np.testing.assert_allclose(found.start_gradient, back, rtol=1e-10, atol=1e-12 * np.abs(back).max())


def points(craft, count=4):
    """States with every motion, fin angles asked of which some are beyond their rate limit."""
    fins = len(craft.craft.fins)
    rng = np.random.default_rng(5)
    x = np.array([start(craft, 0.5 + 0.3 * i, rng.uniform(-1.0, 1.0, 3))[: 13 + fins] for i in range(count)])
    x[:, 8:13] += rng.uniform(-0.2, 0.2, (count, 5))
    return x, x[:, 13:] + rng.uniform(-0.3, 0.3, (count, fins))


@pytest.mark.parametrize("name", CASES)
def test_jacobians_are_those_of_dual_numbers_and_of_casadi(name, monkeypatch):
    craft = model(name)
    x, asked = points(craft)
    thrust, current = np.array([50.0, 10.0, -5.0, 80.0]), noise((4, 3)) * 0.1
    found = jacobian(craft, x, asked, thrust, current)
    monkeypatch.setenv(CHOICE, "numpy")
    other = jacobian(craft, x, asked, thrust, current)
    assert found.names == other.names == free_names(craft)
    for part in ("rates", "A", "B", "G"):
        a, b = getattr(found, part), getattr(other, part)
        np.testing.assert_allclose(a, b, rtol=1e-10, atol=1e-13 * np.abs(b).max())
    if len(craft.craft.fins) < 4:
        return
    form = form_of(craft)
    trace = traced(form)
    v = trace.symbols
    slope = ca.Function("slope", [v.p, v.x, v.asked], [ca.jacobian(trace.expressions.rates, w) for w in (v.x, v.asked)])
    for i in range(len(x)):
        p = parameters(form, craft, shared(craft)["pilot"], thrust[i], current[i])
        A, B = (np.array(part) for part in slope(p, x[i], [*asked[i], 1.0]))
        np.testing.assert_allclose(found.A[i], A, rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(found.B[i], B[:, :-1], rtol=1e-10, atol=1e-12)


def test_jacobians_are_differences_of_rates_and_one_point_is_a_row():
    craft = model("lumped")
    x, asked = points(craft)
    found, h = jacobian(craft, x, asked, 40.0, (0.1, 0.2, 0.0)), 1e-6
    for j in range(x.shape[1]):
        e = h * np.eye(x.shape[1])[j]
        up, down = (jacobian(craft, x + s * e, asked, 40.0, (0.1, 0.2, 0.0)).rates for s in (1.0, -1.0))
        np.testing.assert_allclose(found.A[:, :, j], (up - down) / (2.0 * h), rtol=1e-7, atol=2e-9)
    one = jacobian(craft, x[2], asked[2], 40.0, (0.1, 0.2, 0.0))
    np.testing.assert_array_equal(one.G[0], found.G[2])


@pytest.mark.parametrize("name", CASES)
def test_the_linear_model_is_the_one_of_dual_numbers(name):
    craft = model(name)
    fins = [0.05, -0.1, 0.02, 0.15][: len(craft.craft.fins)]
    trims = [
        [0.0] * 6 + [1.0] + [0.0] * 5 + [0.0] * len(fins),
        [5.0, -3.0, 2.0, 0.1, -0.2, 2.0, 1.2, 0.1, -0.05, 0.01, 0.02, -0.03, *fins],
        [0.0, 0.0, 9.0, -0.6, 1.3, -3.0, 0.4, -0.3, 0.2, 0.1, -0.1, 0.2, *fins],
    ]
    for state in trims:
        found, wanted = (
            linear_at(craft, state, 35.0, (0.2, -0.1, 0.05)),
            linearise_at(craft, state, 35.0, (0.2, -0.1, 0.05)),
        )
        assert (found.states, found.inputs, found.slopes) == (wanted.states, wanted.inputs, wanted.slopes)
        assert found.speed == pytest.approx(wanted.speed, rel=1e-14)
        for part in ("A", "B", "remainder"):
            a, b = getattr(found, part), getattr(wanted, part)
            np.testing.assert_allclose(a, b, rtol=1e-10, atol=1e-13 * np.abs(b).max())
    with pytest.raises(InputError, match="90 deg"):
        linear_at(craft, [0.0] * 4 + [1.6] + [0.0] * (7 + len(fins)), 35.0)


@pytest.mark.parametrize("straightened", [{"kappa_v": 0.3, "kappa_r": 0.2}, {"axisymmetric_crossflow": True}])
def test_options_of_the_model_have_their_slopes_too(straightened):
    plain = model("three fins")
    craft = replace(plain, options=replace(plain.options, **straightened))
    assert craft.options != ModelOptions()
    found = linear_at(craft, [0.0] * 6 + [1.0, 0.1, 0.05, 0.0, 0.02, 0.03] + [0.05, 0.1, 0.0], 35.0)
    wanted = linearise_at(craft, [0.0] * 6 + [1.0, 0.1, 0.05, 0.0, 0.02, 0.03] + [0.05, 0.1, 0.0], 35.0)
    np.testing.assert_allclose(found.A, wanted.A, rtol=1e-10, atol=1e-13 * np.abs(wanted.A).max())


@pytest.mark.parametrize("attitude", [(0.0, 0.0, 0.0), (0.0, 0.5 * np.pi, 0.0)])
def test_a_craft_at_rest_and_one_standing_upright_have_finite_slopes(attitude):
    craft = model("lumped")
    given = shared(craft, (0.0, 0.0, 0.0))
    record = record_of([Leg("go", Orders(piloted=1.0, steer=1.0, heading=0.3), 2.0)], CLOCK)
    begin = at([0.0, 0.0, 0.0, *attitude, *[0.0] * 10])
    seen = channels(4)[: observed(4)]
    found = misfit(craft, begin, record, np.ones((20, len(seen))), 1.0, seen, **given)
    assert np.isfinite([*found.gradient.values(), *found.start_gradient]).all()
    assert max(abs(value) for value in found.gradient.values()) > 0.0


def test_errors_name_what_is_wrong_and_what_to_do(monkeypatch):
    craft, begin, record, given = run_of("three fins")
    measured = np.zeros((len(record.row), 1))
    for message, wrong in (
        ("ends by an event of psi", lambda: record_of(figure()[1:2], CLOCK)),
        ("whole ticks", lambda: record_of([Leg("odd", Orders(), 1.05)], CLOCK)),
        ("24: piloted, rudder", lambda: Record(np.zeros((2, 3)), np.zeros(4, dtype=int), CLOCK)),
        ("outside the 1 of orders", lambda: Record(np.zeros((1, 24)), np.array([0, 1]), CLOCK)),
        ("whole ticks|one tick", lambda: record_of([Leg("short", Orders(), 0.01)], Clock(0.1))),
        (r"\(N, 16\) and \(N, 3\)", lambda: jacobian(craft, np.zeros((2, 17)), np.zeros((2, 4)), 1.0)),
        ("not finite", lambda: jacobian(craft, np.zeros((1, 16)), np.zeros((1, 3)), np.nan)),
    ):
        with pytest.raises(InputError, match=message):
            wrong()
    if library(form_of(craft)) is not None:
        for message, wrong in (
            ("no observed channel 'rudder'", lambda: misfit(craft, begin, record, measured, 1.0, ["rudder"], **given)),
            ("no observed channel 'delta4'", lambda: misfit(craft, begin, record, measured, 1.0, ["delta4"], **given)),
            ("measured has the shape", lambda: misfit(craft, begin, record, measured, 1.0, ["x", "y"], **given)),
            ("weight is negative", lambda: misfit(craft, begin, record, measured, -1.0, ["x"], **given)),
            ("Give 19 finite", lambda: misfit(craft, begin[:-1], record, measured, 1.0, ["x"], **given)),
            ("no parameter 'mixing30'", lambda: sensitivities(craft, begin, record, ["x"], ["mixing30"], **given)),
            ("no entry of the start 'psi'", lambda: sensitivities(
                craft, begin, record, ["x"], [], start_names=["psi"], **given)),
        ):  # fmt: skip
            with pytest.raises(InputError, match=message):
                wrong()
        wild = craft.with_values(Kpp=1e6, Krr=1e7)
        thrown = start(craft)
        thrown[10] = 5.0
        with pytest.raises(TowtankError, match="no longer finite at"):
            misfit(wild, thrown, record, measured, 1.0, ["phi"], **given)
    monkeypatch.setenv(CHOICE, "numpy")
    with pytest.raises(TowtankError, match="towtank doctor"):
        misfit(craft, begin, record, measured, 1.0, ["x"], **given)
    trim = [0.0] * 6 + [1.0] + [0.0] * 8
    np.testing.assert_array_equal(linear_at(craft, trim, 35.0).A, linearise_at(craft, trim, 35.0).A)
