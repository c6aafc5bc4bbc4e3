"""Results and loads keep their numbers, are equal by value, and can be sliced."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from notchflex.results.quantities import QUANTITIES
from refusals import refused


def test_no_array_of_a_result_can_be_written(loop: nf.EquilibriumPath):
    before = loop.total_angle.copy()
    angle = loop.total_angle
    with pytest.raises(ValueError, match="read-only"):
        angle *= 180.0 / np.pi
    assert (loop.total_angle == before).all()
    for name in QUANTITIES:
        for values in (loop.quantity(name), loop[1].quantity(name)):
            assert not isinstance(values, np.ndarray) or not values.flags.writeable, name
    every = [*loop.front, *loop.stability, *loop.state.arrays.values()]
    every += nf.solve_batch(loop.robot, nf.Load(tension=1.0)).values()
    assert not any(array.flags.writeable for array in every)


def test_a_load_path_keeps_no_array_of_the_caller(wrist: nf.Robot):
    tension, stroke = np.array([[0.5], [1.0]]), np.full((2, 1), np.nan)
    turn = np.zeros(3)
    load = nf.LoadPath(tension, stroke, turn)
    path = nf.simulate(wrist, load)
    tension[:], turn[:] = 9.0, 1.0
    assert path.commanded_tension.tolist() == [[0.5], [1.0]]
    assert not any(one.flags.writeable for one in (load.tension, load.stroke, load.base_rotation))
    assert not path.load.base_rotation.any()


def test_loads_are_equal_by_value():
    load = nf.pull(0.0, 1.0, steps=3)
    assert load == nf.pull(0.0, 1.0, steps=3) == nf.LoadPath(load.tension)
    assert load != nf.pull(0.0, 1.0, steps=4)
    assert load != nf.stroke_path(0.0, 1.0, steps=3)
    assert load != load.loaded(tip_mass=1.0)
    assert load != "load"


def test_states_batches_and_paths_are_equal_by_value(wrist: nf.Robot, loop: nf.EquilibriumPath):
    again = nf.simulate(wrist, loop.load)
    assert again == loop
    assert hash(again) == hash(loop)
    assert again.state == loop.state != loop[1].state
    assert again != nf.simulate(wrist.with_value("notch.depth", 1.39), loop.load)
    assert again != nf.simulate(wrist, loop.load, settings=nf.Settings(tolerance=1e-6))
    first, second = (nf.solve_batch(wrist, loop.load) for _ in range(2))
    assert first == second
    assert first != nf.solve_batch(wrist, loop.load, outputs=("tip_position",))


@pytest.mark.parametrize("ending", ["json", "nc", "parquet"])
def test_what_is_read_equals_what_was_saved(loop: nf.EquilibriumPath, tmp_path, ending):
    for path in (loop, loop[2:5]):
        nf.save_path(path, tmp_path / f"loop.{ending}")
        read = nf.read_path(tmp_path / f"loop.{ending}")
        assert read == path
        assert read[1:] == path[1:]
        assert read != loop[1:5]


@pytest.mark.parametrize("steps", [slice(2, 6), slice(None, None, 3), slice(-1, None)])
def test_a_slice_has_the_numbers_of_its_steps(loop: nf.EquilibriumPath, steps):
    part = loop[steps]
    assert len(part) == len(range(len(loop))[steps])
    assert part.load == loop.load[steps]
    counted = {"dissipation", "material_dissipation", "tendon_work"}  # since the first state
    for name in QUANTITIES.keys() - counted:
        np.testing.assert_array_equal(part.quantity(name), loop.quantity(name)[steps], name)
    assert part.state == loop[range(len(loop))[steps][-1]].state


def test_work_of_a_slice_is_counted_from_its_first_state(loop: nf.EquilibriumPath):
    part = loop[3:7]
    gone = loop.tendon_work[2]
    np.testing.assert_allclose(part.tendon_work, loop.tendon_work[3:7] - gone, atol=1e-12)


def test_a_slice_after_a_failure_repeats_the_last_state():
    wrist = nf.load_robot("pacheco2021-a")
    path = nf.simulate(wrist, nf.stroke_path(0.0, 12.0, steps=5))
    assert not path.converged[-2:].any()
    np.testing.assert_array_equal(path[-1:].tip_position, path.tip_position[-1:])
    assert not path[-1:].converged.any()


def test_a_ramp_of_several_tendons():
    load = nf.pull((0.0, 0.0, None), (1.0, 0.5, None), steps=3)
    np.testing.assert_array_equal(
        load.tension, [[0, 0, np.nan], [0.5, 0.25, np.nan], [1, 0.5, np.nan]]
    )
    assert np.isnan(load.stroke).all()
    load = nf.stroke_path((0.2, 0.0), (0.2, 1.0), steps=2)
    assert load.stroke.tolist() == [
        [0.2, 0.0],
        [0.2, 1.0],
    ]
    assert nf.pull(0.0, [None, 2.0], steps=2) == nf.pull(0.0, 2.0, steps=2, tendon=2)
    with refused("WRONG_TYPE", "first tension", "None"):
        nf.pull((0.0, None), (0.0, 1.0))
    with refused("WRONG_SHAPE", "tension"):
        nf.pull((0.0, 1.0), (1.0, 1.0, 1.0))


def test_a_load_path_of_one_kind():
    load = nf.LoadPath([[1.0], [2.0]])
    assert np.isnan(load.stroke).all()
    assert not load.stroke.flags.writeable
    assert not nf.pull(0.0, 1.0).stroke.flags.writeable
    assert np.isnan(nf.LoadPath(stroke=[[1.0], [2.0]]).tension).all()
    with refused("NO_DATA", "tension"):
        nf.LoadPath()
