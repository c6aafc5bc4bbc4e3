"""Rendered photographs of straight wrists against what `notchflex measure --cut` finds in them.

`python benchmarks/measured_cuts.py [COUNT] [FIRST]` prints one line per wrist, photographed twice
and turned by 20 deg in between, and the totals: two photographs a wrist. Errors are in percent of
the outer diameter.
"""

import sys
import time
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import notchflex as nf
from notchflex.photographs.chain_table import chain_table
from notchflex.photographs.measure_cut import LENGTHS, MeasuredCut, combined, fit_straight
from photographs.renderer import Scene, render

TURN = 20.0  # deg


def drawn(robot: nf.Robot, seed: int) -> tuple[nf.Robot, Scene, np.random.Generator]:
    """Return a wrist that was cut inexactly, how it is photographed first, and the generator."""
    random = np.random.default_rng(seed)
    n = robot.number_of_notches
    off = {name: random.uniform(-0.03, 0.03, n) for name in LENGTHS}
    off["depth"] += random.uniform(-0.05, 0.05)
    off["height"] += random.uniform(-0.02, 0.02)
    values = {
        f"notch[{number}].{name}": getattr(notch, name) + off[name][number - 1]
        for name in LENGTHS
        for number, notch in enumerate(robot.notches, 1)
    }
    wide = random.uniform(160, 260)  # px
    scale = wide / robot.tube.outer_diameter
    scene = Scene(
        size=(int(15 * scale), int(7 * scale)),
        scale=scale,
        place=(2.2 * scale, 3.2 * scale),
        roll=random.uniform(-15, -5),
        tilt=random.uniform(-5, 5),
        direction=random.uniform(-12, 12),
        distance=random.uniform(100, 300),
        blur=random.uniform(0.5, 1.5),
        noise=random.uniform(1, 4),
        stripe=80.0,
        seed=seed,
    )
    return robot.with_values(values), scene, random


def measured(robot: nf.Robot, seed: int) -> tuple[nf.Robot, MeasuredCut, MeasuredCut]:
    """Return a wrist, and what two photographs of it and the first alone say."""
    table = chain_table(robot)
    true, first, random = drawn(robot, seed)
    fits = []
    for turn in (0.0, TURN):
        scene = replace(first, roll=first.roll + turn, seed=seed + round(turn))
        angles = np.radians(random.normal(0.0, 1.0, robot.number_of_notches))
        picture = cv2.cvtColor(render(true, angles, scene), cv2.COLOR_GRAY2BGR)
        fits.append(fit_straight(picture, table, f"{seed} turned by {turn:g} deg"))
    both = combined(table, fits, np.radians([0.0, TURN]))
    return true, both, combined(table, fits[:1], np.zeros(1))


def main(count: int, first: int) -> None:
    """Measure wrists and print how far their lengths are off."""
    robot = nf.load_robot("pacheco2021-a")
    errors = {(name, seen): [] for seen in (2, 1) for name in LENGTHS}
    ratios = {key: [] for key in errors}
    for seed in range(first, first + count):
        begin = time.process_time()
        true, *cuts = measured(robot, seed)
        line = f"{seed}: {time.process_time() - begin:.0f} s of CPU"
        for seen, cut in zip((2, 1), cuts, strict=True):
            if cut.reason:
                line += f"; {seen} seen: refused, {cut.reason}"
                continue
            for name in LENGTHS:
                right = np.array([getattr(notch, name) for notch in true.notches])
                error = getattr(cut, name) - right
                errors[name, seen].append(100.0 * error / robot.tube.outer_diameter)
                ratios[name, seen].append(error / getattr(cut, f"{name}_deviation"))
            worst = [f"{np.abs(errors[name, seen][-1]).max():.2f}" for name in LENGTHS]
            line += f"; {seen} seen: worst {' '.join(worst)} %"
        print(line, flush=True)
    print("length, photographs: wrists, rms, worst, within 0.5 % and 1.96 standard deviations")
    for (name, seen), rows in errors.items():
        if rows:
            error, ratio = np.concatenate(rows), np.concatenate(ratios[name, seen])
            print(
                f"{name}, {seen}: {len(rows)}, {np.sqrt((error**2).mean()):.3f} %, "
                f"{np.abs(error).max():.2f} %, {100 * (np.abs(error) < 0.5).mean():.0f} %, "
                f"{100 * (np.abs(ratio) < 1.96).mean():.0f} %"
            )


if __name__ == "__main__":
    given = [int(word) for word in sys.argv[1:]]
    main(given[0] if given else 30, given[1] if given[1:] else 0)
