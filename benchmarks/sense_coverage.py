"""Do the intervals of sensed tip forces cover the truth? 400 simulated trials a robot.

    python benchmarks/sense_coverage.py [wrist links strip two-axis] [--count 400]
        [--json FILE] [--part I/N]

Every trial draws a history (its number is the seed): the tendon is pulled in 6 to 12 steps, in half
of the trials let go for some steps after that and pulled once more; at a step drawn at random a
force comes on at the tip and grows, stays or changes its sign. The readings are those of the model
with noise of 0.01 N and 0.01 mm, and, the same histories again, without noise.

Prints in how many of 100 trials the 95 % interval of the last reading holds the true force, apart
for pulls and for histories with a reversal; in how many friction widens it; how many readings
before the force came show a contact; and in how many trials the interval without noise fails to
hold the truth in any reading.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from harness import options, rms, share, show, trials

import notchflex as nf
from notchflex.sensing import SensorNoise, sense

NOISE = 0.01  # N, mm


class Case(NamedTuple):
    """A robot, the axes of the force, and largest and constant loads, N."""

    robot: str
    axes: str
    largest_tension: float
    largest_force: float
    tension_of_others: float = 0.0


CASES = {
    "wrist": Case("pacheco2021-a", "x", 1.0, 0.04),
    "links": Case("gao2017", "x", 6.0, 0.3),
    "strip": Case("liu2022", "x", 5.0, 0.4),
    "two-axis": Case("two-axis-wrist", "xy", 0.5, 0.04, 0.15),
}


def history(robot: nf.Robot, case: Case, rng: np.random.Generator):
    """Tensions (s, t) and forces (s, 3) of one trial, and the step at which the force comes."""
    steps = int(rng.integers(6, 13))
    pulled = np.linspace(0.0, case.largest_tension, steps + 1)[1:] * rng.uniform(0.7, 1.0)
    reversal = rng.random() < 0.5
    if reversal:
        down = pulled[-1] * (1.0 - 0.1 * np.arange(1, int(rng.integers(2, 5))))
        pulled = np.concatenate([pulled, down, [down[-1] + 0.08 * pulled[-1]]])
    count = len(pulled)
    tension = np.full((count, robot.number_of_tendons), case.tension_of_others)
    tension[:, 0] += pulled
    begin = int(rng.integers(1, count - 1))
    force = np.zeros((count, 3))
    courses = [
        np.linspace(first, last, count - begin) for first, last in ((0.3, 1), (1, 1), (1, -0.5))
    ]
    for axis in case.axes:
        size = rng.uniform(-case.largest_force, case.largest_force)
        force[begin:, "xyz".index(axis)] = size * courses[int(rng.integers(3))]
    return tension, force, begin, reversal


def trial(robot: nf.Robot, case: Case, number: int) -> dict[str, object]:
    """One trial: whether intervals hold the truth with noise and without."""
    rng = np.random.default_rng(number)
    while True:  # another history where one has no equilibrium
        tension, force, begin, reversal = history(robot, case, rng)
        external = tuple(nf.Load(tip_force=tuple(vector)).external for vector in force.tolist())
        load = nf.LoadPath(tension, np.full_like(tension, np.nan), external=external)
        path = nf.simulate(robot, load)
        if path.converged.all():
            break

    def sensed(noise: float):
        errors = rng.normal(size=(2, *tension.shape)) * noise
        sensors = SensorNoise(tension=noise, stroke=noise)
        readings = tension + errors[0], path.stroke + errors[1]
        return sense(robot, *readings, noise=sensors, components=case.axes)

    truth = force[:, ["xyz".index(axis) for axis in case.axes]]
    noisy, exact = sensed(NOISE), sensed(0.0)
    holds, exact_holds = (
        (forces.low <= truth) & (truth <= forces.high) for forces in (noisy, exact)
    )
    return {
        "reversal": bool(reversal),
        "converged": bool(noisy.converged.all() and exact.converged.all()),
        "holds": holds[-1],
        "stuck": noisy.stuck[-1],
        "contacts_before": noisy.contact[:begin],
        "exact_holds": bool(exact_holds.all()),
        "error": rms(noisy.force[-1] - truth[-1]),
    }


def summary(name: str, rows: list[dict]) -> dict[str, object]:
    """Make a row of the table."""

    def collected(key: str, *reversals: bool) -> np.ndarray:
        kept = [np.ravel(row[key]) for row in rows if row["reversal"] in (reversals or (0, 1))]
        return np.concatenate(kept) if kept else np.zeros(0)

    before = collected("contacts_before")
    return {
        "robot": name,
        "all": share(collected("holds")),
        "pulls alone": share(collected("holds", False)),
        "with a reversal": share(collected("holds", True)),
        "widened": share(collected("stuck")),
        "false contacts": f"{share(before)} of {len(before)}",
        "not held without noise": sum(not row["exact_holds"] for row in rows),
        "not converged": sum(not row["converged"] for row in rows),
        "RMS error, N": rms(collected("error")),
        "CPU, s": sum(row["seconds"] for row in rows),
    }


if __name__ == "__main__":
    chosen = options(__doc__, CASES, count=400, part="0/1")
    table = []
    for name in chosen.cases:
        case = CASES[name]
        make = partial(trial, nf.load_robot(case.robot), case)
        table.append(summary(name, list(trials(make, chosen, name))))
    show(table)
