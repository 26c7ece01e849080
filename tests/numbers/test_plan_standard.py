"""The standard plan holds the test matrix of the source and determines every term of the model."""

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from towtank.craft.library import library_names, read_craft
from towtank.errors import InputError, PlanError
from towtank.plan.limits import assess
from towtank.plan.motion import sampled
from towtank.plan.standard import standard_plan
from towtank.symbols import STANDING
from towtank.terms import columns

HOKIE = read_craft("hokie")
SPHEROID = read_craft("spheroid-6-1")


def odd_craft():
    """Three fins: no symmetry between the planes."""
    fins = [replace(HOKIE.fins[0], name=f"f{i}", azimuth=math.radians(a)) for i, a in enumerate((90.0, 210.0, 330.0))]
    return replace(HOKIE, fins=tuple(fins))


@pytest.mark.parametrize("name", library_names())
def test_library_crafts_have_a_plan_without_warnings_of_at_most_115_runs(name):
    craft = read_craft(name)
    plan = standard_plan(craft)
    assert len(plan.tests) <= 115
    assert len({test.name for test in plan.tests}) == len(plan.tests)
    for test in plan.tests:
        violence = assess(test, craft)
        assert not violence.refusals
        assert test.exploratory == bool(violence.warnings)


def test_the_matrix_of_the_source_is_there():
    plan = standard_plan(HOKIE, speed="1 m/s")
    drift = {round(math.degrees(t.motion.angle)) for t in plan.tests if t.kind == "drift"}
    assert drift == {sign * angle for angle in range(0, 21, 2) for sign in (-1, 1)}
    kinds = Counter(test.kind for test in plan.tests)
    # 4-fold symmetry: perron runs no incidence, heave or pitch; one heave and one pitch run check the ties.
    assert "incidence" not in kinds
    assert kinds["heave"] == kinds["pitch"] == 1
    for kind in ("sway", "yaw", "roll", "surge"):
        motions = [test.motion for test in plan.tests if test.kind == kind]
        assert len({motion.frequency for motion in motions}) >= 3
        primed = {round(m.amplitude * m.frequency ** {"yaw": 2, "roll": 0}.get(kind, 1), 9) for m in motions}
        assert len(primed) >= 2
    deflected = [test for test in plan.tests if test.kind == "fins"]
    assert {round(math.degrees(max(map(abs, test.fins)))) for test in deflected} == set(range(5, 41, 5))
    assert all(test.exploratory == (max(map(abs, test.fins)) > math.radians(20.5)) for test in deflected)


def test_each_fin_is_deflected_alone_and_the_virtual_controls_follow_the_mixing():
    plan = standard_plan(HOKIE)
    alone = {i for test in plan.tests for i in np.flatnonzero(test.fins) if np.count_nonzero(test.fins) == 1}
    assert alone == set(range(len(HOKIE.fins)))
    for column, name in enumerate(("rudder", "elevator", "aileron")):
        test = next(test for test in plan.tests if test.name == f"{name}-p10")
        virtual = HOKIE.virtual(np.array(test.fins))[0, :3]
        expected = np.zeros(3)
        expected[column] = math.radians(10.0)
        np.testing.assert_allclose(virtual, expected, atol=1e-9)


def test_a_craft_without_symmetry_between_planes_has_the_whole_vertical_plane():
    kinds = Counter(test.kind for test in standard_plan(odd_craft()).tests)
    assert kinds["incidence"] == kinds["drift"] - 1
    assert kinds["heave"] == kinds["sway"]
    assert kinds["pitch"] == kinds["yaw"]


def test_a_bare_hull_has_no_fin_runs():
    assert all(test.kind != "fins" for test in standard_plan(SPHEROID).tests)


def test_every_term_but_xwq_is_determined_without_symmetry_ties():
    """The regressors of the plan, each scaled to unit length, are independent: no term hides behind another.

    Xwq needs heave and pitch together, which no run of the source combines; the plan says so. Optional terms are left
    out: those of the vertical plane need it too.
    """
    craft = odd_craft()
    assert any("Xwq" in note for note in standard_plan(craft).notes)
    names = [name for name in STANDING if name != "Xwq"]
    rows = []
    for test in standard_plan(craft, 1.0).tests:
        history = sampled(test)
        control = np.tile(craft.virtual(np.array(test.fins or (0.0,) * 3)), (len(history.time), 1))
        rows.append(columns(names, history.nu, history.nudot, control).reshape(-1, len(names)))
    matrix = np.concatenate(rows)
    norms = np.linalg.norm(matrix, axis=0)
    assert [name for name, norm in zip(names, norms, strict=True) if norm == 0.0] == []
    smallest = np.linalg.svd(matrix / norms, compute_uv=False)[-1]
    # 0.196 is found; at 0.1 the noise of a load could reach a coefficient tenfold.
    assert smallest > 0.1


def test_primed_motions_do_not_depend_on_speed_or_size():
    slow, fast = standard_plan(HOKIE, 0.5), standard_plan(HOKIE, "4 kn")
    assert fast.speed == pytest.approx(2.0578, rel=1e-4)
    for one, other in zip(slow.tests, fast.tests, strict=True):
        assert one.name == other.name
        first, second = assess(one, HOKIE), assess(other, HOKIE)
        np.testing.assert_allclose([first.v, first.r, first.p], [second.v, second.r, second.p], rtol=1e-12)


def test_frequencies_and_amplitudes_can_be_replaced():
    plan = standard_plan(HOKIE, frequencies={"sway": (0.5,)}, amplitudes={"sway": (0.1, 0.2)}, periods=4, samples=32)
    sway = [test for test in plan.tests if test.kind == "sway"]
    assert [test.name for test in sway] == ["sway-v0.1-w0.5", "sway-v0.2-w0.5"]
    assert {(test.periods, test.samples) for test in sway} == {(4, 32)}


def test_bad_requests_are_refused():
    with pytest.raises(PlanError, match="Did you mean 'sway'"):
        standard_plan(HOKIE, frequencies={"swey": (1.0,)})
    with pytest.raises(PlanError, match="exploratory"):
        standard_plan(HOKIE, amplitudes={"sway": (0.9,)})
    with pytest.raises(InputError, match="speed"):
        standard_plan(HOKIE, "fast")
    with pytest.raises(PlanError, match="speed"):
        standard_plan(HOKIE, -1.0)
