"""Constants that each robot has of its own: predicted of a robot left out, updated by one row."""

import dataclasses

import numpy as np
import pytest

import notchflex as nf
from notchflex.fit import (
    Constant,
    LeastSquares,
    SumOfRobotErrors,
    calibrate,
    leave_out,
    simulate_measurements,
    update_specimen,
)
from refusals import refused

# Linear, so that a modulus and all factors in proportion bend the wrists alike.
WRIST = nf.load_robot("pacheco2021-a").with_value("material.kind", "linear")
NOISE = {"notch_angle": 0.01}
UP = nf.pull(0.4, 2.0, steps=5)
FACTOR = Constant("each:sensor.force_factor", prior=(1.0, 0.05))
MODULUS = "material.elastic_modulus"
# Of four wrists, about a mean of 1.
FACTORS = {"a": 1.06, "b": 0.97, "c": 1.01, "d": 0.95}


def specimen(factor, seed, load=UP, deviation=NOISE):
    """What is seen of a wrist whose tension is a factor times the reading."""
    pulls = tuple("12" * len(load))
    twice = nf.LoadPath(*(np.repeat(one, 2, axis=0) for one in (load.tension, load.stroke)))
    acting = nf.LoadPath(factor * twice.tension, twice.stroke)
    seen = simulate_measurements(WRIST, acting, deviation=deviation, seed=seed, pull=pulls)
    return dataclasses.replace(seen, load=twice, measured_tension=twice.tension)


def everything(objective=None, names=FACTORS, starts=1):
    robots = dict.fromkeys(names, WRIST.with_value(MODULUS, 9_500.0))
    seen = {name: specimen(FACTORS[name], n) for n, name in enumerate(names)}
    return calibrate(
        robots, seen, (MODULUS, FACTOR), objective=objective, starts=starts, intervals=False
    )


@pytest.fixture(scope="module")
def whole():
    return everything()


@pytest.mark.parametrize("objective", [LeastSquares(), SumOfRobotErrors()])
def test_constants_of_the_tube_and_of_each_specimen_come_out(objective, whole):
    found = whole if objective == LeastSquares() else everything(objective)
    for name, factor in FACTORS.items():
        assert found.values[f"{name}:sensor.force_factor"] == pytest.approx(factor, abs=0.02)
    assert found.values[MODULUS] == pytest.approx(10_000.0, rel=0.02)
    # Only the priors tell how large the factors are: the least sum of squares of factor - 1.
    factors = np.array([found.values[f"{name}:sensor.force_factor"] for name in FACTORS])
    assert factors @ (factors - 1.0) == pytest.approx(0.0, abs=1e-4)
    # So the modulus is known as well as the mean of four factors, though the pulls scatter.
    assert found.deviations[MODULUS] == pytest.approx(0.025 * found.values[MODULUS], rel=0.2)
    # The prior tells 0.05; what scatters between two pulls is raised by the factor for few pulls.
    assert 0.01 < found.deviations["a:sensor.force_factor"] < 0.052


def test_the_prior_of_eq_17_is_the_same_for_all_robots():
    found = everything(SumOfRobotErrors(), ("a", "b"))
    factors = np.array([found.values[f"{name}:sensor.force_factor"] for name in "ab"])
    assert factors @ (factors - 1.0) == pytest.approx(0.0, abs=1e-4)
    assert found.deviations[MODULUS] == pytest.approx(0.0354 * found.values[MODULUS], rel=0.2)
    assert found.converged


def test_a_robot_left_out_is_predicted_by_the_prior_and_the_band_covers_it(whole):
    tested = leave_out(whole, by="robot", photograph=0.6)
    assert [fold.label for fold in tested.folds] == list(FACTORS)
    inside = np.mean([fold.share_inside(0.95)["notch_angle"] for fold in tested.folds])
    assert inside > 0.9
    for fold in tested.folds:
        (name,) = fold.before
        mean, size = fold.before[name]
        assert name == f"{fold.label}:sensor.force_factor"
        assert mean == 1.0
        # Constants of the other robots are judged by whole pulls, of which each has two.
        assert 0.03 < size < 0.07
        # Without the scatter of the specimens the band would be that of the noise.
        assert fold.deviation.max() > 2.0 * NOISE["notch_angle"]
        assert fold.specimen.gain < 0.8
        assert fold.specimen.values[name] == pytest.approx(FACTORS[fold.label], abs=0.03)
    blind, updated = (
        np.mean([errors["notch_angle"] for errors in every])
        for every in zip(*((one.errors, one.errors_updated) for one in tested.folds), strict=True)
    )
    assert updated < 1.1 * NOISE["notch_angle"] < 0.8 * blind


def test_without_a_prior_the_others_tell_mean_and_scatter():
    robots = dict.fromkeys(FACTORS, WRIST)
    fine = {"notch_angle": 1e-3}
    seen = {name: specimen(factor, 7, deviation=fine) for name, factor in FACTORS.items()}
    found = calibrate(robots, seen, "each:sensor.force_factor", starts=1, intervals=False)
    (fold, *_) = leave_out(found, by="robot").folds
    others = [0.97, 1.01, 0.95]
    mean, size = fold.before["a:sensor.force_factor"]
    assert mean == pytest.approx(np.mean(others), abs=5e-3)
    assert size == pytest.approx(np.std(others, ddof=1), abs=5e-3)


def test_one_photograph_of_one_more_wrist(whole):
    more = specimen(1.09, 11)
    drawn = WRIST.with_value(MODULUS, 9_500.0)
    new = update_specimen(whole, drawn, more.taken([6]), "sensor.force_factor")
    assert new.robot.material.elastic_modulus == whole.values[MODULUS]
    assert new.values["sensor.force_factor"] == pytest.approx(1.09, abs=0.03)
    assert new.before["sensor.force_factor"][0] == 1.0
    # All rows tell more than one.
    assert update_specimen(whole, drawn, more).gain < new.gain < 0.7


def test_what_is_not_known_before_is_asked_for(whole):
    one = specimen(1.0, 3).taken([6])
    with refused("MISSING_VALUE", "notch.depth", "prior"):
        update_specimen(whole, WRIST, one, "notch.depth")
    with refused("CONFLICT", "in common"):
        update_specimen(whole, WRIST, one, Constant(MODULUS, prior=(1e4, 1e3)))
    with refused("WRONG_TYPE", "Robot"):
        update_specimen(whole, "pacheco2021-a", one)
    with refused("WRONG_TYPE", "taken"):
        update_specimen(whole, WRIST, {"notch_angle": [0.1]})
    with refused("OUT_OF_RANGE", "largest load"):
        leave_out(whole, by="robot", photograph=1.5)
    with refused("CONFLICT", "each:sensor.force_factor"):
        leave_out(whole, by="pull", photograph=0.5)


def test_a_constant_of_the_robot_left_out_alone_needs_a_prior():
    seen = {name: specimen(1.0, 5) for name in "ab"}
    robots = dict.fromkeys("ab", WRIST)
    own = Constant("a:sensor.force_factor")
    found = calibrate(robots, seen, (MODULUS, own), starts=1, intervals=False)
    with refused("TOO_FEW_DATA", "a:sensor.force_factor", "prior"):
        leave_out(found, by="robot")
