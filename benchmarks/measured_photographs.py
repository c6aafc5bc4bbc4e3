"""Rendered photographs of known wrists against what `notchflex measure` finds in them.

    python benchmarks/measured_photographs.py [--count 400] [--first 0] [--json FILE]

With a FILE, a run that was stopped goes on where it was. One thread is quicker in CPU time: set
OPENBLAS_NUM_THREADS=1.
"""

from __future__ import annotations

import math
import sys
from collections import Counter
from pathlib import Path

import cv2
import numpy as np
from harness import options, rms, share, show, timed, trials

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import notchflex as nf
from notchflex.photographs.measure import measure_picture
from notchflex.photographs.outline import PlanarRobot
from photographs.renderer import Scene, render

ROBOT = nf.load_robot("pacheco2021-a")
TABLE = PlanarRobot(ROBOT)
WRONG = 1.0  # deg
MOST = 32.0  # deg: a notch of this wrist closes soon after


def drawn(seed: int) -> tuple[np.ndarray, Scene]:
    """Return angles (rad) of 0 to 150 deg in all, and a scene."""
    random = np.random.default_rng(seed)
    total = random.uniform(0, 150)
    angles = np.radians(np.minimum(total * random.dirichlet(np.full(5, 6.0)), MOST))
    is_dark = random.random() < 0.6
    scene = Scene(
        seed=seed,
        roll=random.uniform(-15, 15),
        tilt=random.uniform(-10, 10),
        direction=random.uniform(0, 360),
        scale=random.uniform(45, 68),
        distance=random.uniform(60, 300),
        blur=random.uniform(0.5, 2),
        noise=random.uniform(1, 5),
        stripe_at=random.uniform(-50, 50),
        paper=random.random() < 0.3,
        tendon=random.random() < 0.7,
        collet=random.random() < 0.7,
        base=random.uniform(1.2, 4),
        background=170 if is_dark else 60,
        dark=40 if is_dark else 150,
        bright=90 if is_dark else 225,
        stripe=random.uniform(50, 160) if is_dark else 60,
    )
    if random.random() < 0.5:  # seen from the other side
        scene.roll += 180
    scene.place = _framed(angles, scene)
    return angles, scene


def _framed(angles: np.ndarray, scene: Scene) -> tuple[float, float]:
    """Return the place of the first notch that puts the whole robot into the photograph."""
    bodies, _ = nf.bodies_from_angles(ROBOT, angles[None])
    tip, _ = nf.tip_from_angles(ROBOT, angles[None])
    points = np.vstack([[0.0, 0.0, -1.0], bodies[0], tip])
    side = math.copysign(1.0, math.cos(math.radians(scene.roll)))
    turn = math.radians(scene.direction)
    along = np.array([math.cos(turn), math.sin(turn)])
    across = side * np.array([-math.sin(turn), math.cos(turn)])
    seen = scene.scale * (points[:, 2:] * along + points[:, :1] * across)
    x, y = np.array([600.0, 450.0]) - 0.5 * (seen.min(axis=0) + seen.max(axis=0))
    return float(x), float(y)


def trial(seed: int) -> dict[str, object]:
    """Return what is found in one photograph: errors and standard deviations, deg."""
    angles, scene = drawn(seed)
    picture = cv2.cvtColor(render(ROBOT, angles, scene), cv2.COLOR_GRAY2BGR)
    with timed() as seconds:
        found = measure_picture(picture, TABLE, str(seed))
    return {
        "reason": found.reason,
        "seconds": seconds["cpu"],
        "error": np.degrees(found.notch_angle - angles),
        "deviation": np.degrees(found.notch_angle_deviation),
    }


def summary(rows: list[dict]) -> dict[str, object]:
    """Make the table: how many were measured, how well, how often intervals hold the angles."""
    measured = [row for row in rows if not row["reason"]]
    if not measured:
        return {"photographs": len(rows), "measured": 0}
    errors, deviations = (
        np.array([row[key] for row in measured]) for key in ("error", "deviation")
    )
    seconds = [row["seconds"] for row in rows]
    return {
        "photographs": len(rows),
        "measured": len(measured),
        "rms <= 0.15 deg": sum(rms(row) <= 0.15 for row in errors),
        f"wrong by more than {WRONG:g} deg": int((np.abs(errors).max(axis=1) > WRONG).sum()),
        "rms, deg": rms(errors),
        "worst, deg": float(np.abs(errors).max()),
        "within 1.96 deviations": share(np.abs(errors / deviations) < 1.96),
        "CPU s, median and most": (float(np.median(seconds)), max(seconds)),
    }


def main() -> None:
    """Measure photographs; print how well, and why others were refused."""
    cv2.setNumThreads(1)
    rows = list(trials(trial, options(__doc__, count=400, first=0)))
    show({"": key, "angles": value} for key, value in summary(rows).items())
    reasons = Counter(row["reason"] for row in rows if row["reason"])
    show({"refused": reason, "times": times} for reason, times in reasons.most_common())


if __name__ == "__main__":
    main()
