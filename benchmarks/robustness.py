"""Fuzzing: random robots under random paths of loads, each from rest, and what came of them.

A row for each shape of robot (shapes.py): how many states were solved, how many were not and for
which reason, how many failed silently (NaN in a state that is called solved, an exception, a
failure without a reason), how many are wrong, and how long a state took. Wrong is what does not
balance when it is added up outside the solver (judge.py).

    python benchmarks/robustness.py [--count 640] [--seed 1] [--drawn] [--json FILE] [--shape NAME]

With `--drawn` the shapes are those of a drawing: elastic ends, fibres, memory of the material.

Draw i of a seed is the same whatever the count; `--first I --count 1` runs it alone if the shape
is left to its number, and `--first I` goes on where a run was stopped. Exit code 1: something
silent or wrong. Shapes are judged one after the other, and the robots of a shape share their
programs. The first robot of a shape compiles one, which is no part of the times; putting a robot's
arrays together is, in the first step.

With `--folder DIR` the draws are worked on in pieces that are kept, without times: the same call
goes on where it was stopped, and `--workers N` takes so many processes (robustness_pieces.py).
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from draw import Draw, draw
from judge import plain, wrong
from shapes import DRAWN, SHAPES, Shape

import notchflex as nf

# What a solved state must tell as finite numbers; gap and contact tables have NaN where nothing is.
FINITE = (
    "tension",
    "stroke",
    "notch_angle",
    "total_angle",
    "body_position",
    "body_rotation",
    "tip_position",
    "notch_moment",
    "outer_strain",
    "peak_strain",
    "contact_force",
    "base_force",
    "base_moment",
    "moment_error",
    "stored_energy",
    "residual",
    "smallest_eigenvalue",
)


@dataclass
class Outcome:
    """What came of one state of a draw.

    Attributes:
        number: Of the draw.
        step: Of its path, from 0.
        seconds: How long the state took.
        reason: Why it was not solved; empty where it was.
        silent: What failed without being told.
        wrong: What does not hold of a solved state.
    """

    number: int
    step: int
    seconds: float = float("nan")
    reason: str = ""
    silent: list[str] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)


def silent(path: nf.EquilibriumPath) -> list[str]:
    """What a path of one load fails to tell."""
    if not path.converged[0]:
        return [] if path.reason[0] else ["not converged, and no reason"]
    names = [name for name in FINITE if not np.isfinite(getattr(path, name)).all()]
    return [f"{name} is not finite" for name in names]


def follow(one: Draw) -> Iterator[Outcome]:
    """Solve the loads of a draw one after the other, up to the first that is not solved."""
    state = None
    for step, load in enumerate(one.loads):
        outcome = Outcome(one.number, step)
        try:
            start = time.perf_counter()
            path = nf.simulate(one.robot, load, from_state=state)
            outcome.seconds = time.perf_counter() - start
            outcome.reason = path.reason[0]
            outcome.silent = silent(path)
            if path.converged[0]:
                outcome.wrong = wrong(one.robot, load, path)
        except Exception as error:  # whatever it is, it is counted
            outcome.silent = [f"{type(error).__name__}: {error}"]
        yield outcome
        if outcome.reason or outcome.silent:
            return
        state = path.state


def warm(one: Draw) -> float:
    """Compile the program of a draw's shape; its time, s."""
    start = time.perf_counter()
    path = nf.simulate(one.robot, one.loads[0])
    _ = path.smallest_eigenvalue  # a program of its own, computed when asked for
    return time.perf_counter() - start


def row(name: str, outcomes: list[Outcome]) -> dict[str, object]:
    """Counts and times (ms) of one shape, or of all."""
    seconds = [one.seconds for one in outcomes if np.isfinite(one.seconds)]
    middle, late, last = 1e3 * np.quantile(seconds, [0.5, 0.95, 1.0]) if seconds else [None] * 3
    reasons = Counter(plain(one.reason) for one in outcomes if one.reason)
    return {
        "shape": name,
        "draws": len({one.number for one in outcomes}),
        "states": len(outcomes),
        "solved": sum(not one.reason and not one.silent for one in outcomes),
        "unsolved": dict(reasons.most_common()),
        "silent": sum(bool(one.silent) for one in outcomes),
        "wrong": sum(bool(one.wrong) for one in outcomes),
        "median_ms": middle,
        "p95_ms": late,
        "max_ms": last,
    }


