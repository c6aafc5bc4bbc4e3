"""`notchflex follow`: targets of a file, results in files, and what is refused."""

import csv
import json
import random

import numpy as np
import pytest

import notchflex as nf
from notchflex._summary import short
from notchflex.control import TargetSearch


@pytest.fixture
def targets(tmp_path):
    """Positions of the tip during loading and unloading."""
    forward = nf.simulate(nf.load_robot("pacheco2021-a"), nf.pull(0.4, 1.0, steps=4).release())
    with (tmp_path / "targets.csv").open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["tip_x_mm", "tip_z_mm"])
        rows.writerows(forward.tip_position[:, [0, 2]].tolist())
    return forward


def test_targets_are_followed_and_written(call, targets, tmp_path):
    options = ("--json", "f.json", "--csv", "f.csv", "--plot", "f.png", "--save-state", "s.json")
    code, out, err = call("follow", "pacheco2021-a", "targets.csv", *options)
    assert code == 0
    assert not err
    assert "8 of 8 targets met" in out
    found = json.loads((tmp_path / "f.json").read_text())
    assert [one["reached"] for one in found["targets"]] == [True] * 8
    tips = [found["steps"][one["step"]]["tip_position_mm"] for one in found["targets"]]
    np.testing.assert_allclose(tips, targets.tip_position, atol=1e-6)
    rows = list(csv.DictReader((tmp_path / "f.csv").read_text().splitlines()))
    assert [row["target"] for row in rows] == [str(n) for n in range(1, 9)]
    assert (tmp_path / "f.png").stat().st_size > 10_000
    code = call(
        "follow", "pacheco2021-a", "targets.csv", "--from-state", "s.json", "--approach", "least"
    )[0]
    assert code == 0


def test_headers_in_own_words(call, targets, tmp_path):
    text = (tmp_path / "targets.csv").read_text()
    rows = [line.split(",") for line in text.splitlines()[1:]]
    in_um = "".join(f"{x},{1e3 * float(z)}\n" for x, z in rows)
    (tmp_path / "own.csv").write_text(f"quer,Höhe [um]\n{in_um}", encoding="utf-8")
    assert call("follow", "pacheco2021-a", "own.csv")[0] == 2
    named = ("--column", "tip_x_mm=quer", "--column", "tip_z_mm=Höhe [um]")
    code, out, _ = call("follow", "pacheco2021-a", "own.csv", *named)
    assert code == 0
    assert "8 of 8 targets met" in out


def test_a_target_out_of_reach_exits_with_1(call, tmp_path):
    (tmp_path / "far.csv").write_text("tip_x_mm,tip_z_mm\n2.4,9.3068\n30,0\n")
    code, out, err = call("follow", "pacheco2021-a", "far.csv", "--tolerance", "0.05")
    assert code == 1
    assert "TARGET_OUT_OF_REACH" in out
    assert "target 2" in err


def test_targets_typed_to_a_hundredth_are_met(call, tmp_path):
    """They lie off the one path of the tip, which a search to 1e-7 mm never meets."""
    path = nf.simulate(nf.load_robot("pacheco2021-a"), nf.pull(0.5, 1.0, steps=7))
    rows = [f"{x:.2f},{z:.2f}\n" for x, _, z in path.tip_position]
    (tmp_path / "typed.csv").write_text("tip_x_mm,tip_z_mm\n" + "".join(rows))
    code, out, _ = call("follow", "pacheco2021-a", "typed.csv", "--json", "f.json")
    assert code == 0
    assert "7 of 7 targets met" in out
    written = json.loads((tmp_path / "f.json").read_text())
    for target, step in zip(written["targets"], written["steps"], strict=True):
        goal = np.array([one for one in target["target"]["tip_position_mm"] if one is not None])
        missed = np.linalg.norm(np.array(step["tip_position_mm"])[[0, 2]] - goal)
        assert target["error_mm"] == pytest.approx(missed, abs=1e-9)
        assert target["error_deg"] == 0.0
    code, out, _ = call("follow", "pacheco2021-a", "typed.csv", "--tolerance", "1e-7")
    assert code == 1
    assert "0 of 7 targets met" in out


def test_a_target_of_an_angle_has_its_own_tolerance():
    robot = nf.load_robot("pacheco2021-a")
    goals = {"tip_position": [(2.4, None, 9.3068)], "total_angle": [np.radians(26.0)]}
    search = TargetSearch(near=0.2, near_angle=np.radians(5.0))
    found = nf.follow(robot, goals, search=search)
    missed = np.degrees(found.path.total_angle[found.step[0]]) - 26.0
    assert found.error_deg[0] == pytest.approx(abs(missed), abs=1e-9)
    assert found.reached[0]
    assert 0.001 < found.error_deg[0] < 5.0
    closer = nf.follow(robot, goals, search=TargetSearch(near=0.2, near_angle=1e-6))
    assert not closer.reached[0]
    missed = f"{short(float(closer.error_mm[0]))} mm and {short(float(closer.error_deg[0]))} deg"
    assert f"misses it by {missed};" in closer.reason[0]


