"""Rendered photographs of known wrists against what `notchflex measure` finds in them.

`python benchmarks/measured_photographs.py [COUNT] [FIRST] [FILE]` prints one line per photograph
and the totals. With a FILE, a run that was stopped goes on where it was. One thread is quicker in
CPU time: set OPENBLAS_NUM_THREADS=1.
"""

import json
import math
import sys
import time
from collections import Counter
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import notchflex as nf
from notchflex.photographs.chain_table import ChainTable, chain_table
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


def one(robot: nf.Robot, table: ChainTable, seed: int) -> dict:
    """Return what is found in one photograph: errors and standard deviations, deg."""
    angles, scene = drawn(seed)
    picture = cv2.cvtColor(render(robot, angles, scene), cv2.COLOR_GRAY2BGR)
    begin = time.process_time()
    found = measure_picture(picture, table, str(seed))
    return {
        "seed": seed,
        "reason": found.reason,
        "seconds": time.process_time() - begin,
        "error": np.degrees(found.notch_angle - angles).tolist(),
        "deviation": np.degrees(found.notch_angle_deviation).tolist(),
    }


def rms(row: dict) -> float:
    """Return the root mean square of the errors of one photograph, deg."""
    return float(np.sqrt(np.mean(np.square(row["error"]))))


def line(row: dict) -> str:
    """Return what is printed of one photograph."""
    if row["reason"]:
        return f"{row['seed']}: refused, {row['reason']}"
    worst = np.abs(row["error"]).max()
    ratio = np.abs(np.divide(row["error"], row["deviation"])).max()
    return f"{row['seed']}: rms {rms(row):.3f} deg, worst {worst:.3f}, {ratio:.1f} deviations"


def totals(rows: list[dict]) -> None:
    """Print how many were measured, how well, and how often intervals hold the angles."""
    measured = [row for row in rows if not row["reason"]]
    seconds = [row["seconds"] for row in rows]
    good = sum(rms(row) <= 0.15 for row in measured)
    print(f"{len(rows)} photographs: {len(measured)} measured, {good} of them rms <= 0.15 deg")
    print(f"seconds of CPU: {np.median(seconds):.1f} (median), {max(seconds):.1f} (most)")
    reasons = Counter(row["reason"] for row in rows if row["reason"])
    for reason, times in reasons.most_common():
        print(f"{times} x {reason}")
    if not measured:
        return
    error = np.array([row["error"] for row in measured])
    ratio = np.abs(error / np.array([row["deviation"] for row in measured]))
    wrong = int((np.abs(error).max(axis=1) > WRONG).sum())
    print(f"rms {np.sqrt((error**2).mean()):.3f} deg, worst {np.abs(error).max():.3f} deg")
    print(f"wrong by more than {WRONG:g} deg and not refused: {wrong}")
    print(f"within 1.96 standard deviations: {100 * (ratio < 1.96).mean():.1f} %")


def main(count: int, first: int, file: Path | None) -> None:
    """Measure photographs and print how far their angles are off."""
    cv2.setNumThreads(1)
    robot = nf.load_robot("pacheco2021-a")
    table = chain_table(robot)
    texts = file.read_text().splitlines() if file and file.exists() else []
    known = {row["seed"]: row for row in map(json.loads, texts)}
    rows = []
    for seed in range(first, first + count):
        row = known.get(seed) or one(robot, table, seed)
        if file and seed not in known:
            with file.open("a") as out:
                out.write(json.dumps(row) + "\n")
        rows.append(row)
        print(line(row), flush=True)
    totals(rows)


if __name__ == "__main__":
    words = sys.argv[1:]
    main(
        int(words[0]) if words else 400,
        int(words[1]) if words[1:] else 0,
        Path(words[2]) if words[2:] else None,
    )
