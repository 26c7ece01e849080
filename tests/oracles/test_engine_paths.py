"""One motion by every path: numpy on floats and arrays, C one by one, packs of 2, 4 and 8."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from engine_cases import WATCHED, figure, model, shared, start

import synthetic_craft as synthetic
from towtank.engine import library as loading
from towtank.engine import run as running
from towtank.engine.build import C_SOURCES, Target, c_text, compile_library, compiler, targets
from towtank.engine.form import form_of
from towtank.engine.library import CHOICE, cpu_flags
from towtank.engine.plan import Clock, Ended, Leg, Log, Stat
from towtank.engine.run import Ensemble, fly
from towtank.engine.start import at
from towtank.model.kinematics import quaternion_matrix
from towtank.pilot.orders import Orders

ABLE = tuple(target for target in targets() if target.needs <= cpu_flags())
CLOSE = 1e-10
"""Largest difference between paths, in SI and over 100 s: some 1e-13 of round-off, grown in the closed loop."""
LANES = 9
"""More than a pack of any target, and not a whole number of packs."""
CLOCK = Clock(0.2, 2)

assert ABLE, "these tests need a target that this machine runs"
assert loading.can_compile(), "these tests need CasADi and a C compiler"


@pytest.fixture(scope="module")
def wide(tmp_path_factory):
    """A pack of 8 for a CPU without AVX-512: the same text, compiled for AVX2."""
    if any(target.lanes == 8 for target in ABLE) or not any(target.name == "avx2" for target in ABLE):
        return None
    target = replace(next(target for target in ABLE if target.name == "avx2"), name="avx2 by 8", lanes=8)
    return load(target, tmp_path_factory.mktemp("wide"))


def load(target, folder):
    made = compile_library(c_text(form_of(model("lumped"))), target, folder / "library.so")
    return loading._loaded(made, target, True)


@pytest.fixture
def by(monkeypatch, wide):
    """Every path by name; calling one makes it the path of ``fly``."""

    def choose(name):
        monkeypatch.setenv(CHOICE, name if name != "avx2 by 8" else "avx2")
        monkeypatch.setattr(running, "library", (lambda form: wide) if name == "avx2 by 8" else loading.library)

    return choose, ["numpy", *(target.name for target in ABLE), *(["avx2 by 8"] if wide else [])]


def spread(count=LANES):
    """Craft, currents and orders that differ."""
    d, along = model("lumped").derivatives, np.linspace(-1.0, 1.0, count)
    return Ensemble(
        count,
        {"Yuv": d["Yuv"] * (1.0 + 0.05 * along), "Nvdot": d["Nvdot"] * (1.0 - 0.1 * along),
         "zG": 0.0508 + 0.005 * along, "current_north": 0.05 * along},
        orders={"depth": np.array([[3.0, 3.5, 3.5, 6.0, 3.5]]) + 0.1 * along[:, None]},
    )  # fmt: skip


def same(a, b):
    """Two runs agree in all they hold."""
    np.testing.assert_array_equal(a.ended, b.ended)
    np.testing.assert_array_equal(a.by_event, b.by_event)
    for part in ("end_time", "mark_time", "mark", "log", "stats", "state"):
        np.testing.assert_allclose(getattr(a, part), getattr(b, part), rtol=0, atol=CLOSE, err_msg=part)


def test_every_path_makes_the_same_run_over_100_s(by):
    """Closed loop with legs, events, a current, gauges and a log; mass, derivatives and orders differ between lanes."""
    choose, names = by
    craft = model("lumped")
    given = {"clock": CLOCK, "log": Log(every=5), "gauges": WATCHED, **shared(craft)}
    many = {}
    for name in names:
        choose(name)
        many[name] = fly(craft, start(craft), figure(), ensemble=spread(), **given)
        assert many[name].path == name
    first = many.pop("numpy")
    assert first.finished.all()
    assert first.end_time.min() > 100.0
    assert first.by_event[:, 1:4].all()
    assert np.isfinite(first.stats[:, :, 0, Stat.FIRST]).any()
    assert np.nanmax(first.log[:, :, first.names.index("fin_use")]) > 0.9
    for other in many.values():
        same(first, other)


@pytest.mark.parametrize("name", ["lumped", "split", "screw", "three fins"])
def test_one_trajectory_alone_is_the_same_by_every_path(by, name):
    choose, names = by
    craft = model(name)
    given = {"clock": CLOCK, "log": Log(every=5), "gauges": WATCHED, **shared(craft)}
    runs = []
    for each in names if name == "lumped" else names[:2]:
        choose(each)
        runs.append(fly(craft, start(craft), figure(), **given))
    assert runs[0].path == "numpy"
    assert runs[0].end_time[0] > 100.0
    for other in runs[1:]:
        same(runs[0], other)


def pitching():
    """A craft with its CG at its centre, so that nothing rights it."""
    plain = synthetic.model(synthetic.STABLE, zg=0.0)
    return replace(plain, craft=replace(plain.craft, mass=replace(plain.craft.mass, cg=(0.0, 0.0, 0.0))))


def test_a_loop_through_the_vertical_is_the_same_by_every_path(by):
    """The elevator held: the craft goes up, over its back and down again. phi and psi turn over near the vertical."""
    choose, names = by
    craft = pitching()
    begin = at([0.0, 0.0, 200.0, 0.05, 0.0, 0.3, 1.0, *[0.0] * 9])
    loop = [Leg("loop", Orders(elevator=-0.35), 250.0)]
    given = {"thrust": float(craft.thrust(1.0)) * 2.0, "clock": CLOCK, "log": Log()}
    many = Ensemble(LANES, {"Muw": craft.derivatives["Muw"] * np.linspace(0.9, 1.1, LANES)})
    runs = {}
    for name in names:
        choose(name)
        runs[name] = fly(craft, begin, loop, ensemble=many if name != "numpy" else replace_first(many, 2), **given)
    few = len(runs["numpy"])
    first, smooth = runs["numpy"], [i for i, c in enumerate(runs["numpy"].logged) if c not in ("phi", "psi", "turn")]
    theta = first.series("theta")
    assert np.abs(theta).max() > np.radians(85.0)
    J33 = np.array([quaternion_matrix(e)[2][2] for e in first.state[:, 3:7]])
    down = np.cos(first.series("phi")) * np.cos(theta)
    assert down.min() < -0.9
    assert np.isfinite(J33).all()
    np.testing.assert_allclose((first.state[:, 3:7] ** 2).sum(axis=1), 1.0, rtol=0, atol=1e-8)
    for name in names[1:]:
        other = runs[name]
        np.testing.assert_allclose(first.log[:, :, smooth], other.log[:few][:, :, smooth], rtol=0, atol=CLOSE)
        np.testing.assert_allclose(first.state, other.state[:few], rtol=0, atol=CLOSE)
        for angle in ("phi", "psi"):
            # Defined to round-off over cos(theta).
            off = np.abs(np.exp(1j * first.series(angle)) - np.exp(1j * other.series(angle)[:few]))
            assert (off * np.cos(theta)).max() <= CLOSE


def replace_first(many, count):
    """The first ``count`` of an ensemble."""
    return Ensemble(count, {name: values[:count] for name, values in many.parameters.items()})


def test_stops_agree_and_a_lost_lane_leaves_its_neighbours_alone(by):
    choose, names = by
    craft = model("lumped")
    given = {"clock": CLOCK, "log": Log(), "gauges": WATCHED, **shared(craft)}
    legs = [Leg("go", figure()[0].orders, 20.0)]
    healthy = {"thrust": np.full(LANES, given["thrust"]), "Kpp": np.full(LANES, craft.derivatives["Kpp"])}
    sick = {name: values.copy() for name, values in healthy.items()}
    sick["thrust"][2], sick["Kpp"][5] = 1e5, 1e13
    begin = np.tile(start(craft), (LANES, 1))
    begin[5, 10] = 1.0
    left = [i for i in range(LANES) if i not in (2, 5)]
    runs = {}
    for name in names:
        choose(name)
        runs[name] = fly(craft, begin[0], legs, ensemble=Ensemble(LANES, sick, begin), **given)
        ended = runs[name].ended
        assert [ended[2], ended[5]] == [Ended.TOO_FAST, Ended.NOT_FINITE]
        assert (ended[left] == Ended.DONE).all()
        if name != "numpy":
            well = fly(craft, begin[0], legs, ensemble=Ensemble(LANES, healthy, begin), **given)
            for part in ("log", "stats", "mark", "state", "end_time"):
                np.testing.assert_array_equal(getattr(well, part)[left], getattr(runs[name], part)[left])
    first = runs["numpy"]
    for name in names[1:]:
        np.testing.assert_allclose(runs[name].end_time, first.end_time, rtol=0, atol=1e-9)
        np.testing.assert_array_equal(np.isnan(runs[name].log), np.isnan(first.log))
        np.testing.assert_allclose(runs[name].state, first.state, rtol=1e-9, atol=CLOSE)
        for lane in (2, 5):
            choose(name)
            one = {key: values[lane : lane + 1] for key, values in sick.items()}
            alone = fly(craft, begin[lane], legs, ensemble=Ensemble(1, one), **given)
            assert alone.ended[0] == first.ended[lane]
            assert alone.end_time[0] == pytest.approx(first.end_time[lane], abs=1e-9)


def test_the_number_of_threads_does_not_change_a_bit(by):
    choose, names = by
    craft = model("lumped")
    count = 64 * 8 * 2 + 5
    legs = [replace(leg, within=1.0, until=None) for leg in figure()]
    for name in names[1:]:
        choose(name)
        one, two = (
            fly(craft, start(craft), legs, ensemble=spread(count), clock=CLOCK, log=Log(), threads=n, **shared(craft))
            for n in (1, 2)
        )
        for part in ("log", "mark", "state", "end_time"):
            np.testing.assert_array_equal(getattr(one, part), getattr(two, part))


TEXT = """
import hashlib
from towtank.engine.build import c_text
from towtank.engine.form import SHIPPED
for form in SHIPPED[:2]:
    for name, text in sorted(c_text(form).items()):
        print(form.word, name, hashlib.sha256(text.encode()).hexdigest())
