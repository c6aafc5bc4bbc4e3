"""The picture of a path: drawn from the table of quantities, to scale, in every format."""

import numpy as np
import pytest

from fake_path import CLOSING, fake_path
from notchflex.errors import InputError
from notchflex.plot import path_figure, save
from notchflex.plot.curves import abscissa, branches
from notchflex.plot.outline import bending_planes, outline
from notchflex.plot.wrist import telling_steps


def test_axes_have_quantities_and_units():
    figure = path_figure(fake_path(11))
    labels = [(axes.get_xlabel(), axes.get_ylabel()) for axes in figure.axes]
    assert labels[1] == ("tendon tension $T$ [N]", "total bending angle $\\theta$ [deg]")
    assert labels[2][1] == "notch angle $\\theta_j$ [deg]"
    assert all("[mm]" in label for label in labels[0])
    assert figure.axes[0].get_aspect() == 1.0


def test_loading_and_unloading_are_told_apart():
    figure = path_figure(fake_path(11))
    texts = [text.get_text() for text in figure.axes[1].get_legend().get_texts()]
    assert texts == ["pulling", "letting go"]
    styles = {line.get_linestyle() for line in figure.axes[1].get_lines()}
    assert styles == {"-", "--"}


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf", ".PNG"])
def test_every_format_is_written(tmp_path, suffix):
    file = tmp_path / f"wrist{suffix}"
    save(path_figure(fake_path(3)), file)
    start = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}[suffix.lower()]
    assert file.read_bytes().startswith(start)
    assert [found.name for found in tmp_path.iterdir()] == [file.name]


def test_same_picture_is_the_same_file(tmp_path):
    for name in ("a.svg", "b.svg"):
        save(path_figure(fake_path(3)), tmp_path / name)
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()


def test_other_formats_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"\.png, \.svg or \.pdf"):
        save(path_figure(fake_path(3)), tmp_path / "wrist.gif")


@pytest.mark.parametrize("failed", [1, 6])
def test_path_with_failures_is_drawn(failed):
    figure = path_figure(fake_path(3, failed=failed))
    assert len(figure.axes) == 3


def test_single_step_is_drawn():
    path = fake_path(2)
    path.columns = {name: values[1:2] for name, values in path.columns.items()}
    figure = path_figure(path)
    assert figure.axes[1].get_lines()[0].get_marker() == "o"
    assert len(telling_steps(path)) == 1


def test_steps_drawn_are_spread_over_the_shapes():
    path = fake_path(31)
    steps = telling_steps(path)
    assert len(steps) == 5
    assert np.ptp(np.diff(path.total_angle[steps])) < np.radians(12.0)
    assert path.total_angle[steps[-1]] == path.total_angle.max()


def test_branches_turn_where_the_tension_turns():
    x = np.array([0.0, 1.0, 1.0, 2.0, 2.0, 1.0, 1.0, 3.0])
    parts = [(part.start, part.stop, up) for part, up in branches(x)]
    assert parts == [(0, 5, True), (4, 7, False), (6, 8, True)]


def test_abscissa_is_the_step_where_several_tendons_change():
    path = fake_path(3)
    path.columns["tension"] = np.repeat(path.columns["tension"], 2, axis=1)
    assert abscissa(path)[1] == "step"
    path.columns["tension"][:, 0] = 0.5
    assert abscissa(path)[1] == "tension of tendon 2 $T$ [N]"


def test_outline_is_to_scale():
    path = fake_path(3)
    shape = outline(path.robot, path.body_position[0], path.body_rotation[0], 0.0)
    tip = shape.bodies[-1]
    assert np.ptp(tip[:, 0]) == pytest.approx(1.62)
    assert np.ptp(tip[:, 1]) == pytest.approx(1.2)
    strip = shape.flexures[0]
    assert strip[:, 0].min() == pytest.approx(-0.81)  # the spine is away from the bend
    # inner edge of the sector: r_i cos a, with cos a = (1.40 - 0.81) / 0.81
    assert strip[:, 0].max() == pytest.approx(-0.70 * 0.59 / 0.81, abs=1e-3)
    assert shape.centre_line[-1] == pytest.approx([0.0, 10.0])


def test_bent_notch_is_an_arc_of_the_right_length():
    path = fake_path(3)
    shape = outline(path.robot, path.body_position[2], path.body_rotation[2], 0.0)
    strip = shape.flexures[0]
    outer_edge = strip[: len(strip) // 2]
    length = np.linalg.norm(np.diff(outer_edge, axis=0), axis=1).sum()
    assert length == pytest.approx(0.8 + (0.81 - 0.6865) * CLOSING, rel=1e-3)
    # the lips of a closed notch meet
    first, second = shape.bodies[0][2], shape.bodies[1][3]
    assert np.linalg.norm(first - second) < 2e-3


def test_picture_does_not_turn_with_the_base():
    path = fake_path(3)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = outline(path.robot, path.body_position[2] @ turn.T, turn @ path.body_rotation[2], 0.0)
    straight = outline(path.robot, path.body_position[2], path.body_rotation[2], 0.0)
    for one, other in zip(turned.bodies, straight.bodies, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)


def test_robots_that_leave_the_plane_are_drawn_from_two_sides():
    path = fake_path(3)
    assert bending_planes(path.robot) == [0.0]
    assert bending_planes(path.robot.with_value("notch[2].direction_deg", 180)) == [0.0]
    path.robot = path.robot.with_value("notch[2].direction_deg", 90)
    assert len(path_figure(path).axes) == 4
