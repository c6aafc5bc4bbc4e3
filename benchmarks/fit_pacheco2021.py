"""The identification of Pacheco 2021 (eq. 17) on their measurements, and honest tests of it.

Needs their measured angles, `pacheco2021_wrist_A_measured.csv` and so on, in a folder (public, see
docs/papers/pacheco2021.md):

    python benchmarks/fit_pacheco2021.py FOLDER [--starts 20] [--only tube]

Prints where every start of eq. 17 ends, with the time and the solved rows beside the paper's 2,800
trial points; constants and errors of each wrist left out; the two linear models of the paper, whose
friction goes to its limit; least squares with 95 % intervals; and eq. 17 with the law of the tube
(elastic ends, Nitinol by fibres), one set, with a factor for wrist A and one for each, each wrist
left out, and after one photograph of it; `--only tube` makes that alone.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from harness import options, show, timed

import notchflex as nf
from notchflex.fit import (
    PHOTOGRAPH,
    Calibration,
    Constant,
    LeastSquares,
    SumOfRobotErrors,
    calibrate,
    diagnose,
    errors_of_parts,
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
EDGES = "total_edge_angle"
TUBE = (
    Constant("material.elastic_modulus", 15e3, 60e3),
    Constant("material.plateau_stress", 100.0, 600.0),
    Constant("material.plateau_modulus", 1e3, 15e3),
    FRICTION,
)
FACTORS = Constant("each:sensor.force_factor", prior=(1.0, 0.05))
DEPTHS = tuple(
    Constant(name, prior=(0.0, 0.01))
    for name in ("A:offset:notch.depth", "B:offset:notch.depth", "C:offset:notch[each].depth")
)
AS_DRAWN = {
    "notch.depth_at": "outer",
    "material.elastic_modulus": 45e3,
    "material.plateau_stress": 390.0,
}
LINEAR = {"material.kind": "linear", "material.elastic_modulus": 15e3}
# Values of the robots, constants of a fit with the law of the tube, and the objective to reach.
TUBE_FITS = {
    "linear material": (LINEAR, (Constant("material.elastic_modulus", 5e3, 60e3), FRICTION), 24.0),
    "no precurvature": ({"notch.precurvature_deg": 0.0}, TUBE, 15.9),
    "rigid ends": ({"notch.ends": "rigid"}, TUBE, 9.4),
    "as drawn, depths": (AS_DRAWN, (*TUBE, *DEPTHS), 8.22),
    "one set": ({}, TUBE, 11.8),
    "a factor for A": ({}, (*TUBE, Constant("A:sensor.force_factor", 0.8, 1.25)), 7.9),
    "a factor a wrist": ({}, (*TUBE, FACTORS), 7.85),
}
# Errors of the total of a wrist left out, deg: blind, and after one photograph.
LEFT_OUT_TARGETS = {"A": (7.5, 4.1), "B": (3.4, 1.3), "C": (3.6, 2.3)}


def main() -> None:
    """Fit what is asked for, and print it."""
    chosen = options(__doc__, folder=Path, starts=20, only="")
    if chosen.only != "tube":
        robots, data = wrists(chosen.folder, "specimen")  # with the authors' precurvature
        eq17(robots, data, chosen.starts)
        left_out(robots, data)
        linear(robots, data)
        least_squares(robots, data)
    law_of_the_tube(*wrists(chosen.folder, "true", measured="edge"))


def wrists(folder: Path, kind: str, **reading: str):
    """The three wrists of a kind, and what was measured of them."""
    robots = {name: nf.load_robot(f"pacheco2021-{name.lower()}-{kind}") for name in "ABC"}
    data = {
        name: read_measurements(folder / f"pacheco2021_wrist_{name}_measured.csv", robot, **reading)
        for name, robot in robots.items()
    }
    return robots, data


def eq17(robots, data, starts: int) -> None:
    """Four constants of three wrists, from random starts."""
    with timed() as seconds:
        found = calibrate(robots, data, FOUR, objective=SumOfRobotErrors(), starts=starts, seed=0)
    ends = [search.cost.value for search in found.searches if search.cost is not None]
    print(f"eq. 17: {found.cost:.6f} deg at {_text(found)}")
    print(
        f"  {sum(end <= 11.5942 for end in ends)} of {starts} starts end at or below 11.5942 "
        f"(highest {max(ends):.6f}); {seconds['cpu']:.0f} s of CPU, "
        f"{sum(search.calls for search in found.searches)} evaluations of all 226 rows "
        f"({found.solves} solves) beside the paper's {PAPERS_TRIALS} trial points"
    )


def left_out(robots, data) -> None:
    """Each wrist, and each pull, left out of eq. 17: errors of its total angle."""
    found = calibrate(robots, data, FOUR, objective=SumOfRobotErrors(), starts=3)
    folds = [*leave_out(found, by="robot", starts=3).folds]
    folds += leave_out(found, by="pull", starts=1).folds
    show(
        {
            "left out": fold.label,
            "never seen, deg": float(np.degrees(fold.errors["total_angle"])),
            "fitted to all, deg": float(np.degrees(fold.errors_of_all["total_angle"])),
        }
        for fold in folds
    )


def linear(robots, data) -> None:
    """Models (i) and (ii): one modulus, with and without friction, in the authors' limits."""
    modulus = Constant("material.elastic_modulus", 2e3, 20e3)
    bounded = Constant("friction.coefficient", 0.05, 0.5)
    values = {"material.kind": "linear"}
    for label, more, fit in (
        ("i", {}, (modulus, bounded)),
        ("ii", {"friction.coefficient": 0.0}, (modulus,)),
    ):
        these = {name: robot.with_values(values | more) for name, robot in robots.items()}
        found = calibrate(these, data, fit, objective=SumOfRobotErrors(), starts=3)
        print(f"linear model ({label}): {found.cost:.4f} deg at {_text(found)}")
        print("  " + "\n  ".join(diagnose(found)))


