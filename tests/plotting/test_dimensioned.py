"""The dimensioned drawing: the robot's own lengths, true to scale, with texts that can be read."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

import notchflex as nf
from notchflex.plotting import dimensioned_figure, notch_rows
from notchflex.plotting.drawing import MAX_SHAPES
from notchflex.plotting.shapes import outline, shape_from_angles
from refusals import refused

ROBOTS = ["pacheco2021-a", "pacheco2021-c", "york2015", "liu2022", "gao2017", "two-axis-wrist"]
UNUSUAL = {
    "tube.base_length": 30.0,
    "notch.depth": 0.5,
    "notch.uncut_length": 9.0,
    "notch.height": 0.05,
    "tube.inner_diameter": 0.6,
    "tendon.radius": 0.3,
    "tendon.direction_deg": 20.0,
}


def texts_of(robot):
    return [text.get_text().replace("\n", " ") for text in dimensioned_figure(robot).axes[0].texts]


def view_of(robot):
    return notch_rows(robot)[0][0]


@pytest.mark.parametrize(
    ("name", "lengths"),
    [
        (
            "pacheco2021-a",
            "outer diameter 1.62, inner diameter 1.4, depth 1.4, height 0.8, uncut length 1.2, "
            "remaining 0.22, tendon radius 0.7",
        ),
        (
            "liu2022",
            "outer diameter 10, inner diameter 6, depth 6.9, height 3.5, strip thickness 1.5, "
            "strip length 8, tendon radius 4, wall width (both walls together) 4",
        ),
        (
            "gao2017",
            "outer diameter 5.99, inner diameter 4, base length 0.35, slot width 0.55, "
            "strip thickness 0.7, strip length 2, uncut length 0.35, tendon radius 2.5",
        ),
    ],
)
def test_lengths_of_the_robot_file_stand_in_the_drawing(name, lengths):
    texts = texts_of(nf.load_robot(name))
    assert set(lengths.split(", ")) - set(texts) == set()


def test_lengths_of_zero_are_named_in_the_heading():
    assert any(
        "base length 0, uncut length 0" in text for text in texts_of(nf.load_robot("liu2022"))
    )


@pytest.mark.parametrize("robot", [*ROBOTS, "unusual"])
def test_texts_do_not_overlap(robot):
    unusual = nf.load_robot("pacheco2021-a").with_values(UNUSUAL)
    figure = dimensioned_figure(unusual if robot == "unusual" else nf.load_robot(robot))
    renderer = FigureCanvasAgg(figure).get_renderer()
    boxes = [(text.get_text(), text.get_window_extent(renderer)) for text in figure.axes[0].texts]
    width, height = figure.bbox.width, figure.bbox.height
    for text, box in boxes:
        assert 0 < box.x0 < box.x1 < width or not text, text
        assert 0 < box.y0 < box.y1 < height or not text, text
    for (first, one), (second, other) in itertools.combinations(boxes, 2):
        assert not (first and second and one.overlaps(other)), (first, second)


def test_arc_of_the_section_is_that_of_the_cut():
    (arc,) = [text for text in texts_of(nf.load_robot("york2015")) if "remaining arc" in text]
    # The cut plane lies depth - radius = 0.39 mm from the axis of a tube of radius 0.58 mm.
    angle = 2.0 * math.acos(0.39 / 0.58)
    assert (
        arc == f"remaining arc {math.degrees(angle):.4g}°, {0.58 * angle:.4g} at the outer surface"
    )


@pytest.mark.filterwarnings("ignore::notchflex.InputWarning")  # 0.5 mm is shallow
def test_cut_face_of_an_on_axis_cut_shows_both_corners():
    view = view_of(nf.load_robot("pacheco2021-a"))
    # Outer corner: radius - depth; the radial edge meets the bore at the same angle.
    assert view.section[1] == pytest.approx(0.81 - 1.40)
    assert view.faces[0][0, 1] == pytest.approx(0.81 - 1.40)
    assert view.cuts[0][1, 1] == pytest.approx((0.81 - 1.40) * 0.70 / 0.81)
    shallow = view_of(nf.load_robot("pacheco2021-a").with_value("notch.depth", 0.5))
    assert not shallow.faces  # the wall hides it
    assert shallow.cuts[0][1, 1] == pytest.approx(0.31)


def wall_ends(robot, side):
    """Where the walls of the model's first bodies end on one side of the straight robot [mm]."""
    straight = outline(shape_from_angles(robot, np.zeros(robot.number_of_notches)), 0.0)
    ends = [
        place for body in straight.bodies[:4] for across, place in body if abs(across - side) < 1e-9
    ]
    return np.array(ends)


