"""Rendered photographs of straight wrists: notches as they were cut, or a refusal."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

import notchflex as nf
from notchflex.cli.app import run
from notchflex.photographs.measure_cut import StraightFit, combined, depths, seen_edges
from notchflex.photographs.measured import MeasuredPhotograph
from notchflex.photographs.outline import PlanarRobot
from photographs.renderer import Scene, render
from refusals import refused

ROBOT = nf.load_robot("pacheco2021-a")
TABLE = PlanarRobot(ROBOT)
N = ROBOT.number_of_notches
OUTER = ROBOT.tube.outer_diameter
SCALE = 130.0 / OUTER
SCENE = Scene(
    size=(int(15 * SCALE), int(7 * SCALE)),
    scale=SCALE,
    place=(2.2 * SCALE, 3.2 * SCALE),
    direction=4.0,
    roll=-9.0,
    tilt=2.0,
    stripe=80.0,
    noise=2.0,
    seed=5,
)
OFF = {"depth": 0.05, "height": -0.02}


def seen(roll_deg, cut, spread=1e-3, lengths=0.0, reason=""):
    """Return what a photograph of a wrist rolled by an angle says."""
    nothing = np.full(N, np.nan)
    photograph = MeasuredPhotograph(
        "a.png", reason, nothing, nothing, np.full(3, np.nan), np.full(3, np.nan)
    )
    edge = seen_edges(TABLE, cut, np.radians(roll_deg))
    both = np.full(2 * N, lengths)
    return StraightFit(photograph, both, spread**2 * np.eye(2 * N), edge, spread**2 * np.eye(N))


def test_two_views_tell_depth_from_roll():
    cut = np.linspace(-0.04, 0.05, N)
    turns = np.radians([0.0, 20.0])
    found, deviation, apart = depths(TABLE, [seen(-8.0, cut), seen(12.0, cut)], turns)
    assert np.abs(found - cut).max() < 3.0 * deviation.max() < 0.02 * OUTER
    assert apart < 1.0
    _, alone, _ = depths(TABLE, [seen(-8.0, cut)], turns[:1])
    assert alone.min() > 0.01 * OUTER
    assert alone.min() > 3.0 * deviation.max()


def test_photographs_that_contradict_each_other_are_refused():
    cut, turns = np.zeros(N), np.radians([0.0, 20.0])
    good = seen(-8.0, cut)
    assert combined(TABLE, [good, seen(12.0, cut)], turns).measured
    longer = combined(TABLE, [good, seen(12.0, cut, lengths=0.05)], turns)
    assert "heights" in longer.reason
    other = np.where(np.arange(N) % 2, 0.1, -0.1)  # another wrist
    assert "contradict" in combined(TABLE, [good, seen(12.0, other)], turns).reason
    blind = combined(TABLE, [good, seen(12.0, cut, reason="blurred")], turns)
    assert blind.reason == "a.png: blurred"
    assert np.isnan(blind.depth).all()
    with refused("NO_DATA"):
        blind.as_cut()


def test_depths_that_count_from_the_inner_surface():
    """A depth read elsewhere than at the outer surface changes less than the section."""
    inner = ROBOT.with_values({"notch.cut": "on-axis", "notch.depth_at": "inner"})
    table = PlanarRobot(inner)
    cut, turns = np.full(N, 0.03), np.radians([0.0, 20.0])
    fits = [seen(-8.0, cut), seen(12.0, cut)]
    robot = combined(table, fits, turns).as_cut()
    added = PlanarRobot(robot).depth - table.depth
    expected, _, _ = depths(table, fits, turns)
    np.testing.assert_allclose(added, expected, atol=2e-5)


def test_turns_and_options_are_checked(tmp_path, capsys):
    for turns, code in (
        (20.0, "WRONG_SHAPE"),
        ([[1.0]], "WRONG_SHAPE"),
    ):
        with refused(code):
            nf.measure_cut("a.png", ROBOT, turn_deg=turns)
    for turn, code in ((90.0, "OUT_OF_RANGE"), (float("nan"), "OUT_OF_RANGE"), ("x", "WRONG_TYPE")):
        with refused(code):
            nf.measure_cut(["a.png", "b.png"], ROBOT, turn_deg=turn)
    with refused("NO_DATA"):
        nf.measure_cut([], ROBOT)
    words = ["measure", "a.png", "--robot", "pacheco2021-a"]
    for more in (
        ["--turn", "20"],
        ["--write-robot", str(tmp_path / "r.toml")],
        ["--cut", "--pattern", "{tension}"],
        ["--cut", "--turn", "x"],
        ["--cut", "--write-robot", str(tmp_path / "no" / "r.toml")],
    ):
        assert run([*words, *more]) == 2
        assert "Traceback" not in capsys.readouterr().err


def test_a_blank_photograph_is_refused(tmp_path, capsys):
    file, table = tmp_path / "blank.png", tmp_path / "cut.csv"
    cv2.imwrite(str(file), np.full((200, 300), 128, np.uint8))
    words = ["measure", str(file), "--robot", "pacheco2021-a", "--cut", "-o", str(table)]
    assert run([*words, "--json", str(tmp_path / "cut.json")]) == 1
    assert not table.exists()
    assert "refused" in capsys.readouterr().err
    assert not json.loads((tmp_path / "cut.json").read_text())["measured"]


@pytest.mark.nightly
def test_notches_of_a_rendered_wrist(tmp_path, capsys):
    """Two photographs through the command line: lengths, overlay, robot file; bent is refused."""
    values = {
        f"notch[{number}].{name}": getattr(notch, name) + off * (1.0 + 0.2 * number)
        for name, off in OFF.items()
        for number, notch in enumerate(ROBOT.notches, 1)
    }
    true, files = ROBOT.with_values(values), []
    for turn in (0.0, 20.0):
        scene = replace(SCENE, roll=SCENE.roll + turn, seed=SCENE.seed + round(turn))
        files.append(str(tmp_path / f"{turn:.0f}.png"))
        cv2.imwrite(files[-1], render(true, np.radians(np.full(N, 0.5)), scene))
    words = ["measure", *files, "--robot", "pacheco2021-a", "--cut", "--turn", "20"]
    document, robot = tmp_path / "cut.json", tmp_path / "as-cut.toml"
    words += ["-o", str(tmp_path / "cut.csv"), "--json", str(document), "--write-robot", str(robot)]
    assert run(words) == 0
    assert "as cut" in capsys.readouterr().out
    found = json.loads(document.read_text())
    as_cut = nf.load_robot(robot)
    for name in ("height", "depth", "uncut_length"):
        right = np.array([getattr(notch, name) for notch in true.notches])
        error = np.array(found[f"{name}_mm"]) - right
        assert np.abs(error).max() < 0.01 * OUTER
        assert (np.abs(error) < 4.0 * np.array(found[f"{name}_sd_mm"])).all()
        written = [getattr(notch, name) for notch in as_cut.notches]
        np.testing.assert_allclose(written, found[f"{name}_mm"], atol=1e-4)
    assert "standard deviation" in robot.read_text()
    assert (tmp_path / "cut.csv").read_text().startswith("notch,height_mm,height_sd_mm,depth_mm")
    overlay = cv2.imread(str(tmp_path / "cut-overlays" / "20.png"))
    assert (overlay[..., 1].astype(int) - overlay[..., 2] > 80).sum() > 500
    bent = str(tmp_path / "bent.png")
    angles = np.radians(np.full(N, 15.0))
    cv2.imwrite(bent, render(ROBOT, angles, replace(SCENE, place=(2.2 * SCALE, 1.5 * SCALE))))
    assert nf.measure_cut(bent, ROBOT).reason
