"""Data frames of polars and pandas, and data sets without the solver's inside."""

import csv

import numpy as np
import pytest
import xarray

import notchflex as nf
from notchflex.errors import ErrorCode
from notchflex.results.quantities import QUANTITIES
from refusals import refused


@pytest.fixture(scope="module")
def path(loop):
    return loop


@pytest.mark.parametrize("library", ["polars", "pandas"])
def test_columns_and_rows_are_those_of_the_csv(path, tmp_path, library):
    nf.save_path(path, tmp_path / "path.csv")
    rows = list(csv.reader((tmp_path / "path.csv").read_text().splitlines()))
    frame = path.to_dataframe(library)
    assert type(frame).__module__.partition(".")[0] == library
    assert list(frame.columns) == rows[0]
    assert len(frame) == len(rows) - 1 == 8
    np.testing.assert_allclose(frame["notch_2_deg"], np.degrees(path.notch_angle[:, 1]))
    np.testing.assert_array_equal(frame["tip_z_mm"], path.tip_position[:, 2])
    assert frame["notch_1_closed"].to_list() == path.closed[:, 0].tolist()


def test_other_libraries_are_refused(path):
    with refused(ErrorCode.UNKNOWN_NAME):
        path.to_dataframe("arrow")


def test_a_data_set_has_the_quantities_and_nothing_else(path):
    data = path.to_xarray()
    assert set(data.data_vars) == set(QUANTITIES)
    assert all(data[name].attrs["long_name"] for name in data.data_vars)
    sizes = {"step", "tendon", "notch", "body", "axis", "row", "span", "contact"}
    assert set(data.dims) == sizes
    assert "facts" not in data.attrs


def test_a_netcdf_file_shows_the_quantities_first(path, tmp_path):
    nf.save_path(path, tmp_path / "path.nc")
    assert set(xarray.load_dataset(tmp_path / "path.nc").data_vars) == set(QUANTITIES)


def test_netcdf_files_of_the_first_version_are_read(path, tmp_path):
    """They had the record beside the quantities, in no group."""
    nf.save_path(path, tmp_path / "new.nc")
    data, record = (xarray.load_dataset(tmp_path / "new.nc", group=g) for g in (None, "read_back"))
    whole = data.assign(record.data_vars).assign_attrs(record.attrs)
    whole.to_netcdf(tmp_path / "old.nc", engine="h5netcdf")
    found = nf.read_path(tmp_path / "old.nc")
    for name in QUANTITIES:
        np.testing.assert_array_equal(
            np.asarray(getattr(found, name)), np.asarray(getattr(path, name)), err_msg=name
        )
    assert found.state.arrays.keys() == path.state.arrays.keys()
