"""Tests of residuals: rare in noise, sure of a wrong model; tolerances as priors; outliers."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import notchflex as nf
from notchflex.fit import (
    Constant,
    LeastSquares,
    Measurements,
    calibrate,
    calibration_document,
    diagnose,
    diagnosis,
    simulate_measurements,
)
from notchflex.robot.value_names import number_at

WRIST = nf.load_robot("pacheco2021-a")
MODULUS, FRICTION = NAMES = ("material.elastic_modulus", "friction.coefficient")
LOAD = nf.pull(0.2, 1.6, steps=10).release()
DEEPER = WRIST.with_value("notch.depth", 1.42)


def fit(robot=WRIST, seed=1, priors=False, objective=None, away=0.0):
    """A fit of wrist A to what another robot does, with noise of 1 deg and 8 % of outliers."""
    noise = {"notch_angle": np.radians(1.0)}
    seen = simulate_measurements(robot, LOAD, deviation=noise, seed=seed, from_rest=False)
    random = np.random.default_rng(seed)
    shape = (len(LOAD), 5)
    outlying = (random.random(shape) < 0.08) * random.choice((-1.0, 1.0), shape)
    seen.observed["notch_angle"][:] += away * noise["notch_angle"] * outlying
    return calibrate(
        WRIST, seen, NAMES, starts=1, priors=priors, objective=objective, intervals=False
    )


def test_noise_is_rarely_called_a_pattern():
    tests = [fit(seed=seed).tests for seed in range(40)]
    # three tests at 1 % each; more than five of forty has a probability of 0.2 %
    assert sum(bool(one.rejected) for one in tests) <= 5
    for name in ("runs", "notches"):
        chance = np.array([getattr(one, name) for one in tests])
        assert 0.3 < chance.mean() < 0.7  # uniform: 0.5 +- 0.05


def test_a_wrong_depth_is_not_trusted_and_priors_cover_it():
    wrong = fit(DEEPER)
    assert not wrong.trusted
    assert not wrong.allows(MODULUS, 10_000.0)
    said = " ".join(diagnose(wrong))
    assert said.startswith("Not trusted:")
    assert "Try adding" in said
    assert "not trusted" in repr(wrong).splitlines()[0]
    document = calibration_document(wrong)
    assert document["trusted"] is False
    assert document["tests"]["rejected"]
    right = fit(DEEPER, priors=True)
    assert right.allows(MODULUS, 10_000.0)
    assert right.deviations_of_drawing["notch.depth"] > 0.0
    (robot,) = right.robots.values()
    assert robot.notches[0].depth > WRIST.notches[0].depth


def test_the_gain_of_a_constant_is_that_of_a_fit_with_it():
    wrong = fit(DEEPER)
    told = next(one for one in wrong.tests.missing if one.name == "offset:notch.depth")
    seen = wrong.problem.samples.every[0].measured
    again = calibrate(
        WRIST, seen, (*NAMES, "offset:notch.depth"), starts=1, priors=False, intervals=False
    )
    # linearised: the true gain within a third
    assert told.gain == pytest.approx(2.0 * (wrong.cost - again.cost), rel=0.35)


def test_outliers_widen_intervals_of_hubers_objective_less():
    robust, squares = fit(objective=LeastSquares(1.5), away=6.0), fit(away=6.0)
    assert robust.half_width(np.eye(2))[0] < 0.85 * squares.half_width(np.eye(2))[0]
    assert robust.allows(MODULUS, 10_000.0)


def test_priors_are_a_marginal_likelihood():
    """Covariance of the constants where that of the deviations is added to the noise."""
    found = fit(priors=True)
    slopes, spread = np.split(found.residuals.slopes, [2], axis=1)
    covariance = np.diag(found.noise.deviation**2) + spread @ spread.T
    information = slopes.T @ np.linalg.solve(covariance, slopes)
    np.testing.assert_allclose(found.covariance, np.linalg.inv(information), rtol=1e-7)


def test_pulls_shifted_as_wholes_are_judged_by_pulls():
    random = np.random.default_rng(3)
    covered = []
    one_pull = nf.pull(0.2, 1.6, steps=8)
    four = one_pull.then(one_pull).then(one_pull).then(one_pull)
    pulls = tuple("1111111122222222333333334444444" + "4")
    exact = simulate_measurements(WRIST, four, observed=("total_angle",), pull=pulls)
    for _ in range(40):
        shift = np.repeat(np.radians(2.0) * random.standard_normal(4), 8)
        noise = np.radians(0.4) * random.standard_normal(32)
        observed = {"total_angle": exact.observed["total_angle"] + shift + noise}
        deviation = {"total_angle": np.full(32, np.radians(0.4))}
        seen = Measurements("shifted", four, pulls, True, observed, deviation)
        found = calibrate(WRIST, seen, MODULUS, starts=1, priors=False, intervals=False)
        covered.append(found.allows(MODULUS, 10_000.0))
    assert np.mean(covered) > 0.85  # 95 %, and three standard deviations of forty


def test_a_share_of_all_is_100_percent():
    missing = [SimpleNamespace(name="tube.inner_diameter", chance=0.0, share=0.9999)]
    tests = SimpleNamespace(rejected=("missing",), missing=missing)
    _, advice = diagnosis._not_trusted(SimpleNamespace(tests=tests))
    assert "by about 100 %" in advice


@pytest.mark.parametrize(
    ("name", "other"), [("material.transition_strain", FRICTION), (MODULUS, FRICTION)]
)
def test_intervals_of_a_robot_that_deviates_by_many_tolerances(name, other):
    """Fits with one constant held at an end miss by as much more as chance allows."""
    deep = WRIST.with_value("notch.depth", 1.46)
    noise = {"notch_angle": 0.003}
    seen = simulate_measurements(deep, nf.pull(0.2, 1.8, steps=6), deviation=noise, seed=1)
    found = calibrate(WRIST, seen, (name, other), starts=1)
    assert found.deviations_of_drawing["notch.depth"] > 2.0
    interval = found.intervals[name]
    assert interval.lower < number_at(WRIST, name) < interval.upper
    half = 0.5 * (interval.upper - interval.lower)
    assert half == pytest.approx(1.96 * found.deviations[name], rel=0.05)
    for end in (interval.lower, interval.upper):
        held = Constant(name, end * (1.0 - 1e-4), end * (1.0 + 1e-4))
        again = calibrate(WRIST, seen, (held, other), starts=1, intervals=False)
        assert 2.0 * (again.cost - found.cost) == pytest.approx(3.8415, rel=0.02)
