"""Batches of robots that differ by a few numbers, against the same robots made one by one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import notchflex as nf
from notchflex.analysis import batch as varied
from notchflex.analysis.draws import (
    sources_of,
    tolerances_of,
    values_at,
)
from notchflex.robot.numbers import VariedRobots
from notchflex.solver.programs import assembled
from refusals import refused

WRIST = nf.load_robot("pacheco2021-a")
RANDOM = np.random.default_rng(5)
OUTPUTS = ("total_angle", "notch_angle", "tip_position", "peak_strain", "tension", "converged")


def some(robot, widths, count):
    return VariedRobots(
        robot,
        {
            name: robot_value + width * RANDOM.uniform(-1.0, 1.0, count)
            for name, (robot_value, width) in widths.items()
        },
    )


@pytest.mark.parametrize(
    ("name", "widths", "path", "exactness"),
    [
        (
            "pacheco2021-a",
            {"notch.depth": (1.4, 0.01), "tube.inner_diameter": (1.4, 0.01),
             "material.elastic_modulus": (1e4, 500.0), "friction.coefficient": (0.13, 0.02)},
            nf.pull(0.5, 1.0, steps=2).release(), 1e-12,
        ),
        (
            "pacheco2021-a",
            {f"notch[{n}].depth": (1.4, 0.005) for n in range(1, 6)}
            | {"notch.height": (0.8, 0.01)},
            nf.pull(0.5, 1.0, steps=2).loaded(tip_force=(0.01, 0.005, 0.0)), 1e-11,
        ),
        (
            "two-axis-wrist",
            {"notch.height": (0.5, 0.01), "tendon.radius": (0.7, 0.005)},
            nf.LoadPath(tension=[[0.5, 0.2, 0.0, 0.0]], stroke=[[np.nan] * 4]), 1e-11,
        ),
    ],
)  # fmt: skip
def test_rows_are_those_of_the_robots(name, widths, path, exactness):
    robot = nf.load_robot(name)
    if name == "two-axis-wrist":
        widths = {"notch.height": (robot.notches[0].height, 0.005),
                  "material.elastic_modulus": (robot.material.elastic_modulus, 500.0)}  # fmt: skip
        tensions = [[0.5, 0.2, 0.0, 0.0][: robot.number_of_tendons]]
        path = nf.LoadPath(tension=tensions, stroke=[[np.nan] * robot.number_of_tendons])
    robots = some(robot, widths, 1200)
    found = nf.simulate_batch(robots, path, outputs=OUTPUTS)
    assert varied.varied_chains(robots, path, 0) is not None
    rows = [0, 7, 1199]
    exact = nf.simulate_batch([robots[row] for row in rows], path, outputs=OUTPUTS)
    for name in OUTPUTS:
        size = np.abs(exact[name]).max()
        np.testing.assert_allclose(found[name][rows], exact[name], rtol=0.0, atol=exactness * size)


def test_rows_of_notches_with_elastic_ends_are_those_of_the_robots():
    notch = replace(WRIST.notch[0], ends="shell")
    widths = {"notch.depth": (1.4, 0.02), "notch.height": (0.8, 0.02),
              "tube.inner_diameter": (1.4, 0.02)}  # fmt: skip
    robots = some(WRIST.replace(notch=(notch,)), widths, 3000)
    load, outputs = nf.Load(tension=0.5), ("total_angle", "tip_position")
    found = nf.solve_batch(robots, load, outputs=outputs)
    rows = [3, 1500, 2999]
    exact = nf.solve_batch([robots[row] for row in rows], load, outputs=outputs)
    for name in outputs:
        size = np.abs(exact[name]).max()
        np.testing.assert_allclose(found[name][rows], exact[name], rtol=0.0, atol=1e-11 * size)


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["pacheco2021-a-true", "pacheco2021-b-true"])
def test_assumed_tolerances_of_wrists_with_elastic_ends_need_no_robot_for_each_row(name):
    """Up to a quarter of the wall: a thousand robots were assembled one by one."""
    robot, load = nf.load_robot(name), nf.pull(0.5, 0.9, steps=2)
    exact_robot = robot.replace(tolerance=None)
    sources = sources_of(exact_robot, tolerances_of(robot)[0])
    levels = np.random.default_rng(1).uniform(1e-6, 1.0 - 1e-6, (2600, len(sources)))
    robots = VariedRobots(exact_robot, values_at(sources, levels))
    assert varied.varied_chains(robots, load, 0) is not None
    outputs = ("total_angle", "tip_position", "peak_strain")
    found = nf.simulate_batch(robots, load, outputs=outputs)
    rows = [0, 7, 800, 1500, 2599]
    exact = nf.simulate_batch([robots[row] for row in rows], load, outputs=outputs)
    for name in outputs:
        size = np.abs(exact[name]).max()
        np.testing.assert_allclose(found[name][rows], exact[name], rtol=0.0, atol=1e-11 * size)


def test_formulas_that_cannot_be_traced_are_told(monkeypatch):
    """Then robots are assembled one by one."""
    flexure = assembled.flexure
    monkeypatch.setattr(
        assembled, "flexure", lambda notch, *rest: flexure(notch, *rest) if notch.depth > 0.0 else 0
    )
    robots = some(WRIST.with_value("notch.direction_deg", 12.34), {"notch.depth": (1.4, 0.01)}, 256)
    load = nf.Load(tension=1.0)
    with pytest.warns(RuntimeWarning, match="JAX cannot trace"):
        batch = nf.solve_batch(robots, load)
    assert batch["total_angle"][3] == nf.solve_batch(robots[3], load)["total_angle"][0]


def test_few_robots_are_made_one_by_one():
    robots = some(WRIST, {"notch.depth": (1.4, 0.01)}, 8)
    load = nf.Load(tension=1.0)
    assert varied.varied_chains(robots, nf.pull(1.0, 1.0, steps=1), 0) is None
    found = nf.solve_batch(robots, load)
    assert found["total_angle"][3] == nf.solve_batch(robots[3], load)["total_angle"][0]


def same_as_single_robots(robots, load, rows, outputs=("total_angle", "tip_position")):
    batch = nf.solve_batch(robots, load, outputs=outputs)
    for row in rows:
        state = nf.solve(robots[row], load)
        for name in outputs:
            exact = state.quantity(name)
            np.testing.assert_allclose(batch[name][row], exact, atol=1e-11 * np.abs(exact).max())


def test_a_kink_within_the_range():
    # Past the tube axis the farthest fibre is another one.
    robots = some(WRIST, {"notch.depth": (0.81, 0.2)}, 300)
    same_as_single_robots(robots, nf.Load(tension=1.0), range(0, 300, 60))


@pytest.mark.nightly
def test_robots_whose_arrays_are_of_another_form_are_solved_one_by_one():
    """A cut beyond the bore leaves a section of two pieces, one before it of three."""
    nitinol = {"kind": "nitinol", "elastic_modulus": 36e3, "plateau_stress": 350.0,
               "plateau_modulus": 6e3}  # fmt: skip
    robot = WRIST.with_values({"notch.cut": "off-axis", "notch[2].depth": 0.11})
    robots = some(robot.replace(material=nitinol), {"notch[2].depth": (0.11, 0.02)}, 260)
    load = nf.LoadPath([[0.3]])
    chains = varied.varied_chains(robots, load, 0)
    assert 0 < len(chains.rows(slice(None))[2]) < 260
    same_as_single_robots(robots, load[0], range(0, 260, 26))


def test_numbers_that_make_no_robot_are_found():
    depths = [1.4, 1.7, 1.3]  # of 1.62
    assert VariedRobots(WRIST, {"notch.depth": depths}).valid().tolist() == [True, False, True]
    corner = VariedRobots(WRIST, {"notch[2].depth": depths[::2], "tube.inner_diameter": [1.3, 1.4]})
    assert corner.valid().all()


def test_numbers_that_cannot_be_varied():
    with refused("UNKNOWN_NAME"):
        VariedRobots(WRIST, {"notch.dept": [1.0]})
    with refused("WRONG_SHAPE"):
        VariedRobots(WRIST, {"notch.depth": [1.4, 1.39], "notch.height": [0.8]})


def test_factors_on_stiffness_beside_another_number():
    """The robot has a factor of its own as well."""
    robot = WRIST.with_value("notch[3].stiffness_factor", 1.2)
    generator = np.random.default_rng(3)
    values = {
        "notch.depth": generator.uniform(1.38, 1.42, 600),
        "notch[1].stiffness_factor": generator.uniform(0.9, 1.1, 600),
        "notch[5].stiffness_factor": generator.uniform(0.9, 1.1, 600),
    }
    load, outputs = nf.Load(tension=1.0), ("notch_angle", "peak_strain")
    robots = VariedRobots(robot, values)
    assert varied.varied_chains(robots, nf.LoadPath([[1.0]]), 0) is not None
    same_as_single_robots(robots, load, (0, 300, 599), outputs)