"""


def test_the_c_text_is_the_same_to_the_byte_in_every_process():
    out = [
        subprocess.run(
            [sys.executable, "-c", TEXT], env={**os.environ, "PYTHONHASHSEED": seed}, capture_output=True, text=True,
            check=True,
        ).stdout
        for seed in ("1", "2")
    ]  # fmt: skip
    assert out[0] == out[1]
    assert len(set(out[0].split())) == 8


FUNCTIONS = """
#include <stdint.h>
#include "lanes.h"
__attribute__((visibility("default"))) void sines(int64_t n, const double *a, double *s, double *c) {
  for (int64_t i = 0; i < n; i += LANES) {
    T x, y, z;
    memcpy(&x, a + i, sizeof x); SINCOS(x, &y, &z); memcpy(s + i, &y, sizeof y); memcpy(c + i, &z, sizeof z);
  }
}
__attribute__((visibility("default"))) void angles(int64_t n, const double *y, const double *x, double *a) {
  for (int64_t i = 0; i < n; i += LANES) {
    T p, q, r;
    memcpy(&p, y + i, sizeof p); memcpy(&q, x + i, sizeof q); r = ATAN2(p, q); memcpy(a + i, &r, sizeof r);
  }
}
"""


@pytest.mark.parametrize("target", ABLE or (Target("generic", 2),), ids=lambda target: target.name)
def test_sine_cosine_and_arc_tangent_of_packs_are_those_of_the_library(target, tmp_path):
    """Against math to a few units in the last place: angles to 1e5 rad, both signs, every quadrant, and the axes."""
    (tmp_path / "functions.c").write_text(FUNCTIONS)
    made = tmp_path / "functions.so"
    flags = ["-O2", "-std=gnu11", "-Wno-psabi", "-shared", "-fPIC", *target.flags]
    source = [f"-DLANES={target.lanes}", f"-I{C_SOURCES}", str(tmp_path / "functions.c"), "-lm", "-o", str(made)]
    subprocess.run([compiler(), *flags, *source], check=True)
    handle = ctypes.CDLL(str(made))
    rng = np.random.default_rng(7)
    size = 1 << 16
    signs = np.where(rng.random(size) < 0.5, -1.0, 1.0)
    a = signs * 10.0 ** rng.uniform(-12.0, 5.0, size)
    a[:4096] = np.arange(-2048, 2048) * (0.25 * np.pi)
    a[4096:4104] = [0.0, -0.0, np.pi, -np.pi, 0.5 * np.pi, -0.5 * np.pi, 1e-300, -1e-300]
    s, c = np.empty(size), np.empty(size)
    handle.sines(ctypes.c_int64(size), *(ctypes.c_void_p(v.ctypes.data) for v in (a, s, c)))
    ulp = np.spacing(1.0)
    for got, exact in ((s, np.sin(a.astype(np.longdouble))), (c, np.cos(a.astype(np.longdouble)))):
        off = np.abs(got - exact.astype(float))
        # Near a zero the two are known to a unit in the last place of 1, since sine and cosine are mixed by sums.
        assert (off <= 1.5 * ulp).all()
        assert (off <= 4.0 * np.spacing(np.abs(exact.astype(float))))[np.abs(a) < 0.78].all()
    length, turn = 10.0 ** rng.uniform(-150.0, 150.0, size), rng.uniform(-np.pi, np.pi, size)
    y, x = length * np.sin(turn), length * np.cos(turn)
    x[:1000] *= 10.0 ** rng.uniform(-100.0, 100.0, 1000)
    y[1000:1016] = [0.0, 1.0, -1.0, 0.0, 0.0, 1.0, -1.0, 1e-300, 1.0, -1.0, 1.0, -1.0, 3.0, 0.0, 1e300, 1e-320]
    x[1000:1016] = [0.0, 0.0, 0.0, 1.0, -1.0, 1.0, 1.0, 1.0, -1.0, -1.0, 1e300, 1e300, 4.0, 2.0, 1e300, 1.0]
    angle = np.empty(size)
    handle.angles(ctypes.c_int64(size), *(ctypes.c_void_p(v.ctypes.data) for v in (y, x, angle)))
    exact = np.arctan2(y.astype(np.longdouble), x.astype(np.longdouble)).astype(float)
    assert (np.abs(angle - exact) <= 4.0 * np.spacing(np.abs(exact)) + 1e-300).all()
