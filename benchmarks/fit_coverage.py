"""Do 95 % intervals cover in 95 % of cases, also where the model is wrong? 400 fits of each case.

    python benchmarks/fit_coverage.py [--case NAME ...] [--count 400] [--json FILE]

Every repetition draws new noise (seed 0 and its number), fits, and asks whether the 95 % interval
of every constant (profile likelihood) holds the true value: whether the misfit there, with others
making the best of it, has risen by no more than within the interval (`Calibration.allows`; that its
ends say the same is a test). Prints coverage, the bias of the estimates and its standard error, the
mean width of the intervals (linearised), and how often the fit is told not to be trusted.

Cases: robots of the papers (wrist, short, strip, links), and a nitinol wrist loaded and unloaded:
clean, with noise of 1 deg; tolerances, a robot drawn within those that are assumed; deeper, 15 um
deeper than its file with a plateau of 320 instead of 350 MPa, and without_priors the same; shifted,
four pulls of totals shifted as wholes by 2 deg; outliers, 8 % of the angles off by 6 times the
noise, by Huber's objective, and squares the same by least squares.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import notchflex as nf
from notchflex.analysis.draws import draw_robots, tolerances_of
from notchflex.fit import LeastSquares, Measurements, calibrate, simulate_measurements
from notchflex.robot.value_names import number_at

SEED = 0
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
        robot: The robot of the file.
        load: The loads of a pull.
        noise: Standard deviations of what is measured.
        names: The constants.
        truth: What the robot has that was measured; None draws it within the assumed tolerances.
        pulls: How often it is pulled.
        shift: Standard deviation of the shift of a whole pull (rad).
        outliers: Whether some numbers are far off.
        from_rest: Whether every row starts from rest.
        axis_at: Places of points on the axis.
        priors: Whether tolerances are priors.
        objective: The objective.
    """

    robot: nf.Robot
    load: Any
    noise: dict[str, float]
    names: tuple[str, ...] = MATERIAL
    truth: dict[str, float] | None = None
    pulls: int = 1
    shift: float = 0.0
    outliers: bool = False
    from_rest: bool = False
    axis_at: Any = ()
    priors: bool = False
    objective: LeastSquares | None = None


def cases() -> dict[str, Case]:
    """Return all cases by name."""
    wrist = nf.load_robot("pacheco2021-a")
    cycle = nf.pull(2.0, 12.0, steps=6).release()
    points = np.linspace(1.0, 34.0, 30)
    fine, degree = {"notch_angle": np.radians(0.5)}, {"notch_angle": np.radians(1.0)}
    nitinol = wrist.replace(
        material={"kind": "nitinol", "elastic_modulus": 36e3, "plateau_stress": 350.0,
                  "plateau_modulus": 6e3},
        friction={"kind": "capstan", "coefficient": 0.24},
    )  # fmt: skip
    load = nf.pull(0.2, 2.4, steps=12).release()
    clean = Case(nitinol, load, degree, truth={})
    deeper = {"notch.depth": 1.415, "material.plateau_stress": 320.0}
    totals = {"total_angle": np.radians(2.0)}
    off = replace(clean, noise=degree, outliers=True)
    return {
        # As many rows as Pacheco 2021 measured of wrist A, and so few that bias shows.
        "wrist": Case(wrist, nf.pull(0.15, 1.65, steps=68), fine, FOUR, {}, from_rest=True),
        "short": Case(wrist, nf.pull(0.15, 1.65, steps=8), fine, FOUR, {}, from_rest=True),
        "strip": Case(
            nf.load_robot("liu2022"), nf.pull(1.0, 9.0, steps=9), fine, truth={}, from_rest=True
        ),
        "links": Case(
            nf.load_robot("gao2017"), cycle, {"axis_points": 0.1}, truth={}, axis_at=points
        ),
        "clean": clean,
        "tolerances": replace(clean, truth=None, priors=True),
        "deeper": replace(clean, truth=deeper, priors=True),
        "without_priors": replace(clean, truth=deeper),
        "shifted": replace(clean, noise=totals, pulls=4, shift=np.radians(2.0)),
        "outliers": replace(off, objective=LeastSquares(1.5)),
        "squares": off,
    }


