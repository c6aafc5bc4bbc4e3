"""Fits: known constants found again, slopes against differences, intervals, what cannot be told."""

import dataclasses

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

import notchflex as nf
from notchflex.fit import (
    Constant,
    Cost,
    LeastSquares,
    Measurements,
    SumOfDistances,
    SumOfRobotErrors,
    calibrate,
    diagnose,
    leave_out,
    next_measurement,
    read_measurements,
    simulate_measurements,
)
from notchflex.fit.constants import unknowns
from notchflex.fit.residuals import Samples
from notchflex.fit.search import FitProblem
from notchflex.robot.value_names import number_at
from notchflex.solver.programs.compiled import Native
from refusals import refused
from shared_data import measured_path

WRIST = nf.load_robot("pacheco2021-a")
NOISE = {"notch_angle": 0.01}
# Standard deviations of what else is measured.
ALL = {
    "tip_position": 0.05,
    "tip_rotation": 0.01,
    "tip_tension": 0.01,
    "axis_points": 0.05,
    "total_angle": 0.01,
}
UP = nf.pull(0.2, 1.8, steps=8)
FOUR = (
    "material.elastic_modulus",
    "material.superelastic_modulus",
    "material.transition_strain",
    "friction.coefficient",
)
TRUE = {name: number_at(WRIST, name) for name in FOUR}


@pytest.fixture(scope="module")
def noisy():
    return calibrate(
        WRIST,
        simulate_measurements(WRIST, UP, deviation=NOISE, seed=1),
        FOUR,
        starts=1,
        priors=False,
    )


def test_constants_are_found_again_without_noise():
    seen = simulate_measurements(WRIST, UP)
    softer = WRIST.with_values({name: 0.8 * value for name, value in TRUE.items()})
    found = calibrate(softer, seen, FOUR, starts=1, priors=False, intervals=False)
    assert found.converged
    for name, value in TRUE.items():
        assert found.values[name] == pytest.approx(value, rel=1e-5)


def test_interval_of_one_constant_whose_limits_are_whole_numbers():
    """At both ends, twice the misfit is higher by what 95 % allow, evaluated there directly."""
    seen = simulate_measurements(WRIST, nf.pull(0.4, 1.5, steps=3), deviation=NOISE, seed=2)
    found = calibrate(WRIST, seen, ["friction.coefficient"], starts=1, priors=False)
    interval, cost = found.intervals["friction.coefficient"], found.problem
    for end in (interval.lower, interval.upper):
        rise = 2.0 * (cost(np.array([end])).value - cost(found.best.values).value)
        assert rise == pytest.approx(found.allowed_rise("friction.coefficient"), rel=0.05)


def test_intervals_hold_the_truth_and_are_as_wide_as_the_noise_makes_them(noisy):
    for name, interval in noisy.intervals.items():
        assert interval.lower < TRUE[name] < interval.upper
        half = 0.5 * (interval.upper - interval.lower)
        assert half == pytest.approx(1.96 * noisy.deviations[name], rel=0.25)
    assert noisy.reduced_chi_squared == pytest.approx(1.0, abs=0.5)
    assert not noisy.misses


def test_what_an_interval_holds_is_told_without_its_ends(noisy):
    for name, interval in noisy.intervals.items():
        for end in (interval.lower, interval.upper):
            out = end - noisy.values[name]
            assert noisy.allows(name, end - 0.02 * out)
            assert not noisy.allows(name, end + 0.02 * out)
    with refused("UNKNOWN_NAME", "notch[1].depth"):
        noisy.allows("notch[1].depth", 1.0)


def test_ends_of_an_interval_are_where_the_misfit_has_risen_by_chi_squared(noisy):
    name = "friction.coefficient"
    interval = noisy.intervals[name]
    for end in (interval.lower, interval.upper):
        held = WRIST.with_values({**noisy.values, name: end})
        others = [one for one in FOUR if one != name]
        seen = simulate_measurements(WRIST, UP, deviation=NOISE, seed=1)
        again = calibrate(held, seen, others, starts=1, priors=False, intervals=False)
        assert 2.0 * (again.cost - noisy.cost) == pytest.approx(3.8415, rel=0.02)


