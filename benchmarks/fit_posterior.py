"""NUTS against profile-likelihood intervals, on measured wrist B of Pacheco 2021.

    python benchmarks/fit_posterior.py FOLDER [--draws 500] [--chains 2]

FOLDER holds `pacheco2021_wrist_B_measured.csv`. Prints both intervals of every constant, how far
the means lie apart in standard errors of the draws, and how far to trust the draws.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

import notchflex as nf
from notchflex.fit import calibrate, read_measurements, sample_posterior

THREE = ("material.elastic_modulus", "material.superelastic_modulus", "friction.coefficient")


def main() -> None:
    """Read what is asked, fit, and draw."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("--draws", type=int, default=500)
    arguments.add_argument("--chains", type=int, default=2)
    given = arguments.parse_args()
    robot = nf.load_robot("pacheco2021-b-specimen")
    seen = read_measurements(given.folder / "pacheco2021_wrist_B_measured.csv", robot)
    found = calibrate(robot, seen, THREE, starts=2)
    began = time.perf_counter()
    drawn = sample_posterior(found, draws=given.draws, chains=given.chains)
    seconds = time.perf_counter() - began
    print(f"{given.chains} x {given.draws} draws in {seconds:.0f} s, {drawn.divergent} divergent")
    for name in found.names:
        interval = found.intervals[name]
        lower, upper = drawn.intervals[name]
        error = drawn.deviations[name] / np.sqrt(drawn.effective[name])
        print(
            f"{name}: profile {interval.lower:.5g} to {interval.upper:.5g}, "
            f"NUTS {lower:.5g} to {upper:.5g}; mean {drawn.means[name]:.5g} +- {error:.2g}, "
            f"estimate {found.values[name]:.5g}; worth {drawn.effective[name]:.0f} draws, "
            f"R-hat {drawn.r_hat[name]:.3f}"
        )


if __name__ == "__main__":
    main()
