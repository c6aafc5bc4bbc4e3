"""The closed-form cantilever: against elliptic integrals and shooting, a textbook, its limits."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import notchflex as nf
from reference_data import choose, reference
from refusals import refused

COLUMNS = ("slope", "along", "across", "chord")
KINDS = {"clamp_angle": 0, "follower": 1}


@pytest.mark.parametrize("kind", KINDS)
def test_reference(kind, margin):
    table = choose(reference("liu_single_beam.csv"), mode=(0, KINDS[kind]))
    found = nf.elastica(table[:, 2], 1.0, 1.0, **{kind: np.radians(table[:, 1])})
    for what, value, wanted in zip(COLUMNS, found, table[:, 3:].T, strict=True):
        margin.within(f"{kind}, {what}", value - wanted, 1e-12)


def test_small_loads_are_the_linear_beam(margin):
    load = np.array([0.0, 1e-20, 1e-12, 1e-8])
    tip = nf.elastica(load, 1.0, 1.0)
    margin.within("slope, relative", tip.tip_slope[1:] / (0.5 * load[1:]) - 1.0, 1e-11)
    margin.within("across", tip.tip_across - load / 3.0, 1e-15)
    assert tip.tip_slope[0] == 0.0
    assert tip.tip_along[0] == 1.0


@pytest.mark.parametrize(
    ("kind", "load"),
    [("clamp_angle", 30.0), ("follower", 30.0), ("follower", 100.0), ("follower", 400.0)],
)
def test_large_loads_solve_the_equation(kind, load, margin):
    # From the free end with the slope found, the angle at the clamp must come out. Integrating
    # toward the clamp runs down the stable way, so that errors do not grow beyond e^lambda.
    angle = np.radians(100.0)
    tip = nf.elastica(load, 1.0, 1.0, **{kind: angle})
    free = angle + float(tip.tip_slope) if kind == "clamp_angle" else angle

    def slopes(_, state):
        return [state[1], -load * np.sin(state[0]), np.cos(state[0]), np.sin(state[0])]

    ends = solve_ivp(slopes, (0, 1), [free, 0, 0, 0], rtol=1e-12, atol=1e-13, method="DOP853").y
    clamp, opposite, across = ends[0, -1], ends[2, -1], ends[3, -1]
    margin.within("angle at the clamp", clamp - (free - tip.tip_slope), 1e-9)
    along = opposite * np.cos(clamp) + across * np.sin(clamp)
    margin.within("along", along - tip.tip_along, 1e-9)
    margin.within(
        "across", across * np.cos(clamp) - opposite * np.sin(clamp) - tip.tip_across, 2e-10
    )


def test_very_large_load_pulls_the_beam_straight():
    # A cantilever bends within sqrt(EI/F) of its clamp, then it lies along the force.
    tip = nf.elastica(2500.0, 1.0, 1.0)
    assert float(tip.tip_slope) == pytest.approx(0.5 * np.pi, abs=1e-15)
    # Its corner takes (2 - sqrt 2) of 1/lambda: integral of 1 - cos over the half-infinite beam.
    assert float(tip.tip_across) == pytest.approx(1.0 - (2.0 - np.sqrt(2.0)) / 50.0, rel=1e-12)


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        ({"load": -1.0}, "NOT_FINITE"),
        ({"length": 0.0}, "NOT_FINITE"),
        ({"bending_stiffness": np.nan}, "NOT_FINITE"),
        ({"clamp_angle": 3.2}, "NOT_FINITE"),
        ({"follower": 0.0}, "NOT_FINITE"),
        ({"follower": 1.0, "clamp_angle": 1.0}, "CONFLICT"),
        ({"load": 1e6}, "OUT_OF_RANGE"),
    ],
)
def test_bad_input(arguments, code):
    with refused(code, *arguments):
        nf.elastica(**({"load": 1.0, "length": 1.0, "bending_stiffness": 1.0} | arguments))


def test_modulus_comes_back(margin):
    force = np.array([2.0, 4.0, 6.0, 9.0])
    for kind in ("clamp_angle", "follower"):
        angle = nf.elastica(force, 8.0, 1000.406 * 1.125, **{kind: 1.6}).chord_angle
        fitted = nf.modulus_from_single_notch(
            force, angle, length=8.0, second_moment=1.125, **{kind: 1.6}
        )
        margin.within(f"{kind}, MPa", fitted - 1000.406, 2e-8)


def test_modulus_is_the_least_squares_one():
    force = np.array([2.0, 4.0, 6.0])
    angle = nf.elastica(force, 8.0, 1125.0).chord_angle + np.array([0.01, -0.004, 0.006])
    fitted = nf.modulus_from_single_notch(force, angle, length=8.0, second_moment=1.125)

    def squares(modulus):
        return np.sum((nf.elastica(force, 8.0, 1.125 * modulus).chord_angle - angle) ** 2)

    assert squares(fitted) < min(squares(0.999 * fitted), squares(1.001 * fitted))


@pytest.mark.parametrize(("force", "angle"), [([1.0, 2.0], [0.1]), ([1.0], [-0.1]), ([], [])])
def test_modulus_needs_tests_that_bend(force, angle):
    with pytest.raises(nf.InputError):
        nf.modulus_from_single_notch(force, angle, length=8.0, second_moment=1.125)
