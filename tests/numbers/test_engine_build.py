"""Libraries of the engine: compiled when needed, kept, never trusted blindly; without them everything runs on numpy."""

from __future__ import annotations

import _ctypes
import json
import os
import shutil
import subprocess
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import synthetic_craft as synthetic
from towtank.engine import build
from towtank.engine import library as lib
from towtank.engine.form import SHIPPED, Form, form_of
from towtank.engine.library import EngineWarning, find, library, wanted
from towtank.engine.plan import Leg, Log
from towtank.engine.run import Ensemble, fly
from towtank.engine.start import at
from towtank.errors import InputError, TowtankError
from towtank.model.extra import ExtraLoad
from towtank.model.faults import Lost
from towtank.pilot.design import design_pilot
from towtank.pilot.orders import Orders

assert lib.can_compile(), "these tests need CasADi and a C compiler"

COMPILER = """#!/bin/sh
echo call >> {calls}
for word; do shift; [ "$word" = -O2 ] && word=-O0; set -- "$@" "$word"; done
exec {real} "$@"
"""
"""Counts its calls. Optimising is left out: it takes five times as long and these tests are not on speed."""

LAST = replace(build.targets()[-1], flags=(*build.targets()[-1].flags, "-O0"))
NO_FILE = "/dev/null/nothing"


@pytest.fixture
def calls(tmp_path, monkeypatch):
    """Own cache, nothing shipped, a compiler that counts; gives the number of compiler calls so far."""
    real, log, script = build.compiler(), tmp_path / "calls", tmp_path / "cc"
    script.write_text(COMPILER.format(calls=log, real=real))
    script.chmod(0o755)
    monkeypatch.setenv("CC", str(script))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("TOWTANK_ENGINE", raising=False)
    monkeypatch.setattr(build, "SHIPPED_LIBRARIES", tmp_path / "lib")
    lib._kept.cache_clear()
    return lambda: len(log.read_text().split()) if log.exists() else 0


@pytest.fixture
def bare(calls, monkeypatch):
    """No library and no compiler."""
    monkeypatch.setenv("PATH", NO_FILE)
    monkeypatch.delenv("CC")


@pytest.fixture(scope="module")
def craft():
    return synthetic.model(synthetic.STABLE)


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """A library for the last target, compiled once."""
    return build.compile_library(build.c_text(SHIPPED[0]), LAST, tmp_path_factory.mktemp("sound") / "library.so")


def flown(model, **options):
    legs = [
        Leg("turn", Orders(piloted=1.0, rudder=0.2, dive=1.0), 4.0),
        Leg("home", Orders(piloted=1.0, steer=1.0, dive=1.0, heading=-0.3, depth=1.0), 4.0),
    ]
    start = at([0.0, 0.0, 0.0, 0.05, 0.1, 0.0, 1.0, 0.1, -0.05] + [0.0] * (3 + len(model.craft.fins)))
    return fly(model, start, legs, thrust=60.0, pilot=design_pilot(model.with_extra(None)), log=Log(), **options)


