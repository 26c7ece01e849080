"""Metrics of a comparison against closed forms."""

import numpy as np
import pytest

from towtank.field.comparing import signals
from towtank.field.comparing.compare import band_of
from towtank.field.comparing.metrics import METRICS, marks_of, read
from towtank.field.comparing.result import Score, Uncertainty
from towtank.field.robust import fitted, parabola

TICK = 0.1
TIME = np.arange(0.0, 600.0, TICK)


def metric(name):
    return next(one for one in METRICS if one.name == name)


def test_the_power_of_a_sinusoid_is_half_its_amplitude_squared():
    wave = np.stack([0.04 * np.sin(2.0 * np.pi * 0.2 * TIME), 0.01 * np.sin(2.0 * np.pi * 0.2 * TIME)])
    found = signals.band_rms(wave, [(0, len(TIME))], TICK, (0.1, 0.5))
    # The window spreads a line over neighbours, all inside the band.
    np.testing.assert_allclose(found, np.array([0.04, 0.01]) / np.sqrt(2.0), rtol=1e-3)
    assert signals.band_rms(wave, [(0, len(TIME))], TICK, (0.5, 2.0))[0] < 1e-4


def test_the_spectrum_of_white_noise_is_flat_at_twice_its_variance_times_the_tick():
    noise = np.random.default_rng(1).normal(0.0, 0.3, len(TIME))
    frequency, density = signals.power(noise, [(0, len(TIME))], TICK)
    inside = (frequency > 0.3) & (frequency < 4.5)
    # 39 segments: the mean over 126 lines is known to some per cent.
    assert density[inside].mean() == pytest.approx(2.0 * 0.3**2 * TICK, rel=0.05)


def test_the_coherence_of_one_signal_in_two_noises_is_the_share_it_has():
    random = np.random.default_rng(2)
    signal, a, b = random.normal(0.0, 1.0, (3, 60000))
    found = signals.coherence(signal + a, signal + b, [(0, 60000)], TICK, (0.5, 2.0))
    # Signal and noise of equal power: (1 / 2)^2; the mean of 400 segments is biased by some thousandths.
    assert found == pytest.approx(0.25, abs=0.02)
    assert np.isnan(signals.coherence(a[:700], b[:700], [(0, 700)], TICK, (0.5, 2.0)))


def test_a_turn_has_the_rate_and_the_radius_it_was_given():
    rate, speed = 0.05, 1.7
    r = np.where((TIME > 100.0) & (TIME < 200.0), rate, 0.0) - np.where(TIME > 300.0, rate, 0.0)
    motion = {"r": r, "u": np.full(len(TIME), speed)}
    marks = marks_of(motion, [(0, len(TIME))], TICK)
    assert len(marks.turns) == 2
    rows = {name: values[None] for name, values in motion.items()}
    assert read(metric("turn_rate"), rows, marks)[0] == pytest.approx(rate, rel=1e-9)
    assert read(metric("turn_radius"), rows, marks)[0] == pytest.approx(speed / rate, rel=1e-9)


def test_a_rate_that_changes_is_no_steady_turn():
    assert signals.steady_turns(0.05 * np.sin(2.0 * np.pi * TIME / 30.0), TICK) == []
    assert signals.steady_turns(np.zeros(len(TIME)), TICK) == []


def test_the_swing_of_a_decaying_yaw_rate_is_its_integral():
    # r decays to zero and on to the other side after the reversal: r = r0 exp(-t/T) - r1 (1 - exp(-t/T)).
    r0, r1, T = 0.05, 0.03, 8.0
    t = np.arange(0.0, 40.0, TICK)
    r = r0 * np.exp(-t / T) - r1 * (1.0 - np.exp(-t / T))
    psi = r0 * T * (1.0 - np.exp(-t / T)) - r1 * (t - T * (1.0 - np.exp(-t / T)))
    top = T * np.log(1.0 + r0 / r1)
    over, when = signals.swing(psi, r, 0, len(t), TICK)
    assert when == pytest.approx(top, abs=TICK)
    assert over == pytest.approx(r0 * T - r1 * top, rel=1e-3)


def test_reversals_are_where_the_rudder_passes_zero():
    rudder = 0.2 * np.sign(np.sin(2.0 * np.pi * (TIME + 0.05) / 40.0))
    found = signals.reversals(rudder, TICK)
    np.testing.assert_allclose(TIME[found], np.arange(20.0, 600.0, 20.0), atol=1.5 * TICK)
    assert signals.reversals(0.01 * rudder, TICK) == []


def test_a_second_order_answer_overshoots_and_settles_as_the_textbook_says():
    zeta, omega = 0.4, 0.3
    t = TIME[:1500]
    damped = omega * np.sqrt(1.0 - zeta**2)
    answer = 1.0 - np.exp(-zeta * omega * t) * (np.cos(damped * t) + zeta * omega / damped * np.sin(damped * t))
    step = signals.Step(0, len(t), 0.0, 1.0)
    over, settled = signals.answer(answer, step, 0.0, TICK)
    assert over == pytest.approx(np.exp(-np.pi * zeta / np.sqrt(1.0 - zeta**2)), rel=1e-3)
    envelope = -np.log(0.05 * np.sqrt(1.0 - zeta**2)) / (zeta * omega)
    # The 5 % envelope bounds the settling time; the answer meets it up to half a period earlier.
    assert envelope - np.pi / damped < settled <= envelope + TICK


