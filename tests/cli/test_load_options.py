"""Loads on the command line: what `--tension`, `--tip-force` and the others stand for."""

import csv
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import notchflex as nf
from notchflex.cli import run
from notchflex.cli.options import ExternalLoads
from notchflex.support import parse_whole, read_command
from refusals import refused

NUMBERS = st.floats(-100.0, 100.0, allow_nan=False)
WRIST = ("simulate", "pacheco2021-a")


def steps(text):
    """The steps that a word stands for."""
    return read_command("--stroke", True, text).steps


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("2", [2.0]),
        ("0:3:4,3:0:4", [0.0, 1.0, 2.0, 3.0, 3.0, 2.0, 1.0, 0.0]),
        ("1e-3, 2", [0.001, 2.0]),
        ("2:2:1", [2.0]),
        ("0, 1:2:2 ,5", [0.0, 1.0, 2.0, 5.0]),
    ],
)
def test_values_and_ranges(text, values):
    assert steps(text) == values


@given(st.lists(NUMBERS, min_size=1, max_size=8), NUMBERS, NUMBERS, st.integers(2, 50))
def test_any_numbers_read_back_and_ranges_have_their_ends(values, start, stop, count):
    assert steps(",".join(map(repr, values))) == values
    series = steps(f"{start}:{stop}:{count}")
    assert (len(series), series[0], series[-1]) == (count, start, stop)


@given(st.integers())
def test_whole_numbers_read_back_within_their_range(value):
    if -5 <= value <= 7:
        assert parse_whole(-5, 7)(str(value)) == value
    else:
        with pytest.raises(nf.InputError):
            parse_whole(-5, 7)(str(value))


def test_all_options_reach_every_step_and_the_head_of_the_table(call, tmp_path):
    code, out, _ = call(
        *WRIST, "--tension", "0:1:3", "--tip-force", "0,-0.01,0", "--tip-moment", "0.1,0.2,0.3",
        "--tip-point", "0, 0, 1.5", "--body-force", "1:0,0,0.1", "--body-force",
        "2:-1e-2,0,0@0.8,0,0.5", "--tip-mass", "2", "--gravity", "0,0,9.81", "--following",
        "--base-rotation", "-90,0,45", "--json", "a.json",
    )  # fmt: skip
    assert code == 0
    load = nf.pull(0.0, 1.0, 3)
    load = nf.LoadPath(load.tension, load.stroke, np.radians([-90.0, 0.0, 45.0])).loaded(
        tip_force=(0, -0.01, 0),
        tip_moment=(0.1, 0.2, 0.3),
        tip_point=(0, 0, 1.5),
        body_forces=[
            nf.BodyForce(1, (0, 0, 0.1), following=True),
            nf.BodyForce(2, (-0.01, 0, 0), point=(0.8, 0, 0.5), following=True),
        ],
        tip_mass=2,
        gravity=(0, 0, 9.81),
        following=True,
    )
    path = nf.simulate(nf.load_robot("pacheco2021-a"), load)
    written = [
        step["tip_position_mm"] for step in json.loads((tmp_path / "a.json").read_text())["steps"]
    ]
    np.testing.assert_allclose(written, path.tip_position, atol=1e-12)
    head = " ".join(out.split("\nstep")[0].split())
    for words in (
        "tip force (0, -0.01, 0) N at (0, 0, 1.5) mm from the tip",
        "tip moment (0.1, 0.2, 0.3) N mm",
        "tip mass 2 g, gravity (0, 0, 9.81) m/s²",
        "force (-0.01, 0, 0) N on body 2 at (0.8, 0, 0.5) mm following it",
    ):
        assert words in head
    assert max(map(len, out.split("\nstep")[0].splitlines())) <= 80


def test_loads_without_tendons_are_one_step_of_slack_tendons(call):
    code, out, _ = call(*WRIST, "--tip-force", "-0.01,0,0", "--json", "-")
    (step,) = json.loads(out)["steps"]
    assert code == 0
    assert step["load"]["tension_N"] == [None]
    assert step["tendon_tension_N"] == [0.0]


