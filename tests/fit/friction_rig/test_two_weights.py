"""Liu's eq. 21 and its inverse: the printed form, the force balance, limits, slopes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from notchflex.fit import coefficient_from_weights, weight_held
from notchflex.fit.friction_rig import LAWS, slopes_of_coefficient
from refusals import refused

turns = st.floats(0.01, 1.9)


@given(
    mu=st.floats(0.0, 0.7), first=turns, second=turns, weight=st.floats(1.0, 5000.0),
    law=st.sampled_from(LAWS),
)  # fmt: skip
def test_round_trip(mu, first, second, weight, law):
    held = weight_held(weight, mu, first, second, law)
    found = coefficient_from_weights(weight, held, first, second, law)
    # A weight is told to 2e-16 of it; turns of 0.6 deg magnify that by 1 / (b1 + b2) = 100.
    np.testing.assert_allclose(found, mu, rtol=0.0, atol=1e-12)


@given(mu=st.floats(0.01, 0.7), first=turns, second=turns)
def test_it_is_the_printed_formula(mu, first, second):
    m1, m2 = 100.0, float(weight_held(100.0, mu, first, second, "corner"))
    total, apart = m1 + m2, m1 - m2
    half = np.sin(0.5 * (first + second))
    root = np.sqrt(total**2 * half**2 - apart**2 * np.sin(first) * np.sin(second))
    printed = (total * half - root) / (2.0 * apart * np.sin(0.5 * first) * np.sin(0.5 * second))
    found = coefficient_from_weights(m1, m2, first, second, "corner")
    # The printed form loses digits where its two parts are nearly the same.
    lost = total * half / (2.0 * apart * np.sin(0.5 * first) * np.sin(0.5 * second))
    np.testing.assert_allclose(found, printed, atol=1e-14 * lost + 1e-13)


def test_forces_on_the_string_balance_at_both_edges():
    mu, first, second = 0.23, 1.1, 0.4
    low, high = float(weight_held(1.0, mu, first, second, "corner")), 1.0
    between = high
    for turn in (first, second):  # Coulomb's law, the pressure on the bisector
        sine, cosine = np.sin(0.5 * turn), np.cos(0.5 * turn)
        behind = between * (cosine - mu * sine) / (cosine + mu * sine)
        assert (between - behind) * cosine == pytest.approx(mu * (between + behind) * sine)
        between = behind
    assert between == pytest.approx(low, rel=1e-14)


def test_limits():
    assert coefficient_from_weights(100.0, 100.0, 1.0, 1.2) == 0.0
    # one edge alone: mu = q / tan(turn / 2)
    one = coefficient_from_weights(100.0, 80.0, 1.0, 0.0, "corner")
    assert one == pytest.approx(20.0 / 180.0 / np.tan(0.5))
    # small turns: a capstan over the sum of them
    mu = coefficient_from_weights(1.0, np.exp(-0.3 * 2e-3), 1e-3, 1e-3, "corner")
    assert mu == pytest.approx(0.3, rel=1e-6)


@pytest.mark.parametrize("law", LAWS)
def test_slopes(law):
    values = np.array([[200.0, 50.0], [150.0, 30.0], [1.5, 0.6], [1.2, 0.0]])
    slopes = slopes_of_coefficient(values, law)
    for place in range(4):
        step = 1e-6 * max(values[place].max(), 1.0)
        up, down = values.copy(), values.copy()
        up[place], down[place] = up[place] + step, down[place] + (0.0 if place == 3 else -step)
        width = (up - down)[place]
        found = coefficient_from_weights(*up, law) - coefficient_from_weights(*down, law)
        np.testing.assert_allclose(slopes[place], found / width, rtol=1e-5)


@pytest.mark.parametrize(
    ("reading", "code", "name"),
    [
        ((100.0, 110.0, 1.0, 1.0), "OUT_OF_RANGE", "reading 2: weight 2"),
        ((100.0, 90.0, 0.0, 0.0), "OUT_OF_RANGE", "difference of the weights"),
        ((100.0, 100.0, 0.0, 0.0), "OUT_OF_RANGE", "reading 2: the string"),
        ((0.0, 0.0, 1.0, 1.0), "OUT_OF_RANGE", "reading 2: both weights"),
        ((100.0, 90.0, 3.2, 1.0), "OUT_OF_RANGE", "0 to less than 180"),
        ((100.0, 90.0, -0.1, 1.0), "OUT_OF_RANGE", "reading 2: a string"),
    ],
)
def test_readings_that_cannot_be(reading, code, name):
    both = zip((100.0, 90.0, 1.0, 1.0), reading, strict=True)
    with refused(code, name):
        coefficient_from_weights(*both, "corner")


def test_an_edge_that_holds_any_pull_is_refused():
    with refused("OUT_OF_RANGE", "coefficient * tan(turn / 2)"):
        weight_held(100.0, 0.8, 2.0, 0.1, "corner")


def test_the_belt_equation():
    """Capstan: 100 g against 63.1 g over 175 deg; a rod turns the string by any angle."""
    mu = coefficient_from_weights(100.0, 63.1, *np.radians([90.0, 85.0]))
    assert mu == pytest.approx(np.log(100.0 / 63.1) / np.radians(175.0), rel=1e-15)
    assert coefficient_from_weights(100.0, 65.0, np.radians(170.0), 0.0) == pytest.approx(
        0.1452, abs=5e-5
    )
    assert coefficient_from_weights(100.0, 30.0, 2.0 * np.pi, 0.0) == pytest.approx(
        0.1916, abs=5e-5
    )
