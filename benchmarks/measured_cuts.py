"""Rendered photographs of straight wrists against what `notchflex measure --cut` finds in them.

    python benchmarks/measured_cuts.py [--count 30] [--first 0] [--json FILE]

Every wrist is photographed twice and turned by 20 deg in between; the cut is measured from both
photographs and from one. Errors are in percent of the outer diameter.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from harness import options, rms, share, show, trials

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import notchflex as nf
from notchflex.photographs.measure_cut import combined, fit_straight
from notchflex.photographs.measured import LENGTHS
from notchflex.photographs.outline import PlanarRobot
from photographs.renderer import Scene, render

TURN = 20.0  # deg
ROBOT = nf.load_robot("pacheco2021-a")


def drawn(seed: int) -> tuple[nf.Robot, Scene, np.random.Generator]:
    """Return a wrist that was cut inexactly, how it is photographed first, and the generator."""
    random = np.random.default_rng(seed)
    off = {name: random.uniform(-0.03, 0.03, ROBOT.number_of_notches) for name in LENGTHS}
    off["depth"] += random.uniform(-0.05, 0.05)
    off["height"] += random.uniform(-0.02, 0.02)
    values = {
        f"notch[{number}].{name}": getattr(notch, name) + off[name][number - 1]
        for name in LENGTHS
        for number, notch in enumerate(ROBOT.notches, 1)
    }
    scale = random.uniform(160, 260) / ROBOT.tube.outer_diameter  # px/mm
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
    return ROBOT.with_values(values), scene, random


def trial(seed: int) -> dict[str, object]:
    """Measure a wrist: by length and number of photographs its errors over standard deviations."""
    table = PlanarRobot(ROBOT)
    true, first, random = drawn(seed)
    fits = []
    for turn in (0.0, TURN):
        scene = replace(first, roll=first.roll + turn, seed=seed + round(turn))
        angles = np.radians(random.normal(0.0, 1.0, ROBOT.number_of_notches))
        picture = cv2.cvtColor(render(true, angles, scene), cv2.COLOR_GRAY2BGR)
        fits.append(fit_straight(picture, table, f"{seed} turned by {turn:g} deg"))
    both = combined(table, fits, np.radians([0.0, TURN]))
    row: dict[str, object] = {}
    for seen, cut in ((2, both), (1, combined(table, fits[:1], np.zeros(1)))):
        for name in LENGTHS:
            if cut.reason:
                row[f"{name}, {seen}"] = cut.reason
                continue
            right = np.array([getattr(notch, name) for notch in true.notches])
            error = getattr(cut, name) - right
            ratio = error / getattr(cut, f"{name}_deviation")
            row[f"{name}, {seen}"] = [100.0 * error / ROBOT.tube.outer_diameter, ratio]
    return row


def summary(key: str, rows: list[dict]) -> dict[str, object]:
    """Make the row of a length and a number of photographs."""
    kept = [row[key] for row in rows if not isinstance(row[key], str)]
    error, ratio = np.abs(np.concatenate(kept, axis=1)) if kept else np.full((2, 1), np.nan)
    return {
        "length, photographs": key,
        "measured": f"{len(kept)} of {len(rows)}",
        "rms, %": rms(error),
        "worst, %": float(error.max()),
        "within 0.5 %": share(error < 0.5),
        "within 1.96 deviations": share(ratio < 1.96),
    }


if __name__ == "__main__":
    rows = list(trials(trial, options(__doc__, count=30, first=0)))
    show(summary(f"{name}, {seen}", rows) for seen in (2, 1) for name in LENGTHS)
    print(f"{np.median([row['seconds'] for row in rows]):.0f} s of CPU for a wrist")
