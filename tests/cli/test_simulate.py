"""`notchflex simulate` on the real solver: files, tables, warnings, states, exit codes."""

import csv
import json
import math

import pytest

import notchflex as nf

LOOP = ["simulate", "pacheco2021-a", "--tension", "0:3:7,3:0:7"]


def test_json_alone_on_standard_output(call):
    code, out, err = call(*LOOP, "--json", "-")
    assert code == 0
    assert out.count("\n") == 1
    document = json.loads(out, parse_constant=pytest.fail)
    assert len(document["steps"]) == 14
    peak = document["steps"][6]
    assert peak["load"] == {"tension_N": [3.0], "stroke_mm": [None]}
    assert peak["closed"] == [True] * 5
    assert peak["total_angle_deg"] == pytest.approx(153.14, abs=0.01)
    assert len(peak["span_tension_N"][0]) == 10
    assert "allowed strain of 8 %" in err


def test_files_and_table_say_the_same(call, tmp_path):
    code, out, _ = call(*LOOP, "--json", "a.json", "--csv", "a.csv", "--plot", "a.png")
    assert code == 0
    steps = json.loads((tmp_path / "a.json").read_text())["steps"]
    rows = list(csv.DictReader((tmp_path / "a.csv").read_text().splitlines()))
    assert [float(row["total_deg"]) for row in rows] == [step["total_angle_deg"] for step in steps]
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert "Pacheco 2021, wrist A" in out
    assert f"{steps[3]['total_angle_deg']:.2f}" in out
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv", "a.json", "a.png"]


def test_what_set_changed_stands_above_the_table_and_in_the_picture(call, tmp_path):
    change = ("--set", "notch.depth=1.38", "--set", "friction.coefficient=0.1")
    _, out, _ = call(*LOOP[:2], "--tension", "0,1", *change, "--plot", "a.svg")
    title = "Pacheco 2021, wrist A with notch.depth = 1.38, friction.coefficient = 0.1"
    assert out.splitlines()[0] == title
    assert title in (tmp_path / "a.svg").read_text(encoding="utf-8")
    assert call("show", LOOP[1], *change)[1].splitlines()[0] == title


def test_named_columns(call, monkeypatch):
    monkeypatch.setenv("COLUMNS", "160")
    _, out, _ = call(*LOOP[:2], "--tension", "0,2", "--columns", "gap, closed,peak_strain")
    (last,) = (line.split() for line in out.splitlines() if line.startswith("   2 "))
    robot = nf.load_robot("pacheco2021-a")
    state = nf.simulate(robot, [nf.Load(tension=0.0), nf.Load(tension=2.0)])[1]
    wanted = [f"{value:.3f}" for value in state.gap]
    wanted += ["yes" if value else "no" for value in state.closed]
    wanted += [f"{100 * value:.2f}" for value in state.peak_strain]
    assert [word.lstrip("-") for word in last[1:]] == [word.lstrip("-") for word in wanted]
    code, out, err = call(*LOOP[:2], "--tension", "1", "--columns", "notch_angel")
    assert (code, out) == (2, "")
    assert "did you mean `notch_angle`" in err


def test_set_changes_the_robot(call):
    _, out, err = call(
        *LOOP[:2],
        "--tension",
        "1",
        "--set",
        "material.kind=linear",
        "--set",
        "friction.kind=frictionless",
        "--json",
        "-",
    )
    document = json.loads(out)
    assert document["robot"]["material"]["kind"] == "linear"
    angles = document["steps"][0]["notch_angle_deg"]
    assert angles == pytest.approx([angles[0]] * 5)
    assert "superelastic_modulus" in err
    assert "dropped" in err


def test_state_is_continued_with_its_friction(call):
    call(*LOOP[:2], "--tension", "0:1:4", "--save-state", "state.json", "--json", "up.json")
    code, out, _ = call(*LOOP[:2], "--tension", "0.6", "--from-state", "state.json", "--json", "-")
    assert code == 0
    continued = json.loads(out)["steps"][0]
    robot = nf.load_robot("pacheco2021-a")
    whole = nf.simulate(robot, [nf.Load(tension=t) for t in (0.0, 1 / 3, 2 / 3, 1.0, 0.6)])
    assert continued["total_angle_deg"] == pytest.approx(
        math.degrees(whole.total_angle[-1]), abs=1e-9
    )
    rest = nf.solve(robot, nf.Load(tension=0.6))
    assert continued["total_angle_deg"] > math.degrees(rest.total_angle) + 0.5


