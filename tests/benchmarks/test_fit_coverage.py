"""A small draw of the coverage of intervals: they hold the truth, and nothing is biased."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

FOLDER = Path(__file__).parents[2] / "benchmarks"
COUNT = 6


@pytest.fixture
def coverage():
    if not FOLDER.is_dir():
        pytest.skip("benchmarks are no part of this installation")
    sys.path.insert(0, str(FOLDER))
    yield __import__("fit_coverage")
    sys.path.remove(str(FOLDER))


@pytest.mark.nightly
def test_intervals_of_a_few_repetitions_hold_the_truth(coverage):
    case = coverage.cases()["short"]
    rows = [coverage.trial(case, number) for number in range(COUNT)]
    estimates, holds = (np.array([row[key] for row in rows]) for key in ("estimates", "holds"))
    # 24 intervals of 95 %: 5 misses or more happen once in 140 draws, and the draw is fixed.
    assert holds.sum() >= holds.size - 4
    off = (estimates.mean(axis=0) - case.truth) / (estimates.std(axis=0, ddof=1) / np.sqrt(COUNT))
    # Student's t with 5 degrees of freedom: beyond 6 once in 500 draws of one constant.
    assert (np.abs(off) < 6.0).all()
