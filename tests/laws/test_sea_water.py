"""The water of a made-up sea has the numbers that were asked for."""

import numpy as np
import pytest

from towtank.errors import InputError
from towtank.field.sea_water import Environment, eddies, passing_time


def test_eddies_have_the_spread_and_the_memory_that_were_asked_for():
    water = Environment(turbulence=(0.05, 0.03, 0.01), correlation=20.0, seed=8)
    c = eddies(water, 0.5, 40, 4000)
    # Bartlett: 40 craft of 2000 s hold 40 * 2000 / (2 * 20) = 2000 independent values for the mean, and as many for
    # the variance: std known to 1 / sqrt(2 * 4000) = 1.1 %, here within four of it.
    np.testing.assert_allclose(c.std(axis=(0, 1)), water.turbulence, rtol=0.045)
    assert (np.abs(c.mean(axis=(0, 1))) < 4.0 * np.array(water.turbulence) / np.sqrt(2000.0)).all()
    for lag in (1, 10, 40, 80):
        found = (c[:, lag:] * c[:, :-lag]).mean(axis=(0, 1)) / (c * c).mean(axis=(0, 1))
        # Bartlett again: a correlation from 2000 independent values is known to 1 / sqrt(2000) = 0.022 or better.
        np.testing.assert_allclose(found, np.exp(-lag * 0.5 / 20.0), atol=0.07)
    # It begins in its steady state: 40 values know a std to 11 %.
    assert c[:, 0, 0].std() == pytest.approx(0.05, rel=0.45)


def test_eddies_are_the_same_process_in_longer_pieces():
    water = Environment(turbulence=(0.05, 0.05, 0.05), correlation=20.0, seed=8)
    short, long = eddies(water, 0.5, 60, 2000), eddies(water, 5.0, 60, 200)
    # Exact discretisation: no error of the step. 60 * 1000 / 40 = 1500 independent values each, as above.
    assert long.std() == pytest.approx(short.std(), rel=0.05)
    for lag in (1, 4):
        a = (short[:, 10 * lag :] * short[:, : -10 * lag]).mean() / (short * short).mean()
        b = (long[:, lag:] * long[:, :-lag]).mean() / (long * long).mean()
        assert a == pytest.approx(b, abs=0.06)


def test_parts_of_the_current_and_craft_are_independent():
    c = eddies(Environment(turbulence=(1.0, 1.0, 1.0), correlation=1.0, seed=2), 1.0, 4, 20000)
    table = np.corrcoef(c.transpose(0, 2, 1).reshape(12, -1))
    # 20000 / 2.2 independent values: 0.010; five of it.
    assert np.abs(table - np.eye(12)).max() < 0.055


def test_eddies_of_a_length_pass_in_the_time_of_its_passage():
    assert passing_time(30.0, 1.5) == 20.0


@pytest.mark.parametrize(
    ("what", "said"),
    [
        ({"current": (0.1, 0.2)}, "3 finite numbers"),
        ({"current": (0.1, 0.2, np.nan)}, "3 finite numbers"),
        ({"turbulence": (-0.1, 0.0, 0.0)}, "0 or more"),
        ({"correlation": 0.0}, "above zero"),
        ({"piece": -1.0}, "above zero"),
        ({"depth": np.inf}, "finite depth"),
        ({"seed": -1}, "whole number"),
        ({"seed": 1.5}, "whole number"),
    ],
)
def test_what_is_no_water_is_refused(what, said):
    with pytest.raises(InputError, match=said):
        Environment(**what)
