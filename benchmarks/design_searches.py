"""Designs against differential evolution and SLSQP: solves of robots, and what each search finds.

    python benchmarks/design_searches.py [de] [de-each] [curves] [nearest]

`de`: the wrist whose tip closes first, by `nf.design` and by differential evolution (SciPy) of the
same sum and penalties until it reaches the same height to 0.1 %; `de-each` with a depth for every
notch. `curves`: curves of many variables, by least squares as designs are, and by SLSQP.
`nearest`: limits that contradict each other; what misses them by least.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
from harness import options, show, timed
from scipy.optimize import differential_evolution

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import notchflex as nf
from design_wishes import bend, s_curve, s_wrist, tip_first, wide_wrist
from notchflex.designing.design_robot import problems_of
from notchflex.search.slsqp import minimise

PENALTY = 10.0
"""What a limit missed by its size adds to the sum, in sizes of the sum."""


def against_evolution(along: str, generations: int = 300):
    """Solves of both searches until they reach the same height to 0.1 %."""
    spec = tip_first(along)
    nf.design(spec | {"search": {"starts": 1}}, robot=wide_wrist())  # compiles
    best = np.inf
    for starts, candidates in ((1, 1), (3, 12), (3, 32)):
        with timed() as seconds:
            search = {"starts": starts, "candidates": candidates}
            made = nf.design(spec | {"search": search}, robot=wide_wrist())
        best = min(best, made.robot.notches[0].height)
        yield {
            "search": f"design, {starts} starts of {candidates}",
            "solves": made.solves,
            "derivatives": made.gradients,
            "height, mm": f"{made.robot.notches[0].height:.6f}",
            "CPU, s": seconds["cpu"],
        }
    problem = problems_of(nf.DesignSpec(**spec), wide_wrist())[0]

    def merit(z: np.ndarray) -> float:
        (evaluated,) = problem.evaluate_all(z[None])
        if evaluated is None:
            return 1e3
        return evaluated.total + PENALTY * float(np.abs(problem.violation(evaluated)).sum())

    def reached(intermediate_result: Any) -> bool:
        return bool(intermediate_result.fun <= 1.001 * best)

    with timed() as seconds:
        evolved = differential_evolution(
            merit, [(0.0, 1.0)] * problem.count, rng=0, maxiter=generations, callback=reached,
            polish=False, tol=0.0,
        )  # fmt: skip
    yield {
        "search": f"differential evolution, {problem.count} variables",
        "solves": problem.solver.counts["solves"],
        "derivatives": 0,
        "height, mm": f"{evolved.fun:.6f}",
        "CPU, s": seconds["cpu"],
    }


def curves():
    """Curves of many variables, by least squares as designs are, and by SLSQP."""
    for spec, robot in ((bend(), nf.load_robot("pacheco2021-a")), (s_curve(), s_wrist())):
        made = nf.design(spec | {"search": {"starts": 1}}, robot=robot)
        problem = problems_of(nf.DesignSpec(**spec), robot)[0]
        result = minimise(*problem.program(problem.initial), 150)
        ways = {
            "least squares": (made.wishes[0].achieved[0], made.converged, made.solves),
            "SLSQP": (
                result.reached.value**0.5,
                result.is_stationary,
                problem.solver.counts["solves"],
            ),
        }
        for way, (error, settled, solves) in ways.items():
            yield {
                "curve": made.spec.name,
                "by": way,
                "rms, mm": f"{error:.6f}",
                "settled": settled,
                "solves": solves,
            }


def nearest():
    """A strain that no wrist keeps to: what misses all limits by least."""
    spec = tip_first() | {"search": {"starts": 2, "candidates": 8}}
    spec["constraint"][2]["upper"] = 0.02
    made = nf.design(spec, robot=wide_wrist())
    problem, best = made.outcome.problem, made.outcome.evaluation
    yield {
        "squared violations": float((problem.violation(best) ** 2).sum()),
        "largest": float(problem.worst(best)),
        "solves": made.solves,
    }


if __name__ == "__main__":
    runs = {
        "de": lambda: against_evolution("polynomial"),
        "de-each": lambda: against_evolution("each"),
        "curves": curves,
        "nearest": nearest,
    }
    for name in options(__doc__, runs).cases:
        show(runs[name](), name)
