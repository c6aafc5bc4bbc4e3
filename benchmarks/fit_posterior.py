"""NUTS against profile-likelihood intervals, on measured wrist B of Pacheco 2021.

    python benchmarks/fit_posterior.py FOLDER [--draws 500] [--chains 2]

FOLDER holds `pacheco2021_wrist_B_measured.csv`. Prints both intervals of every constant, how far
the means lie apart in standard errors of the draws, and how far to trust the draws.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from harness import options, show, timed

import notchflex as nf
from notchflex.fit import calibrate, read_measurements, sample_posterior

THREE = ("material.elastic_modulus", "material.superelastic_modulus", "friction.coefficient")


def main() -> None:
    """Fit, draw, and print a row for each constant."""
    chosen = options(__doc__, folder=Path, draws=500, chains=2)
    robot = nf.load_robot("pacheco2021-b-specimen")
    seen = read_measurements(chosen.folder / "pacheco2021_wrist_B_measured.csv", robot)
    fitted = calibrate(robot, seen, THREE, starts=2)
    with timed() as seconds:
        sampled = sample_posterior(fitted, draws=chosen.draws, chains=chosen.chains)
    title = f"{chosen.chains} x {chosen.draws} draws, {sampled.divergent} divergent, "
    show((row(name, fitted, sampled) for name in THREE), title + f"{seconds['wall']:.0f} s")


def row(name: str, fitted, sampled) -> dict[str, object]:
    """Make the row of a constant."""
    interval, (lower, upper) = fitted.intervals[name], sampled.intervals[name]
    error = sampled.deviations[name] / np.sqrt(sampled.effective[name])
    return {
        "constant": name,
        "profile": f"{interval.lower:.5g} to {interval.upper:.5g}",
        "NUTS": f"{lower:.5g} to {upper:.5g}",
        "mean": f"{sampled.means[name]:.5g} ± {error:.2g}",
        "estimate": f"{fitted.values[name]:.5g}",
        "worth draws": round(sampled.effective[name]),
        "R-hat": f"{sampled.r_hat[name]:.3f}",
    }


if __name__ == "__main__":
    main()
