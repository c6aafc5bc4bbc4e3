"""Polishing: what is cut, less a layer of all its surfaces, is the robot."""

import importlib.util
import math

import manifold3d
import numpy as np
import pytest

import notchflex as nf
from notchflex.export.drawing import title_lines
from notchflex.export.export import build
from notchflex.export.formats import PatternOptions, SolidOptions, Subject
from notchflex.export.pattern import flat_pattern
from refusals import refused
from robots import UNCUT

LAYER = 0.01


def second_moment(polygons):
    """Second moment about the centroid across the symmetry axis x, by Green's theorem [mm4]."""
    area = first = second = 0.0
    for polygon in polygons:
        x, y = np.asarray(polygon).T
        u, v = np.roll(x, -1), np.roll(y, -1)
        turn = x * v - u * y
        area += turn.sum() / 2.0
        first += ((x + u) * turn).sum() / 6.0
        second += ((x * x + x * u + u * u) * turn).sum() / 12.0
    return area, second - first**2 / area


def polished(section):
    """A cross-section after a layer is taken from all of its edges."""
    return section.offset(-LAYER, manifold3d.JoinType.Round, circular_segments=256).to_polygons()


@pytest.mark.parametrize(
    ("name", "shape"),
    [("pacheco2021-a", nf.annular_sector), ("york2015", nf.annular_segment)],
)
def test_the_solid_less_a_layer_of_all_surfaces_is_the_robot(name, shape):
    robot = nf.load_robot(name)
    notch, tube = robot.notches[0], robot.tube
    options = SolidOptions(polishing=LAYER, chord=1e-5, shank=3.0)
    solid = build("stl", Subject(robot), options).content
    middle = tube.base_length + 0.5 * notch.height
    area, moment = second_moment(polished(solid.slice(middle)))
    wanted = shape(tube.outer_radius, tube.inner_radius, notch.section_depth(tube))
    assert area == pytest.approx(float(wanted.area), rel=2e-4)
    # Radial walls are no longer radial after polishing: right in the middle of the wall (-0.1 %).
    # Without the layer of the tube's surfaces it was -23.5 %.
    assert moment == pytest.approx(float(wanted.second_moment_weak), rel=1.5e-3)
    area, moment = second_moment(polished(solid.slice(-1.0)))
    radii = tube.outer_radius, tube.inner_radius
    assert area == pytest.approx(math.pi * (radii[0] ** 2 - radii[1] ** 2), rel=2e-4)
    assert moment == pytest.approx(math.pi / 4 * (radii[0] ** 4 - radii[1] ** 4), rel=2e-4)
    # Along the tube: the faces of the window, and both ends.
    for inside, outside in ((LAYER, 0.0), (notch.height - LAYER, notch.height)):
        low, high = sorted(tube.base_length + one for one in (inside, outside))
        areas = [solid.slice(low - 1e-6).area(), solid.slice(high + 1e-6).area()]
        assert abs(areas[0] - areas[1]) > 0.1
        assert solid.slice(0.5 * (low + high)).area() == pytest.approx(max(areas), rel=1e-7)
    length = tube.base_length + sum(one.height + one.uncut_length for one in robot.notches)
    low, high = np.array(solid.bounding_box())[[2, 5]]
    assert (low, high) == pytest.approx((-3.0 - LAYER, length + LAYER), abs=1e-9)


