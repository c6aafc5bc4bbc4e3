"""Do 95 % intervals cover in 95 % of cases? 400 fits of each case.

    python benchmarks/fit_coverage.py [wrist short strip links outliers] [--count 400] [--json FILE]

Every repetition draws new noise (seed 0 and its number), fits, and asks whether the 95 % interval
of every constant (profile likelihood) holds the true value: whether the misfit there, with others
making the best of it, has risen by no more than within the interval (`Calibration.allows`; that its
ends say the same is a test). Prints coverage, the bias of the estimates in standard errors, the
mean width of the intervals (linearised), and how often the fit is told not to be trusted.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from harness import options, share, show, trials

import notchflex as nf
from notchflex.fit import LeastSquares, Measurements, calibrate, simulate_measurements
from notchflex.robot.value_names import number_at

MATERIAL = ("material.elastic_modulus", "friction.coefficient")
FOUR = (
    "material.elastic_modulus",
    "material.superelastic_modulus",
    "material.transition_strain",
    "friction.coefficient",
)
OUTLIERS, AWAY = 0.08, 6.0
"""Part of the numbers that are outliers, and how far off they are, in standard deviations."""


@dataclass(frozen=True)
class Case:
    """A robot, what is measured of it and how, and what is fitted.

    Attributes:
        robot: The robot that is measured and fitted.
        load: The loads of a pull.
        names: The constants.
        noise: Standard deviations of what is measured.
        axis_at: Places of points on the axis.
        outliers: Whether some numbers are far off, and Huber's objective is taken.
    """

    robot: nf.Robot
    load: nf.LoadPath
    names: tuple[str, ...]
    noise: dict[str, float]
    axis_at: Any = ()
    outliers: bool = False

    @property
    def truth(self) -> np.ndarray:
        """The true constants."""
        return np.array([number_at(self.robot, name) for name in self.names])


def cases() -> dict[str, Case]:
    """Return all cases by name."""
    wrist, links = nf.load_robot("pacheco2021-a"), nf.load_robot("gao2017")
    fine, points = {"notch_angle": np.radians(0.5)}, np.linspace(1.0, 34.0, 30)
    loop = nf.pull(2.0, 12.0, steps=6).release()
    many, few = (nf.pull(0.15, 1.65, steps=steps) for steps in (68, 8))
    return {
        # As many rows as Pacheco 2021 measured of wrist A, and so few that bias shows.
        "wrist": Case(wrist, many, FOUR, fine),
        "short": Case(wrist, few, FOUR, fine),
        "strip": Case(nf.load_robot("liu2022"), nf.pull(1.0, 9.0, steps=9), MATERIAL, fine),
        "links": Case(links, loop, MATERIAL, {"axis_points": 0.1}, points),
        "outliers": Case(wrist, many, FOUR, fine, outliers=True),
    }


def measured(case: Case, number: int) -> Measurements:
    """Return what is measured in one repetition."""
    random = np.random.default_rng([0, number])
    seen = simulate_measurements(
        case.robot,
        case.load,
        observed=tuple(case.noise),
        deviation=case.noise,
        seed=random,
        axis_at=case.axis_at,
        from_rest=len(case.axis_at) == 0,
    )
    if case.outliers:
        for name, values in seen.observed.items():
            away = random.random(values.shape) < OUTLIERS
            values += away * AWAY * case.noise[name] * random.choice((-1.0, 1.0), values.shape)
    return seen


def trial(case: Case, number: int) -> dict[str, Any]:
    """Fit once: estimates, widths, whether intervals hold the truth, and whether it is trusted."""
    found = calibrate(
        case.robot,
        measured(case, number),
        case.names,
        starts=1,
        intervals=False,
        priors=False,
        objective=LeastSquares(1.5) if case.outliers else None,
    )
    pairs = zip(case.names, case.truth.tolist(), strict=True)
    return {
        "estimates": list(found.values.values()),
        "widths": 2.0 * found.half_width(np.eye(len(case.names))),
        "holds": [bool(found.allows(*pair)) for pair in pairs],
        "trusted": bool(found.trusted),
    }


def summary(name: str, case: Case, rows: list[dict]):
    """Make a row of the table for each constant."""
    keys = ("estimates", "widths", "holds", "trusted")
    estimates, widths, holds, trusted = (np.array([row[key] for row in rows]) for key in keys)
    error = estimates.std(axis=0, ddof=1) / np.sqrt(len(rows))
    for k, constant in enumerate(case.names):
        bias = estimates[:, k].mean() - case.truth[k]
        yield {
            "case": name,
            "constant": constant,
            "covers": share(holds[:, k]),
            "bias": float(bias),
            "in standard errors": float(bias / error[k]),
            "width": float(widths[:, k].mean()),
            "not trusted": share(~trusted),
            "covers or is not trusted": share(holds[:, k] | ~trusted),
        }


if __name__ == "__main__":
    every = cases()
    chosen = options(__doc__, every, count=400, part="0/1")
    for name in chosen.cases:
        case = every[name]
        rows = list(trials(partial(trial, case), chosen, name))
        show(summary(name, case, rows))
