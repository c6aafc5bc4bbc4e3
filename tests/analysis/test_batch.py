"""Batches give what one solve after the other gives, whatever robots and loads they mix."""

from __future__ import annotations

import itertools
import subprocess
import sys

import numpy as np
import pytest

import notchflex as nf
from notchflex.analysis.outputs import OUTPUTS
from notchflex.errors import ErrorCode
from refusals import refused


def test_loads_of_one_robot(wrist, margin):
    loads = nf.pull(0.0, 2.5, steps=70)  # more than one piece
    told: list[tuple[int, int]] = []
    found = nf.solve_batch(wrist, loads, progress=lambda done, count: told.append((done, count)))
    each = nf.solve_each(wrist, loads)
    assert found["converged"].all()
    margin.within("total angle", found["total_angle"] - each.total_angle, 1e-12, "rad")
    margin.within("tip", found["tip_position"] - each.tip_position, 1e-12, "mm")
    np.testing.assert_allclose(found["tip_rotation"], each.tip_rotation, atol=1e-12)
    assert told[-1] == (70, 70)


@pytest.mark.parametrize("steps", [5, 6])
def test_as_many_steps_as_flexures_or_bodies(wrist: nf.Robot, steps: int) -> None:
    """What lies along the steps is not taken for what lies along the chain."""
    paths = [nf.pull(0.0, 1.0 + 0.1 * number, steps=steps) for number in range(9)]
    found = nf.simulate_batch(wrist, paths)["total_angle"]
    alone = [nf.simulate(wrist, path).total_angle for path in paths]
    np.testing.assert_allclose(found, alone, atol=1e-11)


def test_paths_remember(wrist, margin):
    paths = [nf.pull(0.0, top, steps=5).release() for top in (1.0, 1.5, 2.0)]
    names = ("total_angle", "contact_log_ratio", "dissipation", "tendon_work", "converged")
    found = nf.simulate_batch(wrist, paths, outputs=names)
    assert set(found) == set(names)
    assert found["converged"].all()
    for row, path in enumerate(paths):
        alone = nf.simulate(wrist, path)
        margin.within("angle", found["total_angle"][row] - alone.total_angle, 1e-12, "rad")
        margin.within("memory", found["contact_log_ratio"][row] - alone.contact_log_ratio, 1e-11)


def test_robots_of_one_form_and_of_others(wrist, margin):
    deeper = [wrist.with_value("notch.depth", depth) for depth in (1.36, 1.38, 1.40)]
    robots = [*deeper, nf.load_robot("pacheco2021-b"), nf.load_robot("pacheco2021-c")]
    tensions = np.array([0.5, 1.0, 1.5, 0.7, 0.4])
    loads = [nf.Load(tension=float(tension)) for tension in tensions]
    found = nf.solve_batch(robots, loads)
    for row, (robot, load) in enumerate(zip(robots, loads, strict=True)):
        alone = nf.solve(robot, load)
        count = robot.number_of_notches
        margin.within("total", found["total_angle"][row] - alone.total_angle, 1e-12, "rad")
        own = found["notch_angle"][row]
        margin.within("notches", own[:count] - alone.notch_angle, 1e-12, "rad")
        assert np.isnan(own[count:]).all()


def test_a_row_that_fails_leaves_the_others(wrist):
    loads = [nf.Load(stroke=1.0), nf.Load(stroke=50.0), nf.Load(stroke=0.5)]
    assert nf.solve_batch(wrist, loads)["converged"].tolist() == [True, False, True]


@pytest.mark.parametrize(
    ("robots", "loads", "outputs", "code", "said"),
    [
        ([], [nf.Load(tension=1.0)], ("total_angle",), "WRONG_TYPE", "[]"),
        ("pacheco2021-a", [nf.Load(tension=1.0)], ("total_angle",), "WRONG_TYPE", "pacheco2021-a"),
        (2, [nf.Load(tension=1.0)] * 3, ("total_angle",), "WRONG_SHAPE", "2 robots and 3 loads"),
        (1, [nf.Load(tension=1.0)], ("angle",), "UNKNOWN_NAME", "'angle'"),
        (1, [], ("total_angle",), "NO_DATA", "loads"),
    ],
)
def test_what_makes_no_batch(wrist, robots, loads, outputs, code, said):
    given = [wrist] * robots if isinstance(robots, int) else robots
    with refused(code, said):
        nf.solve_batch(given, loads, outputs=outputs)


