"""The writer of netCDF-4 bytes: what it writes is what h5netcdf and xarray, which are not ours, read."""

import io

import h5netcdf
import numpy as np
import pytest
import xarray

from towtank.artefact import Variable, read_netcdf, write_netcdf
from towtank.errors import ArtefactError
from towtank.netcdf import decode, encode


def _variables(seed, samples=7):
    random = np.random.default_rng(seed)
    return {
        "time": Variable(("time",), np.arange(float(samples)), {"units": "s"}),
        "X": Variable(("time",), random.normal(size=samples), {"units": "N", "long_name": "surge force"}),
        "delta": Variable(("time", "fin"), random.normal(size=(samples, 4)), {"units": "rad"}),
        "ensemble": Variable(("member", "time", "load"), random.normal(size=(3, samples, 6)).astype("f4"), {}),
        "empty": Variable(("time", "none"), np.zeros((samples, 0)), {}),
        "one": Variable((), np.array(2.5), {}),
    }


ATTRS = {"schema": "towtank/x/1", "words": "Kármán, β", "nothing": "", "count": 3, "size": 0.1}


@pytest.mark.parametrize("seed", [0, 1])
def test_everything_written_is_read_back_exactly(seed):
    # The second seed is made from the cached layout of the first: its data must not be the first's.
    written = _variables(seed)
    variables, attrs = decode(encode(written, ATTRS))
    assert attrs == ATTRS
    assert set(variables) == set(written)
    for name, variable in written.items():
        assert variables[name].dims == variable.dims
        assert variables[name].attrs == variable.attrs
        assert variables[name].values.dtype == variable.values.dtype
        np.testing.assert_array_equal(variables[name].values, variable.values)


def test_h5netcdf_and_xarray_read_the_same(tmp_path):
    written = _variables(2)
    path = tmp_path / "a.nc"
    path.write_bytes(encode(written, ATTRS))
    with h5netcdf.File(path, "r") as file:
        assert {name: file.variables[name].dimensions for name in file.variables} == {
            name: variable.dims for name, variable in written.items()
        }
        for key in ("schema", "words", "count", "size"):
            assert file.attrs[key] == ATTRS[key]
    with xarray.open_dataset(path, engine="h5netcdf") as data:
        np.testing.assert_array_equal(data["ensemble"].values, written["ensemble"].values)
        assert data["X"].attrs["long_name"] == "surge force"
        assert data.sizes["fin"] == 4


def test_a_file_written_by_h5netcdf_is_read(tmp_path):
    buffer = io.BytesIO()
    values = np.random.default_rng(3).normal(size=(5, 2))
    with h5netcdf.File(buffer, "w") as file:
        file.attrs["schema"] = "towtank/x/1"
        file.dimensions = {"time": 5, "fin": 2}
        file.create_variable("delta", ("time", "fin"), float, data=values).attrs["units"] = "rad"
    path = tmp_path / "b.nc"
    path.write_bytes(buffer.getvalue())
    variables, _ = read_netcdf(path, "towtank/x/1")
    assert variables["delta"].dims == ("time", "fin")
    assert variables["delta"].attrs == {"units": "rad"}
    np.testing.assert_array_equal(variables["delta"].values, values)


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.7, 0.99])
def test_a_cut_file_is_refused_wherever_it_is_cut(tmp_path, share):
    path = write_netcdf(tmp_path / "c.nc", "towtank/x/1", _variables(4), {})
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(ArtefactError, match="Delete it"):
        read_netcdf(path, "towtank/x/1")