@pytest.mark.parametrize("objective", [LeastSquares(), LeastSquares(1.0), SumOfRobotErrors()])
def test_slope_of_the_misfit_is_that_of_differences(objective):
    seen = simulate_measurements(WRIST, UP, deviation=NOISE, seed=1)
    data = {"A": (seen,)}
    problem = FitProblem(Samples.of({"A": WRIST}, data, unknowns({"A": WRIST}, FOUR)), objective)
    at = np.array([1.07 * TRUE[name] for name in FOUR])
    slope = problem(at).gradient
    for number, value in enumerate(at):
        step = np.zeros(4)
        step[number] = 1e-4 * value
        ends = [problem(at + share * step).value for share in (-1.0, -0.5, 0.5, 1.0)]
        wide, near = (ends[3] - ends[0]) / 2.0, ends[2] - ends[1]
        difference = (4.0 * near - wide) / 3.0 / step[number]
        assert slope[number] == pytest.approx(difference, rel=1e-6)


def test_data_that_cannot_tell_a_constant_say_so():
    slick = WRIST.with_value("friction.coefficient", 0.0)
    seen = simulate_measurements(slick, nf.pull(0.2, 0.6, steps=4), deviation=NOISE, seed=1)
    names = ("friction.coefficient", "material.superelastic_modulus")
    found = calibrate(WRIST, seen, names, starts=1, priors=False)
    friction, modulus = (found.intervals[name] for name in names)
    assert friction.lower is None
    assert modulus.lower is modulus.upper is None
    said = " ".join(diagnose(found))
    assert "do not determine material.superelastic_modulus" in said
    assert "friction.coefficient is at most" in said


def test_a_path_with_memory_points_poses_tensions_and_the_sensor_itself():
    load = nf.pull(0.0, 1.5, steps=6).release()
    exact = simulate_measurements(
        WRIST, load, observed=tuple(ALL), axis_at=[1.0, 5.0, 9.0], from_rest=False
    )
    deviation = {name: np.full(one.shape, ALL[name]) for name, one in exact.observed.items()}
    offset = 0.04  # what the gauge shows too much: the robot had that much less
    truth = simulate_measurements(
        WRIST,
        nf.LoadPath(np.maximum(load.tension - offset, 0.0), load.stroke),
        observed=tuple(ALL),
        axis_at=[1.0, 5.0, 9.0],
        from_rest=False,
    )
    shifted = Measurements(
        "shifted", load, exact.pull, False, truth.observed, deviation, exact.axis_at
    )
    names = ("friction.coefficient", "sensor.force_offset")
    found = calibrate(
        WRIST.with_value("friction.coefficient", 0.2), shifted, names, starts=1, priors=False
    )
    assert found.values["sensor.force_offset"] == pytest.approx(offset, abs=1e-6)
    assert found.values["friction.coefficient"] == pytest.approx(0.13, abs=1e-6)


def test_noise_that_nobody_told_is_what_the_fit_leaves():
    exact = simulate_measurements(WRIST, UP, deviation=NOISE, seed=3)
    untold = Measurements("untold", UP, exact.pull, True, exact.observed)
    found = calibrate(WRIST, untold, "friction.coefficient", starts=1, priors=False)
    left = np.sqrt(np.sum(found.residuals.values**2) / found.freedom)
    assert found.noise.deviation == pytest.approx(left, rel=1e-3)
    assert "is estimated from the residuals" in " ".join(diagnose(found))


def test_criteria_of_information_prefer_the_model_that_made_the_data(noisy):
    size, count = noisy.noise.deviation, len(noisy.residuals)
    likely = norm.logpdf(noisy.residuals.values, scale=size).sum()
    assert noisy.log_likelihood == pytest.approx(likely, rel=1e-9)
    assert noisy.aic == pytest.approx(2.0 * (len(FOUR) - likely))
    assert noisy.bic == pytest.approx(np.log(count) * len(FOUR) - 2.0 * likely)
    stiffer = WRIST.with_value("friction.coefficient", 0.2)
    seen = simulate_measurements(WRIST, UP, deviation=NOISE, seed=1)
    without = calibrate(stiffer, seen, FOUR[:3], starts=1, priors=False, intervals=False)
    assert without.aic > noisy.aic + 2.0
    assert without.bic > noisy.bic
    robust = calibrate(
        WRIST, seen, FOUR[:1], starts=1, priors=False, intervals=False,
        objective=LeastSquares(huber=1.5),
    )  # fmt: skip
    assert np.isnan(robust.aic)