def test_state_of_other_values_is_refused(call, tmp_path):
    call(*LOOP[:2], "--tension", "0:1:4", "--save-state", "state.json")
    go_on = (*LOOP[:2], "--tension", "0.6", "--from-state", "state.json")
    code, out, err = call(*go_on, "--set", "notch.depth=1.38")
    assert (code, out) == (2, "")
    assert "this robot has notch.depth = 1.38 instead of 1.4" in err
    code, _, err = call(*go_on, "--set", "notch[2].depth=1.38")
    assert code == 2
    assert "notch[2].depth = 1.38 instead of 1.4" in err
    # When a strain is warned of has no effect on a state.
    assert call(*go_on, "--set", "material.allowed_strain=0.2")[0] == 0
    content = json.loads((tmp_path / "state.json").read_text(), parse_constant=pytest.fail)
    del content["description"]
    (tmp_path / "state.json").write_text(json.dumps(content))
    code, _, err = call(*go_on)
    assert code == 0
    assert "Warning: state.json was written by an older notchflex" in err
    content["description"] = "name = 3"
    (tmp_path / "state.json").write_text(json.dumps(content))
    code, _, err = call(*go_on)
    assert code == 2
    assert "the description of its robot cannot be read" in err


def test_stroke_past_the_last_closing_is_not_converged(call, tmp_path):
    code, out, err = call("simulate", "pacheco2021-a", "--stroke", "0,3,4", "--json", "a.json")
    assert code == 1
    document = json.loads((tmp_path / "a.json").read_text())
    assert document["converged"] is False
    assert "every notch closed" in document["reason"]
    assert [step["converged"] for step in document["steps"]] == [True, True, False]
    assert "every notch closed" in err
    assert "Error: not converged: step 3 of 3" in err
    assert "4.000" in out


def test_turned_base_turns_the_tip(call):
    _, straight, _ = call(*LOOP[:2], "--tension", "1", "--json", "-")
    _, turned, _ = call(*LOOP[:2], "--tension", "1", "--base-rotation", "0,0,90", "--json", "-")
    x, y, z = json.loads(straight)["steps"][0]["tip_position_mm"]
    assert json.loads(turned)["steps"][0]["tip_position_mm"] == pytest.approx([-y, x, z])


def test_several_tendons(call, tmp_path):
    robot = nf.load_robot("pacheco2021-a")
    tendon = robot.tendon[0]
    opposite = nf.Tendon(0.7, direction_deg=180.0)
    nf.save_robot(robot.replace(tendon=(tendon, opposite)), tmp_path / "two.toml")
    code, out, _ = call(
        "simulate", "two.toml", "--tension", "1=0:1:3", "--tension", "2=0.2", "--json", "-"
    )
    assert code == 0
    steps = json.loads(out)["steps"]
    assert [step["load"]["tension_N"] for step in steps] == [[0.0, 0.2], [0.5, 0.2], [1.0, 0.2]]
    assert len(steps[0]["contacts"]) == 2
    assert call("simulate", "two.toml", "--tension", "2")[0] == 2


@pytest.mark.nightly
def test_loads_and_refinement_reach_the_solver_and_the_head_of_the_table(call, tmp_path):
    code, out, _ = call(
        *LOOP[:2], "--tension", "1", "--tip-force", "-0.05,0,0", "--refinement", "1",
        "--json", "a.json",
    )  # fmt: skip
    assert code == 0
    assert "external loads: tip force (-0.05, 0, 0) N" in out
    step = json.loads((tmp_path / "a.json").read_text())["steps"][0]
    robot = nf.load_robot("pacheco2021-a")
    load = nf.Load(tension=1.0, tip_force=(-0.05, 0, 0))
    state = nf.solve(robot, load, refinement=1)
    assert step["total_angle_deg"] == pytest.approx(math.degrees(state.total_angle), abs=1e-9)
    assert step["moment_error"] == pytest.approx(state.moment_error)
    # The holder takes the force, and what the drive pulls the tendon with.
    assert step["base_force_N"] == pytest.approx([0.05, 0.0, 1.0], abs=1e-6)


@pytest.mark.parametrize(
    ("code", "value"),
    [("OUT_OF_RANGE", "4"), ("OUT_OF_RANGE", "-1"), ("NOT_A_NUMBER", "0.5"), ("NOT_A_NUMBER", "")],
)
def test_refinement_is_a_small_whole_number(refused, code, value):
    refused(code, *LOOP, "--refinement", value)
