"""Rendered photographs of known wrists against what `notchflex measure` finds in them.

`python benchmarks/measured_photographs.py [COUNT] [FIRST]` prints one line per photograph and the
totals.
"""

import math
import sys
import time
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import notchflex as nf
from notchflex.photographs.chain.chain_table import chain_table
from notchflex.photographs.measure import measure_picture
from photographs.renderer import Scene, render

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
    bodies, _ = nf.bodies_from_angles(nf.load_robot("pacheco2021-a"), angles[None])
    tip, _ = nf.tip_from_angles(nf.load_robot("pacheco2021-a"), angles[None])
    points = np.vstack([[0.0, 0.0, -1.0], bodies[0], tip])
    side = math.copysign(1.0, math.cos(math.radians(scene.roll)))
    turn = math.radians(scene.direction)
    along = np.array([math.cos(turn), math.sin(turn)])
    across = side * np.array([-math.sin(turn), math.cos(turn)])
    seen = scene.scale * (points[:, 2:] * along + points[:, :1] * across)
    x, y = np.array([600.0, 450.0]) - 0.5 * (seen.min(axis=0) + seen.max(axis=0))
    return float(x), float(y)


def main(count: int, first: int) -> None:
    """Measure photographs and print how far their angles are off."""
    robot = nf.load_robot("pacheco2021-a")
    table = chain_table(robot)
    errors, ratios, seconds, wrong, good = [], [], [], 0, 0
    reasons: dict[str, int] = {}
    for seed in range(first, first + count):
        angles, scene = drawn(seed)
        picture = cv2.cvtColor(render(robot, angles, scene), cv2.COLOR_GRAY2BGR)
        begin = time.process_time()
        found = measure_picture(picture, table, str(seed))
        seconds.append(time.process_time() - begin)
        if not found.measured:
            reasons[found.reason] = reasons.get(found.reason, 0) + 1
            print(f"{seed}: refused, {found.reason}", flush=True)
            continue
        error = np.degrees(found.notch_angle - angles)
        rms = float(np.sqrt((error**2).mean()))
        good += rms <= 0.15
        wrong += bool(np.abs(error).max() > WRONG)
        errors.append(error)
        ratios.append(error / np.degrees(found.notch_angle_deviation))
        print(f"{seed}: rms {rms:.3f} deg, worst {np.abs(error).max():.3f}", flush=True)
    error, ratio = np.concatenate(errors), np.concatenate(ratios)
    print(f"{count} photographs: {len(errors)} measured, {good} of them with rms <= 0.15 deg")
    print(f"rms {np.sqrt((error**2).mean()):.3f} deg, worst {np.abs(error).max():.3f} deg")
    print(f"wrong by more than {WRONG:g} deg and not refused: {wrong}")
    print(f"within 1.96 standard deviations: {100 * (np.abs(ratio) < 1.96).mean():.1f} %")
    print(f"seconds of CPU: {np.median(seconds):.1f} (median), {max(seconds):.1f} (most)")
    for reason, times in sorted(reasons.items(), key=lambda one: -one[1]):
        print(f"{times} x {reason}")


if __name__ == "__main__":
    given = [int(word) for word in sys.argv[1:]]
    main(given[0] if given else 400, given[1] if given[1:] else 0)
