"""The prepared robot of a control loop against `solve` and differences."""

import numpy as np
import pytest

import notchflex as nf
from notchflex.control.program.drive_model import DriveModel
from notchflex.loads.load_path import load_path

OUTPUTS = ("tip_position", "tip_rotation", "total_angle")
WRIST = nf.load_robot("pacheco2021-a")


def model(robot, outputs, **load):
    one = nf.Load(tension=[0.0] * robot.number_of_tendons, **load)
    return DriveModel(robot, load_path(one, robot.number_of_tendons), outputs)


def test_values_are_those_of_solve_in_the_order_that_was_asked():
    made = model(WRIST, OUTPUTS)
    found, state = made.solve(made.first, np.array([1.0])), nf.solve(WRIST, nf.Load(tension=1.0))
    assert found.converged
    assert found.whole
    for name, at in made.slices.items():
        np.testing.assert_allclose(found.values[at], np.ravel(state.quantity(name)), atol=1e-12)


def test_slopes_are_those_of_differences():
    made = model(WRIST, OUTPUTS)
    before = made.solve(made.first, np.array([0.5])).state
    slope = made.solve(before, np.array([0.8])).jacobian[:, 0]
    up, down = (made.solve(before, np.array([0.8 + h])).values for h in (1e-5, -1e-5))
    np.testing.assert_allclose(slope, (up - down) / 2e-5, rtol=1e-6, atol=1e-8)


def test_a_turned_base_turns_vectors():
    straight, turned = (
        model(WRIST, OUTPUTS, base_rotation=turn) for turn in ((0, 0, 0), (0, 0, 0.7))
    )
    one, other = (each.solve(each.first, np.array([1.0])) for each in (straight, turned))
    c, s = np.cos(0.7), np.sin(0.7)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(other.values[:3], rotation @ one.values[:3], atol=1e-12)
    np.testing.assert_allclose(other.jacobian[:3], rotation @ one.jacobian[:3], atol=1e-12)
    whole = [each.values[3:12].reshape(3, 3) for each in (one, other)]
    np.testing.assert_allclose(whole[1], rotation @ whole[0], atol=1e-12)


@pytest.mark.parametrize("unloads", [False, True])
def test_nothing_moves_within_the_dead_band_and_something_beyond(unloads):
    made = model(WRIST, OUTPUTS)
    here = made.solve(made.first, np.array([1.5]))
    if unloads:
        here = made.solve(here.state, np.array([0.9]))
    low, high = made.dead_band(here.state)
    assert high[0] - low[0] > 0.02
    for inside in (low + 1e-6, 0.5 * (low + high), high - 1e-6):
        np.testing.assert_allclose(made.solve(here.state, inside).values, here.values, atol=1e-9)
    for outside in (low - 1e-3, high + 1e-3):
        moved = made.solve(here.state, outside).values - here.values
        assert np.abs(moved).max() > 1e-4


def test_a_dead_band_is_there_whatever_rounding_does_to_the_sliding_contact():
    """The log ratio of a contact that slides misses its bound by rounding, to either side."""
    made = model(WRIST, OUTPUTS)
    state = made.first
    for tension in np.linspace(0.3, 1.7, 57):
        state = made.solve(state, np.array([tension])).state
        low, high = made.dead_band(state)
        assert low[0] < 0.995 * tension
        assert high[0] >= tension
