"""Values that were probably not meant: what warns, what is refused, what is silent."""

import math
import warnings

import pytest

import notchflex as nf
from notchflex.cli import run
from notchflex.robot import robot_from_text, robot_text
from refusals import refused

WRIST = nf.load_robot("pacheco2021-a")


@pytest.mark.parametrize(
    ("name", "value", "meant"),
    [
        ("material.elastic_modulus", 50.0, 50_000.0),
        ("tube.outer_diameter", 1_900.0, 1.9),
        ("friction.coefficient", 18.0, 0.18),
        ("notch.depth", 0.28, 1.34),
        ("material.density", 6.45, 6450.0),
    ],
)
def test_a_slip_of_the_unit_is_asked_about(name, value, meant):
    with pytest.warns(nf.InputWarning, match="did you mean"):
        robot = WRIST.with_value(name, value)
    (warning,) = robot.warnings
    assert warning.code == "UNLIKELY_VALUE"
    assert warning.name == name.replace("notch.", "notch[1].")
    assert warning.value == value
    assert warning.meant == pytest.approx(meant, rel=1e-12)
    assert f"did you mean {meant:,.6g}" in str(warning)


def test_a_file_in_metres_is_one_question(tmp_path, capsys):
    lengths = ("outer_diameter = 1.62", "inner_diameter = 1.40", "depth = 1.40", "height = 0.8")
    text = robot_text(WRIST)
    for line in (*lengths, "radius = 0.7"):
        key, _, number = line.partition(" = ")
        text = text.replace(f"{key} = {float(number)}", f"{key} = {float(number) / 1e3:.9g}")
    (tmp_path / "metres.toml").write_text(text)
    with pytest.warns(nf.InputWarning) as given:
        robot = nf.load_robot(tmp_path / "metres.toml")
    assert [warning.meant for warning in robot.warnings] == [pytest.approx(1.62)]
    assert len(given) == 1
    assert "so are `tube.inner_diameter` and `notch[1].depth` and 2 more" in str(given[0].message)
    assert run(["show", str(tmp_path / "metres.toml"), "--quiet"]) == 0
    assert "Warning: `tube.outer_diameter` is 0.00162 mm" in capsys.readouterr().err


def test_a_tendon_in_a_thin_wall_is_asked_about_unless_its_diameter_is_given():
    wide = {"tube.outer_diameter": 1.9, "tube.inner_diameter": 1.6}
    (warning,) = WRIST.with_values(wide | {"tendon.radius": 0.9}).warnings
    assert (warning.name, warning.meant) == ("tendon[1].radius", 0.8)
    in_wall = WRIST.with_values(wide | {"tendon.radius": 0.875, "tendon.diameter": 0.1})
    assert in_wall.warnings == ()
    assert robot_from_text(robot_text(in_wall)) == in_wall


@pytest.mark.parametrize("diameter", [0.05, 0.3, 2.0])
def test_a_tendon_across_a_surface_is_refused(diameter):
    """The wrist has the tendon on the surface of its lumen: with any diameter it would cross."""
    with refused("INVALID_ROBOT", "`tendon[1].diameter`", "0.7 mm"):
        WRIST.with_value("tendon.diameter", diameter)
    fits = WRIST.with_values({"tendon.diameter": 0.3, "tendon.radius": 0.55})
    assert fits.warnings == ()


def test_ready_robots_are_silent():
    with warnings.catch_warnings(record=True) as given:
        warnings.simplefilter("always")
        assert all(nf.load_robot(name).warnings == () for name in nf.list_robots())
    assert given == []


def test_set_repairs_an_invalid_file(tmp_path, capsys):
    file = tmp_path / "broken.toml"
    text = robot_text(WRIST).replace("depth = 1.40", "depth = 14.0")
    file.write_text(text)
    assert run(["show", str(file), "--quiet"]) == 2
    assert run(["show", str(file), "--quiet", "--set", "notch.depth=1.4"]) == 0
    capsys.readouterr()
    assert run(["show", str(file), "--set", "notch.height=1"]) == 2
    assert "`notch[1].depth` is 14.0 mm" in capsys.readouterr().err
    file.write_text('name = "x"\nnotch = 3\n')
    assert run(["show", str(file), "--set", "notch.depth=1.4"]) == 2
    assert "`tube` is missing" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("load", "name", "meant"),
    [
        (nf.Load(tension=500.0), "tension", 0.5),
        (nf.Load(stroke=1_200.0), "stroke", 1.2),
        (nf.Load(tension=1.0, tip_force=(300.0, 0.0, 0.0)), "tip_force", 0.3),
        (nf.Load(tension=1.0, tip_mass=60_000.0), "tip_mass", 60.0),
        (nf.Load(tension=1.0, tip_moment=(0.0, 1e4, 0.0)), "tip_moment", 10.0),
        (nf.Load(body_forces=[nf.BodyForce(5, (300.0, 0.0, 0.0))]), "body_forces", 0.3),
        (nf.Load(tension=1.0, gravity=(0.0, 0.0, -9810.0)), "gravity", 9.81),
        (nf.Load(tension=1.0, base_rotation=(0.0, 90.0, 0.0)), "base_rotation", math.pi / 2),
    ],
)
def test_loads_in_another_unit_are_asked_about(load, name, meant):
    with pytest.warns(nf.InputWarning, match="did you mean") as given:
        nf.solve(WRIST, load)
    (message,) = [one.message for one in given]
    assert (message.name, message.meant) == (name, pytest.approx(meant))


def test_new_asks_about_what_remains(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    readings = "--outer-diameter 1.62 --inner-diameter 1.4 --cut on-axis --notches 5 --height .8"
    answers = ["--depth", "0.28", "--uncut-length", "1.2", *readings.split()]
    assert run(["new", "wrist", "--yes", *answers]) == 0
    assert "did you mean 1.34 mm, if 0.28 mm is what remains?" in capsys.readouterr().err
