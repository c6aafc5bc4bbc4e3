"""Flat patterns: wrapped back on the tube they are the notches, and kerf moves every edge."""

import math

import numpy as np
import pytest

import notchflex as nf
from notchflex.export.cuts import cuts_of
from notchflex.export.formats import PatternOptions, Subject
from notchflex.export.pattern import flat_pattern
from refusals import refused
from robots import UNCUT

READY = [name for name in nf.list_robots() if name not in UNCUT]


def pattern_of(name, **options):
    robot = nf.load_robot(name) if isinstance(name, str) else name
    return flat_pattern(Subject(robot), PatternOptions(**options))


def area(outline):
    x, y = np.array(outline).T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def wrapped(robot, outline, side_deg, radius=None):
    """The points of an outline seen from the side: along the tube, and toward a side.

    On the outer surface, or where radial walls meet one of another radius.
    """
    x, y = np.array(outline).T
    angle = y / robot.tube.outer_radius - math.radians(side_deg)
    return np.stack([x, (radius or robot.tube.outer_radius) * np.cos(angle)], axis=-1)


def radius_read(robot, notch):
    """The radius of the surface at which the depth of a cut was read."""
    outer, inner = robot.tube.outer_radius, robot.tube.inner_radius
    at = getattr(notch, "depth_at", "outer")
    return {"outer": outer, "inner": inner, "mid-wall": 0.5 * (outer + inner)}[at]


@pytest.mark.parametrize("name", READY)
def test_the_pattern_wrapped_back_has_the_lengths_of_the_robot_file(name):
    robot = nf.load_robot(name)
    cuts = pattern_of(name).cuts
    assert len(cuts) == len(cuts_of(robot).cuts)
    for one in cuts:
        notch = robot.notches[one.placed.notch - 1]
        read = radius_read(robot, notch)
        seen = wrapped(robot, one.outlines[0], one.placed.cut.side_deg, read)
        height, depth = np.ptp(seen[:, 0]), robot.tube.outer_radius - seen[:, 1].min()
        if notch.kind == "u-link":
            wanted = robot.tube.outer_radius + notch.strip_length / 2 + notch.slot_radius
        else:
            wanted = notch.depth
        # Rounding of a few additions along the tube.
        assert height == pytest.approx(notch.height, abs=1e-9)
        assert depth == pytest.approx(wanted, abs=1e-9)


def test_a_window_is_a_rectangle_at_its_place(wrist):
    last = pattern_of(wrist).cuts[0]
    half = wrist.tube.outer_radius * math.acos(1.0 - 1.4 / 0.81)
    corners = [(8.0, -half), (8.0, half), (8.8, -half), (8.8, half)]
    assert np.array(sorted(last.outlines[0])) == pytest.approx(np.array(corners), abs=1e-9)


def test_every_point_of_a_triangular_notch_lies_on_its_planes():
    robot = nf.load_robot("liu2022")
    notch = robot.notches[0]
    lower = pattern_of(robot).cuts[-1]
    along, height = wrapped(robot, lower.outlines[0], 0.0).T
    leaning = (robot.tube.outer_radius - height) * notch.height / notch.depth
    straight = np.full(len(along), notch.height)
    assert np.min([abs(along - leaning), abs(along - straight)], axis=0).max() < 1e-9
    assert np.sum(abs(along - leaning) < 1e-9) > 20


def test_the_round_end_of_a_slot_has_its_radius():
    robot = nf.load_robot("gao2017")
    notch = robot.notches[0]
    one = pattern_of(robot).cuts[-1]
    seen = wrapped(robot, one.outlines[0], one.placed.cut.side_deg)
    centre = one.placed.start + notch.slot_radius, -notch.strip_length / 2
    ends = seen[seen[:, 1] <= centre[1] + 1e-12]
    assert len(ends) > 10
    distance = np.linalg.norm(ends - centre, axis=1)
    assert distance == pytest.approx(notch.slot_radius, abs=1e-9)


@pytest.mark.parametrize("name", ["pacheco2021-a", "york2015", "two-axis-wrist"])
def test_kerf_moves_each_edge_by_exactly_half(name):
    robot = nf.load_robot(name)
    kerf = 0.03
    for plain, moved in zip(pattern_of(name).cuts, pattern_of(name, kerf=kerf).cuts, strict=True):
        edge, path = np.array(plain.outlines[0]), np.array(moved.outlines[0])
        assert edge.min(axis=0)[0] + kerf / 2 == pytest.approx(path.min(axis=0)[0], abs=1e-9)
        assert edge.max(axis=0)[0] - kerf / 2 == pytest.approx(path.max(axis=0)[0], abs=1e-9)
        cut = plain.placed.cut
        if cut.radial:  # the beam turns with the tube: half a kerf on the surface
            assert np.ptp(path, axis=0) == pytest.approx(np.ptp(edge, axis=0) - kerf, abs=1e-9)
        else:  # the beam is offset: half a kerf across the tube
            low, high = (wrapped(robot, line, cut.side_deg)[:, 1].min() for line in (edge, path))
            assert high - low == pytest.approx(kerf / 2, abs=1e-9)