def test_following_alone_with_body_forces_leaves_the_tip_as_it_is(call):
    options = ("--tension", "1", "--body-force", "1:0,0,0.1", "--following", "--json", "-")
    load = json.loads(call(*WRIST, *options)[1])["steps"][0]["load"]
    assert load["following"] is False
    assert load["body_forces"][0]["following"] is True


def test_a_temperature_for_all_steps_or_for_each(capsys):
    known = ["--set", "material.reference_temperature=22", "--json", "-"]
    loads = ["--tension", "1", "--temperature", "22:37:2"]
    assert run(["simulate", "pacheco2021-a-true", *loads, *known]) == 0
    found = json.loads(capsys.readouterr().out)["steps"]
    assert [step["load"]["temperature_C"] for step in found] == [22.0, 37.0]
    robot = nf.load_robot("pacheco2021-a-true").with_value("material.reference_temperature", 22.0)
    path = nf.simulate(robot, [nf.Load(1.0, temperature=one) for one in (22.0, 37.0)])
    angles = [step["total_angle_deg"] for step in found]
    assert angles == pytest.approx(np.degrees(path.total_angle).tolist(), abs=1e-12)
    options = ["--tension", "0:1:3", "--temperature"]
    assert run(["simulate", "pacheco2021-a-true", *options, "37", *known]) == 0
    assert run(["simulate", "pacheco2021-a-true", *options, "20,37", *known]) == 2
    assert "2 temperatures for 3 steps" in capsys.readouterr().err
    assert run(["simulate", "pacheco2021-a-true", *options, "37"]) == 2
    assert "reference_temperature" in capsys.readouterr().err


def test_a_path_that_varies_temperature_or_bend_has_their_columns(tmp_path, capsys):
    known = ["--set", "material.reference_temperature=22", "--csv", str(tmp_path / "path.csv")]
    loads = ["--tension", "1", "--temperature", "22:37:2"]
    assert run(["simulate", "pacheco2021-a-true", *loads, *known]) == 0
    out = capsys.readouterr().out
    assert "external loads of step 1: temperature 22 °C" in out
    rows = (line.split() for line in out.splitlines())
    assert [row[1] for row in rows if row[:1] in (["1"], ["2"])][:2] == ["22", "37"]
    with open(tmp_path / "path.csv", encoding="utf-8") as file:
        rows = [*csv.DictReader(file)]
    assert [float(row["temperature_C"]) for row in rows] == [22.0, 37.0]
    wrist = nf.load_robot("pacheco2021-a").with_values(
        {"tendon.sheath_length": 500.0, "tendon.sheath_wire_stiffness": 1e4}
    )
    path = nf.simulate(wrist, [nf.Load(1.0), nf.Load(1.0, sheath_bend_deg=90.0)])
    assert path.sheath_bend == pytest.approx([np.nan, np.pi / 2.0], nan_ok=True, rel=1e-15)
    table = path.to_dataframe()
    assert table["sheath_bend_deg"].to_list() == [None, pytest.approx(90.0, rel=1e-14)]
    assert "temperature_C" not in table.columns
    assert "sheath_bend_deg" not in nf.simulate(wrist, nf.Load(1.0)).to_dataframe().columns


def test_a_search_has_one_temperature(capsys):
    assert ExternalLoads(temperature=[37.0]).arguments()["temperature"] == 37.0
    options = ["--states", "60", "--tension", "1", "--temperature", "22,37"]
    assert run(["workspace", "pacheco2021-a-true", *options]) == 2
    assert "temperature must be a number of deg C" in capsys.readouterr().err


def test_a_bend_without_a_sheath_is_refused(capsys):
    options = ["--tension", "1", "--sheath-bend-deg", "90"]
    assert run(["simulate", "pacheco2021-a", *options]) == 2
    message = capsys.readouterr().err
    assert "no effect" in message
    assert "tendon.sheath_length" in message
    with refused("OUT_OF_RANGE", "at most 3600 deg"):
        nf.Load(1.0, sheath_bend_deg=1e9)
    with refused("UNSUPPORTED", "sheath"):
        nf.solve(nf.load_robot("pacheco2021-a"), nf.Load(1.0, sheath_bend_deg=10.0))