def quiet(model, **options):
    """Flown with every warning an error."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return flown(model, **options)


def on_numpy(model, monkeypatch, **options):
    with monkeypatch.context() as patch:
        patch.setenv("TOWTANK_ENGINE", "numpy")
        done = quiet(model, **options)
    assert done.path == "numpy"
    return done


def doctor():
    from towtank.cli.app import app

    result = CliRunner().invoke(app, ["doctor", "--json"])
    assert result.exit_code == 0
    summary = json.loads(result.stdout)["summary"]
    return summary["engine"], {item["name"]: item for item in summary["items"]}


def same(one, other):
    np.testing.assert_allclose(one.log, other.log, atol=1e-10, rtol=0)
    np.testing.assert_allclose(one.state, other.state, atol=1e-10, rtol=0)


def tether(nu, down, delta, c, ops):
    pull = -c.drag * nu[0] * ops.fabs(nu[0])
    return [pull, -c.drag * nu[1], c.weight * down[2], 0.0, c.arm * c.weight * down[2], c.arm * c.drag * nu[1]]


def longer_tether(nu, down, delta, c, ops):
    load = tether(nu, down, delta, c, ops)
    return [1.5 * x for x in load]


VALUES = {"drag": 2.0, "weight": 1.5, "arm": -0.5}
TETHER = ExtraLoad("tether", tether, VALUES)


# Without a library


def test_without_a_compiler_everything_runs_on_numpy_and_says_so_once(bare, craft, monkeypatch):
    with pytest.warns(EngineWarning, match=r"no C compiler .* Install one, or set CC") as caught:
        first = flown(craft)
    assert len(caught) == 1
    assert first.path == "numpy"
    quiet(craft)
    same(first, on_numpy(craft, monkeypatch))


def test_doctor_says_why_the_engine_is_on_numpy_and_what_to_do(bare):
    engine, items = doctor()
    assert engine["path"] == "numpy"
    assert engine["library"] == ""
    assert not items["engine"]["installed"]
    assert "numpy" in items["engine"]["use"]
    assert "C compiler" in items["engine"]["remedy"]
    assert not items["C compiler"]["installed"]


def test_doctor_names_the_target_where_it_comes_from_and_that_numpy_was_chosen(sound, calls, monkeypatch):
    last = build.targets()[-1]
    monkeypatch.setenv("TOWTANK_ENGINE", last.name)
    engine, _ = doctor()
    assert (engine["from"], engine["path"], engine["lanes"], engine["library"]) == ("first use", last.name, 2, "")
    for origin, folder in (("cache", build.cache_folder()), ("shipped", build.SHIPPED_LIBRARIES)):
        path = folder / build.library_name(SHIPPED[0], last)
        folder.mkdir(parents=True)
        shutil.copy(sound, path)
        engine, items = doctor()
        assert (engine["from"], engine["library"]) == (origin, str(path))
        assert items["engine"]["version"] == f"{last.name}, 2 lanes"
        assert last.name in items["CPU"]["version"]
    monkeypatch.setenv("TOWTANK_ENGINE", "numpy")
    engine, items = doctor()
    assert (engine["path"], engine["choice"]) == ("numpy", "numpy")
    assert items["engine"]["installed"]
    assert "TOWTANK_ENGINE=numpy" in items["engine"]["use"]
    monkeypatch.setenv("TOWTANK_ENGINE", "abacus")
    assert "abacus" in doctor()[1]["engine"]["remedy"]
    assert calls() == 0


def test_without_casadi_a_form_that_is_not_shipped_runs_on_numpy_and_names_it(calls, craft, monkeypatch):
    monkeypatch.setattr(lib, "_no_casadi", lambda: "CasADi is not installed. Install it: pip install casadi")
    with pytest.warns(EngineWarning, match="pip install casadi"):
        assert flown(craft.with_extra(TETHER)).path == "numpy"
    assert calls() == 0


def test_a_target_that_does_not_exist_or_that_the_cpu_lacks_is_refused(craft, monkeypatch):
    monkeypatch.setenv("TOWTANK_ENGINE", "avx1024")
    with pytest.raises(InputError, match="choose numpy or one of"):
        flown(craft)
    best = build.targets()[0]
    if best.needs:
        monkeypatch.setenv("TOWTANK_ENGINE", best.name)
        monkeypatch.setattr(lib, "cpu_flags", frozenset)
        with pytest.raises(InputError, match="this CPU lacks"):
            flown(craft)


# Compiled when needed


def test_a_form_is_compiled_once_kept_and_loaded_by_the_next_process_without_a_compiler(calls, capfd):
    form = Form(fins=4)
    made = library(form)
    count = calls()
    assert count > 0
    assert made.path.parent == build.cache_folder()
    assert sorted(path.name for path in made.path.parent.iterdir()) == [made.path.name]
    lib._kept.cache_clear()
    assert library(form).path == made.path
    text = (
        "from towtank.engine.form import Form; from towtank.engine.library import library; library(Form(fins=4)).path"
    )
    away = f"from pathlib import Path; from towtank.engine import build; build.SHIPPED_LIBRARIES = Path({NO_FILE!r})"
    subprocess.run([sys.executable, "-c", f"{away}; {text}"], check=True)
    assert calls() == count
    assert capfd.readouterr() == ("", "")


def test_an_extra_load_is_compiled_for_its_text_and_not_for_its_numbers(calls, craft, monkeypatch):
    model = craft.with_extra(TETHER)
    first = quiet(model)
    count = calls()
    assert (count > 0, first.path) == (True, wanted()[0].name)
    same(first, on_numpy(model, monkeypatch))

    heavier = craft.with_extra(TETHER.with_values({"weight": 4.0}))
    second = quiet(heavier)
    lib._kept.cache_clear()
    quiet(heavier)
    assert calls() == count
    assert abs(second.state - first.state).max() > 1e-3
    same(second, on_numpy(heavier, monkeypatch))

    other = craft.with_extra(replace(TETHER, load=longer_tether))
    third = quiet(other)
    assert calls() > count
    same(third, on_numpy(other, monkeypatch))


def test_an_extra_load_that_does_not_run_on_symbols_runs_on_numpy_with_the_reason(calls, craft):
    def stepped(nu, down, delta, c, ops):
        return [-c.drag if nu[0] > 0.5 else 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]

    with pytest.warns(EngineWarning, match=r"'stepped' does not run on symbols .* no if"):
        assert flown(craft.with_extra(ExtraLoad("stepped", stepped, {"drag": 2.0}))).path == "numpy"
    assert calls() == 0


def six_fins(craft):
    """Six fins around the hull, and cross-flow terms that grow with the total cross-flow."""
    fins = tuple(replace(craft.craft.fins[0], name=f"fin{i}", azimuth=np.radians(30.0 + 60.0 * i)) for i in range(6))
    options = replace(craft.options, axisymmetric_crossflow=True)
    return replace(craft, craft=replace(craft.craft, fins=fins), options=options)


FORMS = {
    "six fins, axisymmetric": six_fins,
    "axisymmetric, a fin lost": lambda m: m.with_options(
        axisymmetric_crossflow=True, faults=(Lost(m.craft.fins[0].name),), kappa_v=0.5, kappa_r=0.3
    ),
}


@pytest.mark.parametrize("name", FORMS)
def test_a_form_that_is_not_shipped_is_compiled_and_agrees_with_numpy(name, calls, craft, monkeypatch):
    model = FORMS[name](craft)
    assert not form_of(model).shipped
    for options in ({}, {"ensemble": Ensemble(5, {"Yuv": np.linspace(0.8, 1.2, 5) * float(craft.derivatives["Yuv"])})}):
        done = quiet(model, **options)
        assert done.path == wanted()[0].name
        same(done, on_numpy(model, monkeypatch, **options))
    assert calls() > 0


def test_two_processes_may_compile_the_same_library_at_once(calls):
    text = (
        "from pathlib import Path; from towtank.engine import build; from towtank.engine.form import Form; "
        f"from towtank.engine.library import library; build.SHIPPED_LIBRARIES = Path({NO_FILE!r}); "
        "print(library(Form(axisymmetric=True)).path.name)"
    )
    both = [subprocess.Popen([sys.executable, "-c", text], stdout=subprocess.PIPE, text=True) for _ in range(2)]
    names = {process.communicate()[0].strip() for process in both}
    assert [process.returncode for process in both] == [0, 0]
    assert {path.name for path in build.cache_folder().iterdir()} == names
    assert len(names) == 1


# What goes wrong


@pytest.mark.parametrize(
    ("variable", "value", "words"),
    [
        ("CC", "false", "compiler .*false failed .status 1"),
        ("XDG_CACHE_HOME", NO_FILE, "cannot be written .* Set XDG_CACHE_HOME"),
    ],
)
def test_a_failing_compiler_or_cache_is_warned_of_once_and_numpy_is_used(
    variable, value, words, calls, craft, monkeypatch
):
    monkeypatch.setenv(variable, value)
    with pytest.warns(EngineWarning, match=words) as caught:
        assert flown(craft).path == "numpy"
    assert len(caught) == 1
    assert quiet(craft).path == "numpy"


def test_a_compiler_that_does_not_know_the_best_target_compiles_the_next(calls, monkeypatch):
    # The last target is one that every machine of this kind can run; the best is made to fail.
    first, second = build.targets()[0], build.targets()[-1]
    monkeypatch.setattr(lib, "able", lambda: (replace(first, flags=("-march=abacus",)), second))
    with pytest.warns(EngineWarning, match=f"abacus(.|\n)* runs on {second.name} instead"):
        assert library(SHIPPED[0]).target == second


def spoilt(path):
    """Library contents that must not be loaded."""
    whole = path.read_bytes()
    yield from (whole[:size] for size in (0, 40, 100, 1000, 4096, len(whole) // 2))
    yield b"#!/bin/sh\n" * 1000
    yield b"\0" * len(whole)
    yield b"\x7fELF" + b"\xff" * 5000


def test_a_library_that_cannot_be_loaded_is_warned_of_and_numpy_is_used(sound, calls, craft, monkeypatch):
    monkeypatch.setenv("TOWTANK_ENGINE", LAST.name)
    path = build.cache_folder() / build.library_name(SHIPPED[0], LAST)
    path.parent.mkdir(parents=True)
    for content in (*spoilt(sound), Path(_ctypes.__file__).read_bytes()):
        lib._kept.cache_clear()
        path.unlink(missing_ok=True)  # another file, not a loaded one written over
        path.write_bytes(content)
        with pytest.warns(EngineWarning, match=r"cannot be loaded .* Remove it"):
            assert library(SHIPPED[0]) is None
    assert flown(craft).path == "numpy"
    assert "Remove it" in doctor()[1]["engine"]["remedy"]
    monkeypatch.setenv("XDG_CACHE_HOME", str(path.parent))
    build.cache_folder().mkdir(parents=True)
    shutil.copy(sound, build.cache_folder() / path.name)
    assert quiet(craft).path == LAST.name


def test_a_shipped_library_that_cannot_be_loaded_is_replaced_by_one_that_is_compiled(calls, craft):
    for target in wanted():
        path = build.SHIPPED_LIBRARIES / build.library_name(SHIPPED[0], target)
        path.parent.mkdir(exist_ok=True)
        path.write_text("not a library")
    with pytest.warns(EngineWarning, match=r"Install towtank again. .* instead \(cache\)"):
        assert flown(craft).path == wanted()[0].name
    assert calls() > 0


# What is kept


def test_a_library_of_an_older_text_is_not_used(sound, calls, monkeypatch):
    monkeypatch.setenv("TOWTANK_ENGINE", LAST.name)
    build.SHIPPED_LIBRARIES.mkdir()
    shutil.copy(sound, build.SHIPPED_LIBRARIES / f"{SHIPPED[0].word}.{LAST.name}.0123456789abcdef.so")
    assert find(SHIPPED[0]).pending


def test_a_build_repeats_to_the_byte_removes_older_libraries_and_tells_what_failed(sound, calls, tmp_path):
    old = tmp_path / "lumped.old.0.so"
    old.touch()
    made, errors = build.build(SHIPPED[:1], tmp_path, (LAST, replace(LAST, name="odd", flags=("-march=abacus",))))
    assert [path.name for path in made] == [build.library_name(SHIPPED[0], LAST)]
    assert len(errors) == 1
    assert "abacus" in errors[0]
    assert list(tmp_path.glob("*.so")) == made
    assert made[0].read_bytes() == sound.read_bytes()


def test_a_build_without_a_compiler_says_so(bare, tmp_path):
    with pytest.raises(TowtankError, match="no C compiler"):
        build.build(SHIPPED[:1], tmp_path)


def test_the_cache_keeps_the_libraries_used_last(tmp_path):
    for i in range(6):
        (tmp_path / f"{i}.so").touch()
        os.utime(tmp_path / f"{i}.so", (i, i))
    build.prune(tmp_path, keep=2)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["4.so", "5.so"]
