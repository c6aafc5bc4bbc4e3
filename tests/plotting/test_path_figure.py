"""The picture of a path: drawn from the table of quantities, to scale, in every format."""

import numpy as np
import pytest

from fake_path import CLOSING, fake_path
from notchflex.loads.load import BodyForce, ExternalLoad
from notchflex.plotting import path_figure, path_picture, save
from notchflex.plotting.curves import abscissa, branches, steps_by_branch
from notchflex.plotting.marks import Area, Span
from notchflex.plotting.shapes import (
    bending_plane,
    lips,
    load_label,
    outline,
    representative_steps,
    shape_at,
)
from notchflex.robot import Linear
from refusals import refused


def outline_at(path, step):
    return outline(shape_at(path, step), 0.0)


def panels(path):
    """What every panel has on its vertical axis, without units."""
    return [axes.get_ylabel().partition(" [")[0] for axes in path_figure(path).axes]


def part_of(path, steps):
    """The same path with some of its steps only."""
    path.columns = {name: values[steps] for name, values in path.columns.items()}
    return path


LOOP = ["along the base, z"] * 2 + [
    "total bending angle $\\theta$",
    "notch angle $\\theta_j$",
    "peak strain of every notch",
    "span tension $T$",
    "reversed contacts",
]


def test_panels_are_what_the_path_holds():
    assert panels(fake_path(5)) == LOOP
    assert panels(part_of(fake_path(5), slice(0, 5))) == [LOOP[0], *LOOP[2:5]]
    assert panels(part_of(fake_path(5), slice(3, 4))) == LOOP[:1]
    smooth = fake_path(5)
    smooth.columns["contact_bound"] = 0.0 * smooth.contact_bound
    assert panels(smooth) == LOOP[:-1]


def test_axes_have_quantities_and_units():
    figure = path_figure(fake_path(11))
    labels = [(axes.get_xlabel(), axes.get_ylabel()) for axes in figure.axes]
    assert labels[2] == ("tendon tension $T$ [N]", "total bending angle $\\theta$ [deg]")
    assert labels[3][1] == "notch angle $\\theta_j$ [deg]"
    assert labels[5] == ("span of tendon [number], 0 at the base", "span tension $T$ [N]")
    assert all("[" in label for labels_of_one in labels for label in labels_of_one)
    assert all("[mm]" in label for labels_of_one in labels[:2] for label in labels_of_one)
    assert figure.axes[0].get_aspect() == 1.0


def test_loading_and_unloading_are_told_apart():
    figure = path_figure(fake_path(11))
    assert [axes.get_title(loc="left") for axes in figure.axes[:2]] == ["loading", "unloading"]
    for axes in (figure.axes[2], figure.axes[5]):
        texts = [text.get_text() for text in axes.get_legend().get_texts()]
        assert texts == ["loading", "unloading"]
        assert {line.get_linestyle() for line in axes.get_lines()} == {"-", "--"}


def test_tension_is_drawn_from_span_to_span():
    path = fake_path(4)
    first = path_figure(path).axes[5].get_lines()[0]
    assert list(first.get_xdata()) == list(range(10))
    np.testing.assert_array_equal(first.get_ydata(), path.span_tension[1, 0])  # step 1 is slack


def test_front_goes_from_contact_to_contact_as_eta_falls():
    path = fake_path(5)
    path.columns["front_eta"][7] = -0.5
    path.columns["front_eta"][6] = np.nan
    _, unloading = path_figure(path).axes[6].get_lines()
    # Steps 5 to 9; without tension, in the last, nothing rubs.
    np.testing.assert_array_equal(unloading.get_ydata(), [0.0, 1.0, 2.75, 3.0, np.nan])


def test_front_is_drawn_only_where_it_moves_through_the_contacts():
    path = fake_path(5)
    assert panels(path)[-1] == "reversed contacts"
    # All at once, as with one contact or after a long way back: there is nothing to see.
    path.columns["front_contact"][5:] = 1.0 + 9.0 * (np.arange(5) > 0)[:, None]
    path.columns["front_eta"][6:] = np.nan
    assert panels(path)[-1] == "span tension $T$"


def test_stroke_is_the_abscissa_where_it_is_commanded():
    path = fake_path(4)
    path.columns["commanded_stroke"], path.columns["commanded_tension"] = (
        path.stroke,
        path.commanded_stroke,
    )
    values, label = abscissa(path)
    assert label == "tendon stroke $u$ [mm]"
    np.testing.assert_array_equal(values, path.stroke[:, 0])


def by_stroke(steps):
    path = fake_path(steps)
    path.columns["commanded_stroke"], path.columns["commanded_tension"] = (
        path.stroke,
        path.commanded_stroke,
    )
    # Friction: the way back needs less tension.
    path.columns["tension"][steps:] *= 0.8
    return path


