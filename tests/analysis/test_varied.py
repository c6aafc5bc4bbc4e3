"""Batches of robots and loads with numbers of their own, against the same rows one by one."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

import notchflex as nf
from notchflex.analysis import varied
from notchflex.errors import ErrorCode
from refusals import refused

WRIST = nf.load_robot("pacheco2021-a")
RANDOM = np.random.default_rng(5)
OUTPUTS = ("total_angle", "notch_angle", "tip_position", "peak_strain", "tension", "converged")


def some(widths, count):
    return {
        name: middle + width * RANDOM.uniform(-1.0, 1.0, count)
        for name, (middle, width) in widths.items()
    }


def robot_at(robot, values, row):
    return robot.with_values({name: each[row] for name, each in values.items()})


def same_as_single_rows(found, robots, loads, exactness=1e-11):
    """Compare some rows with paths of their own: robots and loads by number of the row."""
    for row, robot in robots.items():
        alone = nf.simulate(robot, loads[row] if isinstance(loads, dict) else loads)
        for name in set(found) - {"iterations"}:
            exact = alone.quantity(name).reshape(found[name][row].shape)
            size = np.abs(exact).max()
            np.testing.assert_allclose(found[name][row], exact, rtol=0.0, atol=exactness * size)


@pytest.fixture
def compiled(monkeypatch):
    """Which batches of robots were assembled by programs."""
    made, chains_of = [], varied.RobotForm.chains

    def told(self, *arguments):
        chains = chains_of(self, *arguments)
        if chains is None:
            return None

        def packed(numbers):
            rows, alike = chains.packed(numbers)
            made.append(alike)
            return rows, alike

        return replace(chains, packed=packed)

    monkeypatch.setattr(varied.RobotForm, "chains", told)
    return made


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
            {"notch.height": (1.0, 0.005), "material.elastic_modulus": (1e4, 500.0)},
            nf.LoadPath(tension=[[0.5, 0.2, 0.0, 0.0]]), 1e-11,
        ),
    ],
)  # fmt: skip
def test_rows_are_those_of_the_robots(name, widths, path, exactness, compiled):
    robot = nf.load_robot(name)
    values = some(widths, 1200)
    found = nf.batch(robot, values, path, outputs=OUTPUTS)
    assert sum(map(len, compiled)) == 1200
    assert all(alike.all() for alike in compiled)
    robots = {row: robot_at(robot, values, row) for row in (0, 7, 1199)}
    same_as_single_rows(found, robots, path, exactness)


def test_rows_of_notches_with_elastic_ends_are_those_of_the_robots():
    notch = replace(WRIST.notch[0], ends="shell")
    widths = {"notch.depth": (1.4, 0.02), "notch.height": (0.8, 0.02),
              "tube.inner_diameter": (1.4, 0.02)}  # fmt: skip
    robot, values = WRIST.replace(notch=(notch,)), some(widths, 3000)
    load = nf.Load(tension=0.5)
    found = nf.batch(robot, values, load, outputs=OUTPUTS)
    robots = {row: robot_at(robot, values, row) for row in (3, 1500, 2999)}
    same_as_single_rows(found, robots, load)


def test_a_kink_within_the_range():
    # Past the tube axis the farthest fibre is another one.
    values, load = some({"notch.depth": (0.81, 0.2)}, 300), nf.Load(tension=1.0)
    found = nf.batch(WRIST, values, load)
    robots = {row: robot_at(WRIST, values, row) for row in range(0, 300, 60)}
    same_as_single_rows(found, robots, load)


@pytest.mark.nightly
def test_robots_whose_arrays_are_of_another_form_are_solved_one_by_one(compiled):
    """A ring of no length has no compliance."""
    robot = nf.load_robot("pacheco2021-a-true")
    lengths = np.where(np.arange(260) % 3 == 0, 0.0, 1.2)
    values, load = {"notch[2].uncut_length": lengths}, nf.Load(tension=0.3)
    found = nf.batch(robot, values, load, outputs=OUTPUTS)
    assert 0 < sum((~alike).sum() for alike in compiled) < 260
    robots = {row: robot_at(robot, values, row) for row in range(0, 260, 26)}
    same_as_single_rows(found, robots, load)


def test_factors_on_stiffness_beside_another_number(compiled):
    """The robot has a factor of its own as well."""
    robot = WRIST.with_value("notch[3].stiffness_factor", 1.2)
    widths = {"notch.depth": (1.4, 0.02), "notch[1].stiffness_factor": (1.0, 0.1),
              "notch[5].stiffness_factor": (1.0, 0.1)}  # fmt: skip
    values, load = some(widths, 600), nf.Load(tension=1.0)
    found = nf.batch(robot, values, load, outputs=OUTPUTS)
    assert compiled
    robots = {row: robot_at(robot, values, row) for row in (0, 300, 599)}
    same_as_single_rows(found, robots, load)


LOADED = {
    "tension": np.linspace(0.2, 1.0, 9),
    "tip_force": np.array([[0.0, 0.0, 0.0], [0.01, 0.0, -0.02], [0.0, 0.01, 0.0]] * 3),
    "tip_moment": np.array([[0.0, 0.05, 0.0]] * 3 + [[0.0] * 3] * 3 + [[0.02, 0.0, 0.01]] * 3),
}


def loads_at(values, row, base=(0.0, 0.0, 0.0), **others):
    """One step, with tensions and loads of a row."""
    at = {name: values[name][row] for name in ("tip_force", "tip_moment")}
    load = nf.LoadPath([[values["tension"][row]]], base_rotation=base)
    return load.loaded(**at, **others)


@pytest.mark.parametrize(
    ("base", "others"),
    [
        ((0.0, 0.0, 0.0), {}),
        pytest.param(
            (0.3, -0.2, 0.1),
            {
                "following": True,
                "tip_mass": 2.0,
                "body_forces": [nf.BodyForce(2, (0.01, 0.0, 0.0))],
            },
            marks=pytest.mark.nightly,
        ),
    ],
)
def test_numbers_of_loads(base, others):
    """None, in the plane and across it: each row has the strain modes that its own loads need."""
    load = nf.Load(tension=1.0, base_rotation=base, **others)
    found = nf.batch(WRIST, LOADED, load, outputs=OUTPUTS)
    loads = {row: loads_at(LOADED, row, base, **others) for row in range(9)}
    same_as_single_rows(found, dict.fromkeys(range(9), WRIST), loads, 1e-12)


def test_numbers_of_many_robots_and_their_loads(compiled):
    values = some({"notch[2].depth": (1.4, 0.01), "tube.inner_diameter": (1.4, 0.01)}, 900)
    of_loads = {name: np.tile(each.T, 100).T for name, each in LOADED.items()}
    load = nf.Load(tension=1.0, base_rotation=(0.0, 0.0, 0.2), tip_mass=1.0)
    found = nf.batch(WRIST, values | of_loads, load, outputs=OUTPUTS)
    assert sum(map(len, compiled)) == 800  # those in the plane are few
    rows = [*range(0, 9), *range(450, 459)]
    robots = {row: robot_at(WRIST, values, row) for row in rows}
    loads = {row: loads_at(of_loads, row, (0.0, 0.0, 0.2), tip_mass=1.0) for row in rows}
    same_as_single_rows(found, robots, loads)


def test_steps_and_tendons_of_loads():
    """A number is that of all tendons which the loads command, or each step has its own."""
    robot = nf.load_robot("two-axis-wrist")
    tendons = robot.number_of_tendons
    path = nf.LoadPath([[0.5, *[None] * (tendons - 1)]] * 2)
    tension = np.zeros((2, 2, tendons))
    tension[..., 0] = [[0.2, 0.4], [0.3, 0.1]]
    found = nf.batch(robot, {"tension": tension}, path, outputs=OUTPUTS)
    assert found["tension"][..., 0].tolist() == pytest.approx(tension[..., 0], rel=1e-12)
    same = nf.batch(robot, {"tension": [0.2, 0.3]}, path, outputs=OUTPUTS)
    assert same["tension"][:, 0, 0] == pytest.approx([0.2, 0.3], rel=1e-12)
    assert (same["tension"][..., 1:] == 0.0).all()


def test_all_combinations():
    """Robots, then names in their order, then loads, of which the last are the fastest."""
    robots = [WRIST, nf.load_robot("pacheco2021-b")]
    paths = [nf.pull(0.0, top, steps=2).release() for top in (0.4, 0.8, 1.2)]
    values = {"tip_force": [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]], "notch.height": [0.7, 0.8]}
    found = nf.batch(robots, values, paths, outputs=OUTPUTS, product=True)["total_angle"]
    assert found.shape == (24, 4)
    grid = found.reshape(2, 2, 2, 3, 4)
    for a, b, c, d in np.ndindex(grid.shape[:-1]):
        robot = robots[a].with_value("notch.height", values["notch.height"][c])
        alone = nf.simulate(robot, paths[d].loaded(tip_force=values["tip_force"][b]))
        np.testing.assert_allclose(grid[a, b, c, d], alone.total_angle, atol=1e-12)


def test_lists_of_robots_of_one_form(compiled):
    """Others among them are assembled alone."""
    values = some({"notch[2].depth": (1.4, 0.01), "friction.coefficient": (0.13, 0.02)}, 300)
    robots = [robot_at(WRIST, values, row) for row in range(300)]
    robots[7] = nf.load_robot("pacheco2021-b")
    robots[8] = WRIST
    path = nf.pull(0.3, 0.6, steps=2).release()
    found = nf.simulate_batch(robots, path)
    assert sum(map(len, compiled)) == 298
    some_rows = {row: robots[row] for row in (0, 7, 8, 299)}
    same_as_single_rows(found, some_rows, path)
    varied_too = nf.batch(robots[:9], {"notch.height": np.linspace(0.7, 0.8, 9)}, path)
    robots = {row: robots[row].with_value("notch.height", 0.7 + row / 80) for row in (0, 7, 8)}
    same_as_single_rows(varied_too, robots, path)


def test_neither_order_nor_pieces_matter():
    """To the last bit."""
    values = some({"notch.depth": (1.4, 0.01), "tip_force": (0.0, 0.0)}, 700)
    values["tip_force"] = RANDOM.normal(0.0, 0.01, (700, 3))
    load, order = nf.Load(tension=0.8), RANDOM.permutation(700)
    found = nf.batch(WRIST, values, load, cores=1)
    other = nf.batch(WRIST, {name: each[order] for name, each in values.items()}, load, cores=3)
    part = nf.batch(WRIST, {name: each[100:400] for name, each in values.items()}, load)
    for name in set(found) - {"iterations"}:
        np.testing.assert_array_equal(found[name][order], other[name])
        np.testing.assert_array_equal(found[name][100:400], part[name])


def test_rows_without_a_robot_are_told():
    seen: list[tuple[int, int]] = []
    values = {"notch.depth": [1.4, 1.7, 1.3], "stroke": [50.0, 1.0, 1.0]}  # of 1.62
    found = nf.batch(WRIST, values, nf.Load(stroke=1.0), progress=lambda *told: seen.append(told))
    assert found.valid.tolist() == [True, False, True]
    assert found["converged"].tolist() == [False, False, True]
    assert np.isnan(found["notch_angle"][:2]).all()
    assert found.reason.shape == (3,)
    assert found.reason[0] == nf.solve(WRIST, nf.Load(stroke=50.0)).reason
    assert found.reason[1].startswith("`notch[1].depth` is 1.7 mm")
    assert found.reason[2] == ""
    assert seen[-1] == (3, 3)
    with pytest.raises(nf.ConvergenceError, match="row 1 of 3: every notch closed") as problem:
        found.raise_if_failed()
    assert str(problem.value.code) == "NOTCHES_CLOSED"
    assert found.path(2).total_angle[0] == pytest.approx(found["total_angle"][2], rel=1e-12)
    with refused("INVALID_ROBOT", "1.7"):
        found.path(1)
    assert pickle.loads(pickle.dumps(found)).reason.tolist() == found.reason.tolist()


def test_reasons_of_steps():
    """Those after a failure are not tried."""
    path = nf.stroke_path(0.0, 8.0, steps=5)
    found = nf.batch([WRIST, WRIST.with_value("notch.depth", 1.39)], {}, path)
    alone = nf.simulate(WRIST, path)
    assert found["converged"][0].tolist() == alone.converged.tolist()
    assert not alone.converged.all()
    assert found.reason[0].tolist() == alone.reason
    with pytest.raises(nf.ConvergenceError, match="row 1 of 2, step 3: every"):
        found.raise_if_failed()
    nothing = nf.batch(WRIST, {}, path[:2])
    assert nothing.raise_if_failed() is nothing
    assert nothing.reason.tolist() == [["", ""]]
    with refused("NO_DATA", "without robots"):
        nf.Batch({"converged": np.zeros(1, bool)}).path(0)


@pytest.mark.parametrize(
    ("values", "code", "said"),
    [
        ({"notch.dept": [1.0]}, "UNKNOWN_NAME", "depth"),
        ({"robots": [1.0, 2.0]}, "UNKNOWN_NAME", "`robots` is no number"),
        ({"notch.depth": [1.4, 1.39], "notch.height": [0.8] * 3}, "WRONG_SHAPE", "2 notch.depth"),
        ({"notch.depth": []}, "WRONG_SHAPE", "0 notch.depth"),
        ({"notch.depth": 1.4}, "WRONG_SHAPE", "one for each row"),
        ({"notch.depth": ["deep"]}, "WRONG_SHAPE", "one for each row"),
        ({"notch.depth": [[1.4]]}, "WRONG_SHAPE", "one for each row"),
        ({"notch.depth": [1.7, np.inf]}, "INVALID_ROBOT", "1.7"),
        ({"stroke": [1.0]}, "NO_DATA", "no stroke"),
        ({"tension": [-1.0, 1.0]}, "OUT_OF_RANGE", "-1 N"),
        ({"tension": [np.nan]}, "NOT_FINITE", "tension"),
        ({"tension": [[1.0, 2.0]]}, "WRONG_SHAPE", "(1, 2)"),
        ({"tip_force": [0.0, 0.0, 1.0]}, "WRONG_SHAPE", "rows by 3"),
    ],
)
def test_what_cannot_vary(values, code, said):
    with refused(code, said):
        nf.batch(WRIST, values, nf.Load(tension=1.0))


def test_loads_that_are_none():
    with refused(ErrorCode.WRONG_TYPE, "Load or LoadPath"):
        nf.batch(WRIST, {}, 1.0)
    with refused(ErrorCode.WRONG_SHAPE, "equally many steps"):
        nf.batch(WRIST, {}, [nf.pull(0.0, 1.0, steps=2), nf.pull(0.0, 1.0, steps=3)])