def test_steps_of_an_order_are_found_with_their_ends():
    order = np.full(len(TIME), np.nan)
    order[[0, 1000, 3000]] = [0.0, 0.5, 0.2]
    held = order.copy()
    for i in range(1, len(held)):
        held[i] = held[i - 1] if np.isnan(order[i]) else order[i]
    found = signals.steps_of(held, 0.1, TICK)
    assert [(one.at, one.end, one.before, one.after) for one in found] == [
        (1000, 3000, 0.0, 0.5), (3000, 6000, 0.5, 0.2),
    ]  # fmt: skip


def test_fin_effort_of_a_sinusoid():
    a, f, speed = 0.1, 0.25, 2.0
    motion = {
        "delta1": (a * np.sin(2.0 * np.pi * f * TIME))[None], "delta2": np.zeros((1, len(TIME))),
        "u": np.full((1, len(TIME)), speed),
    }  # fmt: skip
    marks = marks_of({name: values[0] for name, values in motion.items()}, [(0, len(TIME))], TICK)
    # Half of the fins move.
    assert read(metric("fin_rms"), motion, marks)[0] == pytest.approx(a / 2.0, rel=1e-3)
    # Four amplitudes a period on one of two fins; the peaks fall on samples.
    assert read(metric("fin_travel"), motion, marks)[0] == pytest.approx(4.0 * a * f / speed / 2.0, rel=2e-3)


def test_a_band_holds_the_share_it_says():
    low, high = band_of(np.random.default_rng(3).normal(0.0, 2.0, (20000, 3)))
    np.testing.assert_allclose(high, 1.96 * 2.0, rtol=0.03)
    np.testing.assert_allclose(low, -1.96 * 2.0, rtol=0.03)


def test_a_band_leaves_lost_craft_out():
    values = np.tile(np.linspace(0.0, 1.0, 101)[:, None], (1, 2))
    values[50:, 1] = np.nan
    low, high = band_of(values)
    np.testing.assert_allclose(low, [0.025, 0.025 * 0.49], atol=1e-12)
    np.testing.assert_allclose(high, [0.975, 0.975 * 0.49], atol=1e-12)


def test_an_error_within_its_uncertainty_is_validated_at_that_level():
    score = Score("a", "r", "s", "", "", 3.0, 2.0, Uncertainty(0.6, 0.0, 0.9))
    assert score.error == 1.0
    assert score.uncertainty.total == pytest.approx(np.sqrt(0.6**2 + 0.9**2))
    assert score.validated is True
    assert Score("a", "r", "s", "", "", 3.0, 1.0, Uncertainty(0.6, 0.0, 0.9)).validated is False
    assert Score("a", "r", "s", "", "", np.nan, 1.0, Uncertainty(0.6, 0.0, 0.9)).validated is None


def test_a_robust_line_is_that_of_least_squares_without_outliers():
    time = np.linspace(0.0, 10.0, 200)
    random = np.random.default_rng(5)
    line = 1.0 + 0.3 * time + random.normal(0.0, 0.1, 200)
    A = np.stack([np.ones(200), time], axis=1)
    spoiled = line.copy()
    spoiled[::20] += 50.0
    plain = np.linalg.lstsq(A, line, rcond=None)[0]
    assert np.abs(fitted(A, spoiled).unknowns - plain).max() < 0.03
    assert np.abs(np.linalg.lstsq(A, spoiled, rcond=None)[0] - plain).max() > 1.0


def test_the_error_of_a_parabola_is_that_of_many_records():
    time = np.linspace(-1.0, 1.0, 21)
    random = np.random.default_rng(6)
    fits = [parabola(time, 2.0 - time + 0.5 * time**2 + random.normal(0.0, 0.1, 21)) for _ in range(600)]
    scatter = np.std([(fit.value - 2.0, fit.slope + 1.0) for fit in fits], axis=0)
    stated = np.sqrt(np.mean([(fit.std**2, fit.slope_std**2) for fit in fits], axis=0))
    # Huber's weights take 5 % of the efficiency and a little of the stated error of small samples.
    np.testing.assert_allclose(stated, scatter, rtol=0.15)


def test_errors_of_groups_hold_when_neighbours_err_alike():
    random, count, size = np.random.default_rng(7), 20, 30
    groups = np.repeat(np.arange(count), size)
    A = np.ones((count * size, 1))
    fits = [fitted(A, 1.0 + random.normal(0.0, 0.2, count)[groups] + random.normal(0.0, 0.05, len(groups)), groups)
            for _ in range(300)]  # fmt: skip
    scatter = np.std([fit.unknowns[0] for fit in fits])
    stated = np.sqrt(np.mean([fit.covariance[0, 0] for fit in fits]))
    assert stated == pytest.approx(scatter, rel=0.15)
    assert scatter > 3.0 * 0.05 / np.sqrt(count * size)
