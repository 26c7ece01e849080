"""Margins by python-control against what they promise, against the pilot's own, and against published figures."""

from __future__ import annotations

import builtins
from dataclasses import replace

import numpy as np
import pytest

import synthetic_craft as synthetic
from towtank.engine.clock import clock_of
from towtank.errors import TowtankError, TrialError
from towtank.pilot.design import design_pilot
from towtank.pilot.loops import COMMANDS, WholeLoop, whole_loop
from towtank.pilot.lqi import design_lqi
from towtank.tuning.margins import disk_of, robust_margins, structured_norm

LOOPS = {"rudder": "heading", "elevator": "depth", "aileron": "roll"}


@pytest.fixture(scope="module")
def craft():
    return synthetic.model(synthetic.SUBOFF, speed=2.0)


@pytest.fixture(scope="module", params=[design_pilot, design_lqi])
def pilot(request, craft):
    return request.param(craft)


@pytest.fixture(scope="module")
def found(craft, pilot):
    return robust_margins(craft, pilot)


def growth(whole, K):
    return np.linalg.eigvals(whole.A - whole.B @ K).real.max()


def test_margins_of_the_pilot_are_those_of_python_control():
    # The CG is on the axis and the delay is none, so that the planes stand alone, as the pilot's own margins have them.
    plain = synthetic.model(synthetic.SUBOFF, speed=2.0, zg=0.001)
    for design in (design_pilot, design_lqi):
        pilot = design(plain)
        loops = robust_margins(plain, pilot, delay=0.0).loops
        for command, loop in LOOPS.items():
            up, down, phase = pilot.margins[loop]
            # python-control joins points of the response by splines, the pilot's own solves for each frequency; and the
            # low CG of a millimetre still couples sway with roll.
            assert loops[command].phase == pytest.approx(phase, rel=5e-3)
            assert 1.0 / max(loops[command].down, 1e-9) == pytest.approx(1.0 / max(down, 1e-9), rel=1e-2)
            assert loops[command].up == pytest.approx(up, rel=1e-2) or (up == np.inf and loops[command].up > 1e3)


@pytest.mark.parametrize("command", COMMANDS)
def test_the_gain_may_change_by_its_margin_and_no_more(craft, pilot, found, command):
    whole = whole_loop(craft, pilot, delay=found.held)
    one = found.loops[command]
    for factor, beyond in ((one.up, 1.01), (one.down, 0.99)):
        if not 0.0 < factor < np.inf:
            continue
        for step, stable in ((1.0 / beyond, True), (beyond, False)):
            K = whole.K.copy()
            K[COMMANDS.index(command)] *= factor * step
            assert (growth(whole, K) < 0.0) == stable, (factor, step)


@pytest.mark.parametrize("command", COMMANDS)
def test_the_delay_margin_is_a_delay_that_the_loop_just_bears(craft, pilot, found, command):
    one, at = found.loops[command], COMMANDS.index(command)
    A, B, K = whole_loop(craft, pilot, delay=found.held).cut(at)
    frequency = np.logspace(-3, 2, 40001)
    loop = WholeLoop(A, B, K).response(frequency)[:, 0, 0]
    if one.delay == np.inf:
        # A loop that bears any delay has no crossover: its gain stays below one.
        assert np.abs(loop).max() < 1.0
        return
    for share, stable in ((0.98, True), (1.02, False)):
        # Nyquist: the closed loop is as stable as without the added delay if the curve has the same turns about -1.
        late = 1.0 + loop * np.exp(-1j * frequency * share * one.delay)
        turns = np.sum(np.angle(late[1:] / late[:-1])) - np.sum(np.angle((1.0 + loop[1:]) / (1.0 + loop[:-1])))
        low = frequency < 30.0  # above it the gain is so low that no delay matters
        assert np.abs(late[~low] - 1.0).max() < 0.5
        assert (abs(turns) < 0.5 * np.pi) == stable


def test_the_modulus_margin_bounds_gain_and_phase(found):
    for one in found.loops.values():
        m = one.modulus
        assert one.up >= 1.0 / (1.0 - m) - 1e-3
        assert one.down <= 1.0 / (1.0 + m) + 1e-3
        assert one.phase >= 2.0 * np.arcsin(m / 2.0) - 1e-3


