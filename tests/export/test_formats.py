"""The table of formats, and what `export` refuses."""

import xml.etree.ElementTree as ET
from types import SimpleNamespace

import ezdxf
import numpy as np
import pytest
from ezdxf.lldxf.encoding import decode_dxf_unicode

import notchflex as nf
from notchflex.export.export import build
from notchflex.export.formats import FORMATS, Subject, format_of
from notchflex.results.state import robot_digest
from notchflex.robot.kinds import Notch
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


def test_what_is_no_path_is_refused(wrist):
    for file in (None, b"a.dxf", 3):
        with refused("WRONG_TYPE", "path"):
            nf.export_robot(wrist, file)


def test_a_state_is_no_cut_pattern_and_one_that_failed_is_nothing(wrist):
    failed = SimpleNamespace(converged=[True, False], reason=["", "the reason"])
    with refused("CONFLICT", "without loads"):
        build("dxf", Subject(wrist, failed, 0))
    for name in ("stl", "step"):
        with refused("NOT_CONVERGED", "the reason"):
            build(name, Subject(wrist, failed, 1))


@pytest.mark.parametrize(
    ("name", "shown"),
    [("a  b", "a b"), ("β µm", "β µm"), ("$x_{", "$x_{"), (" ", "robot")],
)
def test_any_name_of_a_robot_goes_into_a_file(wrist, tmp_path, name, shown):
    robot = wrist.replace(name=name)
    for version in ("R2000", "R12"):
        nf.export_robot(robot, tmp_path / "a.dxf", nf.PatternOptions(dxf_version=version))
        document = ezdxf.readfile(tmp_path / "a.dxf")
        assert not document.audit().errors
        texts = [decode_dxf_unicode(one.dxf.text) for one in document.query("TEXT")]
        assert shown in texts
    nf.export_robot(robot, tmp_path / "a.svg")
    assert shown in [one.text for one in ET.parse(tmp_path / "a.svg").iter()]


def test_a_kind_of_notch_without_cuts_has_no_pattern(wrist, tmp_path, monkeypatch):
    monkeypatch.setattr(nf.ArcNotch, "cut_layout", Notch.cut_layout)
    wrist = wrist.replace(name="anew")  # a robot keeps its cuts
    for suffix in ("dxf", "svg", "pdf", "stl"):
        with refused("UNSUPPORTED", "arc", "cut_layout"):
            nf.export_robot(wrist, tmp_path / f"a.{suffix}")
    assert not list(tmp_path.iterdir())


def test_options_take_any_real_number():
    assert nf.PatternOptions(kerf=np.float64(0.02), shank=np.int64(3)).inside == (0.01, 0.01)
    with refused("INVALID_INPUT", "two_axis"):
        nf.PatternOptions(two_axis="no")
