"""The table of formats, and what `export` refuses."""

import pytest

import notchflex as nf
from notchflex.export.formats import FORMATS, format_of
from notchflex.results.same_robot import robot_digest
from refusals import refused


def test_every_suffix_belongs_to_one_format():
    suffixes = [suffix for one in FORMATS.values() for suffix in one.suffixes]
    assert len(set(suffixes)) == len(suffixes)
    assert all(format_of(f"a{suffix.upper()}") in FORMATS for suffix in suffixes)


@pytest.mark.parametrize("name", FORMATS)
def test_options_can_be_left_out(name):
    FORMATS[name].options()


@pytest.mark.parametrize("file", ["wrist", "wrist.txt", "."])
def test_a_suffix_that_no_format_has_is_refused(wrist, file):
    with refused("FILE_FORMAT", ".dxf", ".stl"):
        nf.export_robot(wrist, file)


def test_what_is_no_robot_is_refused(tmp_path):
    with refused("WRONG_TYPE", "dict"):
        nf.export_robot({}, tmp_path / "a.dxf")


def test_options_of_another_format_are_refused(wrist, tmp_path):
    with refused("WRONG_TYPE", "int"):
        nf.export_robot(wrist, tmp_path / "a.dxf", 3)
    assert not list(tmp_path.iterdir())


def test_the_digest_depends_on_every_value(wrist):
    first = robot_digest(wrist)
    assert len(first) == 12
    for path, value in (("notch[3].depth", 1.39), ("friction.coefficient", 0.2), ("name", "B")):
        assert robot_digest(wrist.with_value(path, value)) != first
