"""Unloading rows against loading rows: a difference is found, and rarely seen in noise."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from notchflex.fit import branch_words
from notchflex.fit.diagnosis import branch_difference

BRANCH = np.repeat([1, -1], 10)


def test_noise_is_rarely_taken_for_hysteresis():
    random = np.random.default_rng(1)
    found = [branch_difference(random.standard_normal(20), BRANCH) for _ in range(1000)]
    # two tests at 1 % and three standard deviations of 1,000 draws
    assert sum(one is not None for one in found) < 1000 * 0.02 + 3.0 * np.sqrt(20.0)


def test_hysteresis_of_twice_the_noise_is_found():
    random = np.random.default_rng(2)
    lag = np.where(BRANCH < 0, np.sin(np.linspace(0.0, 2.0 * np.pi, 20)) ** 2 * 4.0, 0.0)
    found = [branch_difference(lag + random.standard_normal(20), BRANCH) for _ in range(200)]
    assert sum(one is not None and one[1] > one[0] for one in found) > 150


def test_few_rows_one_branch_and_no_error_tell_nothing():
    assert branch_difference(np.array([0.0, 0.0, 1.0, 1.0]), np.array([1, 1, -1, -1])) is None
    assert branch_difference(np.arange(20.0), np.ones(20, int)) is None
    assert branch_difference(np.zeros(20), BRANCH) is None
    # a misfit that is much alike on both branches
    smooth = 1.0 - 0.1 * (BRANCH < 0) + 1e-3 * np.cos(np.arange(20.0) ** 2)
    assert branch_difference(smooth, BRANCH) is None
    missing = np.where(BRANCH < 0, np.nan, 1.0)
    assert branch_difference(missing, BRANCH) is None


def test_exact_numbers_that_differ():
    assert branch_difference(np.where(BRANCH < 0, 0.1, 0.0), BRANCH) == pytest.approx((0.0, 0.1))


def test_words_say_what_to_do():
    load = nf.pull(0.0, 1.0, steps=11).release()
    angle = {"total_angle": np.zeros(len(load))}
    rest, path = (
        nf.Measurements("my.csv", load, ("1",) * len(load), from_rest, angle)
        for from_rest in (True, False)
    )
    off = np.where(rest.branches < 0, 0.1, -0.05)
    (said,) = branch_words(off, "total_angle", rest)
    assert said.startswith(
        "Unloading rows of my.csv are 5.7 deg above the model and loading rows 2.9 deg below it:"
    )
    assert "--path" in said
    (said,) = branch_words(off, "notch_angle", path)
    assert "(mean of the notches): the hysteresis of the model is not that of the data" in said
    assert branch_words(np.zeros(len(load)), "total_angle", rest) == ()
