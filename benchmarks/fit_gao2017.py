"""The two steps of Gao 2017, on shapes made from the model with noise of 0.1 mm.

    python benchmarks/fit_gao2017.py [--seed 0] [--json FILE]

First the modulus, from shapes of 30 points under hung weights of 20, 70 and 150 g without tension,
then friction, from free bending under odd forces, both by eq. 27 (a sum of distances). Each is
tested on what it never saw: 10, 50 and 100 g, and even forces. No measured shapes are public.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np

import notchflex as nf
from notchflex.analysis import axis_points
from notchflex.fit import Measurements, SumOfDistances, calibrate, simulate_measurements

NOISE = 0.1  # mm
POINTS = np.linspace(1.0, 34.9, 30)  # mm along the straight axis
SIDEWAYS = (-9.81, 0.0, 0.0)  # m/s^2: weights pull across the tube, against the tendon
MODULUS, FRICTION = "material.elastic_modulus", "friction.coefficient"


def main() -> None:
    """Read what is asked, and run both steps."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--seed", type=int, default=0)
    arguments.add_argument("--json", type=Path)
    given = arguments.parse_args()
    random = np.random.default_rng(given.seed)
    began = time.perf_counter()
    truth = nf.load_robot("gao2017")
    start = truth.with_values({MODULUS: 15_000.0, FRICTION: 0.3})

    hung = {grams: shape(truth, weight(grams), random) for grams in (10, 20, 50, 70, 100, 150)}
    fitted = [hung[grams] for grams in (20, 70, 150)]
    first = calibrate(start, fitted, MODULUS, objective=SumOfDistances(), starts=1)
    stiff = next(iter(first.robots.values()))
    unseen = [distances(stiff, hung[grams]) for grams in (10, 50, 100)]
    told = {"modulus": tell("modulus", first.values[MODULUS], 22_000.0, "MPa", unseen)}

    bend = nf.pull(1.0, 13.0, steps=13)
    whole = shape(truth, bend, random, from_rest=False)
    odd = np.round(bend.tension[:, 0]) % 2 == 1
    seen = {"axis_points": np.where(odd[:, None, None], whole.observed["axis_points"], np.nan)}
    only_odd = Measurements("odd forces", bend, whole.pull, False, seen, axis_at=POINTS)
    second = calibrate(stiff, only_odd, FRICTION, objective=SumOfDistances(), starts=1)
    both = next(iter(second.robots.values()))
    unseen = [distances(both, whole)[~odd]]
    told["friction"] = tell("friction", second.values[FRICTION], 0.66, "", unseen)
    print(f"{time.perf_counter() - began:.0f} s, {first.solves + second.solves} rows solved")
    if given.json:
        given.json.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")


def weight(grams: float) -> nf.LoadPath:
    """A weight at the tip, tendon slack."""
    return nf.pull(0.0, 0.0, steps=1).loaded(tip_mass=grams, gravity=SIDEWAYS)


def shape(
    robot: nf.Robot, load: nf.LoadPath, random: np.random.Generator, *, from_rest: bool = True
) -> Measurements:
    """A photographed shape: points along the axis, with noise."""
    return simulate_measurements(
        robot,
        load,
        observed=("axis_points",),
        deviation={"axis_points": NOISE},
        axis_at=POINTS,
        seed=random,
        from_rest=from_rest,
    )


def distances(robot: nf.Robot, seen: Measurements) -> np.ndarray:
    """Mean distance of the points of every row, mm."""
    path = nf.simulate(robot, seen.load).raise_if_failed()
    off = axis_points(path, POINTS) - seen.observed["axis_points"]
    return np.linalg.norm(off, axis=-1).mean(axis=-1)


def tell(
    name: str, value: float, true: float, unit: str, unseen: list[np.ndarray]
) -> dict[str, float]:
    """Print and return what a step found."""
    mean = float(np.mean(np.concatenate([np.ravel(one) for one in unseen])))
    print(f"{name}: {value:.6g} {unit} (true {true:g}); unseen shapes off by {mean:.4f} mm in mean")
    return {"value": value, "true": true, "unseen_mm": mean}


if __name__ == "__main__":
    main()
