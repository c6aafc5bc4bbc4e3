"""Do 95 % intervals cover in 95 % of cases? Constants of each paper's robot, measured 400 times.

    python benchmarks/fit_coverage.py [--robot wrist|short|strip|links] [--count 400] [--json FILE]

Every repetition draws new noise (seed 0 and its number), fits from the true constants, and asks
whether the 95 % interval of every constant (profile likelihood) holds the true value: whether the
misfit there, with the others making the best of it, has risen by no more than within the interval
(`Calibration.allows`; that its ends say the same is a test). Prints coverage, the bias of the
estimates and its standard error.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np

import notchflex as nf
from notchflex.fit import calibrate, simulate_measurements
from notchflex.loads import LoadPath
from notchflex.robot.value_names import number_at

SEED = 0


def cases():
    """Robot, loads, what is measured, its noise, constants, and whether rows start from rest."""
    wrist = nf.load_robot("pacheco2021-a")
    strip = nf.load_robot("liu2022")
    links = nf.load_robot("gao2017")
    cycle = nf.pull(2.0, 12.0, steps=6).release()
    points = np.linspace(1.0, 34.0, 30)
    wide = np.radians(0.5)
    material = ("material.elastic_modulus", "friction.coefficient")
    four = (
        "material.elastic_modulus",
        "material.superelastic_modulus",
        "material.transition_strain",
        "friction.coefficient",
    )
    return {
        # As many rows as Pacheco 2021 measured of wrist A, and so few that bias shows.
        "wrist": (wrist, nf.pull(0.15, 1.65, steps=68), {"notch_angle": wide}, (), four, True),
        "short": (wrist, nf.pull(0.15, 1.65, steps=8), {"notch_angle": wide}, (), four, True),
        "strip": (strip, nf.pull(1.0, 9.0, steps=9), {"notch_angle": wide}, (), material, True),
        "links": (links, cycle, {"axis_points": 0.1}, points, material, False),
    }


def covered(case, count: int):
    """Truth, estimates and intervals of every repetition."""
    robot, load, noise, axis_at, names, from_rest = case
    assert isinstance(load, LoadPath)
    truth = np.array([number_at(robot, name) for name in names])
    estimates, holds = [], []
    began = time.perf_counter()
    for number in range(count):
        seen = simulate_measurements(
            robot,
            load,
            observed=tuple(noise),
            deviation=noise,
            seed=np.random.default_rng([SEED, number]),
            axis_at=axis_at,
            from_rest=from_rest,
        )
        found = calibrate(robot, seen, names, starts=1, intervals=False)
        estimates.append([found.values[name] for name in names])
        holds.append([found.allows(*one) for one in zip(names, truth, strict=True)])
        if number % 20 == 19:
            print(
                f"{number + 1} of {count}, {time.perf_counter() - began:.0f} s, "
                f"{np.mean(holds, axis=0).round(3)}",
                file=sys.stderr,
            )
    return names, truth, np.array(estimates), np.array(holds)


def main() -> None:
    """Read what is asked, and print a row per constant."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--robot", choices=list(cases()), action="append")
    arguments.add_argument("--count", type=int, default=400)
    arguments.add_argument("--json", type=Path)
    given = arguments.parse_args()
    told = {}
    for name, case in cases().items():
        if given.robot and name not in given.robot:
            continue
        names, truth, estimates, holds = covered(case, given.count)
        off = estimates.mean(axis=0) - truth
        error = estimates.std(axis=0, ddof=1) / np.sqrt(len(estimates))
        for number, constant in enumerate(names):
            row = {
                "coverage": float(holds[:, number].mean()),
                "bias": float(off[number]),
                "standard_error": float(error[number]),
                "count": len(holds),
            }
            told[f"{name} {constant}"] = row
            print(
                f"{name:6} {constant:32} covers {100 * row['coverage']:5.1f} %  "
                f"bias {row['bias']:+.3g} ± {row['standard_error']:.2g}"
            )
    if given.json:
        given.json.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
