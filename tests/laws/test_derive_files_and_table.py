"""What is written is read back equal; the table says level, uncertainty and what is missing."""

import dataclasses
import json

import numpy as np
import pytest
from derive_synthetic import campaign, fourfold_coefficients, loaded

from towtank.derive.derive import derive
from towtank.derive.files import read_derivatives, write_derivatives
from towtank.derive.show import pair
from towtank.errors import ArtefactError


@pytest.fixture(scope="module")
def found():
    runs = loaded(campaign(), fourfold_coefficients(), noise=0.02)
    runs[0] = dataclasses.replace(runs[0], flags=("drift beyond the tested range",))
    return derive(runs, about=3.9, length=7.5)


def test_derivatives_are_read_back_equal(found, tmp_path):
    again = read_derivatives(write_derivatives(found, tmp_path / "derivatives.json"))
    for field in dataclasses.fields(found):
        a, b = getattr(found, field.name), getattr(again, field.name)
        assert np.array_equal(a, b) if isinstance(a, np.ndarray) else a == b, field.name


def test_file_keeps_the_contract(found, tmp_path):
    content = json.loads(write_derivatives(found, tmp_path / "derivatives.json").read_text())
    assert content["schema"] == "towtank/derivatives/1"
    assert set(content["reference"]) == {"length", "speed", "density", "origin_from_nose"}
    assert content["reference"]["length"] == 7.5
    entry = content["terms"]["Yuv"]
    assert set(entry) == {"value", "std", "unit", "prime", "std_parts", "runs"}
    parts = entry["std_parts"]
    assert entry["std"] == pytest.approx(np.hypot(np.hypot(parts["fit"], parts["mesh"]), parts["model"]))
    assert entry["prime"] == pytest.approx(entry["value"] / (0.5 * 1000.0 * 7.5**2))
    n = len(content["order"])
    assert np.shape(content["covariance"]) == (n, n)


@pytest.mark.parametrize("damage", ["{", "", '{"schema": "towtank/derivatives/1"}', '{"schema": "towtank/grid/1"}'])
def test_a_damaged_file_is_refused_with_its_name(tmp_path, damage):
    path = tmp_path / "derivatives.json"
    path.write_text(damage)
    with pytest.raises(ArtefactError, match=r"derivatives\.json"):
        read_derivatives(path)


def test_a_covariance_of_another_size_is_refused(found, tmp_path):
    path = write_derivatives(found, tmp_path / "derivatives.json")
    content = json.loads(path.read_text())
    content["covariance_parts"]["fit"] = [[1.0]]
    path.write_text(json.dumps(content))
    with pytest.raises(ArtefactError, match="covariance fit"):
        read_derivatives(path)


def test_table_says_level_uncertainty_and_remarks(found):
    text = str(found)
    assert "a test of identification, no statement about a hull" in text
    assert "not assessed: mesh, model form" in text
    assert "validity remarks" in text
    for name in found.names:
        assert any(line.startswith(name + " ") for line in text.splitlines())
    assert "Slopes at the origin" in text


@pytest.mark.parametrize(
    ("value", "std", "text"),
    [(-1840.3, 95.2, "-1840 +/- 95"), (-1843.0, 954.0, "-1840 +/- 950"), (0.012346, 0.00067, "0.01235 +/- 0.00067"),
     (-274.963, 0.604, "-274.96 +/- 0.60"), (12.0, 0.0, "12 +/- 0")],
)  # fmt: skip
def test_value_is_written_to_the_place_its_uncertainty_allows(value, std, text):
    assert pair(value, std) == text