def show(rows: Iterable[dict]) -> None:
    """Print the table and, below, the reasons."""
    rows = list(rows)
    print(
        f"{'shape':22}{'draws':>7}{'states':>8}{'solved':>8}{'unsolved':>9}{'silent':>7}"
        f"{'wrong':>6}{'median':>9}{'95 %':>9}{'max ms':>9}"
    )
    for one in rows:
        print(
            f"{one['shape']:22}{one['draws']:7}{one['states']:8}{one['solved']:8}"
            f"{sum(one['unsolved'].values()):9}{one['silent']:7}{one['wrong']:6}"
            + "".join(
                f"{'-' if one[name] is None else format(one[name], '.2f'):>9}"
                for name in ("median_ms", "p95_ms", "max_ms")
            )
        )
    for one in rows:
        for reason, count in one["unsolved"].items():
            print(f"{one['shape']}: {count} x {reason}")


def judged(every: list[Draw], shape: Shape) -> tuple[list[Outcome], float]:
    """Follow all draws of a shape; what came of them, and the time to compile, s."""
    compiled = warm(every[0])
    outcomes = []
    for one in every:
        found = list(follow(one))
        outcomes += found
        told(found, shape.name)  # at once: a run that is stopped loses nothing
        print(f"\r{one.number:6}  {shape.name:24}", end="", file=sys.stderr)
    show([row(shape.name, outcomes)])
    sys.stdout.flush()
    return outcomes, compiled


def told(outcomes: list[Outcome], name: str) -> None:
    """Print every state that is silent, wrong or not solved, with what reproduces it."""
    for one in outcomes:
        what = [*one.silent, *one.wrong, *([one.reason] if one.reason else [])]
        if what:
            kind = "silent" if one.silent else "wrong" if one.wrong else "unsolved"
            place = f"draw {one.number} ({name}) step {one.step}"
            print(f"{kind}: {place}: {what[0]}", flush=True)
            for more in what[1:]:
                print(f"    {more}", flush=True)


def judged_shapes(
    given: argparse.Namespace, compiled: dict[str, float]
) -> dict[str, list[Outcome]]:
    """Follow the draws of all shapes, one after the other; what came of them, by shape.

    Args:
        given: The options.
        compiled: Takes the time to compile, s, by shape.
    """
    shapes = DRAWN if given.drawn else SHAPES
    outcomes: dict[str, list[Outcome]] = {}
    for number, shape in enumerate(shapes):
        numbers = range(number, given.first + given.count, len(shapes))
        every = [draw(one, given.seed, shape) for one in numbers if one >= given.first]
        if every and given.shape in (None, shape.name):
            outcomes[shape.name], compiled[shape.name] = judged(every, shape)
    print(file=sys.stderr)
    return outcomes


def main() -> int:
    """Draw, solve, judge, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=640, help="robots to draw")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first draw")
    parser.add_argument("--drawn", action="store_true", help="shapes as the tube makes them")
    parser.add_argument("--shape", help="only draws of this shape")
    parser.add_argument("--json", type=Path, help="write rows and every state that is not good")
    parser.add_argument("--folder", type=Path, help="keep pieces here, and go on with them")
    parser.add_argument("--workers", type=int, help="processes that work on the pieces")
    given = parser.parse_args()
    last = given.first + given.count
    compiled: dict[str, float] = {}
    if given.folder:
        from robustness_pieces import Chosen, PieceFolder, followed

        chosen = Chosen(given.seed, given.first, given.count, given.drawn, given.shape)
        outcomes = followed(chosen, PieceFolder(given.folder, given.workers))
        for name, some in outcomes.items():
            told(some, name)
    else:
        outcomes = judged_shapes(given, compiled)
    every = sorted((one for some in outcomes.values() for one in some), key=lambda o: o.number)
    rows = [row(name, some) for name, some in outcomes.items() if some]
    rows.append(row("all", every))
    print(f"\nseed {given.seed}, draws {given.first} to {last - 1}")
    show(rows)
    if given.json:
        bad = [vars(one) for one in every if one.reason or one.silent or one.wrong]
        content = {"seed": given.seed, "rows": rows, "compiled_s": compiled, "not_good": bad}
        given.json.write_text(json.dumps(content, indent=1) + "\n")
    return int(any(one.silent or one.wrong for one in every))


if __name__ == "__main__":
    sys.exit(main())
