"""Paths to files and back: equal numbers, equal states, and what a format cannot hold is said."""

import dataclasses
import json

import numpy as np
import pytest

import notchflex as nf
from notchflex.errors import ErrorCode, InputError
from notchflex.results.quantities import QUANTITIES
from notchflex.robot import robot_text
from refusals import refused

WHOLE = (".json", ".nc", ".parquet")


@pytest.fixture(scope="module")
def loop():
    """Pulled until notches close, and let go: friction and contacts."""
    robot = nf.load_robot("pacheco2021-a")
    settings = nf.Settings(max_iterations=30)
    return nf.simulate(robot, nf.pull(0.0, 3.0, steps=4).release(), settings=settings)


@pytest.fixture(scope="module")
def turned():
    """A base that is turned, and external loads of several kinds, all in one plane."""
    robot = nf.load_robot("pacheco2021-a")
    side = nf.BodyForce(2, (0.01, 0.0, 0.0), point=(0.5, 0.0, 0.0), following=True)
    loads = nf.pull(0.0, 1.0, steps=2).loaded(tip_force=(0.0, 0.0, 0.02), body_forces=[side])
    loads = loads.then(loads.loaded(tip_mass=2.0))
    return nf.simulate(robot, dataclasses.replace(loads, base_rotation=np.array([0.0, 0.3, 0.0])))


def assert_same(found, path):
    assert found.robot == path.robot
    assert found.settings == path.settings
    assert found.load.external == path.load.external
    np.testing.assert_array_equal(found.load.base_rotation, path.load.base_rotation)
    for name in QUANTITIES:
        given, wanted = np.asarray(getattr(found, name)), np.asarray(getattr(path, name))
        assert given.dtype.kind == wanted.dtype.kind, name
        np.testing.assert_array_equal(given, wanted, err_msg=name)
    for step in range(len(path)):
        one, other = found.state_at(step), path.state_at(step)
        assert (one.level, one.loaded, one.refinement) == (
            other.level,
            other.loaded,
            other.refinement,
        )
        assert one.arrays.keys() == other.arrays.keys()
        for name, array in one.arrays.items():
            np.testing.assert_array_equal(array, other.arrays[name], err_msg=name)


@pytest.mark.parametrize("suffix", WHOLE)
def test_a_loop_is_read_back_equal_and_gone_on_with(loop, tmp_path, suffix):
    file = tmp_path / f"loop{suffix}"
    nf.save_path(loop, file)
    found = nf.read_path(file)
    assert_same(found, loop)
    nexts = [nf.solve(p.robot, nf.Load(tension=0.7), from_state=p.state) for p in (loop, found)]
    for name in ("notch_angle", "contact_slid", "stroke", "iterations"):
        np.testing.assert_array_equal(getattr(nexts[1], name), getattr(nexts[0], name))


@pytest.mark.parametrize("suffix", WHOLE)
def test_loads_from_outside_and_a_turned_base_come_back(turned, tmp_path, suffix):
    file = tmp_path / f"turned{suffix}"
    nf.save_path(turned, file)
    assert_same(nf.read_path(file), turned)


def test_a_path_that_failed_comes_back_with_its_reasons(tmp_path):
    path = nf.simulate(nf.load_robot("pacheco2021-a"), nf.stroke_path(0.0, 9.0, steps=3))
    assert not path.converged.all()
    nf.save_path(path, tmp_path / "failed.nc")
    found = nf.read_path(tmp_path / "failed.nc")
    assert_same(found, path)
    assert found.reason == path.reason


def test_a_document_of_the_first_version_with_steps_not_tried_is_read(tmp_path):
    """It had zeros where now the last good state is repeated."""
    path = nf.simulate(nf.load_robot("pacheco2021-a"), nf.stroke_path(0.0, 9.0, steps=4))
    assert not path.run.tried[3]
    file = tmp_path / "failed.json"
    nf.save_path(path, file)
    document = json.loads(file.read_text())
    document["steps"][3]["total_angle_deg"] = 0.0
    file.write_text(json.dumps(document))
    assert_same(nf.read_path(file), path)
    document["steps"][2]["total_angle_deg"] = 0.0
    file.write_text(json.dumps(document))
    with refused(ErrorCode.FILE_DAMAGED):
        nf.read_path(file)


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_table_comes_back_to_the_printed_digits(loop, tmp_path, suffix):
    nf.save_path(loop, tmp_path / f"loop{suffix}")
    found = nf.read_table(tmp_path / f"loop{suffix}")
    assert {"tension", "notch_angle", "span_tension", "closed", "reason"} <= found.keys()
    for name, values in found.items():
        wanted = np.asarray(getattr(loop, name))
        if QUANTITIES[name].scale == 1.0:
            np.testing.assert_array_equal(values, wanted, err_msg=name)
        else:
            np.testing.assert_allclose(values, wanted, rtol=4e-16, err_msg=name)
    for missing in ("contact_slid", "body_position", "chord_angle"):
        assert missing not in found