def test_kerf_moves_the_leaning_edge_of_a_triangle_at_right_angles():
    robot = nf.load_robot("liu2022")
    notch = robot.notches[0]
    one = pattern_of(robot, kerf=0.04).cuts[-1]
    along, height = wrapped(robot, one.outlines[0], 0.0).T
    slope = np.array([notch.height, -notch.depth]) / math.hypot(notch.height, notch.depth)
    away = (along - 0.0) * -slope[1] + (height - robot.tube.outer_radius) * slope[0]
    on_it = abs(away - 0.02) < 1e-9
    assert on_it.sum() > 20
    assert along[~on_it] == pytest.approx(notch.height - 0.02, abs=1e-9)


@pytest.mark.parametrize("name", ["pacheco2021-a", "york2015"])
def test_kerf_along_and_round_the_tube_can_differ(name):
    """A slot round the tube and one along it are not equally wide."""
    along, across = 0.03, 0.05
    for plain, moved in zip(
        pattern_of(name).cuts, pattern_of(name, kerf=(along, across)).cuts, strict=True
    ):
        edge, path = np.array(plain.outlines[0]), np.array(moved.outlines[0])
        assert np.ptp(edge[:, 0]) - np.ptp(path[:, 0]) == pytest.approx(along, abs=1e-9)
        if plain.placed.cut.radial:
            lost = np.ptp(edge[:, 1]) - np.ptp(path[:, 1])
            assert lost == pytest.approx(across, abs=1e-9)
        else:
            robot, side = nf.load_robot(name), plain.placed.cut.side_deg
            low, high = (wrapped(robot, line, side)[:, 1].min() for line in (edge, path))
            assert high - low == pytest.approx(across / 2, abs=1e-9)


def test_a_beam_of_two_widths_cuts_a_round_corner_where_it_is(wrist):
    """The ellipse of the beam touches the edge along its path and nowhere crosses it."""
    along, across, corner = 0.03, 0.06, 0.2
    edge = np.array(pattern_of(wrist, corner_radius=corner, chord=1e-5).cuts[0].outlines[0])
    path = np.array(
        pattern_of(wrist, corner_radius=corner, kerf=(along, across), chord=1e-5)
        .cuts[0]
        .outlines[0]
    )
    # In units of the beam's semi-axes it is a circle of radius 1.
    edge, path = (line * [2.0 / along, 2.0 / across] for line in (edge, path))
    start, step = edge, np.roll(edge, -1, axis=0) - edge
    away = path[:, None] - start
    part = np.clip((away * step).sum(-1) / (step**2).sum(-1), 0.0, 1.0)
    distance = np.linalg.norm(away - part[..., None] * step, axis=-1).min(axis=1)
    # Chords of 1e-5 mm, in units of 0.015 mm.
    assert distance == pytest.approx(1.0, abs=2e-3)
    with refused("OUT_OF_RANGE", "radius"):
        pattern_of(wrist, corner_radius=corner, kerf=(0.01, 0.1))


def test_a_corner_radius_takes_the_corners_away(wrist):
    plain, rounded = (
        pattern_of(wrist, corner_radius=radius, chord=1e-5).cuts[0] for radius in (0.0, 0.1)
    )
    lost = area(plain.outlines[0]) - area(rounded.outlines[0])
    # Four corners of (1 - pi / 4) r^2; flattening with chords of 1e-5 mm adds less than 2e-5 mm2.
    assert lost == pytest.approx((4.0 - math.pi) * 0.1**2, abs=2e-5)


def test_curves_are_within_the_chord_tolerance():
    """The area under a fine curve is what it tends to."""
    coarse, fine = (pattern_of("liu2022", chord=chord).cuts[0] for chord in (1e-2, 1e-3))
    finest = area(pattern_of("liu2022", chord=1e-5).cuts[0].outlines[0])
    length = 30.0  # mm; the curve is shorter
    assert abs(area(coarse.outlines[0]) - finest) < 1e-2 * length
    assert abs(area(fine.outlines[0]) - finest) < 1e-3 * length
    assert len(coarse.outlines[0]) < len(fine.outlines[0])


def test_the_order_is_from_the_tip_to_the_base_and_the_numbers_are_those_of_the_notches():
    for name in READY:
        cuts = pattern_of(name).cuts
        ends = [one.placed.end for one in cuts]
        assert ends == sorted(ends, reverse=True)
        numbers = [int(one.placed.name.rstrip("ab")) for one in cuts]
        assert numbers == [one.placed.notch for one in cuts]
        assert len({one.placed.name for one in cuts}) == len(cuts)
    assert [one.placed.name for one in pattern_of("york2015").cuts] == ["5", "4", "3", "2", "1"]
    # The last of the links has the slot on its far side too, a pair of triangles has two cuts.
    assert [one.placed.name for one in pattern_of("gao2017").cuts][:3] == ["27b", "27a", "26"]
    assert [one.placed.name for one in pattern_of("liu2022").cuts][-3:] == ["2a", "1b", "1a"]