def test_loop_of_tension_over_stroke_is_drawn_where_strokes_drive():
    path = by_stroke(5)
    panel = next(cell.panel for cell in path_picture(path).cells if "tension" in cell.panel.y_label)
    assert panel.x_label == "tendon stroke $u$ [mm]"
    assert panel.y_label == "tendon tension $T$ [N]"
    loading, unloading = panel.items
    assert (loading.name, unloading.name) == ("loading", "unloading")
    assert (loading.dash, loading.colour) != (unloading.dash, unloading.colour)
    middle = path.stroke[2, 0]
    at = [np.interp(middle, *one.rows[np.argsort(one.rows[:, 0])].T) for one in panel.items]
    assert at[1] < 0.9 * at[0]
    assert "tendon tension $T$" not in panels(fake_path(5))


def test_shapes_are_named_by_what_drives_them():
    path = by_stroke(4)
    path.columns["tension"][7] = 4.87e-17
    names = [
        text.get_text() for axes in path_figure(path).axes[:2] for text in
        axes.get_legend().get_texts()
    ]  # fmt: skip
    assert all(" mm, " in name or name == "closed notch" for name in names)
    assert "0 mm, 0.0°" in names
    path = fake_path(4)
    path.columns["tension"][0] = 4.87e-17
    assert load_label(path, 0) == "0 N, 0.0°"
    assert load_label(path, 2) == f"2 N, {np.degrees(path.total_angle[2]):.1f}°"


def test_strain_is_drawn_with_what_is_allowed():
    path = fake_path(4)
    panel = next(cell.panel for cell in path_picture(path).cells if "strain" in cell.panel.y_label)
    (level,) = (item for item in panel.items if isinstance(item, Span))
    assert level.high is None
    assert (level.low, level.name) == (pytest.approx(8.0), "allowed 8 %")
    np.testing.assert_allclose(
        panel.items[0].rows[:, 1], 100.0 * path.peak_strain[:5, 0]
    )  # the peak is held
    path.robot = path.robot.replace(material=Linear(10_000.0))
    panel = next(cell.panel for cell in path_picture(path).cells if "strain" in cell.panel.y_label)
    assert not any(isinstance(item, Span) for item in panel.items)


def test_clamp_ends_where_the_robot_begins():
    held = outline_at(fake_path(3), 2).held
    assert held[:, 1].max() == 0.0
    assert held[:, 1].min() < -0.5
    assert np.ptp(held[:, 0]) > 1.62
    areas = [
        item for cell in path_picture(fake_path(3)).cells[:1] for item in cell.panel.items
        if isinstance(item, Area) and np.array_equal(item.polygons[0], held)
    ]  # fmt: skip
    assert len(areas) == 1  # it stands still, whatever the robot does


def test_ways_of_two_tendons_are_told_by_their_sum():
    path = fake_path(3)
    path.columns["tension"] = np.repeat(path.tension, 2, axis=1) * [1.0, 0.5]
    path.columns["commanded_tension"] = path.columns["tension"]
    path.columns["commanded_stroke"] = np.full((6, 2), np.nan)
    path.columns["stroke"] = np.repeat(path.stroke, 2, axis=1)
    assert steps_by_branch(path) == {"loading": [0, 1, 2, 3], "unloading": [3, 4, 5]}


def arrows(figure):
    return [patch for patch in figure.axes[0].patches if hasattr(patch, "get_arrowstyle")]


def test_loads_are_arrows_where_they_act():
    path = part_of(fake_path(3), slice(2, 3))
    side = BodyForce(2, (0.0, 0.0, 0.1), point=(0.5, 0.0, 0.0), following=True)
    path.columns["external"] = (
        ExternalLoad(tip_force=(-0.2, 0.0, 0.0), tip_moment=(0.0, 1.0, 0.0), body_forces=[side]),
    )
    figure = path_figure(path)
    names = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert {"force 0.2 N", "moment 1 N mm", "force 0.1 N, following"} <= set(names)
    shape = shape_at(path, 0)
    dead = (path.tip_position[0] - path.body_position[0, 0])[[0, 2]]
    ends = [arrow._posA_posB for arrow in arrows(figure)]
    # A moment about y, which points away from the viewer, turns clockwise: down on the right.
    assert ends[1][1][0] > dead[0]
    assert ends[1][1][1] < ends[1][0][1]
    np.testing.assert_allclose(ends[0][0], dead, atol=1e-9)
    np.testing.assert_allclose(np.sign(np.subtract(*ends[0][::-1])), [-1.0, 0.0])
    np.testing.assert_allclose(ends[2][0], shape.on_body(2, [0.5, 0.0, 0.0])[[0, 2]])
    along = shape.rotation[2, :, 2][[0, 2]]
    np.testing.assert_allclose(
        np.subtract(*ends[2][::-1]) / np.linalg.norm(np.subtract(*ends[2][::-1])), along
    )
    # Half the force, half the arrow.
    longest = np.linalg.norm(np.subtract(*ends[0][::-1]))
    assert np.linalg.norm(np.subtract(*ends[2][::-1])) == pytest.approx(0.5 * longest)


