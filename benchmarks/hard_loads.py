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

import sys
from functools import partial
from math import sqrt
from typing import Any

import numpy as np
from harness import options, show, timed, trials
from random_robots.judge import plain, wrong

import notchflex as nf

FLEXURES, FLEXURE = 20, 20.0  # mm
OUTER, INNER, DEPTH = 21.0, 17.0, 0.2  # mm
STIFFNESS = 10_200.0  # N mm^2
MOST_TENSION, MOST_FORCE = 5.0, 0.3  # N
FRICTIONS = {"frictionless": nf.Frictionless(), "capstan 0.1": nf.Capstan(0.1)}


def robot(friction: nf.Capstan | nf.Frictionless) -> nf.Robot:
    """The robot that stands for the peers' continuum robot."""
    left = nf.annular_segment(0.5 * OUTER, 0.5 * INNER, DEPTH)  # what the shallow cut leaves
    mean = sqrt(float(left.second_moment_weak) * float(left.second_moment_strong))
    return nf.Robot(
        name="0.4 m, 20 flexures, 6 tendons",
        tube=nf.Tube(OUTER, INNER),
        notch=(nf.ArcNotch("off-axis", DEPTH, FLEXURE, uncut_length=0.0, repeat=FLEXURES),),
        tendon=tuple(
            nf.Tendon(10.0, direction_deg=side, end_body=end, path="straight")
            for end in (10, 20)
            for side in (0.0, 120.0, 240.0)
        ),
        material=nf.Linear(STIFFNESS / mean),
        friction=friction,
    )


def loads(count: int, seed: int) -> list[nf.Load]:
    """Draw tensions, and a force across the tube whose direction is as random as its size."""
    generator = np.random.default_rng(seed)

    def load() -> nf.Load:
        tension = generator.uniform(0.0, MOST_TENSION, 6)
        force, angle = generator.uniform(0.0, MOST_FORCE), generator.uniform(0.0, 2.0 * np.pi)
        across = (force * np.cos(angle), force * np.sin(angle), 0.0)
        return nf.Load(tension=tension.tolist(), tip_force=across)

    return [load() for _ in range(count)]


def trial(arm: nf.Robot, hard: list[nf.Load], number: int) -> dict[str, Any]:
    """Solve a load as a user does, and judge it."""
    load = hard[number]
    with timed() as seconds:
        path = nf.simulate(arm, load)
    return {
        "ms": 1e3 * seconds["wall"],
        "reason": path.reason[0] if not path.converged[0] else "",
        "wrong": wrong(arm, load, path),
        "turned": abs(float(np.degrees(path.total_angle[0]))),
    }


def main() -> int:
    """Print a row for each friction, and what went wrong."""
    chosen = options(__doc__, FRICTIONS, count=300, seed=1)
    hard, table, failed = loads(chosen.count, chosen.seed), [], []
    for friction in chosen.cases:
        arm = robot(FRICTIONS[friction])
        nf.simulate(arm, nf.Load(tension=[1.0] * 6, tip_force=(0.1, 0.1, 0.0)))  # compiles
        make = partial(trial, arm, hard)
        rows = list(trials(make, chosen, f"{friction}, seed {chosen.seed}"))
        times = np.quantile([row["ms"] for row in rows], [0.5, 0.95, 1.0])
        table.append(
            {
                "friction": friction,
                "solved": f"{sum(not row['reason'] for row in rows)} of {len(rows)}",
                "wrong": sum(bool(row["wrong"]) for row in rows),
                "median, 95 %, most, ms": times.round(1).tolist(),
                "tip turned by up to, deg": max(row["turned"] for row in rows),
            }
        )
        failed += [row for row in rows if row["reason"] or row["wrong"]]
    show(table)
    for row in failed:
        print(row["case"], row["number"], plain(row["reason"]), *row["wrong"])
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main())
