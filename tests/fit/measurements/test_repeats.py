"""How measurements repeat: known noise is found again, and nothing else is taken for it."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from notchflex.fit import Measurements, repeats, repeats_of_each

LOOP = np.concatenate([np.linspace(0.0, 1.0, 11), np.linspace(0.9, 0.0, 10)])
NOISE = 0.02


def angle(force: np.ndarray) -> np.ndarray:
    """A loop: letting go the angle lags behind."""
    way = np.arange(force.shape[-1]) > np.argmax(force, axis=-1)
    return force**2 + 0.3 * way * force * (1.0 - force)


def pulls(force: np.ndarray, noise: np.ndarray, *, from_rest: bool = False) -> Measurements:
    """Pulls (k, steps) with noise on two angles."""
    count, steps = force.shape
    tension = force.reshape(-1, 1)
    exact = np.stack([angle(one) for one in force]).reshape(-1, 1)
    return Measurements(
        "made",
        nf.LoadPath(tension, np.full_like(tension, np.nan)),
        tuple(str(number) for number in range(count) for _ in range(steps)),
        from_rest,
        {"notch_angle": exact + noise.reshape(-1, 2)},
    )


def drawn(seed: int, *shape: int) -> np.ndarray:
    return NOISE * np.random.default_rng(seed).standard_normal(shape)


def test_pulls_at_the_same_loads_are_pooled_without_bias():
    force = np.tile(LOOP, (4, 1))
    squares = [
        repeats_of_each(pulls(force, drawn(seed, 4, 21, 2)))["notch_angle"] ** 2
        for seed in range(200)
    ]
    # 63 degrees of freedom each: the mean of 400 variances is right to sqrt(2 / 63 / 400) = 0.9 %.
    assert np.mean(squares) == pytest.approx(NOISE**2, rel=0.036)


def test_a_row_and_its_repeat_in_formula():
    force = np.array([[0.3, 0.7], [0.3, 0.7]])
    noise = np.zeros((2, 2, 2))
    noise[1, 0, 0] = 0.04
    found = repeats_of_each(pulls(force, noise))["notch_angle"]
    np.testing.assert_allclose(found, [0.04 / np.sqrt(2.0) / np.sqrt(2.0), 0.0], atol=1e-12)
    assert repeats(pulls(force, noise))["notch_angle"] == pytest.approx(0.02 / np.sqrt(2.0))


def test_loading_is_no_repeat_of_letting_go():
    force = LOOP[None]
    assert np.isnan(repeats(pulls(force, drawn(0, 1, 21, 2)))["notch_angle"])
    two = np.tile(LOOP, (2, 1))
    assert repeats(pulls(two, np.zeros((2, 21, 2))))["notch_angle"] < 1e-12
    # taken as pulls from rest, rows at one load repeat each other, and lag as far as the loop does
    assert repeats(pulls(two, np.zeros((2, 21, 2)), from_rest=True))["notch_angle"] > 0.02


def test_letting_go_from_unlike_peaks_is_no_repeat():
    high = np.array([0.0, 0.5, 1.0, 0.5, 0.0])
    low = np.array([0.0, 0.5, 0.8, 0.5, 0.0])
    data = pulls(np.stack([high, low]), np.zeros((2, 5, 2)))
    # The rows while pulling repeat; those while letting go are not asked, whatever they are.
    moved = np.repeat(data.load.tension, 2, axis=1)
    moved[8:] += 1.0
    other = Measurements("made", data.load, data.pull, False, {"notch_angle": moved})
    assert repeats(other)["notch_angle"] < 1e-12


@pytest.mark.parametrize("from_rest", [True, False])
def test_pulls_at_other_loads_are_compared_by_straight_lines(from_rest):
    # An error that stays through a pull is found in full, whatever the loads.
    random = np.random.default_rng(1)
    found = []
    for _ in range(100):
        force = np.sort(random.uniform(0.0, 1.0, (6, 9)), axis=1)
        force[:, 0], force[:, -1] = 0.0, 1.0
        offset = NOISE * random.standard_normal((6, 1, 2))
        data = pulls(force, np.broadcast_to(offset, (6, 9, 2)), from_rest=from_rest)
        straight = data.observed["notch_angle"] - data.load.tension**2 + data.load.tension
        data = Measurements("made", data.load, data.pull, from_rest, {"notch_angle": straight})
        found.append(repeats_of_each(data)["notch_angle"] ** 2)
    # 5 degrees of freedom each, 200 of them: sqrt(2 / 5 / 200) = 4.5 %
    assert np.mean(found) == pytest.approx(NOISE**2, rel=0.15)


def test_errors_drawn_anew_come_out_a_fifth_too_small_at_most():
    random = np.random.default_rng(2)
    found = []
    for _ in range(100):
        force = np.sort(random.uniform(0.0, 1.0, (4, 30)), axis=1)
        data = pulls(force, NOISE * random.standard_normal((4, 30, 2)))
        found.append(repeats_of_each(data)["notch_angle"] ** 2)
    assert 0.8 < np.sqrt(np.mean(found)) / NOISE < 0.9


def test_loads_from_outside_count():
    force = np.tile(np.linspace(0.0, 1.0, 5), (2, 1))
    data = pulls(force, drawn(3, 2, 5, 2))
    hung = nf.LoadPath(
        data.load.tension,
        data.load.stroke,
        external=(*data.load.external[:5], *data.load.loaded(tip_mass=5.0).external[5:]),
    )
    other = Measurements("made", hung, data.pull, False, data.observed)
    assert np.isnan(repeats(other)["notch_angle"])
    assert repeats(data)["notch_angle"] > 0.0


def test_what_was_not_measured_is_left_out():
    data = pulls(np.tile(LOOP, (3, 1)), drawn(4, 3, 21, 2))
    gaps = data.observed["notch_angle"].copy()
    gaps[:21, 0] = np.nan
    gaps[:, 1] = np.nan
    gaps[0, 1] = 0.0
    found = repeats_of_each(
        Measurements("made", data.load, data.pull, False, {"notch_angle": gaps})
    )
    rest = repeats_of_each(data.of_pulls(["1", "2"]))
    np.testing.assert_allclose(found["notch_angle"], [rest["notch_angle"][0], np.nan])


def test_the_step_of_a_sensor():
    force = np.array([[0.1, 0.5, 1.0], [0.1004, 0.5004, 1.0004]])
    data = pulls(force, np.zeros((2, 3, 2)))
    lines = repeats(data)["notch_angle"]
    rows = repeats(data, step=0.01)["notch_angle"]
    assert lines < 1e-3
    expected = np.sqrt(np.mean(np.diff(force**2, axis=0) ** 2) / 2.0)
    assert rows == pytest.approx(expected, rel=1e-9)