def openings(view, side):
    before = [cut for cut in view.cuts if cut[-1, 0] < view.breaks[0]]
    return [place for cut in before for place, across in cut[[0, -1]] if across == side]


# The model has no thickness of a strip between its two notches, so that its far one is not drawn
# where the model has it; the pair itself is symmetric.
@pytest.mark.parametrize(("name", "sides"), [("liu2022", [1.0]), ("gao2017", [1.0, -1.0])])
def test_cuts_lie_where_the_bodies_of_the_model_end(name, sides):
    robot = nf.load_robot(name)
    view = view_of(robot)
    for sign in sides:
        side = sign * robot.tube.outer_radius
        places = openings(view, side)
        assert len(places) >= 2
        for place in places:
            assert np.abs(wall_ends(robot, side) - place).min() < 1e-9


def test_pair_of_a_strip_looks_the_same_after_half_a_turn():
    upper, lower, *_ = view_of(nf.load_robot("liu2022")).cuts
    middle = np.array([3.5 + 0.5 * 1.5, 0.0])
    assert 2.0 * middle - upper == pytest.approx(lower[[2, 1, 0]])


def test_long_pieces_are_broken_and_others_true_to_scale():
    robot = nf.load_robot("pacheco2021-a").with_value("tube.base_length", 30.0)
    view = view_of(robot)
    base, height, uncut = view.along
    assert base.end - base.start < 30.0
    assert any(base.start < place < base.end for place in view.breaks)
    assert height.end - height.start == pytest.approx(0.8)
    assert uncut.end - uncut.start == pytest.approx(1.2)


def test_equal_notches_share_a_drawing_and_the_rest_is_named():
    texts = texts_of(nf.load_robot("two-axis-wrist"))
    assert [text.partition(":")[0] for text in texts if text.startswith("notches ")] == [
        "notches 1, 5",
        "notches 2, 6",
        "notches 3, 7",
        "notches 4, 8",
    ]
    depths = {f"notch[{number}].depth": 1.20 + 0.02 * number for number in range(1, 9)}
    texts = texts_of(nf.load_robot("two-axis-wrist").with_values(depths))
    assert sum(text.startswith("notch ") for text in texts) == MAX_SHAPES
    assert any("Not shown: notches 7, 8." in text for text in texts)


def test_sections_have_their_own_diameters_and_what_has_no_cuts_is_named():
    joint = nf.TableNotch(2.0, angle_deg=(5.0, 20.0), moment=(1.0, 3.0), uncut_length=1.0)
    wrist = nf.load_robot("pacheco2021-a")
    own = dataclasses.replace(wrist.notch[0], tube=nf.Tube(1.7, 1.45), repeat=2)
    robot = wrist.replace(notch=(joint, own), tendon=(nf.Tendon(0.7),))
    texts = texts_of(robot)
    assert {"outer diameter 1.7", "inner diameter 1.45"} <= set(texts)
    assert [text.partition(":")[0] for text in texts if text.startswith("notch")] == ["notches 2–3"]
    assert any("Not shown, as cuts are not known: notch 1." in text for text in texts)
    with refused("UNSUPPORTED", "the cuts of no notch"):
        dimensioned_figure(robot.replace(notch=(joint,)))
    for name in ("a.stl", "a.dxf"):
        with refused("UNSUPPORTED", 'notch 1 is of kind = "table"'):
            nf.export_robot(robot.replace(notch=(joint, wrist.notch[0])), name)


def test_a_kind_without_names_of_its_pieces_is_drawn_with_their_lengths(monkeypatch):
    monkeypatch.setattr("notchflex.plotting.drawing._PIECES", {})
    texts = texts_of(nf.load_robot("gao2017"))
    assert {"0.55", "0.7", "0.35", "depth 4.27"} <= set(texts)


def test_depth_from_a_calliper_on_radial_edges():
    """The formula of docs/your_own_wrist.md: the jaws touch the inner corners."""
    view = view_of(nf.load_robot("pacheco2021-a"))
    thickness = 0.81 + view.cuts[0][1, 1]
    assert thickness == pytest.approx(0.300, abs=5e-4)
    assert 0.81 + (0.81 - thickness) * 0.81 / 0.70 == pytest.approx(1.40)