@pytest.mark.parametrize(("rows", "cores"), [(1, 3), (7, 3), (65, 1), (1030, 3)])
def test_rows_come_back_in_order_however_they_are_cut(wrist, rows, cores):
    loads, seen = nf.pull(0.1, 2.0 if rows > 1 else 0.1, steps=rows), []
    found = nf.solve_batch(wrist, loads, cores=cores, progress=lambda *done: seen.append(done))
    # Solved one at a time they are the same to the last bit: lanes do not touch each other.
    some = np.unique([0, rows // 2, rows - 1])
    for row in some:
        alone = nf.solve_batch(wrist, loads[row : row + 1])
        assert alone["total_angle"][0] == found["total_angle"][row]
    assert seen[-1] == (rows, rows)
    assert all(before < after for (before, _), (after, _) in itertools.pairwise(seen))
    assert len(seen) >= min(cores, -(-rows // 8))


@pytest.mark.parametrize(
    ("cores", "code"),
    [(0, "OUT_OF_RANGE"), (-2, "OUT_OF_RANGE"), (1.5, "WRONG_TYPE"), (True, "WRONG_TYPE")],
)
def test_cores_that_there_cannot_be(wrist, cores, code):
    with refused(code, "cores", str(cores)):
        nf.solve_batch(wrist, nf.pull(0.0, 1.0, steps=2), cores=cores)


@pytest.mark.parametrize(
    "load",
    [
        nf.Load(tension=2.4),
        pytest.param(nf.Load(stroke=0.7, tip_force=(0.02, 0.0, -0.01)), marks=pytest.mark.nightly),
    ],
)
def test_robots_of_unlike_length(wrist, load, margin):
    robots = [
        wrist.replace(
            notch=(nf.ArcNotch("on-axis", 1.40, 0.8, uncut_length=1.2, repeat=count),),
            tendon=(nf.Tendon(0.7),),
        )
        for count in (2, 4, 3)
    ]
    names = [name for name in OUTPUTS if name not in ("residual", "iterations")]
    found = nf.solve_batch(robots, load, outputs=names)
    for row, robot in enumerate(robots):
        alone = nf.solve(robot, load)
        for name in names:
            one = np.asarray(getattr(alone, name))
            all_of_it = found[name][row]
            own = all_of_it[tuple(slice(size) for size in one.shape)]
            np.testing.assert_allclose(own, one, rtol=1e-8, atol=1e-9, err_msg=name)
    again = nf.solve_batch(robots[:1], load, outputs=names)
    for name, values in again.items():  # to the bit, whatever robots are beside it
        own = found[name][:1][tuple(slice(size) for size in values.shape)]
        np.testing.assert_array_equal(own, values, err_msg=name)
    assert np.isnan(found["notch_angle"][0, 2:]).all()
    assert np.isnan(found["body_position"][0, 3:]).all()
    margin.within("tip", found["tip_position"][1] - nf.solve(robots[1], load).tip_position, 1e-12)


@pytest.mark.nightly
def test_robots_with_unlike_tendons(wrist):
    robots = [wrist, nf.load_robot("two-axis-wrist")]
    load = nf.Load(tension=0.3, tip_force=(0.0, 0.01, 0.0))
    found = nf.solve_batch(robots, load)
    for row, robot in enumerate(robots):
        np.testing.assert_allclose(
            found["tip_position"][row], nf.solve(robot, load).tip_position, rtol=0.0, atol=1e-11
        )
        assert found.path(row).total_angle[0] == pytest.approx(found["total_angle"][row], rel=1e-12)
    with refused("WRONG_SHAPE", "more tendons than"):
        nf.solve_batch(robots, nf.Load(tension=[0.3, 0.1]))


def test_an_unknown_output_is_an_input_error_that_names_what_there_is():
    batch = nf.solve_batch(nf.load_robot("pacheco2021-a"), nf.Load(tension=1.0))
    with pytest.raises(nf.InputError) as problem:
        batch["angle"]
    assert problem.value.code is ErrorCode.UNKNOWN_NAME
    assert isinstance(problem.value, KeyError)
    assert str(problem.value).startswith("there is no output 'angle'; there are converged, ")
    assert "angle" not in batch
    assert batch.get("angle") is None


def test_works_are_those_of_paths(wrist):
    path = nf.pull(0.0, 0.8, steps=4).release()
    paths, names = [path, nf.pull(0.0, 1.0, steps=4).release()], ("dissipation", "tendon_work")
    outputs = ("total_angle", "contact_log_ratio", *names)  # as in the test of memory
    batch = nf.simulate_batch(wrist, paths, outputs=outputs)
    assert set(batch) == {*outputs, "converged"}
    for row, load in enumerate(paths):
        single = nf.simulate(wrist, load)
        for name in names:
            np.testing.assert_allclose(batch[name][row], getattr(single, name), atol=1e-12)
        # released, all work was lost to friction, but for the coarse steps
        lost, done = batch["dissipation"][row, -1].sum(), batch["tendon_work"][row, -1].sum()
        assert lost == pytest.approx(done, rel=0.02)
        assert done > 0.01
    each = nf.solve_batch(wrist, path, outputs=[*names, "stroke"])
    half = 0.5 * path.tension * each["stroke"]
    np.testing.assert_allclose(each["tendon_work"], half, atol=1e-12)
    with refused("UNKNOWN_NAME", "dissipation"):
        nf.differentiable(wrist, path, ["notch.depth"], outputs=["dissipation"])


@pytest.mark.parametrize("given", [1, None])
def test_what_is_no_batch_of_paths(wrist, given):
    with refused(ErrorCode.WRONG_TYPE):
        nf.simulate_batch(wrist, given)
    with refused(ErrorCode.WRONG_TYPE):
        nf.simulate_batch(given, nf.pull(0.0, 1.0, steps=2))


def test_works_are_outputs_whatever_is_imported_first() -> None:
    code = "from notchflex.analysis.outputs import WORKS; assert 'tendon_work' in WORKS"
    subprocess.run([sys.executable, "-c", code], check=True)
