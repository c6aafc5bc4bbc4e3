"""Whether a robot, its mirror image and the same loads but for rounding give the same states.

Random robots (draw.py) take their loads and let go of them again. Beside each, its mirror image at
the y-z plane and the robot under all tensions and strokes times 1 + 1e-13 and 1 - 1e-13 are solved.
A state is the same where all of them fail, or all converge within 1e-7 rad. One that some of them
reach and others not, or elsewhere, was found by luck of rounding.

    python benchmarks/mirrored.py [--count 500] [--seed 1] [--json FILE]
"""

from __future__ import annotations

import argparse
import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from draw import Draw, draw
from shapes import DRAWN, SHAPES

import notchflex as nf

SAME = 1e-7  # rad
CHANGE = 1e-13
VECTORS, AXES = np.array([-1.0, 1.0, 1.0]), np.array([1.0, -1.0, -1.0])


def mirrored(one: Draw) -> Draw:
    """Return the mirror image of a robot and its loads at the y-z plane."""
    notches, tendons = (
        tuple(dataclasses.replace(part, direction_deg=180.0 - part.direction_deg) for part in parts)
        for parts in (one.robot.notch, one.robot.tendon)
    )
    robot = dataclasses.replace(one.robot, notch=notches, tendon=tendons)
    return one._replace(robot=robot, loads=tuple(map(mirrored_load, one.loads)))


def mirrored_load(load: nf.Load) -> nf.Load:
    """Return the mirror image of a load."""
    forces = [
        dataclasses.replace(
            force,
            force=VECTORS * force.force,
            moment=AXES * force.moment,
            point=VECTORS * force.point,
        )
        for force in load.body_forces
    ]
    return dataclasses.replace(
        load,
        tip_force=VECTORS * load.tip_force,
        tip_moment=AXES * load.tip_moment,
        tip_point=VECTORS * load.tip_point,
        base_rotation=AXES * load.base_rotation,
        gravity=None if load.gravity is None else VECTORS * load.gravity,
        body_forces=forces,
    )


def scaled(one: Draw, factor: float) -> Draw:
    """Return a draw with all tensions and strokes times a factor."""

    def times(values: Sequence[float | None] | float | None):
        if values is None or isinstance(values, float):
            return None if values is None else factor * values
        return [None if value is None else factor * value for value in values]

    changed = [
        dataclasses.replace(load, tension=times(load.tension), stroke=times(load.stroke))
        for load in one.loads
    ]
    return one._replace(loads=tuple(changed))


def followed(one: Draw) -> nf.EquilibriumPath:
    """Solve the loads of a draw, and the same back again."""
    return nf.simulate(one.robot, [*one.loads, *one.loads[::-1]])


def same_states(one: Draw) -> np.ndarray:
    """Return which states of a draw do not depend on its orientation, or on rounding."""
    others = [mirrored(one), scaled(one, 1.0 + CHANGE), scaled(one, 1.0 - CHANGE)]
    reference, *paths = [followed(variant) for variant in (one, *others)]
    same = np.ones(len(reference), bool)
    for path in paths:
        apart = np.abs(path.notch_angle - reference.notch_angle).max(axis=1)
        same &= (path.converged == reference.converged) & (~path.converged | (apart < SAME))
    return same


def main() -> None:
    """Draw, solve, compare, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=500, help="robots to draw")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", type=Path, help="write the result")
    options = parser.parse_args()
    states: dict[str, list[np.ndarray]] = {}
    different = []
    shapes = (*SHAPES, *DRAWN)
    for first, shape in enumerate(shapes):
        numbers = range(first, options.count, len(shapes))
        draws = [draw(number, options.seed, shape) for number in numbers]
        for one in draws:
            same = same_states(one)
            states.setdefault(shape.name, []).append(same)
            if not same.all():
                different.append(
                    {"draw": one.number, "shape": shape.name, "step": int(same.argmin())}
                )
                print(f"draw {one.number} ({shape.name}): step {same.argmin()} differs", flush=True)
        print(f"{shape.name}: {len(draws)} robots", flush=True)
    rows = {name: np.concatenate(same) for name, same in states.items()}
    rows["all"] = np.concatenate(list(rows.values()))
    for name, same in rows.items():
        print(f"{name:24}{len(same):7} states  {100.0 * same.mean():6.2f} % the same")
    robots = sum(map(len, states.values()))
    share = 1.0 - len(different) / robots
    print(f"{robots} robots, {100.0 * share:.2f} % the same in all states")
    if options.json:
        content = {
            "seed": options.seed,
            "robots": robots,
            "same_robots": share,
            "same_states": {name: float(same.mean()) for name, same in rows.items()},
            "different": different,
        }
        options.json.write_text(json.dumps(content, indent=1) + "\n")


if __name__ == "__main__":
    main()
