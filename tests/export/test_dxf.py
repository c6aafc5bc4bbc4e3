"""Flat patterns as files: read back by ezdxf and as XML."""

import math
import xml.etree.ElementTree as ET

import ezdxf
import numpy as np
import pytest

import notchflex as nf
from notchflex.export.formats import PatternOptions, Subject
from notchflex.export.pattern import flat_pattern
from notchflex.results.state import robot_digest
from robots import UNCUT

LAYERS = ("CUT", "CUT_OFF", "REFERENCE", "TEXT")


def outlines_of(space, layer):
    """The lines of a layer in the order of the file, and whether they are closed."""
    found = []
    for one in space.query(f'LWPOLYLINE POLYLINE[layer=="{layer}"]'):
        points = one.get_points("xy") if one.dxftype() == "LWPOLYLINE" else one.points()
        found.append((np.array([tuple(point)[:2] for point in points]), one.is_closed))
    return found


def written(robot, tmp_path, **options):
    file = tmp_path / "pattern.dxf"
    nf.export_robot(robot, file, PatternOptions(**options))
    return ezdxf.readfile(file)


@pytest.mark.parametrize("version", ["R2000", "R12"])
@pytest.mark.parametrize("name", [name for name in nf.list_robots() if name not in UNCUT])
def test_ezdxf_reads_it_back_without_errors(name, version, tmp_path):
    robot = nf.load_robot(name)
    document = written(robot, tmp_path, dxf_version=version, kerf=0.02, seam="split")
    audit = document.audit()
    assert not audit.errors
    assert not audit.fixes
    assert document.dxfversion == {"R2000": "AC1015", "R12": "AC1009"}[version]
    if version == "R2000":
        assert document.header["$INSUNITS"] == 4  # mm
    assert {one.dxf.name for one in document.layers} >= set(LAYERS)
    kinds = {one.dxftype() for one in document.modelspace()}
    assert kinds == {"LWPOLYLINE" if version == "R2000" else "POLYLINE", "TEXT"}
    pattern = flat_pattern(Subject(robot), PatternOptions(kerf=0.02, seam="split"))
    wanted = [outline for one in pattern.cuts for outline in one.outlines]
    found = outlines_of(document.modelspace(), "CUT")
    for (points, closed), outline in zip(found, wanted, strict=True):
        assert closed
        assert points == pytest.approx(np.array(outline), abs=1e-9)


@pytest.mark.parametrize(("degrees", "unit"), [(False, 4), (True, 0)])
def test_degrees_and_mm_have_no_common_unit(wrist, tmp_path, degrees, unit):
    y_unit = "deg" if degrees else "mm"
    assert written(wrist, tmp_path, y_unit=y_unit).header["$INSUNITS"] == unit
    nf.export_robot(wrist, tmp_path / "a.svg", PatternOptions(y_unit=y_unit))
    assert ET.parse(tmp_path / "a.svg").getroot().get("width").endswith("mm") is not degrees


def test_no_line_stands_twice(tmp_path):
    space = written(nf.load_robot("gao2017"), tmp_path, seam="split").modelspace()
    edges = set()
    for layer in LAYERS:
        for points, closed in outlines_of(space, layer):
            ends = np.roll(points, -1, axis=0) if closed else points[1:]
            for start, end in zip(points, ends, strict=False):
                edge = tuple(sorted([tuple(np.round(start, 9)), tuple(np.round(end, 9))]))
                assert edge not in edges
                edges.add(edge)


def test_the_cut_off_is_the_last_line_that_is_cut(wrist, tmp_path):
    space = written(wrist, tmp_path, shank=4.0).modelspace()
    layers = [one.dxf.layer for one in space if one.dxf.layer.startswith("CUT")]
    assert layers == ["CUT"] * 5 + ["CUT_OFF"]
    ((points, _),) = outlines_of(space, "CUT_OFF")
    assert points[:, 0] == pytest.approx([-4.0, -4.0])
    assert np.ptp(points[:, 1]) == pytest.approx(math.pi * 1.62)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({}, "NOT COMPENSATED"),
        ({"kerf": 0.025}, "half the kerf of 0.025 mm"),
        ({"kerf": (0.02, 0.03)}, "half the kerf of 0.02 mm along the tube and 0.03 mm round it"),
        ({"polishing": 0.004}, "removes 0.004 mm from every surface"),
    ],
)
def test_the_title_block_says_what_the_path_is(wrist, tmp_path, options, words):
    texts = [one.dxf.text for one in written(wrist, tmp_path, **options).query("TEXT")]
    whole = "\n".join(texts)
    assert words in whole
    for part in (nf.__version__, robot_digest(wrist), wrist.name, "1.62", "1.4", "ON-AXIS"):
        assert part in whole


def test_cuts_beside_the_axis_are_named_so(tmp_path):
    whole = "\n".join(
        one.dxf.text for one in written(nf.load_robot("york2015"), tmp_path).query("TEXT")
    )
    assert "notches 1-5: OFF-AXIS" in whole
    assert "ON-AXIS" not in whole


def test_degrees_on_request(wrist, tmp_path):
    plain = outlines_of(written(wrist, tmp_path).modelspace(), "CUT")
    turned = outlines_of(written(wrist, tmp_path, y_unit="deg").modelspace(), "CUT")
    for (mm, _), (deg, _) in zip(plain, turned, strict=True):
        assert deg[:, 0] == pytest.approx(mm[:, 0])
        assert deg[:, 1] == pytest.approx(360.0 * mm[:, 1] / (math.pi * 1.62))


@pytest.mark.parametrize("suffix", ["dxf", "svg"])
def test_the_same_robot_gives_the_same_file(wrist, tmp_path, suffix):
    texts = []
    for name in ("a", "b"):
        file = tmp_path / f"{name}.{suffix}"
        nf.export_robot(wrist, file)
        texts.append(file.read_bytes())
    assert texts[0] == texts[1]


def test_the_svg_is_at_full_size_and_has_the_layers(tmp_path):
    robot = nf.load_robot("two-axis-wrist").replace(name="A <b> & c")
    file = tmp_path / "pattern.svg"
    nf.export_robot(robot, file, PatternOptions(kerf=0.02))
    root = ET.parse(file).getroot()
    _, _, wide, high = map(float, root.get("viewBox").split())
    assert float(root.get("width").removesuffix("mm")) == pytest.approx(wide, rel=1e-5)
    assert float(root.get("height").removesuffix("mm")) == pytest.approx(high, rel=1e-5)
    space = "{http://www.w3.org/2000/svg}"
    groups = {one.get("id"): one for one in root.iter(f"{space}g")}
    assert set(groups) == set(LAYERS)
    pattern = flat_pattern(Subject(robot), PatternOptions(kerf=0.02))
    paths = list(groups["CUT"].iter(f"{space}path"))
    for path, one in zip(paths, pattern.cuts, strict=True):
        words = path.get("d")
        assert words.endswith(" Z")
        points = [tuple(map(float, w.split(","))) for w in words[2:-2].split(" L ")]
        assert np.array(points) * [1, -1] == pytest.approx(np.array(one.outlines[0]), abs=1e-12)
    assert robot.name in [one.text for one in groups["TEXT"].iter(f"{space}text")]
