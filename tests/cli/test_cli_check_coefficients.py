"""``towtank check-coefficients``: verdicts, exit codes, and what a faulty file is told."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from towtank.cli.app import app
from towtank.derive.files import write_derivatives
from towtank.derive.published import read_coefficients

runner = CliRunner()
DATA = Path(__file__).parents[1] / "data"
REMUS, RODDY = DATA / "coefficients_remus100.toml", DATA / "coefficients_suboff_4fins.toml"

PRINTED = """
schema      = "towtank/coefficients/1"
craft       = "hull"
formulation = "perron-printed"
sense       = "damping-left"
units       = "SI"
symmetry    = "fourfold"
[reference]
length = "4 m"
speed = "2 m/s"
density = 1000
origin_from_nose = "1.9 m"
[tested]
v = "negative"
w = "positive"
r = "positive"
[terms]
Yvdot = -600
Xuu = 9
Yuv = 60
Nuv = 466
Yuudr = 40
Xuuvv = -1.5
Xuuww = 2.5
Xuv = 3
Xrr = -10
"""


def check(*arguments):
    return runner.invoke(app, ["check-coefficients", *map(str, arguments)])


def test_the_printed_remus_table_fails_with_the_names_of_its_faults():
    result = check(REMUS)
    assert result.exit_code == 3
    assert "planes: Zww against Yvv" in result.stdout
    assert "planes: Mqq against Nrr" in result.stdout
    assert result.stdout.index("fail") < result.stdout.index("pass ")
    assert "6 checks failed" in result.stderr
    assert "Traceback" not in result.stderr
    assert max(map(len, result.stdout.splitlines())) <= 100


def test_a_sound_set_ends_with_code_0():
    result = check(RODDY)
    assert result.exit_code == 0, result.output
    assert "0 fail, 0 warn" in result.stdout


def test_json_holds_every_check_and_what_was_read_otherwise():
    result = check(REMUS, "--json")
    answer = json.loads(result.stdout)
    assert (result.exit_code, answer["exit_code"], answer["status"]) == (3, 3, "failed")
    summary = answer["summary"]
    assert summary["verdicts"]["fail"] == 6
    assert all(set(item) == {"check", "verdict", "value", "limit", "words"} for item in summary["checks"])
    assert list(summary["not_represented"]) == ["Kprop"]


def test_derivatives_of_a_study_are_read_too(tmp_path: Path):
    path = write_derivatives(read_coefficients(RODDY), tmp_path / "derivatives.json")
    assert check(path, "--craft", "suboff-fins").exit_code == 0
    result = check(tmp_path, "--against", RODDY)
    assert result.exit_code == 0, result.output
    assert "published against published" in result.stdout


def test_a_craft_of_another_origin_is_refused(tmp_path: Path):
    result = check(REMUS, "--craft", "hokie")
    assert result.exit_code == 3
    assert "about a point" in result.stderr


def test_printed_terms_are_read_with_every_departure_in_words(tmp_path: Path):
    path = tmp_path / "printed.toml"
    path.write_text(PRINTED)
    d = read_coefficients(path)
    # natural signs from the left-hand side; u^2 |v| v at 2 m/s on the side v < 0: factor -4, and the sense of the file
    assert d.as_dict() == pytest.approx({
        "Yvdot": -600.0, "Xuu": -9.0, "Yuv": -60.0, "Nuv": -466.0, "Yuudr": 40.0,
        "Xuuvv": -6.0, "Xuuww": -10.0, "Xrr": 10.0, "Xvr": 600.0,
    })  # fmt: skip
    assert d.quality["not_represented"]["Xuv"]["value"] == -3.0
    words = " ".join(d.quality["departures"])
    for name in ("Xuuvv", "Xuuww", "Xuv", "Xrr", "Xvr", "left-hand side"):
        assert name in words
    text = check(path).stdout
    assert "Read otherwise than printed" in text
    assert "even form" in " ".join(text.split())


def test_terms_without_a_printed_place_follow_from_the_others(tmp_path: Path):
    """Xvr and Xwq from M_A; Xqq of a 4-fold craft from Xrr, which holds the viscous part too."""
    path = tmp_path / "printed.toml"
    path.write_text(PRINTED.replace("Yvdot = -600", "Yvdot = -600\nZwdot = -600\nZqdot = -20"))
    d = read_coefficients(path)
    assert (d["Xvr"], d["Xwq"], d["Xqq"]) == (600.0, -600.0, d["Xrr"])
    path.write_text(path.read_text().replace("fourfold", "mirror"))
    assert read_coefficients(path)["Xqq"] == -20.0


def test_units_and_primes_are_the_same_set(tmp_path: Path):
    text = PRINTED.replace('"perron-printed"', '"gertler-hagen"').replace("damping-left", "body")
    head = text[: text.index("[tested]")] + "[terms]\n"
    rho, length = 1000.0, 4.0
    (tmp_path / "si.toml").write_text(head + 'Nr = "-197 kg*m/rad"\nYvdot = "-0.6 tonne"\n[std]\nNr = "10 %"\n')
    primes = f"Nr = {-197.0 / (0.5 * rho * length**4)}\nYvdot = {-600.0 / (0.5 * rho * length**3)}\n"
    std = f"[std]\nNr = {19.7 / (0.5 * rho * length**4)}\n"
    (tmp_path / "prime.toml").write_text((head + primes + std).replace('"SI"', '"prime"'))
    one, other = (read_coefficients(tmp_path / f"{name}.toml") for name in ("si", "prime"))
    assert one.as_dict() == pytest.approx({"Yvdot": -600.0, "Nur": -197.0})
    assert other.as_dict() == pytest.approx(one.as_dict())
    assert other.covariance == pytest.approx(one.covariance)
    assert one.covariance[1, 1] == pytest.approx(19.7**2)


def test_an_even_term_has_the_printed_force_on_the_tested_side(tmp_path: Path):
    """At the reference speed, on the side that was tested, the force of the file is the force of the model."""
    path = tmp_path / "printed.toml"
    path.write_text(PRINTED)
    d = read_coefficients(path)
    u, v = 2.0, -0.4
    # the file has it on the left: - (-1.5) u^2 |v| v. The even form is u^2 v^2 / V^2; V is the reference speed
    printed = 1.5 * u**2 * abs(v) * v
    assert d["Xuuvv"] * u**2 * v**2 / d.reference.speed**2 == pytest.approx(printed)


FAULTS = {
    "unknown term": ("Yvdot = -600", "Yvddot = -600", "Yvdot"),
    "term of another formulation": ("Yvdot = -600", "Xvr = 560", "formulation perron-printed"),
    "missing units": ('units       = "SI"\n', "", "units is missing"),
    "unknown units": ('units       = "SI"', 'units = "imperial"', "prime"),
    "wrong formulation": ('"perron-printed"', '"perron"', "perron-printed, prestero"),
    "missing sense": ('sense       = "damping-left"\n', "", "damping matrix on the left"),
    "unknown symmetry": ('"fourfold"', '"axial"', "mirror"),
    "missing reference": ('length = "4 m"\n', "", "reference.length is missing"),
    "length of zero": ('length = "4 m"', "length = 0", "not positive"),
    "diameter of zero": ("[tested]", "[body]\ndiameter = 0\n[tested]", "body.diameter is not positive"),
    "wrong dimension": ("Yuv = 60", 'Yuv = "60 kg"', "terms.Yuv"),
    "not a number": ("Yuv = 60", "Yuv = nan", "terms.Yuv"),
    "text that is no quantity": ("Yuv = 60", 'Yuv = "sixty"', "terms.Yuv"),
    "untested side": ('v = "negative"\n', "", "[tested] v"),
    "unknown side": ('v = "negative"', 'v = "port"', "positive, negative"),
    "unknown table": ("[tested]", "[proved]", "proved"),
    "terms not a table": ("[terms]\n", "[[terms]]\n", "terms is not a table"),
    "another schema": ("towtank/coefficients/1", "towtank/plan/1", "towtank/plan/1"),
    "not TOML": ("Yuv = 60", "Yuv: 60", "is not a TOML file"),
}


@pytest.mark.parametrize(("old", "new", "named"), FAULTS.values(), ids=FAULTS)
def test_a_faulty_file_is_told_what_to_write(old: str, new: str, named: str, tmp_path: Path):
    assert PRINTED.count(old) == 1
    path = tmp_path / "faulty.toml"
    path.write_text(PRINTED.replace(old, new))
    result = check(path)
    assert result.exit_code == 2, result.output
    assert named in result.stderr
    assert "faulty.toml" in result.stderr
    assert "Traceback" not in result.stderr


def test_all_faults_are_told_at_once(tmp_path: Path):
    path = tmp_path / "faulty.toml"
    path.write_text(PRINTED.replace("Yvdot", "Yvddot").replace('units       = "SI"\n', "").replace('"4 m"', '"4 kg"'))
    stderr = check(path).stderr
    for named in ("Yvddot", "units", "length"):
        assert named in stderr


@pytest.mark.parametrize("content", [None, b"", b"\xff\xfe\x00", b"{}"])
@pytest.mark.parametrize("name", ["set.toml", "derivatives.json"])
def test_a_file_that_is_no_set_is_refused(name: str, content: bytes | None, tmp_path: Path):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    result = check(path)
    assert result.exit_code == 2
    assert name in result.stderr
    assert "Traceback" not in result.stderr
