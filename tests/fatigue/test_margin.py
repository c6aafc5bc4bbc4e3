"""The margin as a quantity: slopes, batches, files, designs, tolerances, sweeps, the verb."""

import json

import numpy as np
import pytest

import notchflex as nf
from notchflex.cli import run
from refusals import refused

WRIST = nf.load_robot("pacheco2021-a-true").with_value("fatigue.line", "cao2020")


def worst_of(robot, tension):
    return nf.solve(robot, nf.Load(tension)).fatigue_margin.min()


@pytest.mark.parametrize("robot", [WRIST, WRIST.with_value("fatigue.corner_factor", 1.4)])
def test_slopes_are_those_of_differences(robot):
    names = ["notch.depth", "material.plateau_stress", "tube.inner_diameter"]
    state = nf.simulate(robot, [nf.Load(0.7)])
    slope = state.jacobian(names, ("fatigue_margin",))["fatigue_margin"][0, :, :]
    for column, name in enumerate(names):
        value = nf.support.number_at(robot, name)
        moved = [
            nf.solve(robot.with_value(name, value * (1.0 + part)), nf.Load(0.7)).fatigue_margin
            for part in (1e-5, -1e-5)
        ]
        differences = (moved[0] - moved[1]) / (2e-5 * value)
        assert slope[:, column] == pytest.approx(differences, rel=1e-4)


def test_rows_of_a_batch_and_files_have_it(tmp_path):
    path = nf.simulate(WRIST, nf.pull(0.0, 1.0, steps=3))
    depths = np.array([1.38, 1.4, 1.41])
    rows = nf.batch(WRIST, {"notch.depth": depths}, path.load, outputs=("fatigue_margin",))
    assert rows["fatigue_margin"][1] == pytest.approx(path.fatigue_margin, abs=1e-10)
    assert path.fatigue_margin[0] == pytest.approx(0.0055, abs=1e-15)
    nf.save_path(path, tmp_path / "path.json")
    again = nf.read_path(tmp_path / "path.json")
    assert again.fatigue_margin == pytest.approx(path.fatigue_margin, abs=0.0)
    plain = nf.simulate(nf.load_robot("pacheco2021-a-true"), path.load)
    assert np.isnan(plain.fatigue_margin).all()
    assert "fatigue_margin" not in json.dumps(plain[2].to_dict())


def test_a_design_stays_under_the_line(tmp_path):
    nf.save_robot(WRIST, tmp_path / "wrist.toml")
    spec = nf.DesignSpec(
        name="to the line",
        robot=str(tmp_path / "wrist.toml"),
        variable=[{"value": "load.pulled.tension", "lower": 0.2, "upper": 1.0}],
        load={"pulled": {"tension": 0.3}},
        objective=[{"quantity": "total_angle", "load": "pulled", "goal": "maximise"}],
        constraint=[{"quantity": "fatigue_margin", "load": "pulled", "lower": 0.0}],
        search={"starts": 1, "candidates": 4},
    )
    found = nf.design(spec)
    state = found.path[-1]
    assert state.fatigue_margin.min() == pytest.approx(0.0, abs=1e-6)
    # At the line of Cao, straight up to 3 %, a cycle from rest has this strain.
    assert state.peak_strain.max() == pytest.approx(0.0055 / (1.0 + 0.39 / 3.0) * 2.0, rel=1e-4)


CORNERED = WRIST.with_value("fatigue.corner_radius", 0.05)
"""Its corners are known; those of a cut of 1 mm are too shallow for their law."""


@pytest.mark.parametrize("others", [(1.2, 1.38), (1.01, 1.05)])
def test_a_row_of_a_sweep_is_rejected_where_a_limited_margin_is_not_known(others, tmp_path):
    nf.save_robot(CORNERED, tmp_path / "wrist.toml")
    plan = {
        "robot": str(tmp_path / "wrist.toml"),
        "variable": [{"value": "notch[2].depth", "values": [1.0, *others]}],
        "load": {"pulled": {"tension": 0.1}},
        "keep": [{"quantity": "fatigue_margin", "lower": -0.01}, {"quantity": "total_angle"}],
    }
    rows = nf.sweep(plan, tmp_path / "limited").lazy().collect()
    assert rows["code"].to_list() == ["rejected" if d < 1.1 else "accepted" for d in (1.0, *others)]
    columns = [f"fatigue_margin_{notch}" for notch in range(1, 6)]
    assert [rows[0, name] is None for name in columns] == [n == 2 for n in range(1, 6)]
    plan["keep"] = [{"quantity": "fatigue_margin"}]
    assert set(nf.sweep(plan, tmp_path / "kept").lazy().collect()["code"]) == {"accepted"}


def test_a_limit_on_a_margin_that_is_not_known_is_not_met(tmp_path):
    shallow, load = CORNERED.with_value("notch[2].depth", 1.0), {"pulled": nf.Load(0.1)}
    limit = nf.AcceptanceLimit("fatigue_margin", lower=-0.01)
    with refused("NOT_FINITE", "fatigue_margin[2]"):
        nf.tolerance_analysis(shallow, nf.ToleranceSpec([limit], load), draws=50)
    limits = {"fatigue_margin": (-0.01, None)}
    with refused("NOT_FINITE", "fatigue_margin[2]"):
        nf.workspace(shallow, states=32, tension=0.1, limits=limits)
    assert nf.workspace(CORNERED, states=32, tension=0.1, limits=limits).beyond == 0
    line = WRIST.with_value("fatigue.line", "pelton2003")  # not known beyond a mean of 1.5 %
    found = nf.workspace(line, states=32, tension=2.0, limits={"fatigue_margin": (-1.0, None)})
    assert 0.5 * found.strain.max() < 0.015
    assert len(found) > 0
    with refused("UNSUPPORTED", "base_tension"):
        nf.workspace(CORNERED, states=32, tension=0.1, limits={"base_tension": 1.0})
    nf.save_robot(shallow, tmp_path / "wrist.toml")
    spec = nf.DesignSpec(
        name="not known",
        robot=str(tmp_path / "wrist.toml"),
        variable=[{"value": "notch[1].depth", "lower": 1.3, "upper": 1.4}],
        load={"pulled": {"tension": 0.1}},
        objective=[{"quantity": "total_angle", "load": "pulled", "goal": "maximise"}],
        constraint=[{"quantity": "fatigue_margin", "load": "pulled", "lower": -0.01}],
        search={"starts": 1, "candidates": 4},
    )
    with refused("UNSUPPORTED", "notch 2 is not a number"):
        nf.design(spec)


def test_the_verb_writes_what_python_finds(tmp_path, capsys):
    options = ["--tension", "0:0.5:3,0.5:0:3", "--set", "fatigue.line=cao2020", "--json", "-"]
    assert run(["fatigue", "pacheco2021-a-true", *options, "--csv", str(tmp_path / "a.csv")]) == 0
    document = json.loads(capsys.readouterr().out)
    cycle = nf.strain_cycle(nf.simulate(WRIST, nf.pull(0.0, 0.5, steps=3).release()))
    margins = [row["margin_%"] for row in document["notches"]]
    assert margins == pytest.approx((100.0 * cycle.smallest_margin).tolist(), rel=1e-12)
    lines = (tmp_path / "a.csv").read_text(encoding="utf-8").splitlines()
    assert len(lines) == 1 + cycle.mean.size
    assert run(["fatigue", "pacheco2021-a", "--tension", "0:0.5:2"]) == 0
    assert "no limit line" in capsys.readouterr().err
    assert run(["fatigue", "pacheco2021-a"]) == 2
