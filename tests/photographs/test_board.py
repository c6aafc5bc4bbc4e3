"""Boards of markers and given scales: what they say about a view, and how they are drawn."""

import re
from dataclasses import replace

import cv2
import numpy as np
import pytest

import notchflex as nf
from notchflex.cli.app import run
from notchflex.photographs import board_of
from notchflex.photographs.board import NOT_FLAT, NOT_SEEN, Ruler, sight
from notchflex.photographs.measure import measure_picture
from notchflex.photographs.outline import PlanarRobot
from photographs.renderer import Scene, _camera, _project, render
from photographs.test_measure import ANGLES, ROBOT
from refusals import refused

BOARD = nf.Board(columns=4, rows=1, marker=2.0, gap=0.8)
SCENE = Scene(
    size=(760, 640), scale=46.0, place=(400.0, 130.0), direction=75.0, roll=8.0, tilt=7.0,
    distance=90.0, background=200.0, seed=3,
)  # fmt: skip


def laid(board, first, scene, picture):
    """Draw a board into a photograph: its top left corner at (along, across) the tube, mm."""
    side = 400
    cells = board.cells().astype(np.uint8)
    before = replace(scene, roll=0.0)  # a board does not roll with the tube
    for cell, corners in zip(cells, board.corners() + np.array(board.size) / 2.0, strict=True):
        u, v = (corners + first).T
        seen = _project(_camera(np.stack([v, np.zeros(4), u], axis=1), before), before)
        marker = cv2.resize(cell * 200, (side, side), interpolation=cv2.INTER_NEAREST) + 20
        corner = np.array([[0, 0], [side, 0], [side, side], [0, side]], np.float32) - 0.5
        turn = cv2.getPerspectiveTransform(corner, (seen * 4 + 1.5).astype(np.float32))
        size = (scene.size[0] * 4, scene.size[1] * 4)
        fine = cv2.warpPerspective(marker, turn, size, flags=cv2.INTER_AREA)
        covers = cv2.warpPerspective(np.ones_like(marker, np.float32), turn, size)
        covers = cv2.resize(covers, scene.size, interpolation=cv2.INTER_AREA)
        shade = cv2.resize(fine.astype(np.float32), scene.size, interpolation=cv2.INTER_AREA)
        picture = (1.0 - covers) * picture + shade
    return np.clip(cv2.GaussianBlur(picture, (0, 0), 0.8), 0, 255).astype(np.uint8)


@pytest.fixture(scope="module")
def photograph():
    """A wrist with a board beside it, which is the same in every part of the photograph."""
    grey = laid(BOARD, (-1.0, -4.6), SCENE, render(ROBOT, ANGLES, SCENE).astype(np.float32))
    return cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR)


def test_a_board_gives_scale_tilt_and_distance(photograph):
    """Known is where the renderer's camera stood: at the first notch, px/mm, deg, 1/mm."""
    seen = sight(photograph, BOARD)
    assert len(seen.corners) == 4
    known = seen.prior(np.array(SCENE.place) - np.array(SCENE.size) / 2.0)
    assert np.exp(known.log_scale[0]) == pytest.approx(SCENE.scale, rel=0.003)
    direction = np.radians(SCENE.direction)
    tilt = np.degrees(np.arctan(known.slope @ np.array([np.cos(direction), np.sin(direction)])))
    assert tilt == pytest.approx(SCENE.tilt, abs=2.0)
    perspective, deviation = known.perspective
    assert abs(perspective - 1.0 / SCENE.distance) < 3.0 * deviation
    assert deviation < 0.004


@pytest.mark.nightly
def test_angles_beside_a_board(photograph):
    """The board itself is not taken for the robot; its scale and tilt enter the fit."""
    table = PlanarRobot(ROBOT)
    found = measure_picture(photograph, table, "wrist", Ruler(board=BOARD))
    assert found.reason == ""
    np.testing.assert_allclose(found.notch_angle, ANGLES, atol=np.radians(0.3))
    assert found.scale == pytest.approx(SCENE.scale, rel=0.003)
    thick = ROBOT.with_value("tube.outer_diameter", 1.75)
    wrong = measure_picture(photograph, PlanarRobot(thick), "wrist", Ruler(board=BOARD))
    assert wrong.reason


