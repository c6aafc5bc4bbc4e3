"""Hard loads on a long tendon robot, each from rest: how many are solved, and how long one takes.

The loads are those that the peers of `shared/peers.md` were given: 0.4 m, 20 flexures, bending
stiffness 0.0102 N m², two sets of three tendons 10 mm from the axis that end halfway and at the
tip, each pulled with up to 5 N, and a lateral force of up to 0.3 N on the tip, in any direction.

The robot is such a continuum robot made of notches: a tube of 21 mm outer and 17 mm inner diameter
with 20 notches of 20 mm one behind the other, so that no rigid tube is left between them. A cut
that is 0.2 mm deep in a wall of 2 mm takes next to nothing away (the two bending stiffnesses
differ by a few percent, and the tube stays closed, so that it is stiff in torsion as a backbone
is); Young's modulus is set so that the mean of the two is 10,200 N mm².

    python benchmarks/hard_loads.py [--count 300] [--seed 1] [--json FILE]

Every result is judged by `wrong` (judge.py) as well. Exit code 1: one unsolved or wrong.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator
from math import sqrt
from pathlib import Path

import numpy as np
from judge import plain, wrong

import notchflex as nf

FLEXURES = 20
FLEXURE = 20.0  # mm
OUTER, INNER, DEPTH = 21.0, 17.0, 0.2  # mm
STIFFNESS = 10_200.0  # N mm^2
TENDON_RADIUS = 10.0  # mm
ENDS = (10, 20)
SIDES = (0.0, 120.0, 240.0)  # deg
MOST_TENSION, MOST_FORCE = 5.0, 0.3  # N
FRICTIONS = {"frictionless": nf.Frictionless(), "capstan 0.1": nf.Capstan(0.1)}


def section() -> nf.Section:
    """What the shallow saw cut leaves of the tube."""
    return nf.annular_segment(0.5 * OUTER, 0.5 * INNER, DEPTH)


def robot(friction: nf.Capstan | nf.Frictionless) -> nf.Robot:
    """The robot that stands for the peers' continuum robot."""
    left = section()
    mean = sqrt(float(left.second_moment_weak) * float(left.second_moment_strong))
    return nf.Robot(
        name="0.4 m, 20 flexures, 6 tendons",
        tube=nf.Tube(OUTER, INNER),
        notch=(nf.ArcNotch("off-axis", DEPTH, FLEXURE, uncut_length=0.0, repeat=FLEXURES),),
        tendon=tuple(
            nf.Tendon(TENDON_RADIUS, direction_deg=side, end_body=end, path="straight")
            for end in ENDS
            for side in SIDES
        ),
        material=nf.Linear(STIFFNESS / mean),
        friction=friction,
    )


def loads(count: int, seed: int) -> Iterator[nf.Load]:
    """Draw tensions, and a force across the tube whose direction is as random as its size."""
    generator = np.random.default_rng(seed)
    for _ in range(count):
        tension = generator.uniform(0.0, MOST_TENSION, len(ENDS) * len(SIDES))
        force, angle = generator.uniform(0.0, MOST_FORCE), generator.uniform(0.0, 2.0 * np.pi)
        yield nf.Load(
            tension=tension.tolist(),
            tip_force=(force * np.cos(angle), force * np.sin(angle), 0.0),
        )


def measure(friction: str, count: int, seed: int) -> dict[str, object]:
    """Solve all loads from rest, one by one as a user does, and judge them."""
    arm = robot(FRICTIONS[friction])
    seconds, unsolved, found, bend = [], {}, {}, []
    nf.simulate(arm, nf.Load(tension=[1.0] * 6, tip_force=(0.1, 0.1, 0.0)))  # compiles
    for number, load in enumerate(loads(count, seed)):
        start = time.perf_counter()
        path = nf.simulate(arm, load)
        seconds.append(time.perf_counter() - start)
        bend.append(float(path.total_angle[0]))
        if not path.converged[0]:
            unsolved[number] = path.reason[0]
        if problems := wrong(arm, load, path):
            found[number] = problems
        print(f"\r{friction}: {number + 1} of {count}", end="", file=sys.stderr)
    print(file=sys.stderr)
    middle, late, last = 1e3 * np.quantile(seconds, [0.5, 0.95, 1.0])
    return {
        "friction": friction,
        "solved": count - len(unsolved),
        "unsolved": unsolved,
        "wrong": found,
        "median_ms": middle,
        "p95_ms": late,
        "max_ms": last,
        "largest_angle_deg": float(np.degrees(np.abs(bend).max())),
    }


def main() -> int:
    """Print a row for each friction."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    left = section()
    ratio = float(left.second_moment_weak / left.second_moment_strong)
    print(f"seed {given.seed}, {given.count} loads; EI of the two planes: ratio {ratio:.4f}")
    rows = [measure(friction, given.count, given.seed) for friction in FRICTIONS]
    for row in rows:
        print(
            f"{row['friction']:14} solved {row['solved']} of {given.count}, "
            f"wrong {len(row['wrong'])}; median {row['median_ms']:.1f} ms, "
            f"95 % {row['p95_ms']:.1f} ms, max {row['max_ms']:.1f} ms; "
            f"tip turned by up to {row['largest_angle_deg']:.0f} deg"
        )
        for number, reason in row["unsolved"].items():
            print(f"  {number}: {plain(reason)}")
        for number, problems in row["wrong"].items():
            print(f"  {number}: {'; '.join(problems)}")
    if given.json:
        given.json.write_text(json.dumps({"seed": given.seed, "rows": rows}, indent=1) + "\n")
    return int(any(row["unsolved"] or row["wrong"] for row in rows))


if __name__ == "__main__":
    sys.exit(main())