def test_likelihood_integrates_deviations_from_the_drawing_out():
    """And counts noise that nobody told as a constant."""
    seen = simulate_measurements(WRIST, UP, deviation=NOISE, seed=1)
    untold = dataclasses.replace(seen, deviation={})
    found = calibrate(WRIST, untold, FOUR[:2], starts=1, intervals=False)
    assert found.drawing
    assert not found.noise.is_known
    spread = found.residuals.slopes[:, 2:]
    moved = np.array([one.start - one.prior[0] for one in found.drawing])
    scale = np.sqrt(found.freedom / found.counted) * found.noise.deviation
    covariance = np.diag(scale**2) + spread @ spread.T
    before = found.residuals.values - spread @ moved
    likely = multivariate_normal.logpdf(before, cov=covariance)
    assert found.log_likelihood == pytest.approx(likely, rel=1e-9)
    assert found.aic == pytest.approx(2.0 * (3 - likely), rel=1e-9)


def test_an_objective_of_ones_own():
    """The sum of fourth powers, with no class of the package below it."""

    class FourthPowers:
        is_likelihood = takes_priors = False

        def check(self, quantities):
            assert quantities == ("notch_angle",)

        def weight_of_one(self, residuals, noise):
            return 0.0

        def cost(self, residuals, noise):
            scaled, slopes = residuals.values / noise, residuals.slopes / noise[:, None]
            each = 4.0 * scaled[:, None] ** 3 * slopes
            curvature = 12.0 * (slopes * scaled[:, None] ** 2).T @ slopes
            return Cost(float(np.sum(scaled**4)), each.sum(0), curvature, residuals, each)

    seen = simulate_measurements(WRIST, UP, deviation=NOISE, seed=1)
    found = calibrate(WRIST, seen, FOUR[:1], starts=1, objective=FourthPowers())
    assert found.converged
    assert found.intervals == {}
    value = found.best.values[0]
    for factor in (0.99, 1.01):
        assert found.problem(np.array([factor * value])).value > found.cost
    assert value == pytest.approx(TRUE[FOUR[0]], rel=0.1)


def test_a_total_that_is_the_sum_of_the_notches_counts_once():
    both = simulate_measurements(
        WRIST, UP, observed=("notch_angle", "total_angle"), deviation=NOISE, seed=1
    )
    sums = {**both.observed, "total_angle": both.observed["notch_angle"].sum(axis=1)}
    both = Measurements("both", UP, both.pull, True, sums, {"notch_angle": np.full((8, 5), 0.01)})
    found = calibrate(WRIST, both, "friction.coefficient", starts=1, priors=False, intervals=False)
    assert found.freedom == 8 * 5 - 1


def test_a_prior_pulls_as_a_measurement_would():
    seen = simulate_measurements(WRIST, UP, deviation=NOISE, seed=1)
    name = "friction.coefficient"
    free = calibrate(WRIST, seen, name, starts=1, priors=False, intervals=False)
    other = free.values[name] + free.deviations[name]
    prior = Constant(name, prior=(other, free.deviations[name]))
    pulled = calibrate(WRIST, seen, prior, starts=1, priors=False, intervals=False)
    half_way = 0.5 * (free.values[name] + other)
    assert pulled.values[name] == pytest.approx(half_way, rel=2e-3)


def test_the_next_measurement_narrows_as_much_as_it_says(noisy):
    told = next_measurement(noisy, nf.pull(0.3, 1.8, steps=4), narrow=["friction.coefficient"])
    load = nf.Load(tension=float(told.loads.tension[told.best, 0]))
    more = simulate_measurements(WRIST, load, deviation=NOISE)
    exact = simulate_measurements(WRIST.with_values(noisy.values), load)
    more = Measurements("more", more.load, ("2",), True, exact.observed, more.deviation)
    first = simulate_measurements(WRIST, UP, deviation=NOISE, seed=1)
    after = calibrate(WRIST, [first, more], FOUR, starts=1, priors=False, intervals=False)
    name = "friction.coefficient"
    assert after.deviations[name] / noisy.deviations[name] == pytest.approx(
        told.gain[told.best], rel=1e-3
    )


def test_a_pull_left_out_is_judged_by_constants_that_never_saw_it():
    rough = WRIST.with_value("friction.coefficient", 0.3)
    bad = simulate_measurements(rough, UP, deviation=NOISE, seed=2, pull=["bad"] * 8)
    good = simulate_measurements(WRIST, UP, deviation=NOISE, seed=1, pull=["good"] * 8)
    whole = calibrate(
        WRIST, [good, bad], "friction.coefficient", starts=1, priors=False, intervals=False
    )
    tested = leave_out(whole, by="pull")
    assert [fold.label.rsplit(" ", 1)[1] for fold in tested.folds] == ["good", "bad"]
    without_bad = tested.folds[1]
    assert without_bad.found.values["friction.coefficient"] == pytest.approx(0.13, abs=0.02)
    assert without_bad.errors["notch_angle"] > without_bad.errors_of_all["notch_angle"]


