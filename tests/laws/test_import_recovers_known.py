"""Known coefficients, hidden behind other people's axes, points, scales and halves, come back from the gate."""

from __future__ import annotations

import numpy as np
import pytest
from import_cases import (
    HEAD,
    HOKIE,
    STAR_AXES,
    STAR_COLUMNS,
    fins_text,
    force_and_moment,
    forces_dat,
    halved,
    inertial,
    known,
    motion_text,
    plan,
    runs_of,
    seen,
    star_csv,
)

from towtank.derive.derive import derive
from towtank.frames import move_load
from towtank.tank.imported.gate import import_runs

VALUES = known()
PLAN = plan()
RUNS = runs_of(PLAN, VALUES)

# The files hold 17 digits, so what is lost is round-off of the conversions and of a fit of condition 100: each of some
# 1e-16 x 100, and 1e-9 leaves room for terms that are small beside the load they stand in.
ROUND_OFF = 1e-9


def assert_same_runs(found, wanted):
    for a, b in zip(found, wanted, strict=True):
        assert (a.name, a.kind, a.periods) == (b.name, b.kind, b.periods if b.period else 1)
        assert a.period == pytest.approx(b.period, rel=1e-12)
        assert a.speed == pytest.approx(b.speed, rel=1e-12)
        force, moment = np.abs(b.loads[:, :3]).max(), np.abs(b.loads[:, 3:]).max()
        # A moment is a difference of force times arm: its round-off is that of the larger of the two.
        size = np.array([force] * 3 + [max(moment, force * HOKIE.length)] * 3)
        np.testing.assert_allclose(a.loads / size, b.loads / size, atol=1e-12)
        np.testing.assert_allclose(a.history.nu, b.history.nu, atol=1e-12)
        np.testing.assert_allclose(a.history.nudot, b.history.nudot, atol=1e-12)
        np.testing.assert_allclose(a.control, b.control, atol=1e-15)


def assert_known(runs):
    found = derive(runs).as_dict()
    assert len(found) > 40
    for name, value in found.items():
        assert value == pytest.approx(VALUES[name], rel=ROUND_OFF), name


def mapping(folder, head, entries):
    """A mapping file of the standard plan with the keys of ``entries(test)`` for each run."""
    text = head
    for test in PLAN.tests:
        keys = {"name": f'"{test.name}"', "fins": fins_text(test), **entries(test)}
        text += "\n[[run]]\n" + "".join(f"{key} = {value}\n" for key, value in keys.items())
    (folder / "map.toml").write_text(text, encoding="utf-8")
    return folder / "map.toml"


def test_star_monitors_of_half_models_at_scale_with_x_aft_and_another_moment_point(tmp_path):
    model = {"length": 3.4, "speed": 1.7, "density": 0.9}
    point = (HOKIE.origin_from_nose - 2.5, 0.0, -0.3)
    for test, run in zip(PLAN.tests, RUNS, strict=True):
        star_csv(tmp_path / f"{test.name}.csv", *seen(run, point=point, half=halved(test), **model))
    head = HEAD.format(form="star", speed=PLAN.speed * 1.7, density=HOKIE.water.density * 0.9, axes='["-x", "y", "-z"]')
    head += f'moment_point = {{ from_nose = "{2.5 / 3.4!r} m", z = "{-0.3 / 3.4!r} m" }}\n'
    head += f'scale = {{ lambda = 3.4, speed = "{PLAN.speed!r} m/s" }}\n' + STAR_COLUMNS

    def entries(test):
        half = {"half_model": '"xz"'} if halved(test) else {}
        return {"file": f'"{test.name}.csv"', "motion": motion_text(test, 3.4, 1.7), **half}

    found = import_runs(mapping(tmp_path, head, entries))
    assert_same_runs(found, RUNS)
    assert_known(found)
    assert sum("half model cut at xz" in " ".join(run.provenance["conversions"]) for run in found) > 5
    assert all("Reynolds" in " ".join(run.flags) for run in found)


@pytest.mark.parametrize("layout", ["nested", "columns", "columns in brackets"])
def test_openfoam_forces_along_inertial_axes_over_restarts_that_overlap(layout, tmp_path):
    """The CofR is fixed in the carriage, x aft and z up; every oscillation was restarted at its middle."""
    point, centre = (0.4, 0.0, -0.2), (7.0, 1.0, 2.0)
    nose = (np.array(centre) - STAR_AXES @ (np.array(point) - [HOKIE.origin_from_nose, 0.0, 0.0])).tolist()
    for test, run in zip(PLAN.tests, RUNS, strict=True):
        turned = move_load(run.loads, np.array(point)) if test.kind == "turn" else inertial(run, point)
        loads = np.concatenate([turned[:, :3] @ STAR_AXES.T, turned[:, 3:] @ STAR_AXES.T], axis=1)
        time, half = run.history.time, len(run.history.time) // 2
        parts = [("0", slice(None))]
        if not run.steady:
            # The first part ran on past the restart and diverged there; what the restart wrote holds.
            parts = [("0", slice(0, half + 7)), (f"{time[half]:.17g}", slice(half, None))]
        for number, (start, rows) in enumerate(parts):
            spoilt = loads.copy()
            if number == 0 and not run.steady:
                spoilt[half:] *= 3.0
            place = tmp_path / test.name / "postProcessing" / "forces" / start
            if layout == "nested":
                forces_dat(place / "forces.dat", time[rows], spoilt[rows], centre)
            else:
                force_and_moment(place, time[rows], spoilt[rows], centre, brackets=layout == "columns in brackets")
    head = HEAD.format(form="openfoam", speed=PLAN.speed, density=HOKIE.water.density, axes='["-x", "y", "-z"]')

    def entries(test):
        frame, fixed = ("body", "body") if test.kind == "turn" else ("inertial", "carriage")
        return {
            "file": f'"{test.name}"',
            "motion": motion_text(test),
            "frame": f'"{frame}"',
            "moment_point": f'{{ nose = {[f"{x!r} m" for x in nose]}, fixed = "{fixed}" }}',
        }

    found = import_runs(mapping(tmp_path, head, entries))
    assert_same_runs(found, RUNS)
    assert_known(found)
    sway = next(run for run in found if run.kind == "sway")
    assert any("overlaps what was written before" in text for text in sway.provenance["conversions"])