@pytest.mark.parametrize(("unit", "scale"), [("m", 1e-3), ("µm", 1e3)])
def test_positions_in_another_unit_are_told_from_targets_out_of_reach(call, tmp_path, unit, scale):
    (tmp_path / "other.csv").write_text(f"tip_x_mm,tip_z_mm\n{2.4 * scale},{9.3 * scale}\n")
    code, _, err = call("follow", "pacheco2021-a", "other.csv")
    assert code == 1
    assert err.rstrip().endswith(f"in {unit}.")
    # A target that is too far in mm is none of these.
    (tmp_path / "far.csv").write_text("tip_x_mm,tip_z_mm\n30,0\n")
    assert "positions are in mm" not in call("follow", "pacheco2021-a", "far.csv")[2]


def test_overshoots_are_shown(call, tmp_path):
    (tmp_path / "angle.csv").write_text("total_deg\n40\n")
    code, out, _ = call("follow", "pacheco2021-a", "angle.csv", "--approach", "least")
    assert code == 0
    assert "overshoot" in out


FILES = {
    "wrong column": ("TABLE_COLUMNS", "tip_x\n1\n"),
    "no number": ("TABLE_ROWS", "tip_x_mm,tip_z_mm\n,\n"),
    "text": ("NOT_A_NUMBER", "tip_x_mm\nfar\n"),
    "not finite": ("NOT_FINITE", "tip_x_mm\nnan\n"),
    "a slip of the keyboard": ("OUT_OF_RANGE", "tip_x_mm\n1e9\n"),
    "no rows": ("TABLE_ROWS", "tip_x_mm\n"),
    "no direction": ("OUT_OF_RANGE", "tip_direction_x,tip_direction_y,tip_direction_z\n0,0,0\n"),
    "too many notches": ("TABLE_COLUMNS", "notch_6_deg\n3\n"),
}


@pytest.mark.parametrize("name", FILES)
def test_bad_targets_are_refused(refused, tmp_path, name):
    code, text = FILES[name]
    (tmp_path / "targets.csv").write_text(text)
    refused(code, "follow", "pacheco2021-a", "targets.csv", "--json", "f.json", name=name)


@pytest.mark.parametrize(
    ("code", "options"),
    [
        ("OUT_OF_RANGE", ("--least-tension", "2", "--most-tension", "1")),
        ("OUT_OF_RANGE", ("--rate", "0")),
        ("OUT_OF_RANGE", ("--tolerance", "0")),
        ("OUT_OF_RANGE", ("--angle-tolerance", "0")),
        ("OUT_OF_RANGE", ("--most-strain", "-1")),
        ("NOT_FINITE", ("--most-tension", "nan")),
        ("UNKNOWN_NAME", ("--approach", "sideways")),
        ("FILE_NOT_FOUND", ("--from-state", "none.json")),
        ("CONFLICT", ("--csv", "targets.csv")),
    ],
)
def test_bad_options_are_refused(refused, tmp_path, code, options):
    (tmp_path / "targets.csv").write_text("tip_x_mm\n1\n")
    refused(code, "follow", "pacheco2021-a", "targets.csv", *options)


def test_mutated_files_are_followed_or_refused(call, tmp_path):
    """Every mutation is read or refused; every tenth is followed too."""
    whole = "tip_x_mm,tip_z_mm,total_deg\n2.1,9.5,\n2.4,9.3,\n,,30\n"
    chance, robot = random.Random(24), nf.load_robot("pacheco2021-a")
    for number in range(200):
        text = list(whole)
        for _ in range(chance.randint(1, 4)):
            at = chance.randrange(len(text))
            text[at] = chance.choice([*',;\n"-.9eE#x\t\0 ', "", "nan", "1e400", "é"])
        (tmp_path / "targets.csv").write_bytes("".join(text).encode())
        found = None
        try:
            nf.read_targets(tmp_path / "targets.csv", robot)
        except nf.InputError as problem:
            found = problem.code
        refused = found is not None
        assert found is not nf.ErrorCode.INVALID_INPUT
        if number % 10 == 0:
            code, out, err = call("follow", "pacheco2021-a", "targets.csv", "--json", "-")
            assert (code == 2) is refused
            assert "Traceback" not in err
            assert out == "" if refused else json.loads(out)