def measured(case: Case, number: int) -> Measurements:
    """Return what is measured in one repetition."""
    random = np.random.default_rng([SEED, number])
    if case.truth is None:
        sources = [one for one in tolerances_of(case.robot)[0] if one.value not in case.names]
        (robot,) = draw_robots(case.robot, sources, 1, number).robots
    else:
        robot = case.robot.with_values(case.truth) if case.truth else case.robot
    seen = [
        simulate_measurements(
            robot,
            case.load,
            observed=tuple(case.noise),
            deviation=case.noise,
            seed=random,
            axis_at=case.axis_at,
            from_rest=case.from_rest,
            pull=(str(pull),) * len(case.load),
        )
        for pull in range(case.pulls)
    ]
    every = seen[0] if len(seen) == 1 else _joined(seen)
    for name, values in every.observed.items():
        if case.shift:
            shift = case.shift * random.standard_normal(case.pulls)
            values += np.repeat(shift, len(case.load)).reshape(-1, *(1,) * (values.ndim - 1))
        if case.outliers:
            away = random.random(values.shape) < OUTLIERS
            values += away * AWAY * case.noise[name] * random.choice((-1.0, 1.0), values.shape)
    return every


def _joined(seen: list[Measurements]) -> Measurements:
    load = seen[0].load
    for one in seen[1:]:
        load = load.then(one.load)
    observed, deviation = (
        {name: np.concatenate([held[name] for held in parts]) for name in parts[0]}
        for parts in ([one.observed for one in seen], [one.deviation for one in seen])
    )
    pulls = tuple(label for one in seen for label in one.pull)
    return Measurements("simulated", load, pulls, seen[0].from_rest, observed, deviation)


def covered(case: Case, count: int) -> tuple[np.ndarray, ...]:
    """Return estimates, widths, whether intervals hold the truth, and whether each is trusted."""
    truth = [number_at(case.robot, name) for name in case.names]
    estimates, widths, holds, trusted = [], [], [], []
    began = time.perf_counter()
    for number in range(count):
        found = calibrate(
            case.robot,
            measured(case, number),
            case.names,
            starts=1,
            intervals=False,
            priors=case.priors,
            objective=case.objective,
        )
        estimates.append(list(found.values.values()))
        widths.append(2.0 * found.half_width(np.eye(len(truth))))
        holds.append([found.allows(*one) for one in zip(case.names, truth, strict=True)])
        trusted.append(found.trusted)
        if number % 50 == 49:
            print(
                f"{number + 1} of {count}, {time.perf_counter() - began:.0f} s, "
                f"{np.mean(holds, axis=0).round(3)}",
                file=sys.stderr,
            )
    return tuple(map(np.array, (estimates, widths, holds, trusted)))


def main() -> None:
    """Read what is asked, and print a row per constant."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--case", choices=list(cases()), action="append")
    arguments.add_argument("--count", type=int, default=400)
    arguments.add_argument("--json", type=Path)
    given = arguments.parse_args()
    told = {}
    for name, case in cases().items():
        if given.case and name not in given.case:
            continue
        estimates, widths, holds, trusted = covered(case, given.count)
        truth = np.array([number_at(case.robot, one) for one in case.names])
        error = estimates.std(axis=0, ddof=1) / np.sqrt(len(estimates))
        for number, constant in enumerate(case.names):
            row = {
                "coverage": float(holds[:, number].mean()),
                "bias": float(estimates[:, number].mean() - truth[number]),
                "standard_error": float(error[number]),
                "width": float(widths[:, number].mean()),
                "not_trusted": float(1.0 - trusted.mean()),
                "covered_or_told": float((holds[:, number] | ~trusted).mean()),
                "count": len(holds),
            }
            told[f"{name} {constant}"] = row
            print(
                f"{name:14} {constant:32} covers {100 * row['coverage']:5.1f} %  "
                f"bias {row['bias']:+.3g} ± {row['standard_error']:.2g}  width {row['width']:.3g}  "
                f"not trusted {100 * row['not_trusted']:.1f} %"
            )
    if given.json:
        given.json.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
