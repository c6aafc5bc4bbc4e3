"""A small draw of the fuzz: nothing silent, nothing wrong, reasons for what is not solved."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "benchmarks"
# One shape of each kind of notch, friction and load; all of them are drawn by the benchmark.
NUMBERS = (0, 1, *(pytest.param(one, marks=pytest.mark.nightly) for one in (2, 5, 8, 13)))
DRAWN = (1, 2)  # with hysteresis; linear under loads in the plane


@pytest.fixture(scope="module")
def robustness():
    if not FOLDER.is_dir():
        pytest.skip("benchmarks are no part of this installation")
    sys.path.insert(0, str(FOLDER))
    yield __import__("robustness")
    sys.path.remove(str(FOLDER))


@pytest.mark.nightly
@pytest.mark.parametrize("number", NUMBERS)
def test_a_draw_is_solved_or_says_why(robustness, number):
    follow_draws(robustness, __import__("shapes").SHAPES, number)


@pytest.mark.nightly
@pytest.mark.parametrize("number", DRAWN)
def test_a_draw_as_the_tube_makes_it_is_solved_or_says_why(robustness, number):
    follow_draws(robustness, __import__("shapes").DRAWN, number)


def follow_draws(robustness, shapes, number):
    """Follow two draws of a shape."""
    draw = __import__("draw")
    for row in range(2):
        one = draw.draw(number + row * len(shapes), 7, shapes[number])
        for outcome in robustness.follow(one):
            assert not outcome.silent
            assert not outcome.wrong
            assert outcome.reason == "" or len(outcome.reason) > 20
