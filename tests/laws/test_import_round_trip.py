"""A plan that leaves as a macro and motion tables, and comes back as monitors, gives the runs that the plan means."""

from __future__ import annotations

import csv
import re
from dataclasses import replace

import numpy as np
import pytest
from import_cases import HOKIE, known, seen, star_csv

from towtank.plan.kinds import CaptiveTest
from towtank.plan.macro import MONITORS, PLOT, parameters, star_macro
from towtank.plan.motion import KINDS, sample_times
from towtank.plan.standard import standard_plan
from towtank.plan.tables import motion_table
from towtank.progress import Silent
from towtank.tank.imported.export import write_export
from towtank.tank.imported.gate import import_runs
from towtank.tank.lpm import LpmTank

PLAN = standard_plan(HOKIE, periods=2, samples=64)
TANK = LpmTank(known())
CALL = re.compile(r'^ {8}test\("(?P<name>[^"]+)", (?P<numbers>[^)]+)\);$', re.MULTILINE)


def read_macro(text):
    """Name -> end, step, and parameter -> value, as the macro would set them."""
    names = re.findall(r'"([^"]+)"', text[text.index("PARAMETERS = {") : text.index("};")])
    out = {}
    for found in CALL.finditer(text):
        end, step, *values = (float(word) for word in found["numbers"].split(", "))
        out[found["name"]] = (end, step, dict(zip(names, values, strict=True)))
    return out


def motion_of(values):
    """The motion that field functions of the macro's parameters describe, by their names alone."""
    for kind in ("surge", "sway", "heave", "yaw", "pitch", "roll"):
        if values[f"{kind.title()} Amplitude"]:
            return KINDS[kind](values["Speed"], values[f"{kind.title()} Amplitude"], values["Frequency"])
    if values["Yaw Rate"]:
        return KINDS["turn"](values["Speed"], values["Yaw Rate"], values["Drift"])
    if values["Incidence"]:
        return KINDS["incidence"](values["Speed"], values["Incidence"])
    return KINDS["drift"](values["Speed"], values["Drift"])


def test_the_macro_sets_every_test_of_the_plan_and_names_what_it_assumes():
    text = star_macro(PLAN)
    made = read_macro(text)
    assert list(made) == [test.name for test in PLAN.tests]
    for test in PLAN.tests:
        _, _, values = made[test.name]
        assert motion_of(values) == test.motion
        fins = tuple(values[f"Fin {fin.name}"] for fin in HOKIE.fins)
        assert fins == (test.fins or (0.0,) * len(HOKIE.fins))
    head = text[: text.index("package macro")]
    assert "It has not been run in STAR-CCM+" in head
    assert all(name in head for name in (*MONITORS, PLOT, *(name for name, _ in parameters(HOKIE))))
    for opening, closing in ("{}", "()"):
        assert text.count(opening) == text.count(closing)


def test_a_macro_of_many_tests_is_split_into_methods_that_java_accepts():
    tests = tuple(replace(PLAN.tests[i % 80], name=f"t{i}") for i in range(450))
    text = star_macro(replace(PLAN, tests=tests))
    methods = re.split(r"private void part\d+\(\)", text)[1:]
    assert sum(len(CALL.findall(method)) for method in methods) == 450
    # A value takes at most 7 bytes of code and a call some 20 more; a method may have 65535.
    assert all(len(CALL.findall(m)) * (7 * (len(parameters(HOKIE)) + 2) + 20) < 65535 for m in methods)
    assert all(f"part{i}();" in text for i in range(len(methods)))


@pytest.mark.parametrize("test", PLAN.tests[::7], ids=lambda test: test.name)
def test_a_motion_table_holds_the_motion_of_the_test(test):
    head, *rows = csv.reader(motion_table(test).splitlines())
    assert head[:2] == ["Time (s)", "x (m)"]
    assert head[-1] == "r (rad/s)"
    values, history = np.array(rows, dtype=float), test.motion.history(sample_times(test))
    exact = np.column_stack([history.time, history.position, history.attitude, history.nu])
    # 12 digits are printed.
    np.testing.assert_allclose(values, exact, rtol=1e-11, atol=1e-15)


def test_monitors_made_by_the_macro_s_numbers_come_back_as_the_runs_of_the_plan(tmp_path):
    files = write_export(PLAN, tmp_path, "hokie")
    (tmp_path / "monitors").mkdir()
    for name, (end, step, values) in read_macro(files["macro"].read_text("utf-8")).items():
        motion = motion_of(values)
        fins = tuple(values[f"Fin {fin.name}"] for fin in HOKIE.fins)
        oscillating = motion.period > 0.0
        samples, periods = (round(motion.period / step), round(end / motion.period)) if oscillating else (64, 1)
        run = TANK.run(HOKIE, CaptiveTest(name, motion.speed, motion, fins, periods, samples), Silent())
        time, loads = seen(run, matrix=np.eye(3))
        if not oscillating:
            time = np.arange(1, round(end / step / 20) + 1) * 20 * step  # monitors that skip steps, to write less
            loads = np.tile(loads[:1], (len(time), 1))
        star_csv(tmp_path / "monitors" / f"{name}.csv", time, loads)
    found = import_runs(files["mapping"])
    assert [run.name for run in found] == [test.name for test in PLAN.tests]
    for run, test in zip(found, PLAN.tests, strict=True):
        fine = replace(test, samples=256)
        wanted = TANK.run(HOKIE, fine, Silent())
        assert (run.kind, run.speed, run.exploratory) == (wanted.kind, wanted.speed, test.exploratory)
        # 17 digits are printed: round-off only.
        np.testing.assert_allclose(run.loads, wanted.loads, atol=1e-11 * np.abs(wanted.loads).max())
        np.testing.assert_allclose(run.history.nu, wanted.history.nu, atol=1e-12)
        np.testing.assert_allclose(run.control, wanted.control, atol=1e-15)