@pytest.mark.nightly
def test_a_given_scale_that_contradicts_the_diameter(photograph):
    found = measure_picture(photograph, PlanarRobot(ROBOT), "wrist", Ruler(scale=43.0))
    assert "outer diameter" in found.reason


def test_photographs_without_the_board_are_refused(photograph):
    blank = np.full((200, 300, 3), 180, np.uint8)
    other = replace(BOARD, gap=1.2)
    assert sight(blank, BOARD) == NOT_SEEN
    assert sight(photograph, replace(BOARD, dictionary="apriltag_36h11")) == NOT_SEEN
    assert sight(photograph, other) == NOT_FLAT
    found = measure_picture(blank, PlanarRobot(ROBOT), "wrist", Ruler(board=BOARD))
    assert found.reason == NOT_SEEN


@pytest.mark.parametrize("dictionary", ["4x4_50", "apriltag_36h11"])
def test_the_drawing_is_the_board_in_its_size(tmp_path, dictionary, capsys):
    """Rectangles of the SVG, drawn at 20 px/mm, are read as the board by OpenCV."""
    text = f"3x2,marker=6,gap=2,dictionary={dictionary}"
    file = tmp_path / "board.svg"
    assert run(["board", text, "-o", str(file)]) == 0
    assert "calliper" in capsys.readouterr().err
    drawing, board = file.read_text(), board_of(text)
    assert 'width="34mm" height="26mm"' in drawing
    image = np.full((520, 680), 255, np.uint8)
    rectangle = r'<rect x="(.*?)" y="(.*?)" width="(.*?)" height="(.*?)"( fill="white")?/>'
    for *numbers, white in re.findall(rectangle, drawing):
        x, y, width, height = np.array(numbers, float) * 20.0
        place = np.s_[round(y) : round(y + height), round(x) : round(x + width)]
        image[place] = 255 if white else 0
    seen = sight(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), board)
    assert len(seen.corners) == 6
    assert np.exp(seen.prior(np.zeros(2)).log_scale[0]) == pytest.approx(20.0, rel=0.005)
    assert board_of(board.text()) == board


def test_boards_and_scales_that_are_refused(tmp_path, capsys):
    for text in (
        "",
        "4",
        "4x3",
        "4x3,marker=5",
        "4x3,marker=a,gap=1",
        "4x3,marker=5,gap=1,x=2",
        "4x3,marker=5,marker=5,gap=1",
        "4x3,marker=nan,gap=1",
        "-1x3,marker=5,gap=1",
    ):
        with refused("BAD_SYNTAX"):
            board_of(text)
    for text, code in (
        ("0x3,marker=5,gap=1", "OUT_OF_RANGE"),
        ("4x3,marker=-5,gap=1", "OUT_OF_RANGE"),
        ("4x3,marker=5,gap=0.1", "OUT_OF_RANGE"),
        ("4x3,marker=5,gap=1,dictionary=qr", "UNKNOWN_NAME"),
    ):
        with refused(code):
            board_of(text)
    with refused("OUT_OF_RANGE"):
        nf.Board(40, 40, 1.0, 0.5).cells()
    for scale, code in ((0.0, "OUT_OF_RANGE"), (float("nan"), "OUT_OF_RANGE"), ("x", "WRONG_TYPE")):
        with refused(code):
            nf.measure("a.png", ROBOT, scale=scale)
    with refused("CONFLICT"):
        nf.measure("a.png", ROBOT, scale=50.0, board=BOARD)
    for words in (["board", "4x3"], ["board", "4x3,marker=5,gap=1"],
                  ["board", "4x3,marker=5,gap=1", "-o", str(tmp_path / "b.png")],
                  ["board", "4x3,marker=5,gap=1", "-o", str(tmp_path / "no" / "b.svg")],
                  ["measure", "a.png", "--robot", "pacheco2021-a", "--scale", "x"],
                  ["measure", "a.png", "--robot", "pacheco2021-a", "--board", "x"]):  # fmt: skip
        assert run(words) == 2
        assert "Traceback" not in capsys.readouterr().err