def test_a_csv_says_that_it_holds_no_path(loop, tmp_path):
    nf.save_path(loop, tmp_path / "loop.csv")
    with refused(ErrorCode.FILE_FORMAT):
        nf.read_path(tmp_path / "loop.csv")


def test_data_set_has_names_and_units(loop):
    data = loop.to_xarray()
    assert data["notch_angle"].attrs["units"] == "rad"
    assert data["tension"].attrs["long_name"] == "tendon tension"
    assert data["notch_angle"].dims == ("step", "notch")
    assert list(data["axis"].to_numpy()) == ["x", "y", "z"]
    assert "pacheco" in data.attrs["robot_file"].lower()
    np.testing.assert_array_equal(data["notch_angle"].sel(notch=2, step=3), loop.notch_angle[2, 1])
    one = loop[2].to_xarray()
    np.testing.assert_array_equal(one["notch_angle"], loop.notch_angle[2])


def test_a_document_whose_steps_were_changed_is_refused(loop, tmp_path):
    file = tmp_path / "loop.json"
    nf.save_path(loop, file)
    document = json.loads(file.read_text())
    document["steps"][1]["tendon_tension_N"] = [9.0]
    file.write_text(json.dumps(document))
    with refused(ErrorCode.FILE_DAMAGED):
        nf.read_path(file)


def _without(document, *keys):
    *outer, last = keys
    for key in outer:
        document = document[key]
    del document[last]


@pytest.mark.parametrize(
    ("keys", "code", "name"),
    [
        (("read_back",), "FILE_FORMAT", "loop.json"),
        (("read_back", "arrays"), "FILE_DAMAGED", "loop.json"),
        (("read_back", "facts", "format"), "FILE_FORMAT", "None"),
        (("read_back", "arrays", "notch_angle"), "FILE_DAMAGED", "notch_angle"),
        (("read_back", "arrays", "tension", "base64"), "FILE_DAMAGED", "loop.json"),
        (("read_back", "facts", "settings"), "FILE_DAMAGED", "settings"),
    ],
)
def test_a_damaged_document_is_told(loop, tmp_path, keys, code, name):
    file = tmp_path / "loop.json"
    nf.save_path(loop, file)
    document = json.loads(file.read_text())
    _without(document, *keys)
    file.write_text(json.dumps(document))
    with refused(code, name):
        nf.read_path(file)


def test_arrays_that_do_not_fit_the_robot_are_told(loop, tmp_path):
    file = tmp_path / "loop.json"
    nf.save_path(loop, file)
    document = json.loads(file.read_text())
    facts = document["read_back"]["facts"]
    facts["robot"] = robot_text(nf.load_robot("gao2017"))
    file.write_text(json.dumps(document))
    with refused(ErrorCode.FILE_DAMAGED):
        nf.read_path(file)


@pytest.mark.parametrize("suffix", [".json", ".nc", ".parquet", ".csv"])
def test_rubbish_is_told_in_a_sentence(tmp_path, suffix):
    file = tmp_path / f"x{suffix}"
    read = nf.read_table if suffix == ".csv" else nf.read_path
    with refused(ErrorCode.FILE_NOT_FOUND, file.name):
        read(file)
    for rubbish in (b"", b"\x00\xff\x13", b"{}", b"a,b\n1\n"):
        file.write_bytes(rubbish)
        with pytest.raises(InputError):
            read(file)


@pytest.mark.parametrize(
    ("suffix", "module"), [(".nc", "xarray"), (".nc", "h5py"), (".parquet", "polars")]
)
def test_a_missing_library_is_told_with_its_command(loop, tmp_path, monkeypatch, suffix, module):
    import importlib.util

    real = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == module else real(name)
    )
    with refused(ErrorCode.MISSING_PACKAGE, module, "pip install 'notchflex[data]'"):
        nf.save_path(loop, tmp_path / f"a{suffix}")
    assert not list(tmp_path.iterdir())


def test_other_suffixes_are_refused(loop, tmp_path):
    with refused(ErrorCode.FILE_FORMAT):
        nf.save_path(loop, tmp_path / "a.xlsx")
    with refused(ErrorCode.FILE_FORMAT):
        nf.read_path(tmp_path / "a")
