"""Straightening factors of SUBOFF's stern planes from roddy1990: hull and planes less the bare hull (THEORY section 5).

The rudder derivatives were measured on the craft with ring wing and sail, so the level of both factors is known to
30 %; their ratio does not rest on them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from suboff import DATA
from towtank import read_craft
from towtank.derive.convert import about_point
from towtank.derive.fin_curve import FinCurve
from towtank.derive.straightening import factors, straightening, with_straightening
from towtank.model.values import known

ARM = 0.448
"""Stocks aft of the reference point over the length (THEORY section 5)."""
TABLE = DATA["derivatives"]
RUDDER = np.array([TABLE["control_with_ring_wing"]["Ydr"], TABLE["control_with_ring_wing"]["Ndr"]])


def _added(motion: str) -> np.ndarray:
    return np.array([TABLE["fins"][load + motion] - TABLE["bare"][load + motion] for load in "YN"])


# -v/u is the angle that drift brings to a fin, -x r/u that of turning, x = -ARM.
DRIFT, TURN = -_added("v"), _added("r") / ARM


def test_planes_add_the_loads_that_theory_states() -> None:
    assert -DRIFT[0] == pytest.approx(-0.004546, abs=1e-6)
    assert TURN[0] == pytest.approx(0.0101, abs=5e-5)
    assert -TURN[1] / ARM == pytest.approx(0.0073, abs=5e-5)


def test_two_factors_are_those_of_theory() -> None:
    """Over the force slope in turning, THEORY's scale: kappa_v about 0.45, kappa_r 0.7 by moment and 1 by force."""
    assert DRIFT[0] / TURN[0] == pytest.approx(0.45, abs=0.01)
    assert -TURN[1] / ARM / TURN[0] == pytest.approx(0.72, abs=0.01)


def test_factors_over_the_deflection_are_those_of_the_table() -> None:
    kv, kv_each = factors(DRIFT, RUDDER)
    kr, kr_each = factors(TURN, RUDDER)
    assert kv_each == pytest.approx([0.767, 0.695], abs=0.001)
    assert kr_each == pytest.approx([1.699, 1.477], abs=0.001)
    assert kv_each.min() < float(kv) < kv_each.max()
    assert kr_each.min() < float(kr) < kr_each.max()


def test_the_fast_tank_gives_the_factors_within_its_evidence() -> None:
    """Predicted but for the sidewash, which was set on Y'v of the finned hull. The tank's own rudder is 25 % weak."""
    found = straightening(read_craft("suboff-fins"))
    assert found is not None
    measured_v, measured_r = float(factors(DRIFT, RUDDER)[0]), float(factors(TURN, RUDDER)[0])
    assert found.kappa_r == pytest.approx(measured_r, rel=0.15)
    assert found.kappa_v == pytest.approx(measured_v, abs=2.0 * found.std[0])
    # A fin takes less out of drift than out of turning: the hull ahead has straightened the flow.
    assert found.kappa_v < 0.75 * found.kappa_r


def test_factors_do_not_depend_on_where_the_planes_sit_around_the_hull() -> None:
    plus, cross = (straightening(read_craft(name)) for name in ("suboff-fins", "suboff-x"))
    assert plus is not None
    assert cross is not None
    assert cross.kappa_v == pytest.approx(plus.kappa_v, rel=0.01)
    assert cross.kappa_r == pytest.approx(plus.kappa_r, rel=0.01)
    assert straightening(read_craft("suboff-bare")) is None


def test_the_factors_enter_the_fin_curve_and_move_with_its_point_of_reference() -> None:
    """What turning brings to the fins is the same whatever point the derivatives refer to."""
    craft = read_craft("suboff-fins")
    curve = FinCurve(0.6, 0.0, 0.1, 0.1, "the test")
    here = replace(known(craft, {"Yuudr": 1.0}, "lumped", "published"), fin_curve=curve)
    found = with_straightening(here, craft).fin_curve
    moved = with_straightening(about_point(here, craft.origin_from_nose - 0.3), craft).fin_curve
    assert found is not None
    assert moved is not None
    assert found.kappa_level == "semi-empirical"
    assert found.kappa_v == moved.kappa_v > 0.0
    there = about_point(replace(here, fin_curve=found), craft.origin_from_nose - 0.3).fin_curve
    assert there is not None
    assert moved.kappa_r == pytest.approx(there.kappa_r)
    assert moved.kappa_r != pytest.approx(found.kappa_r, rel=0.01)
    bare = replace(here, fin_curve=None)
    assert with_straightening(bare, craft) is bare
    assert with_straightening(here, read_craft("suboff-bare")) is here