@pytest.mark.parametrize("name", [name for name in nf.list_robots() if name not in UNCUT])
def test_pattern_and_solid_are_of_the_same_tube(name):
    """The pattern wrapped on the stock tube is the cut of the solid on its outer surface."""
    robot = nf.load_robot(name).with_value("notch.precurvature_deg", 0.0)
    pattern = flat_pattern(Subject(robot), PatternOptions(polishing=LAYER))
    solid = build("stl", Subject(robot), SolidOptions(polishing=LAYER)).content
    outer = robot.tube.outer_radius + LAYER
    assert pattern.facts["stock_diameters_mm"] == pytest.approx(
        [robot.tube.outer_diameter + 2 * LAYER, robot.tube.inner_diameter - 2 * LAYER]
    )
    assert pattern.around == pytest.approx(math.tau * outer)
    assert (pattern.start, pattern.end) == pytest.approx(
        tuple(np.array(solid.bounding_box())[[2, 5]]), abs=1e-9
    )
    for one in pattern.cuts:
        if robot.notches[one.placed.notch - 1].kind != "arc":
            continue
        x, y = np.array(one.nominal).T
        points = np.concatenate(solid.slice(0.5 * (x.min() + x.max())).to_polygons())
        surface = points[np.linalg.norm(points, axis=1) > outer - 2e-3]
        angle = np.arctan2(surface[:, 1], surface[:, 0]) - math.radians(one.placed.cut.side_deg)
        open_half = np.abs((angle + math.pi) % math.tau - math.pi).min()
        # The flat sides of the solid are 0.001 mm from round.
        assert open_half == pytest.approx(0.5 * np.ptp(y) / outer, abs=4e-3)


def test_the_title_tells_the_stock_from_the_finished_tube(wrist):
    text = "\n".join(title_lines(flat_pattern(Subject(wrist), PatternOptions(polishing=LAYER))))
    assert "STOCK TUBE, before polishing" in text
    assert "outer diameter 1.64 mm, inner diameter 1.38 mm" in text
    assert "outer diameter 1.62 mm, inner diameter 1.4 mm" in text
    assert "KERF: NOT COMPENSATED" in text


def test_a_precurved_robot_is_straight_before_polishing_and_a_loaded_one_is_refused():
    robot = nf.load_robot("pacheco2021-c-specimen")
    box = build("stl", Subject(robot), SolidOptions(polishing=LAYER)).facts["box_mm"]
    assert box[1][1] == pytest.approx(robot.tube.outer_radius + LAYER, abs=2e-3)
    assert box[0][1] == pytest.approx(-box[1][1], abs=1e-9)
    path = nf.simulate(nf.load_robot("pacheco2021-a"), nf.pull(0.0, 1.0, steps=2))
    with refused("CONFLICT", "polishing"):
        build("stl", Subject(path.robot, path, 1), SolidOptions(polishing=LAYER))


def test_polishing_that_needs_a_tube_without_a_bore_is_refused(wrist):
    with refused("INVALID_ROBOT", "before polishing", "inner_diameter"):
        flat_pattern(Subject(wrist), PatternOptions(polishing=0.7))


def test_channels_are_drilled_narrower():
    robot = nf.load_robot("gao2017")
    volumes = [
        build("stl", Subject(robot), SolidOptions(channels=width, polishing=layer)).facts[
            "volume_mm3"
        ]
        for width, layer in ((0.0, LAYER), (0.6, LAYER))
    ]
    uncut = 45.0 + 2 * LAYER - 14 * (0.55 - 2 * LAYER)
    lost = uncut * math.pi * (0.3 - LAYER) ** 2
    assert volumes[0] - volumes[1] == pytest.approx(lost, rel=2e-3)
    with refused("OUT_OF_RANGE", "channels"):
        build("stl", Subject(robot), SolidOptions(channels=0.3, polishing=0.15))


@pytest.mark.nightly
@pytest.mark.skipif(
    importlib.util.find_spec("build123d") is None,
    reason="build123d is not installed: pip install 'notchflex[cad]'",
)
@pytest.mark.parametrize("name", ["pacheco2021-a", "liu2022", "gao2017"])
def test_step_and_stl_are_one_solid(name):
    robot = nf.load_robot(name)
    options = SolidOptions(polishing=LAYER, chord=1e-4)
    step, stl = (build(kind, Subject(robot), options).facts for kind in ("step", "stl"))
    assert step["volume_mm3"] == pytest.approx(stl["volume_mm3"], rel=1e-5)