def least_squares(robots, data) -> None:
    """The same four constants by least squares over the noise of the repeats, with intervals."""
    found = calibrate(robots, data, FOUR, objective=LeastSquares(), starts=3)
    print(f"least squares: reduced chi squared {found.reduced_chi_squared:.2f}")
    show(
        {
            "constant": name,
            "found": f"{found.values[name]:.6g}",
            "95 %": f"{interval.lower:.6g} to {interval.upper:.6g}",
        }
        for name, interval in found.intervals.items()
    )
    print("  " + "\n  ".join(diagnose(found)))


def law_of_the_tube(robots, data, starts: int = 4) -> None:
    """Elastic ends, mid-wall depth and Nitinol by fibres: eq. 17 on edge angles of all wrists."""
    for label, (values, fit, target) in TUBE_FITS.items():
        these = {name: robot.with_values(values) for name, robot in robots.items()}
        # Ten constants take minutes from each start.
        tries = starts if len(fit) < 7 else 1
        found = calibrate(these, data, fit, objective=SumOfRobotErrors(), starts=tries)
        totals = [part.error for part in errors_of_parts(found) if part.quantity == EDGES]
        print(f"{label}: eq. 17 {found.cost:.4f} deg (target {target}) at {_text(found)}")
        print("  totals A, B, C: " + ", ".join(f"{error:.2f}" for error in totals))
    show(
        (
            {
                "wrist": part.robot,
                "quantity": part.title,
                "rms error": part.error,
                "of repeats": part.repeats,
                "unit": part.unit,
            }
            for part in errors_of_parts(found)
        ),
        "with a factor for each wrist",
    )
    folds = leave_out(found, by="robot", photograph=PHOTOGRAPH, starts=3).folds
    show(map(_left_out_wrist, folds))


def _left_out_wrist(fold) -> dict[str, object]:
    targets = LEFT_OUT_TARGETS[fold.label]
    return {
        "wrist left out": fold.label,
        "total blind, deg (target)": f"{np.degrees(fold.errors[EDGES]):.2f} ({targets[0]})",
        "after one photograph": f"{np.degrees(fold.errors_updated[EDGES]):.2f} ({targets[1]})",
        "which narrows it to": fold.specimen.gain,
        "in the blind 90 % band": f"{100.0 * fold.share_inside()[EDGES]:.0f} %",
    }


def _text(found: Calibration) -> str:
    names = (name.replace("material.", "").replace("sensor.", "") for name in found.names)
    pairs = zip(names, found.best.values, strict=True)
    return ", ".join(f"{name} {value:.6g}" for name, value in pairs)


if __name__ == "__main__":
    main()
