"""The identification of Pacheco 2021 (eq. 17) on their measurements, and honest tests of it.

Needs their measured angles, `pacheco2021_wrist_A_measured.csv` and so on, in a folder (public, see
docs/papers/pacheco2021.md):

    python benchmarks/fit_pacheco2021.py FOLDER [--starts 20] [--json FILE]

Prints where every start of eq. 17 ends, with the time and the solved rows beside the paper's 2,800
trial points; constants and errors of each wrist left out; the two linear models of the paper, whose
friction goes to its limit; and least squares with 95 % intervals.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np

import notchflex as nf
from notchflex.fit import (
    Calibration,
    Constant,
    LeastSquares,
    SumOfRobotErrors,
    calibrate,
    diagnose,
    leave_out,
    read_measurements,
)

PAPERS_TRIALS = 2_800
FRICTION = Constant("friction.coefficient", 0.0, 0.5)
FOUR = (
    Constant("material.elastic_modulus", 5e3, 20e3),
    Constant("material.superelastic_modulus", 1e3, 6e3),
    Constant("material.transition_strain", 0.01, 0.05),
    FRICTION,
)


def main() -> None:
    """Read what is asked, and run all of it."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("--starts", type=int, default=20)
    arguments.add_argument("--json", type=Path)
    given = arguments.parse_args()
    robots, data = specimens(given.folder)
    told = {
        "eq17": eq17(robots, data, given.starts),
        "left_out": left_out(robots, data),
        "linear": linear(robots, data),
        "least_squares": least_squares(robots, data),
    }
    if given.json:
        given.json.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")


def specimens(folder: Path):
    """The three wrists with the authors' precurvature, and what was measured of them."""
    robots = {name: nf.load_robot(f"pacheco2021-{name.lower()}-specimen") for name in "ABC"}
    data = {
        name: read_measurements(folder / f"pacheco2021_wrist_{name}_measured.csv", robot)
        for name, robot in robots.items()
    }
    return robots, data


def eq17(robots, data, starts: int):
    """Four constants of three wrists, from random starts."""
    began = time.perf_counter()
    found = calibrate(robots, data, FOUR, objective=SumOfRobotErrors(), starts=starts, seed=0)
    seconds = time.perf_counter() - began
    ends = [one.cost.value for one in found.searches if one.cost is not None]
    calls = sum(one.calls for one in found.searches)
    print(f"eq. 17: {found.cost:.6f} deg at {_text(found)}")
    print(
        f"  {sum(end <= 11.5942 for end in ends)} of {starts} starts end at or below 11.5942 "
        f"(highest {max(ends):.6f}); {seconds:.0f} s, {calls} evaluations of all 226 rows "
        f"({found.solves} solves) beside the paper's {PAPERS_TRIALS} trial points"
    )
    return {
        "values": found.values,
        "cost": found.cost,
        "ends": ends,
        "seconds": seconds,
        "evaluations": calls,
        "solves": found.solves,
    }


def left_out(robots, data):
    """Each wrist, and each pull, left out of eq. 17."""
    told = {}
    found = calibrate(robots, data, FOUR, objective=SumOfRobotErrors(), starts=3)
    for by, starts in (("robot", 3), ("pull", 1)):
        tested = leave_out(found, by=by, starts=starts)
        for fold in tested.folds:
            without = np.degrees(fold.errors["total_angle"])
            of_all = np.degrees(fold.errors_of_all["total_angle"])
            print(f"without {fold.label}: total {without:.2f} deg (fitted to all {of_all:.2f})")
            values = fold.found.values
            told[fold.label] = {"values": values, "total_deg": without, "of_all": of_all}
    return told


def linear(robots, data):
    """Models (i) and (ii): one modulus, with and without friction, in the authors' limits."""
    told = {}
    plain = {name: robot.with_value("material.kind", "linear") for name, robot in robots.items()}
    modulus = Constant("material.elastic_modulus", 2e3, 20e3)
    bounded = Constant("friction.coefficient", 0.05, 0.5)
    slick = {name: robot.with_value("friction.coefficient", 0.0) for name, robot in plain.items()}
    for label, these, fit in (("i", plain, (modulus, bounded)), ("ii", slick, (modulus,))):
        found = calibrate(these, data, fit, objective=SumOfRobotErrors(), starts=3)
        print(f"linear model ({label}): {found.cost:.4f} deg at {_text(found)}")
        for sentence in diagnose(found):
            print(f"  {sentence}")
        told[label] = {"values": found.values, "cost": found.cost}
    return told


def least_squares(robots, data):
    """The same four constants by least squares over the noise of the repeats, with intervals."""
    found = calibrate(robots, data, FOUR, objective=LeastSquares(), starts=3)
    print(f"least squares: reduced chi squared {found.reduced_chi_squared:.2f}")
    told = {}
    for name, interval in found.intervals.items():
        ends = (interval.lower, interval.upper)
        print(f"  {name}: {found.values[name]:.6g}, 95 % {ends[0]:.6g} to {ends[1]:.6g}")
        told[name] = {"value": found.values[name], "interval": ends}
    for sentence in diagnose(found):
        print(f"  {sentence}")
    return told


def _text(found: Calibration) -> str:
    every = (f"{name.split('.')[1]} {value:.6g}" for name, value in found.values.items())
    return ", ".join(every)


if __name__ == "__main__":
    main()
