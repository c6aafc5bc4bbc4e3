"""Designs against differential evolution and a grid: `python benchmarks/design_searches.py`.

Prints solves and CPU seconds of `nf.design` for the wrist whose tip closes first, of differential
evolution (SciPy) for the same sum and penalties, of ten random starts, of a grid of robots, of
a robot of 27 links, of curves by least squares and by SLSQP, and of limits that contradict each
other. Give `de`, `de-each` (a depth for every notch), `starts`, `grid`, `links`, `curves` or
`nearest` for one of them alone.
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
from design_wishes import bend, s_curve, s_wrist, tip_first, wide_wrist
from notchflex.designing.design_robot import problems_of
from notchflex.designing.problem import DesignProblem
from notchflex.designing.search import search_from
from notchflex.designing.specification import spec_from_table
from notchflex.search.slsqp import minimise

# What a limit missed by its size adds to the sum, in sizes of the sum.
_PENALTY = 10.0


def problem_of(along: str = "polynomial") -> DesignProblem:
    """The wrist whose tip closes first."""
    return problems_of(spec_from_table(tip_first(along)), wide_wrist())[0]


def merit(problem: DesignProblem, z: np.ndarray) -> float:
    """Sum and penalties."""
    (one,) = problem.evaluate_all(z[None])
    if one is None:
        return 1e3
    return one.total + _PENALTY * float(np.abs(problem.violation(one)).sum())


def against_evolution(along: str = "polynomial", generations: int = 300) -> None:
    """Solves of both searches until they reach the same height to 0.1 %."""
    spec = tip_first(along)
    nf.design(spec | {"search": {"starts": 1}}, robot=wide_wrist())  # compiles
    counts: list[int] = []
    best = np.inf
    for starts, candidates in ((1, 1), (3, 12), (3, 32)):
        begin = time.process_time()
        options = {"starts": starts, "candidates": candidates}
        made = nf.design(spec | {"search": options}, robot=wide_wrist())
        best = min(best, made.robot.notches[0].height)
        counts.append(made.solves + made.gradients)
        print(
            f"design, {starts} start(s) of {candidates}: {made.solves} solves, "
            f"{made.gradients} derivatives, ",
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
    times = ", ".join(f"{solves / one:.0f}" for one in counts)
    print(f"{times} x as many as the designs above")


def random_starts() -> None:
    """Heights found from ten random starts."""
    problem = problem_of("each")
    rng = np.random.default_rng(1)
    for number in range(10):
        begin, before = time.process_time(), problem.solver.counts["solves"]
        first = problem.evaluate(rng.random(problem.count))
        results = [] if first is None else search_from(problem, first, 150)
        best = min(results, key=lambda result: result.merit, default=None)
        text = "no robot" if best is None else f"{best.merit[1]:.6f} mm, missed {best.merit[0]:.1e}"
        settled = best is not None and best.is_stationary
        solves = problem.solver.counts["solves"] - before
        print(f"start {number}: {text}, settled {settled}, {solves} solves, ", end="")
        print(f"{time.process_time() - begin:.1f} s", flush=True)


def curves() -> None:
    """Curves of many variables, by least squares as designs are, and by SLSQP."""
    for spec, robot in ((bend(), nf.load_robot("pacheco2021-a")), (s_curve(), s_wrist())):
        made = nf.design(spec | {"search": {"starts": 1}}, robot=robot)
        print(f"{made.spec.name}, least squares: {made.wishes[0].achieved[0]:.6f} mm rms, ", end="")
        print(f"settled {made.converged}, {made.solves} solves", flush=True)
        problem = problems_of(spec_from_table(spec), robot)[0]
        first = problem.initial
        assert first is not None
        found = minimise(*problem.program(first), 150)
        assert found is not None
        print(
            f"  SLSQP: {found.reached.value**0.5:.6f} mm rms, settled {found.is_stationary}, ",
            end="",
        )
        print(f"{problem.solver.counts['solves']} solves", flush=True)


def nearest() -> None:
    """A strain that no wrist keeps to: what misses all limits by least."""
    spec = tip_first() | {"search": {"starts": 2, "candidates": 8}}
    spec["constraint"][2]["upper"] = 0.02
    made = nf.design(spec, robot=wide_wrist())
    problem, best = made.outcome.problem, made.outcome.evaluation
    squares = float((problem.violation(best) ** 2).sum())
    print(f"nearest: squared violations {squares:.3f}, largest {problem.worst(best):.3f}, ", end="")
    print(f"{made.solves} solves")


def grid(each: int = 100) -> None:
    """The best of 1e6 robots: depth at base and tip and tendon radius, each with its least height.

    Tensions that close a notch and strains of closed ones do not depend on the height, and the
    angle of closed notches is proportional to it. So a batch of one height finds which robots are
    closed between 1.4 and 1.6 N, and the height that each needs; those of least height are then
    evaluated as the design is, until one meets all limits.
    """
    made = nf.design(tip_first(), robot=wide_wrist())
    best = made.robot.notches[0].height
    problem = problem_of()
    begin = time.process_time()
    box = np.array([(0.0, 1.0)] * 3)
    around = problem.solver.variables
    there = (np.array([one.value for one in made.variables]) - around.lower) / around.span
    for name, low, high in (
        ("all", box[:, 0], box[:, 1]),
        ("a tenth about the design", there[[0, 1, 3]] - 0.05, there[[0, 1, 3]] + 0.05),
    ):
        low, high = np.clip(low, 0.0, 1.0), np.clip(high, 0.0, 1.0)
        axes = [np.linspace(a, b, each) for a, b in zip(low, high, strict=True)]
        points = np.stack([one.ravel() for one in np.meshgrid(*axes, indexing="ij")], axis=1)
        found = [closed(problem, part) for part in np.array_split(points, 20)]
        height = np.concatenate(found)
        order = np.argsort(height)
        tried, least = 0, np.inf
        for k in order[: int(np.isfinite(height).sum())].tolist():
            z = np.insert(points[k], 2, (height[k] - 0.4) / 1.1)
            one = problem.evaluate(z)
            tried += 1
            if one is not None and problem.worst(one) <= 1e-6:
                least = one.total
                break
        steps = (high - low) * around.span[[0, 1, 3]] / (each - 1)
        print(
            f"grid of {len(points)} robots ({name}; steps {steps.round(6).tolist()} mm): ", end=""
        )
        print(
            f"{np.isfinite(height).sum()} close as asked, {tried} of them evaluated; least height "
        )
        print(
            f"  {least:.6f} mm; design {best:.6f} mm, {100.0 * (least / best - 1.0):.3f} %; ",
            end="",
        )
        print(f"{time.process_time() - begin:.0f} s of CPU", flush=True)


def closed(problem: DesignProblem, points: np.ndarray) -> np.ndarray:
    """Height that robots need for the angle, mm; inf where strain or closing is not as asked."""
    variables = problem.solver.variables
    z = np.insert(points, 2, 0.5, axis=1)
    x = variables.lower + z * variables.span
    names = [f"notch[{number}].depth" for number in range(1, 6)]
    along = np.linspace(0.0, 1.0, 5)
    depths = x[:, :1] * (1.0 - along) + x[:, 1:2] * along
    numbers = dict(zip(names, depths.T, strict=True)) | {
        "notch.height": x[:, 2],
        "tendon.radius": x[:, 3],
    }
    load = nf.LoadPath(np.array([[0.7], [1.4], [1.6], [1.65]]), np.full((4, 1), np.nan))
    outputs = ("gap", "contact_force", "outer_strain", "total_angle", "converged")
    batch = nf.batch(variables.robot, numbers, load, outputs=outputs)
    good = batch["converged"].all(axis=1) & (batch["contact_force"][:, 1] < 1e-6).all(axis=1)
    good &= (batch["gap"][:, 2] < 1e-9).all(axis=1)
    good &= (batch["outer_strain"][:, 3] <= 0.06 * (1.0 + 1e-6)).all(axis=1)
    needed = x[:, 2] * np.radians(90.0) / batch["total_angle"][:, 3]
    return np.where(good & (needed <= 1.5), needed, np.inf)


def links() -> None:
    """Strips of 27 links: 60 degrees at 8 N, the largest strain as small as possible."""
    spec = {
        "robot": "gao2017",
        "variable": [
            {"value": "notch.strip_thickness", "lower": 0.5, "upper": 0.9, "along": "each"}
        ],
        "load": {"pulled": {"tension": 8.0}},
        "objective": [
            {"quantity": "peak_strain", "load": "pulled", "take": "largest", "goal": "minimise"}
        ],
        "constraint": [{"quantity": "total_angle", "load": "pulled", "equal": 60.0}],
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
        "curves": curves,
        "nearest": nearest,
    }
    for name in sys.argv[1:] or runs:
        runs[name]()
