"""The two steps of Gao 2017, on shapes made from the model with noise of 0.1 mm.

    python benchmarks/fit_gao2017.py [--seed 0]

First the modulus, from shapes of 30 points under hung weights of 20, 70 and 150 g without tension,
then friction, from free bending under odd forces, both by eq. 27 (a sum of distances). Each is
tested on what it never saw: 10, 50 and 100 g, and even forces. No measured shapes are public.
"""

from __future__ import annotations

import numpy as np
from harness import options, show

import notchflex as nf
from notchflex.analysis import axis_points
from notchflex.fit import Measurements, SumOfDistances, calibrate, simulate_measurements

NOISE = 0.1  # mm
POINTS = np.linspace(1.0, 34.9, 30)  # mm along the straight axis
SIDEWAYS = (-9.81, 0.0, 0.0)  # m/s^2: weights pull across the tube, against the tendon
MODULUS, FRICTION = "material.elastic_modulus", "friction.coefficient"
TRUTH = nf.load_robot("gao2017")


def main() -> None:
    """Fit both constants, one after the other, and print a row for each."""
    random = np.random.default_rng(options(__doc__, seed=0).seed)

    def shape(load: nf.LoadPath, *, from_rest: bool = True) -> Measurements:
        return simulate_measurements(
            TRUTH,
            load,
            observed=("axis_points",),
            deviation={"axis_points": NOISE},
            axis_at=POINTS,
            seed=random,
            from_rest=from_rest,
        )

    hung = {
        grams: shape(nf.pull(0.0, 0.0, steps=1).loaded(tip_mass=float(grams), gravity=SIDEWAYS))
        for grams in (10, 20, 50, 70, 100, 150)
    }
    start = TRUTH.with_values({MODULUS: 15_000.0, FRICTION: 0.3})
    stiff, modulus = fitted(start, [hung[grams] for grams in (20, 70, 150)], MODULUS)
    unseen = [distances(stiff, hung[grams]) for grams in (10, 50, 100)]
    rows = [modulus | {"unseen shapes, mm": float(np.mean(unseen))}]

    bend = nf.pull(1.0, 13.0, steps=13)
    whole = shape(bend, from_rest=False)
    odd = np.round(bend.tension[:, 0]) % 2 == 1
    seen = {"axis_points": np.where(odd[:, None, None], whole.observed["axis_points"], np.nan)}
    only_odd = Measurements("odd forces", bend, whole.pull, False, seen, axis_at=POINTS)
    both, friction = fitted(stiff, only_odd, FRICTION)
    rows.append(friction | {"unseen shapes, mm": float(distances(both, whole)[~odd].mean())})
    show(rows)


def fitted(start: nf.Robot, seen, name: str) -> tuple[nf.Robot, dict[str, object]]:
    """Fit a constant by eq. 27: the fitted robot, and the row of the table."""
    found = calibrate(start, seen, name, objective=SumOfDistances(), starts=1)
    true = nf.robot.value_names.number_at(TRUTH, name)
    row = {"constant": name, "found": f"{found.values[name]:.6g}", "true": f"{true:g}"}
    return next(iter(found.robots.values())), row


def distances(robot: nf.Robot, seen: Measurements) -> np.ndarray:
    """Mean distance of the points of every row, mm."""
    path = nf.simulate(robot, seen.load).raise_if_failed()
    off = axis_points(path, POINTS) - seen.observed["axis_points"]
    return np.linalg.norm(off, axis=-1).mean(axis=-1)


if __name__ == "__main__":
    main()