def test_load_out_of_the_plane_is_drawn_in_space():
    path = part_of(fake_path(3), slice(2, 3))
    path.columns["external"] = (ExternalLoad(tip_force=(0.0, 0.1, 0.0)),)
    assert path_figure(path).axes[0].name == "3d"
    path.columns["external"] = (ExternalLoad(tip_moment=(0.0, 0.1, 0.0)),)
    assert path_figure(path).axes[0].name == "rectilinear"


def test_letters_of_a_suffix_may_be_large(tmp_path):
    save(path_figure(part_of(fake_path(2), slice(1, 2))), tmp_path / "wrist.PNG")
    assert (tmp_path / "wrist.PNG").read_bytes().startswith(b"\x89PNG")
    assert [found.name for found in tmp_path.iterdir()] == ["wrist.PNG"]


def test_same_picture_is_the_same_file(tmp_path):
    for name in ("a.svg", "b.svg"):
        save(path_figure(part_of(fake_path(3), slice(0, 3))), tmp_path / name)
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()


def test_other_formats_are_refused(tmp_path):
    with refused("FILE_FORMAT"):
        save(path_figure(fake_path(3)), tmp_path / "wrist.gif")


@pytest.mark.parametrize("failed", [1, 6])
def test_path_with_failures_is_drawn(failed):
    figure = path_figure(fake_path(3, failed=failed))
    assert len(figure.axes) == (4 if failed == 6 else 6)


def test_single_step_is_drawn():
    path = part_of(fake_path(2), slice(1, 2))
    assert len(path_figure(path).axes) == 1
    assert len(representative_steps(path)) == 1


def test_steps_drawn_are_spread_over_the_shapes():
    path = fake_path(31)
    steps = representative_steps(path)
    assert len(steps) == 5
    assert np.ptp(np.diff(path.total_angle[steps])) < np.radians(12.0)
    assert path.total_angle[steps[-1]] == path.total_angle.max()


def test_branches_turn_where_the_tension_turns():
    x = np.array([0.0, 1.0, 1.0, 2.0, 2.0, 1.0, 1.0, 3.0])
    parts = [(part.start, part.stop, up) for part, up in branches(x)]
    assert parts == [(0, 5, "loading"), (4, 7, "unloading"), (6, 8, "loading")]


def test_abscissa_is_the_step_where_several_tendons_change():
    path = fake_path(3)
    for name in ("tension", "stroke", "commanded_tension", "commanded_stroke"):
        path.columns[name] = np.repeat(path.columns[name], 2, axis=1)
    assert abscissa(path)[1] == "tension of tendon 1 $T$ [N]"  # both alike
    path.columns["tension"][1, 1] = 0.2
    assert abscissa(path)[1] == "step [number]"
    path.columns["tension"][:, 0] = 0.5
    assert abscissa(path)[1] == "tension of tendon 2 $T$ [N]"


def test_outline_is_to_scale():
    path = fake_path(3)
    shape = outline_at(path, 0)
    tip = shape.bodies[-1]
    assert np.ptp(tip[:, 0]) == pytest.approx(1.62)
    assert np.ptp(tip[:, 1]) == pytest.approx(1.2)
    strip = shape.flexures[0]
    assert strip[:, 0].min() == pytest.approx(-0.81)  # the spine is away from the bend
    # inner edge of the sector: r_i cos a, with cos a = (1.40 - 0.81) / 0.81
    assert strip[:, 0].max() == pytest.approx(-0.70 * 0.59 / 0.81, abs=1e-3)


def test_bent_notch_is_an_arc_of_the_right_length():
    path = fake_path(3)
    shape = outline_at(path, 2)
    strip = shape.flexures[0]
    outer_edge = strip[: len(strip) // 2]
    length = np.linalg.norm(np.diff(outer_edge, axis=0), axis=1).sum()
    assert length == pytest.approx(0.8 + (0.81 - 0.6865) * CLOSING, rel=1e-3)
    # the lips of a closed notch meet
    first, second = shape.bodies[0][1], shape.bodies[1][0]
    assert np.linalg.norm(first - second) < 2e-3
    lip = lips(shape_at(path, 2), 0)
    np.testing.assert_allclose(lip[[0, 2]], first, atol=2e-3)


def test_picture_does_not_turn_with_the_base():
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    path = fake_path(3)
    straight = outline_at(path, 2)
    path.columns["body_position"] = path.body_position @ turn.T
    path.columns["body_rotation"] = turn @ path.body_rotation
    turned = outline_at(path, 2)
    for one, other in zip(turned.bodies, straight.bodies, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)


def test_robots_that_leave_the_plane_are_drawn_in_space():
    path = part_of(fake_path(3), slice(0, 3))
    assert bending_plane(path.robot) == 0.0
    assert bending_plane(path.robot.with_value("notch[2].direction_deg", 180)) == 0.0
    path.robot = path.robot.with_value("notch[2].direction_deg", 90)
    figure = path_figure(path)
    assert [axes.name for axes in figure.axes] == [
        "3d",
        "rectilinear",
        "rectilinear",
        "rectilinear",
    ]
    assert figure.axes[0].get_zlabel() == "z, along the base [mm]"