def test_the_disk_of_all_loops_holds_for_gains_changed_at_once(craft, pilot, found):
    whole, random = whole_loop(craft, pilot, delay=found.held), np.random.default_rng(3)
    limit = np.log(found.together.gain) * 0.999
    corners = np.array(np.meshgrid(*[[-limit, limit]] * 3)).reshape(3, -1).T
    for logs in [*random.uniform(-limit, limit, (200, 3)), *corners]:
        assert growth(whole, whole.K * np.exp(logs)[:, None]) < 0.0
    assert found.together.alpha <= min(one.disk.alpha for one in found.loops.values()) * 1.001


def test_the_disk_of_all_loops_is_reached_by_a_complex_change(craft, pilot, found):
    # mu is exact for three changes: some diagonal of complex factors of the disk's size makes I + L singular.
    whole = whole_loop(craft, pilot, delay=found.held)
    S = np.linalg.inv(np.eye(3) + whole.response(whole.frequencies)) - 0.5 * np.eye(3)
    radius = max(np.abs(np.linalg.eigvals(s)).max() for s in S)  # the same factor in all loops: a lower bound of mu
    assert 1.0 / found.together.alpha >= radius * (1.0 - 1e-9)
    assert 1.0 / found.together.alpha <= max(np.linalg.norm(s, 2) for s in S)


def test_half_a_control_period_of_delay_is_counted(craft, pilot, found):
    assert found.held == clock_of(craft, 2.0).tick / 2.0
    now = robust_margins(craft, pilot, delay=0.0)
    late = robust_margins(craft, pilot, delay=4.0 * found.held)
    for command, one in found.loops.items():
        if one.delay < np.inf:
            # The crossover does not move with a delay; the delay margin is what is left of it.
            assert now.loops[command].delay == pytest.approx(one.delay + found.held, rel=2e-2)
            assert late.loops[command].delay == pytest.approx(one.delay - 3.0 * found.held, rel=2e-2)


def test_scaled_norms_of_known_matrices():
    random = np.random.default_rng(4)
    for n in (1, 2, 3):
        M = random.normal(size=(n, n)) + 1j * random.normal(size=(n, n))
        d = np.exp(random.normal(size=n))
        mu = structured_norm(M)
        assert structured_norm(M * d[:, None] / d) == pytest.approx(mu, rel=1e-6)  # scaling does not change it
        assert np.abs(np.linalg.eigvals(M)).max() - 1e-9 <= mu <= np.linalg.norm(M, 2) + 1e-9
    # A triangular matrix is as large as its diagonal; of [[0, a], [b, 0]] it is sqrt(ab).
    assert structured_norm(np.array([[0.7, 90.0], [0.0, 0.4j]])) == pytest.approx(0.7, rel=1e-2)
    assert structured_norm(np.array([[0.0, 8.0], [0.5, 0.0]])) == pytest.approx(2.0, rel=1e-6)


def test_published_disk_margins():
    # seiler2020, the spinning satellite: 0.3754 for both loops at once, gain 3.3 dB, phase 21.26 deg.
    A, B, C = np.array([[0.0, 10.0], [-10.0, 0.0]]), np.eye(2), np.array([[1.0, 10.0], [-10.0, 1.0]])
    whole = WholeLoop(A, B, np.array([[1.0, -2.0], [0.0, 1.0]]) @ C)
    S = np.linalg.inv(np.eye(2) + whole.response(np.array([1e-6, 0.1, 1.0, 5.0, 20.0, 100.0]))) - 0.5 * np.eye(2)
    disk = disk_of(1.0 / max(structured_norm(s) for s in S))
    assert disk.alpha == pytest.approx(0.3754, abs=2e-3)
    assert 20.0 * np.log10(disk.gain) == pytest.approx(3.3, abs=0.05)
    assert np.degrees(disk.phase) == pytest.approx(21.26, abs=0.1)
    # The same, one loop: 25 / (s^3 + 10 s^2 + 10 s + 10) has 0.46, 4.05 dB, 25.8 deg.
    one = disk_of(0.46)
    assert (20.0 * np.log10(one.gain), np.degrees(one.phase)) == pytest.approx((4.05, 25.8), abs=0.3)  # 0.46 is rounded


def test_a_loop_that_is_not_stable_has_no_margins(craft):
    wrong = replace(design_pilot(craft), yaw_rate=0.0)
    with pytest.raises(TrialError, match="not stable"):
        robust_margins(craft, wrong)


def test_without_python_control_the_extra_is_named(craft, monkeypatch):
    real = builtins.__import__

    def absent(name, *args, **kwargs):
        if name == "control":
            raise ImportError(name)
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", absent)
    with pytest.raises(TowtankError, match=r"towtank\[control\]"):
        robust_margins(craft, design_pilot(craft))
