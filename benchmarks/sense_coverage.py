"""Do the intervals of sensed tip forces cover the truth? 400 simulated trials a robot.

    python benchmarks/sense_coverage.py [--robot wrist|links|strip|two-axis] [--count 400]
        [--held] [--json FILE] [--part I/N]

Every trial draws a history (its number is the seed): the tendon is pulled in 6 to 12 steps, in half
of the trials let go for some steps after that and pulled once more; at a step drawn at random a
force comes on at the tip and grows, stays or changes its sign. The readings are those of the model
with noise of 0.01 N and 0.01 mm, and, the same histories again, without noise.

With --held the tendon is then held for 4 to 8 readings, and the force comes on while it is: changes
that noise could explain, in readings that are averaged.

Prints in how many of 100 trials the 95 % interval of the last reading holds the true force, with
the standard error of that number, apart for pulls and for histories with a reversal; how many false
contacts there were before the force came; and how often the interval without noise fails to hold
the truth in any reading.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np

import notchflex as nf
from notchflex.sensing import SensorNoise, sense

CASES = {
    # Robot, axes of the force, largest tension and force, tension of the other tendons, N.
    "wrist": ("pacheco2021-a", "x", 1.0, 0.04, 0.0),
    "links": ("gao2017", "x", 6.0, 0.3, 0.0),
    "strip": ("liu2022", "x", 5.0, 0.4, 0.0),
    "two-axis": ("two-axis-wrist", "xy", 0.5, 0.04, 0.15),
}
NOISE = 0.01


def history(robot, case, rng, held):
    """Tensions (s, t) and forces (s, 3) of one trial, and the step at which the force comes."""
    _, axes, top, most, others = case
    steps = int(rng.integers(6, 13))
    pulled = np.linspace(0.0, top, steps + 1)[1:] * rng.uniform(0.7, 1.0)
    reversal = rng.random() < 0.5
    if reversal:
        down = pulled[-1] * (1.0 - 0.1 * np.arange(1, int(rng.integers(2, 5))))
        pulled = np.concatenate([pulled, down, [down[-1] + 0.08 * pulled[-1]]])
    before = len(pulled)
    if held:
        pulled = np.append(pulled, np.full(int(rng.integers(4, 9)), pulled[-1]))
    count = len(pulled)
    tension = np.full((count, robot.number_of_tendons), others)
    tension[:, 0] += pulled
    begin = int(rng.integers(before if held else 1, count - 1))
    force = np.zeros((count, 3))
    course = [np.linspace(0.3, 1.0, count - begin), np.ones(count - begin)]
    course.append(np.linspace(1.0, -0.5, count - begin))
    for axis in axes:
        size = rng.uniform(-most, most)
        force[begin:, "xyz".index(axis)] = size * course[int(rng.integers(3))]
    return tension, force, begin, reversal


def trial(robot, case, number, held):
    """One trial: whether intervals hold the truth with noise and without."""
    rng = np.random.default_rng(number)
    axes = ["xyz".index(axis) for axis in case[1]]
    while True:  # another history where one has no equilibrium
        tension, force, begin, reversal = history(robot, case, rng, held)
        external = tuple(nf.Load(tip_force=tuple(one)).external for one in force.tolist())
        load = nf.LoadPath(tension, np.full_like(tension, np.nan), external=external)
        path = nf.simulate(robot, load)
        if path.converged.all():
            break
    truth = force[:, axes]
    found = {}
    for noise in (NOISE, 0.0):
        drawn = rng.normal(size=(2, *tension.shape)) * noise
        sensors = SensorNoise(tension=noise, stroke=noise)
        one = sense(
            robot, tension + drawn[0], path.stroke + drawn[1], noise=sensors, components=case[1]
        )
        found[noise] = one
    noisy, exact = found[NOISE], found[0.0]
    holds = (noisy.low <= truth) & (truth <= noisy.high)
    by_noise = np.abs(noisy.force - truth) <= 1.96 * noisy.deviation
    inside = (exact.low <= truth) & (truth <= exact.high)
    width = exact.high - exact.low
    return {
        "number": number,
        "reversal": reversal,
        "converged": bool(noisy.converged.all() and exact.converged.all()),
        "holds": holds[-1].tolist(),
        "by_noise": by_noise[-1].tolist(),
        "stuck": noisy.stuck[-1].tolist(),
        "readings_held": holds.mean(axis=0).tolist(),
        "false_contacts": int(noisy.contact[:begin].sum()),
        "readings_without": begin,
        "found_at_end": bool(noisy.contact[-1]),
        "exact_holds": bool(inside.all()),
        "exact_miss": float(np.max(np.maximum(exact.low - truth, truth - exact.high))),
        "exact_width": float(np.median(width)),
        "exact_widest": float(width.max()),
        "error": float(np.sqrt(np.mean((noisy.force[-1] - truth[-1]) ** 2))),
    }


def share(rows, name):
    """Percentage and its standard error over all components of some trials."""
    values = np.array([entry for row in rows for entry in row[name]], float)
    if not len(values):
        return "-"
    part = values.mean()
    return f"{100 * part:.1f} ± {100 * np.sqrt(part * (1 - part) / len(values)):.1f} %"


def report(name, rows, seconds, cpu):
    """Print the table of one robot."""
    print(f"{name}: {len(rows)} trials, {seconds:.0f} s, {cpu:.0f} s of CPU")
    print(f"  not converged                    {sum(not row['converged'] for row in rows)}")
    groups = {"all": rows}
    groups["pulls alone"] = [row for row in rows if not row["reversal"]]
    groups["with a reversal"] = [row for row in rows if row["reversal"]]
    for label, some in groups.items():
        kept = len(some)
        print(f"  {label}: {kept} trials")
        print(f"    interval holds the truth       {share(some, 'holds')}")
        print(f"    estimate ± 1.96 SD by noise    {share(some, 'by_noise')}")
        print(f"    interval widened by stuck      {share(some, 'stuck')}")
    before = sum(row["readings_without"] for row in rows)
    false = sum(row["false_contacts"] for row in rows)
    print(f"  false contacts                   {100 * false / before:.1f} % of {before} readings")
    shown = 100 * np.mean([row["found_at_end"] for row in rows])
    print(f"  contact shown at the end         {shown:.0f} %")
    error = np.sqrt(np.mean([row["error"] ** 2 for row in rows]))
    print(f"  RMS error at the end             {error:.4f} N")
    missed = [row for row in rows if not row["exact_holds"]]
    numbers = [row["number"] for row in missed][:9]
    print(f"  without noise: truth outside in  {len(missed)} trials {numbers}")
    print(f"    widest interval                {max(row['exact_widest'] for row in rows):.4f} N")
    if missed:
        print(f"    largest miss                   {max(row['exact_miss'] for row in rows):.3g} N")


def main():
    """Run the trials that were asked for."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--robot", choices=CASES)
    parser.add_argument("--count", type=int, default=400)
    parser.add_argument("--held", action="store_true", help="the force comes at a held tension")
    parser.add_argument("--part", default="0/1", help="every Nth trial from I: I/N")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    first, parts = map(int, options.part.split("/"))
    document = {}
    for name, case in CASES.items():
        if options.robot not in (None, name):
            continue
        robot = nf.load_robot(case[0])
        began, cpu = time.perf_counter(), time.process_time()
        rows = [
            trial(robot, case, number, options.held)
            for number in range(first, options.count, parts)
        ]
        report(name, rows, time.perf_counter() - began, time.process_time() - cpu)
        sys.stdout.flush()
        document[name] = rows
    if options.json is not None:
        options.json.write_text(json.dumps(document))


if __name__ == "__main__":
    main()