def test_outlines_are_counter_clockwise_and_closed_by_no_second_point():
    for name in READY:
        for one in pattern_of(name, kerf=0.02, corner_radius=0.02).cuts:
            assert area(one.outlines[0]) > 0.0
            assert math.dist(one.outlines[0][0], one.outlines[0][-1]) > 1e-9


@pytest.mark.parametrize("name", ["two-axis-wrist", "gao2017", "liu2022"])
@pytest.mark.parametrize("seam_deg", [180.0, 33.0])
def test_a_split_pattern_lies_within_the_seam_and_is_the_same_cut(name, seam_deg):
    past, split = (pattern_of(name, seam=seam, seam_deg=seam_deg) for seam in ("past", "split"))
    low, high = split.seam
    assert high - low == pytest.approx(math.pi * split.robot.tube.outer_diameter)
    assert any(len(one.outlines) == 2 for one in split.cuts)
    for whole, parts in zip(past.cuts, split.cuts, strict=True):
        y = np.concatenate([np.array(part)[:, 1] for part in parts.outlines])
        assert low - 1e-9 <= y.min() <= y.max() <= high + 1e-9
        assert sum(map(area, parts.outlines)) == pytest.approx(area(whole.outlines[0]), abs=1e-9)


def test_notches_turned_by_the_robot_are_turned_in_the_pattern():
    pattern = pattern_of("two-axis-wrist")
    quarter = math.pi / 2 * pattern.robot.tube.outer_radius
    middles = [one.middle[1] / quarter for one in reversed(pattern.cuts)]
    assert middles == pytest.approx([0, 1, 2, -1] * 2, abs=1e-9)


def test_a_two_axis_machine_gets_no_segment():
    pattern_of("pacheco2021-a", two_axis=True)
    for name in ("york2015", "liu2022", "gao2017"):
        with refused("UNSUPPORTED", "two-axis", "notch 1", "on-axis"):
            pattern_of(name, two_axis=True)


def test_thin_webs_warn_from_three_kerfs_on(wrist):
    tight = wrist.with_value("notch.uncut_length", 0.07)
    assert pattern_of(tight).warnings == ()
    assert pattern_of(tight, kerf=0.0233).warnings == ()
    (warning,) = pattern_of(tight, kerf=0.0234).warnings
    assert "0.07 mm" in warning
    assert pattern_of(tight).facts["thinnest_web_mm"] == pytest.approx(0.07, abs=1e-9)


def test_the_spine_is_a_web_too(wrist):
    deep = wrist.with_value("notch.depth", 1.619)
    around = 2.0 * 0.81 * math.acos(1.619 / 0.81 - 1.0)
    assert pattern_of(deep).web.width == pytest.approx(around, abs=1e-9)


def test_cuts_that_meet_are_refused(wrist):
    with refused("UNSUPPORTED", "notch 1", "notch 2", "uncut_length"):
        pattern_of(
            wrist.with_value("notch[1].uncut_length", 0.0).with_value("tube.base_length", 0.5)
        )
    with refused("UNSUPPORTED", "cut-off", "shank"):
        pattern_of(wrist, shank=0.0)


def test_a_tip_inside_the_last_cut_gets_a_ring_and_a_warning():
    robot = nf.load_robot("liu2022")
    pattern = pattern_of(robot)
    assert pattern.end == pytest.approx(38.5 + 2.0)
    assert "uncut_length" in pattern.warnings[0]


@pytest.mark.parametrize(
    "options",
    [
        {"kerf": -0.01},
        {"kerf": math.nan},
        {"shank": math.inf},
        {"kerf": "0.025"},
        {"polishing": True},
        {"seam": "cross"},
        {"dxf_version": "R2018"},
        {"y_unit": "inch"},
        {"paper": "a5"},
        {"chord": 0.0},
        {"kerf": (0.02, 0.02, 0.02)},
        {"kerf": (0.02, -0.02)},
    ],
)
def test_options_that_are_not_allowed(options):
    with refused("INVALID_INPUT", *options):
        PatternOptions(**options)


@pytest.mark.parametrize(
    "options",
    [
        {"kerf": 0.8},
        {"kerf": 2.0},
        {"corner_radius": 0.41},
        {"kerf": 0.2, "corner_radius": 0.05},
        {"polishing": 0.4},
    ],
)
def test_what_does_not_fit_a_cut_is_refused(wrist, options):
    with refused("OUT_OF_RANGE", "mm"):
        pattern_of(wrist, **options)


def test_a_beam_wider_than_the_slot_is_refused():
    with refused("OUT_OF_RANGE", "notch"):
        pattern_of("gao2017", kerf=0.56)