def test_a_robot_with_a_constant_of_its_own_cannot_be_left_out():
    robots = {"a": WRIST, "b": WRIST}
    seen = dict.fromkeys(robots, simulate_measurements(WRIST, UP, deviation=NOISE, seed=1))
    own = ("a:friction.coefficient", "material.elastic_modulus")
    whole = calibrate(robots, seen, own, starts=1, priors=False, intervals=False)
    with refused("TOO_FEW_DATA", "`a:friction.coefficient`"):
        leave_out(whole, by="robot")


def test_distances_of_points_are_made_small():
    seen = simulate_measurements(WRIST, UP, observed=("axis_points",), axis_at=[4.0, 9.0])
    stiff = WRIST.with_value("friction.coefficient", 0.2)
    found = calibrate(
        stiff, seen, "friction.coefficient", objective=SumOfDistances(), starts=1, priors=False
    )
    assert found.values["friction.coefficient"] == pytest.approx(0.13, abs=1e-6)
    assert not found.intervals
    with refused("UNSUPPORTED", "prior"):
        known = Constant("friction.coefficient", prior=(0.1, 0.1))
        calibrate(stiff, seen, known, objective=SumOfDistances(), starts=1, priors=False)


@pytest.mark.parametrize(
    ("change", "code", "name"),
    [
        ({"objective": SumOfDistances()}, "UNSUPPORTED", "notch_angle"),
        ({"measurements": {"X": None}}, "CONFLICT", "X"),
    ],
)
def test_what_does_not_belong_together_is_refused(change, code, name):
    given = {
        "measurements": simulate_measurements(WRIST, UP),
        "fit": "friction.coefficient",
        "objective": SumOfRobotErrors(),
    } | change
    fit, measurements = given.pop("fit"), given.pop("measurements")
    with refused(code, name):
        calibrate(WRIST, measurements, fit, **given)


def test_the_identification_of_pacheco_2021():
    robots = {name: nf.load_robot(f"pacheco2021-{name}-specimen") for name in "abc"}
    data = {
        name: read_measurements(
            measured_path(f"pacheco2021_wrist_{name.upper()}_measured.csv"), robot
        )
        for name, robot in robots.items()
    }
    fit = (
        Constant("material.elastic_modulus", 5e3, 20e3),
        Constant("material.superelastic_modulus", 1e3, 6e3),
        Constant("material.transition_strain", 0.01, 0.05),
        Constant("friction.coefficient", 0.0, 0.5),
    )
    found = calibrate(robots, data, fit, objective=SumOfRobotErrors(), starts=2)
    assert found.cost <= 11.5942
    expected = [10_329.0, 3_063.8, 0.026397, 0.12599]
    np.testing.assert_allclose(list(found.values.values()), expected, rtol=1e-4)


def test_a_fit_makes_no_program_of_xla(monkeypatch):
    def refuse(*_):
        raise AssertionError("XLA compiles mechanics")

    monkeypatch.setattr(Native, "_by_xla", refuse)
    load = nf.pull(0.4, 1.6, steps=3).release()
    seen = simulate_measurements(
        WRIST,
        load,
        observed=tuple(ALL),
        axis_at=[1.0, 5.0, 9.0],
        from_rest=False,
        deviation=ALL,
        seed=1,
    )
    names = ("friction.coefficient", "notch.depth", "sensor.force_offset")
    found = calibrate(WRIST, seen, names, starts=1, priors=False, intervals=False)
    assert found.converged
    assert next_measurement(found, nf.pull(0.3, 1.8, steps=4)).converged.all()


def test_a_slack_is_found_where_opposite_tendons_are_let_go():
    """Strokes below 0 are no strokes of 0: the tendon opposite is released."""
    robot = nf.load_robot("two-axis-wrist")
    drawn = np.linspace(0.1, 0.6, 5)[:, None] * [1.0, 0.4, -1.0, -0.4]
    truth = simulate_measurements(robot, nf.LoadPath(stroke=drawn - 0.05))
    seen = dataclasses.replace(truth, load=nf.LoadPath(stroke=drawn))
    found = calibrate(robot, seen, "sensor.stroke_slack", starts=1, priors=False, intervals=False)
    assert found.values["sensor.stroke_slack"] == pytest.approx(0.05, abs=1e-6)
