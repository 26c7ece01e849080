"""Laws of the captive motions: velocities are those of the path, accelerations are their derivatives."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from towtank.errors import PlanError
from towtank.frames import rotation
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import KINDS, Drift, Pitch, Roll, Surge, Sway, Turn, Yaw, sampled

OSCILLATIONS = ("sway", "yaw", "heave", "pitch", "roll", "surge")
# Central differences of eighth order; 0.02 of a radian of phase leaves a truncation error near 1e-15 of the amplitude.
WEIGHTS = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0.0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])


def derivative(function, time, step):
    """Time derivative (N, ...) of ``function`` of time (N,)."""
    stencil = np.arange(-4, 5)
    return sum(weight * function(time + k * step) for k, weight in zip(stencil, WEIGHTS, strict=True)) / step


@st.composite
def motions(draw):
    kind = draw(st.sampled_from(sorted(KINDS)))
    speed = draw(st.floats(0.3, 8.0))
    frequency = draw(st.floats(0.05, 3.0))
    # v/U to 1 (45 deg), far beyond what a plan allows: the closed forms are not small-angle.
    slope = draw(st.floats(-1.0, 1.0))
    angle = draw(st.floats(-1.2, 1.2))
    if kind in ("drift", "incidence"):
        return KINDS[kind](speed, angle)
    if kind == "turn":
        return Turn(speed, slope * frequency, angle)
    if kind == "roll":
        return Roll(speed, angle, frequency)
    return KINDS[kind](speed, slope * speed / frequency, frequency)


@settings(max_examples=60, deadline=None)
@given(motions(), st.floats(-30.0, 30.0))
def test_velocities_are_those_of_the_path_and_accelerations_their_derivatives(motion, start):
    rate = 2.0 * math.pi / motion.period if motion.period else 1.0 + abs(getattr(motion, "rate", 0.0))
    time, step = (start + np.linspace(0.0, 2.0 * math.pi, 7)) / rate, 0.02 / rate
    here = motion.history(time)

    moved = derivative(lambda t: motion.history(t).position, time, step)
    phi, theta, _ = here.attitude.T
    phidot, thetadot, psidot = derivative(lambda t: motion.history(t).attitude, time, step).T
    velocity = np.einsum("nji,nj->ni", rotation(here.attitude), moved)
    turned = np.stack(
        [
            phidot - psidot * np.sin(theta),
            thetadot * np.cos(phi) + psidot * np.cos(theta) * np.sin(phi),
            -thetadot * np.sin(phi) + psidot * np.cos(theta) * np.cos(phi),
        ],
        axis=-1,
    )
    # 1e-8 of the speed, of the frequency and of their product: round-off of the differences is 1e-13 of them.
    np.testing.assert_allclose(here.nu[:, :3], velocity, atol=1e-8 * motion.speed)
    np.testing.assert_allclose(here.nu[:, 3:], turned, atol=1e-8 * rate)
    accelerated = derivative(lambda t: motion.history(t).nu, time, step)
    np.testing.assert_allclose(here.nudot[:, :3], accelerated[:, :3], atol=1e-8 * motion.speed * rate)
    np.testing.assert_allclose(here.nudot[:, 3:], accelerated[:, 3:], atol=1e-8 * rate * rate)


@settings(max_examples=30, deadline=None)
@given(motions(), st.floats(-50.0, 0.0))
def test_motion_repeats_after_a_period_at_negative_times_too(motion, time):
    if motion.period == 0.0:
        assert motion.history(np.array([time, 0.0, 3.0])).steady
        return
    now, later = motion.history(np.array([time])), motion.history(np.array([time + motion.period]))
    np.testing.assert_allclose(now.nu, later.nu, atol=1e-9 * (1.0 + abs(now.nu).max()))
    step = later.position - now.position
    np.testing.assert_allclose(step, [[motion.speed * motion.period, 0.0, 0.0]], atol=1e-7)


@pytest.mark.parametrize(("make", "still"), [(Yaw, 1), (Pitch, 2)])
def test_pure_yaw_and_pitch_have_no_cross_flow_at_all(make, still):
    # Amplitude for a path slope of 1: 45 deg of heading.
    history = make(2.0, 4.0, 0.5).history(np.linspace(-20.0, 20.0, 101))
    assert np.all(history.nu[:, still] == 0.0)
    assert np.all(history.nudot[:, still] == 0.0)
    assert abs(history.attitude).max() == pytest.approx(math.pi / 4.0, rel=1e-3)


@pytest.mark.parametrize("degrees", [-20.0, 8.0])
def test_drift_and_turn_hold_the_drift_angle_and_the_resultant_speed(degrees):
    beta = math.radians(degrees)
    for motion in (Drift(1.5, beta), Turn(1.5, 0.2, beta)):
        nu = motion.history(np.array([-3.0, 0.0, 7.0])).nu
        np.testing.assert_allclose(np.arctan2(-nu[:, 1], nu[:, 0]), beta, rtol=1e-14)
        np.testing.assert_allclose(np.hypot(nu[:, 0], nu[:, 1]), 1.5, rtol=1e-14)


def test_rotating_arm_goes_round_a_circle_of_radius_speed_over_rate():
    position = Turn(2.0, 0.1, 0.1).history(np.linspace(0.0, 80.0, 50)).position
    np.testing.assert_allclose(np.hypot(position[:, 0], position[:, 1] - 20.0), 20.0, rtol=1e-13)


def test_turn_without_rate_is_the_straight_drift():
    time = np.array([-2.0, 0.0, 5.0])
    straight, turn = Drift(1.3, 0.2).history(time), Turn(1.3, 0.0, 0.2).history(time)
    for one, other in zip(vars(straight).values(), vars(turn).values(), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-15)


def test_yaw_becomes_the_small_angle_sinusoid_of_the_classical_formulae():
    U, a, w = 1.0, 1e-3, 0.5
    time = np.linspace(0.0, 12.0, 25)
    history = Yaw(U, a, w).history(time)
    # The next term is of relative order (a w / U)^2 = 2.5e-7.
    np.testing.assert_allclose(history.nu[:, 5], -a * w**2 / U * np.sin(w * time), atol=3e-7 * a * w**2)
    np.testing.assert_allclose(history.nudot[:, 5], -a * w**3 / U * np.cos(w * time), atol=3e-7 * a * w**3)


def test_records_hold_whole_periods_and_both_ends():
    test = CaptiveTest("s", 1.0, Sway(1.0, 0.2, 0.5), periods=3, samples=64)
    history = sampled(test)
    assert len(history.time) == 193
    assert history.time[64] == pytest.approx(test.motion.period, rel=1e-14)
    assert len(sampled(CaptiveTest("d", 1.0, Drift(1.0, 0.1))).time) == 2


@pytest.mark.parametrize(
    ("make", "arguments", "word"),
    [
        (Sway, (0.0, 0.1, 1.0), "speed"),
        (Sway, (1.0, 0.1, 0.0), "frequency"),
        (Surge, (1.0, math.nan, 1.0), "amplitude"),
        (Drift, (math.inf, 0.1), "speed"),
        (Turn, (-1.0, 0.1), "speed"),
    ],
)
def test_impossible_motions_are_refused(make, arguments, word):
    with pytest.raises(PlanError, match=word):
        make(*arguments)
