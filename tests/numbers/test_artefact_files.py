"""Files of a study are whole or absent, say what they are, and come back as they were."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from towtank.artefact import (
    Variable,
    json_text,
    read_json,
    read_netcdf,
    replace_file,
    write_json,
    write_netcdf,
    write_text,
)
from towtank.errors import ArtefactError
from towtank.provenance import digest, provenance

SCHEMA = "towtank/test/1"
PLAIN = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**53), 2**53)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)


@settings(max_examples=40)
@given(st.dictionaries(st.text(max_size=8), PLAIN, max_size=4))
def test_json_gives_back_what_was_written(content: dict):
    assert json.loads(json_text({"content": content})) == {"content": content}


def test_arrays_become_lists_and_non_finite_numbers_null():
    text = json_text({"a": np.array([1.0, math.nan]), "b": np.float64(2.0), "c": (math.inf, 3)})
    assert json.loads(text) == {"a": [1.0, None], "b": 2.0, "c": [None, 3]}


def test_a_json_file_of_another_schema_is_refused(tmp_path: Path):
    path = write_json(tmp_path / "x.json", {"schema": "towtank/other/1"})
    with pytest.raises(ArtefactError, match="towtank/other/1"):
        read_json(path, SCHEMA)


@pytest.mark.parametrize("content", ["", "{", "[]", '{"schema": 3}', "\x00\x00"])
def test_a_broken_json_file_is_refused_with_its_name(tmp_path: Path, content: str):
    path = tmp_path / "broken.json"
    path.write_text(content)
    with pytest.raises(ArtefactError, match=r"broken\.json"):
        read_json(path, SCHEMA)


def test_a_missing_file_is_named(tmp_path: Path):
    for read in (read_json, read_netcdf):
        with pytest.raises(ArtefactError, match="does not exist"):
            read(tmp_path / "absent", SCHEMA)


def _series() -> dict[str, Variable]:
    time = np.linspace(0.0, 1.0, 500)
    return {
        "time": Variable(("time",), time, {"units": "s"}),
        "loads": Variable(("time", "load"), np.random.default_rng(1).normal(size=(500, 6)), {"units": "N"}),
    }


def test_netcdf_gives_back_numbers_to_the_last_bit(tmp_path: Path):
    written = _series()
    path = write_netcdf(tmp_path / "run.nc", SCHEMA, written, {"name": "sway", "speed": 1.5, "flags": ["a", "b"]})
    read, attrs = read_netcdf(path, SCHEMA)
    for name, variable in written.items():
        assert np.array_equal(read[name].values, variable.values)
        assert read[name].dims == variable.dims
        assert read[name].attrs["units"] == variable.attrs["units"]
    assert attrs["name"] == "sway"
    assert attrs["speed"] == 1.5
    assert json.loads(attrs["flags"]) == ["a", "b"]


@pytest.mark.parametrize("kept", [0, 1, 100, 4096, -1])
def test_a_truncated_netcdf_file_is_refused(tmp_path: Path, kept: int):
    """Cut anywhere, to nothing or by the last byte, the file is not taken for whole."""
    path = write_netcdf(tmp_path / "run.nc", SCHEMA, _series(), {})
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(ArtefactError, match="not a whole netCDF-4 file"):
        read_netcdf(path, SCHEMA)


def test_a_writer_that_fails_leaves_the_old_file_and_no_other(tmp_path: Path):
    path = write_text(tmp_path / "result.json", "old")

    def fail(part: Path) -> None:
        part.write_text("half of the n")
        raise OSError(28, "No space left on device")

    with pytest.raises(ArtefactError, match="No space left"):
        replace_file(path, fail)
    assert path.read_text() == "old"
    assert [item.name for item in tmp_path.iterdir()] == ["result.json"]


def test_an_interrupted_writer_leaves_the_old_file_and_no_other(tmp_path: Path):
    path = write_text(tmp_path / "result.json", "old")

    def interrupted(part: Path) -> None:
        part.write_text("half")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        replace_file(path, interrupted)
    assert [item.name for item in tmp_path.iterdir()] == ["result.json"]
    assert path.read_text() == "old"


def test_a_folder_that_cannot_be_made_is_an_error_with_a_remedy(tmp_path: Path):
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(ArtefactError, match="--out"):
        write_text(tmp_path / "file" / "study" / "x.json", "text")


def test_a_digest_ignores_order_and_the_last_bit_but_nothing_else():
    assert digest({"a": 1.0, "b": 2.0}) == digest({"b": 2.0, "a": 1.0})
    assert digest(0.1 + 0.2) == digest(0.3)
    assert digest(0.3) != digest(0.3000001)
    assert digest(1) != digest("1")
    assert digest(np.arange(3.0)) == digest([0.0, 1.0, 2.0])


def test_provenance_says_program_version_platform_and_date():
    block = provenance({"craft": "abc"}, wall_s=1.0)
    assert {"program", "version", "platform", "date", "inputs", "wall_s"} <= set(block)
    assert block["inputs"] == {"craft": "abc"}
