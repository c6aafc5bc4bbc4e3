"""`notchflex follow`: targets of a file, results in files, and what is refused."""

import csv
import json
import random

import numpy as np
import pytest

import notchflex as nf


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


def test_a_target_out_of_reach_exits_with_1(call, tmp_path):
    (tmp_path / "far.csv").write_text("tip_x_mm,tip_z_mm\n2.4,9.3068\n30,0\n")
    code, out, err = call("follow", "pacheco2021-a", "far.csv", "--tolerance", "0.05")
    assert code == 1
    assert "TARGET_OUT_OF_REACH" in out
    assert "target 2" in err


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
