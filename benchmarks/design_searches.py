"""Designs against differential evolution and a grid: `python benchmarks/design_searches.py`.

Prints solves and CPU seconds of `nf.design` for the wrist whose tip closes first, of differential
evolution (SciPy) for the same sum and penalties, of ten random starts, of a grid of robots, and of
a robot of 27 links. Give `de`, `de-each` (a depth for every notch), `starts`,
`grid` or `links` for one of them alone.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import differential_evolution

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import notchflex as nf
from design_wishes import tip_first, wide_wrist
from notchflex.designing.forms import problems_of
from notchflex.designing.search.local import search_from
from notchflex.designing.search.problem import Problem
from notchflex.designing.specification.reading import spec_from_table

# What a limit missed by its size adds to the sum, in sizes of the sum.
_PENALTY = 10.0


def problem_of(along: str = "polynomial") -> Problem:
    """The wrist whose tip closes first."""
    return problems_of(spec_from_table(tip_first(along)), wide_wrist())[0]


def merit(problem: Problem, z: np.ndarray) -> float:
    """Sum and penalties."""
    one = problem.evaluate(z)
    if one is None:
        return 1e3
    return one.total + _PENALTY * float(np.abs(problem.violation(one)).sum())


def against_evolution(along: str = "polynomial", generations: int = 300) -> None:
    """Solves of both searches until they reach the same height to 0.1 %."""
    spec = tip_first(along)
    nf.design(spec | {"search": {"starts": 1}}, robot=wide_wrist())  # compiles
    counts: list[int] = []
    best = np.inf
    for starts in (1, 3):
        begin = time.process_time()
        made = nf.design(spec | {"search": spec["search"] | {"starts": starts}}, robot=wide_wrist())
        best = min(best, made.robot.notches[0].height)
        counts.append(made.solves + made.gradients)
        print(
            f"design, {starts} start(s): {made.solves} solves, {made.gradients} derivatives, ",
            end="",
        )
        print(f"height {made.robot.notches[0].height:.6f} mm, ", end="")
        print(f"{time.process_time() - begin:.2f} s of CPU", flush=True)
    problem = problem_of(along)

    def reached(intermediate_result: Any) -> bool:
        return bool(intermediate_result.fun <= 1.001 * best)

    begin = time.process_time()
    found = differential_evolution(
        lambda z: merit(problem, z),
        [(0.0, 1.0)] * problem.count,
        rng=0,
        maxiter=generations,
        callback=reached,
        polish=False,
        tol=0.0,
    )
    solves = problem.solver.counts["solves"]
    print(f"differential evolution, {problem.count} variables: {solves} solves, ", end="")
    print(f"sum {found.fun:.6f} mm, {100.0 * (found.fun / best - 1.0):.3f} % above the design, ")
    print(f"  {time.process_time() - begin:.1f} s of CPU; ", end="")
    print(f"{solves / counts[0]:.0f} x as many as one start, {solves / counts[1]:.0f} x as three")


def random_starts() -> None:
    """Heights found from ten random starts."""
    problem = problem_of("each")
    problem.set_sizes([one for one in [problem.evaluate(problem.start)] if one is not None])
    rng = np.random.default_rng(1)
    for number in range(10):
        begin = time.process_time()
        found = search_from(problem, rng.random(problem.count), 150)
        one = found.evaluation
        text = "no robot" if one is None else f"{one.total:.6f} mm, missed {problem.worst(one):.1e}"
        print(f"start {number}: {text}, settled {found.stationary}, ", end="")
        print(f"{time.process_time() - begin:.1f} s", flush=True)


def grid(each: int = 32) -> None:
    """The best of a grid of depth at base and tip, height and tendon radius."""
    made = nf.design(tip_first(), robot=wide_wrist())
    best = made.robot.notches[0].height
    problem = problem_of()
    # The height enters the angle alone: closing tensions and strains do not depend on it.
    at = np.linspace(0.0, 1.0, each)
    depth, tip, radius = (one.ravel() for one in np.meshgrid(at, at, at, indexing="ij"))
    least = np.inf
    tried = 0
    for a, b, c in zip(depth.tolist(), tip.tolist(), radius.tolist(), strict=True):
        one = problem.evaluate(np.array([a, b, 1.0, c]))
        tried += each
        if one is None:
            continue
        rows = np.abs(problem.violation(one))
        if rows[:-1].max() > 1e-9:
            continue
        for height in at:
            other = problem.evaluate(np.array([a, b, height, c]))
            if other is not None and problem.worst(other) <= 1e-9:
                least = min(least, other.total)
                break
    print(f"grid of {tried} robots: least height {least:.6f} mm; design {best:.6f} mm")


def links() -> None:
    """Strips of 27 links: 60 degrees at 8 N, the largest strain as small as possible."""
    spec = {
        "robot": "gao2017",
        "variable": [
            {"value": "notch.strip_thickness", "lower": 0.5, "upper": 0.9, "along": "each"}
        ],
        "state": [{"name": "pulled", "tension": 8.0}],
        "objective": [
            {"quantity": "peak_strain", "state": "pulled", "take": "largest", "goal": "minimise"}
        ],
        "constraint": [{"quantity": "total_angle", "state": "pulled", "equal": 60.0}],
        "search": {"starts": 1},
    }
    for _ in range(2):  # the first compiles
        begin = time.process_time(), time.perf_counter()
        made = nf.design(spec)
        wall, cpu = time.perf_counter() - begin[1], time.process_time() - begin[0]
        print(f"27 links: {cpu:.1f} s of CPU, {wall:.1f} s, {made.solves} solves, ", end="")
        print(f"{made.gradients} derivatives, converged {made.converged} {made.reason}")
        print(made)


if __name__ == "__main__":
    runs: dict[str, Callable[[], None]] = {
        "de": against_evolution,
        "de-each": partial(against_evolution, "each"),
        "starts": random_starts,
        "grid": grid,
        "links": links,
    }
    for name in sys.argv[1:] or runs:
        runs[name]()
