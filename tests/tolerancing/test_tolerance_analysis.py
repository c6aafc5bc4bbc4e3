"""Worst case, root sum of squares and yield of a wrist, against what they are by definition."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from notchflex.analysis.draws import deviation, moments
from notchflex.pieces import CODES
from notchflex.robot.problems import Tolerance
from notchflex.tolerancing.spec import criteria_of
from notchflex.tolerancing.study import Study, replicates, tolerances_for, yield_interval
from refusals import refused

WRIST = nf.load_robot("pacheco2021-a")
SMALL = {
    "notch.depth": {"plus": 1e-4, "minus": 1e-4},
    "material.elastic_modulus": {"plus": "0.1 %", "minus": "0.1 %"},
    "friction.coefficient": 1e-4,
}
PULLED = {"pulled": nf.pull(0.5, 0.9, steps=2)}  # at 1 N the law of the material has a kink
LEAST = 0.8054  # rad, near the total angle of the drawing


def analysed(spec, draws=200, robot=WRIST):
    return nf.tolerance_analysis(robot, spec, draws=draws)


@pytest.fixture(scope="module")
def small():
    limits = [
        nf.AcceptanceLimit("total_angle", lower=LEAST),
        nf.AcceptanceLimit("tip_position", axis="x", lower=0.0),
        nf.AcceptanceLimit("notch_angle", notch=2, upper=1.0, step=1),
    ]
    return analysed(nf.ToleranceSpec(limits, PULLED, SMALL), 800)


def test_small_tolerances_scatter_as_the_root_of_squares_says(small):
    drawn = small.drawn.outcomes.values
    np.testing.assert_allclose(drawn.std(axis=0), small.linear.sd, rtol=0.02)
    np.testing.assert_allclose(drawn.mean(axis=0), small.linear.mean, atol=2e-3 * drawn.std())


def test_worst_case_is_the_worse_corner(small):
    low, high = small.linear.worst_case[0]
    corners = []
    for depth in (-1e-4, 1e-4):
        for modulus in (0.999, 1.001):
            for friction in (-3e-4, 3e-4):
                values = {
                    "notch.depth": 1.40 + depth,
                    "material.elastic_modulus": 1e4 * modulus,
                    "friction.coefficient": 0.13 + friction,
                }
                robot = WRIST.with_values(values)
                corners.append(nf.simulate(robot, PULLED["pulled"]).total_angle[-1])
    nominal = small.linear.nominal[0]
    assert low - nominal == pytest.approx(min(corners) - nominal, rel=0.02)
    assert high - nominal == pytest.approx(max(corners) - nominal, rel=0.02)


def test_every_robot_has_a_row_with_what_became_of_it(small):
    values = small.drawn.outcomes.values[:, 0]
    accepted = small.drawn.outcomes.accepted
    assert small.draws == len(values) == 800
    assert accepted.any()
    assert not accepted.all()
    np.testing.assert_array_equal(accepted, values >= LEAST)
    assert small.accepted_fraction == accepted.mean()
    low, high = small.interval
    assert low < small.accepted_fraction < high
    assert sum(small.counts.values()) == small.draws


def test_sobol_indices_are_parts_of_the_variance_where_effects_add(small):
    np.testing.assert_allclose(small.sobol.first[0], small.linear.share[0], atol=0.05)
    np.testing.assert_allclose(small.sobol.total[0], small.linear.share[0], atol=0.05)


def test_a_drawn_robot_is_the_robot_with_those_numbers(small):
    row = 7
    numbers = {name: float(values[row]) for name, values in small.drawn.numbers.items()}
    path = nf.simulate(WRIST.with_values(numbers), PULLED["pulled"])
    np.testing.assert_allclose(
        small.drawn.outcomes.values[row],
        [path.total_angle[1], path.tip_position[1, 0], path.notch_angle[0, 1]],
        rtol=1e-5,  # as exactly as varied chains are
    )


def test_the_table_of_the_robot_holds_where_none_is_given():
    robot = WRIST.replace(tolerance={"notch.depth": 0.004})
    limits = [nf.AcceptanceLimit("total_angle", lower=0.8)]
    chosen, assumed = tolerances_for(robot, nf.ToleranceSpec(limits, PULLED))
    assert (chosen[0].value, chosen[0].sd) == ("notch.depth", 0.004)
    assert "notch.depth" not in assumed
    chosen, assumed = tolerances_for(robot, nf.ToleranceSpec(limits, PULLED, SMALL))
    assert [one.value for one in chosen] == list(SMALL)
    assert assumed == ()


def test_a_limit_without_a_notch_holds_for_each():
    spec = nf.ToleranceSpec([nf.AcceptanceLimit("peak_strain", upper=0.2)], PULLED, SMALL)
    found = criteria_of(spec, {"pulled": nf.simulate(WRIST, PULLED["pulled"])})
    assert [one.name for one in found] == [f"peak_strain[{n}]" for n in range(1, 6)]


def test_a_robot_that_fails_has_a_row_and_counts_as_rejected():
    tolerances = {"notch.depth": {"plus": 0.3, "minus": 0.01}}
    limits = [nf.AcceptanceLimit("total_angle", lower=0.0)]
    spec = nf.ToleranceSpec(limits, PULLED, tolerances)
    paths = {"pulled": nf.simulate(WRIST, PULLED["pulled"])}
    chosen = WRIST.replace(tolerance=tolerances).tolerance
    study = Study(WRIST, chosen, paths, criteria_of(spec, paths))
    found = study.at_levels(np.array([[0.05], [0.9], [0.02]]))
    assert [CODES[code] for code in found.codes] == ["accepted", "INVALID_ROBOT", "accepted"]
    assert np.isnan(found.values[1]).all()
    assert found.accepted.tolist() == [True, False, True]


def test_moments_are_those_of_the_deviations():
    levels = (np.arange(200_000) + 0.5) / 200_000
    for one in (
        Tolerance("a", sd=0.1),
        Tolerance("a", plus=0.3, minus=0.1),
        Tolerance("a", sd="5 %", plus=0.08, minus=0.02),
        Tolerance("a", sd=0.1, plus=0.05),
    ):
        drawn = deviation(one, 2.0, levels)
        mean, sd = moments(one, 2.0)
        assert mean == pytest.approx(drawn.mean(), abs=1e-4)
        assert sd == pytest.approx(drawn.std(), rel=1e-3)


def test_the_interval_holds_the_yield_as_often_as_it_says():
    """A rule whose yield is known in closed form: a quarter of a disc in the square."""
    truth, held = np.pi / 4.0, 0
    for seed in range(400):
        sets = np.stack(replicates(2, 32, seed))
        accepted = ((sets**2).sum(axis=-1) <= 1.0).sum(axis=-1)
        low, high = yield_interval(accepted, 32)
        held += low <= truth <= high
    assert abs(held / 400 - 0.95) <= 0.02


def test_an_interval_without_rejects_is_that_of_independent_draws():
    low, high = yield_interval(np.full(25, 64), 64)
    assert high == 1.0
    assert 1.0 - low == pytest.approx(2.064**2 / (1600 + 2.064**2), rel=1e-3)


@pytest.mark.parametrize(
    ("limit", "code"),
    [
        ({"quantity": "angel", "lower": 1.0}, "UNKNOWN_NAME"),
        ({"quantity": "total_angle"}, "MISSING_VALUE"),
        ({"quantity": "total_angle", "lower": 1.0, "upper": 0.5}, "OUT_OF_RANGE"),
        ({"quantity": "total_angle", "lower": float("nan")}, "NOT_FINITE"),
        ({"quantity": "total_angle", "lower": "1"}, "WRONG_TYPE"),
        ({"quantity": "total_angle", "lower": 1.0, "notch": 1}, "CONFLICT"),
        ({"quantity": "tip_position", "lower": 1.0}, "MISSING_VALUE"),
        ({"quantity": "notch_angle", "lower": 1.0, "notch": 0}, "OUT_OF_RANGE"),
        ({"quantity": "notch_angle", "lower": 1.0, "notch": 1.5}, "WRONG_TYPE"),
    ],
)
def test_limits_that_cannot_be(limit, code):
    with refused(code):
        nf.AcceptanceLimit(**limit)


@pytest.mark.parametrize(
    ("limit", "code"),
    [
        ({"notch": 6}, "OUT_OF_RANGE"),
        ({"step": 3}, "OUT_OF_RANGE"),
        ({"load": "pushed"}, "UNKNOWN_NAME"),
    ],
)
def test_limits_that_robot_and_loads_do_not_have(limit, code):
    with refused(code):
        limits = [nf.AcceptanceLimit("notch_angle", lower=0.1, **limit)]
        analysed(nf.ToleranceSpec(limits, PULLED, SMALL))


def test_nothing_deviates():
    limits = [nf.AcceptanceLimit("total_angle", lower=0.1)]
    with refused("NO_DATA"):
        analysed(nf.ToleranceSpec(limits, PULLED, {"notch.depth": 0.0}))
