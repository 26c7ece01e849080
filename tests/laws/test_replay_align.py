"""A shift of the clock is found by the correlation of record and model."""

import numpy as np
import pytest

from towtank.field.align import lag_of, moved


def swing(time):
    return 0.05 * np.sin(0.9 * time) + 0.03 * np.sin(2.3 * time + 1.0) + 0.02 * np.sin(0.31 * time)


@pytest.mark.parametrize("shift", [-1.37, -0.04, 0.0, 0.25, 0.9, 3.0])
def test_a_known_shift_is_found_to_a_twentieth_of_a_tick(shift):
    time = np.arange(0.0, 120.0, 0.1)
    found = lag_of({"r": swing(time - shift)}, {"r": swing(time)}, 0.1)
    # The parabola misses a smooth peak by some hundredths of a tick.
    assert found.seconds == pytest.approx(shift, abs=0.005)
    assert found.peak > 0.999
    assert f"{abs(found.seconds):.3g} s" in found.words
    assert "correlation" in found.words


def test_noise_and_holes_do_not_move_the_lag():
    time, random = np.arange(0.0, 120.0, 0.1), np.random.default_rng(4)
    record = swing(time - 0.43) + random.normal(0.0, 0.01, len(time))
    record[300:350] = np.nan
    record[::7] = np.nan
    found = lag_of({"r": record}, {"r": swing(time)}, 0.1)
    # White noise of a fifth of the motion on a thousand samples: a few hundredths of a second.
    assert found.seconds == pytest.approx(0.43, abs=0.05)


def test_a_lag_is_taken_out_when_asked_or_when_it_is_long_and_plain():
    time = np.arange(0.0, 120.0, 0.1)
    late, model = {"r": swing(time - 0.3)}, {"r": swing(time)}
    assert lag_of(late, model, 0.1).applied
    assert not lag_of(late, model, 0.1, align=False).applied
    small = {"r": swing(time - 0.02)}
    assert not lag_of(small, model, 0.1).applied
    assert lag_of(small, model, 0.1, align=True).applied
    noise = {"r": swing(time - 0.3) + np.random.default_rng(1).normal(0.0, 0.2, len(time))}
    found = lag_of(noise, model, 0.1)
    assert found.peak < 0.9
    assert not found.applied
    assert "left as it is" in found.words


def test_the_channel_that_agrees_best_tells():
    time = np.arange(0.0, 120.0, 0.1)
    random = np.random.default_rng(2)
    record = {"r": random.normal(0.0, 1.0, len(time)), "theta": swing(time - 0.5)}
    found = lag_of(record, {"r": swing(time), "theta": swing(time)}, 0.1)
    assert found.channel == "theta"
    assert found.seconds == pytest.approx(0.5, abs=0.01)


def test_nothing_moves_nothing_is_told():
    none = {"r": np.zeros(500)}
    assert lag_of(none, none, 0.1).channel == ""
    assert "not told" in lag_of({}, none, 0.1).words


def test_moved_rows_are_those_of_an_earlier_time():
    time = np.arange(0.0, 20.0, 0.1)
    rows = np.stack([time, 2.0 * time])
    late = moved(rows, 0.25, 0.1)
    held = np.isfinite(late[0])
    np.testing.assert_allclose(late[0][held], time[held] - 0.25, atol=1e-12)
    assert held.sum() == len(time) - 3
    early = moved(rows, -0.25, 0.1)
    np.testing.assert_allclose(early[1][np.isfinite(early[1])][0], 0.5, atol=1e-12)
