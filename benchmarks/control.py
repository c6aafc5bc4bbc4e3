"""How well and how fast targets are met.

`python benchmarks/control.py [paths|curves|reversal|loop]`, all without an argument.

Times are processor time, beside the load of the machine; the loop's are of the wall too.
"""

from __future__ import annotations

import os
import resource
import sys
import time

import numpy as np

import notchflex as nf
from notchflex.control.problem import Problem, ProblemOptions, Response, make_problem
from notchflex.control.search import find, smallest_tensions
from notchflex.control.targets import make_targets

PATHS, STEPS = 200, 20
OPTIONS = ProblemOptions(None, None, "tension", None, None, None)
LARGEST = {
    "pacheco2021-a": 1.9,
    "pacheco2021-b": 1.4,
    "pacheco2021-c": 1.4,
    "liu2022": 8.0,
    "gao2017": 10.0,
    "two-axis-wrist": 3.0,
}
FRICTION = "friction.coefficient"


def load() -> str:
    """Return the load averages of the machine."""
    return "load " + ", ".join(f"{one:.1f}" for one in os.getloadavg())


def forward_drives(random: np.random.Generator, tendons: int, largest: float) -> np.ndarray:
    """Tensions of one path: of one tendon, or of two neighbours of four, to and fro."""
    drives = np.zeros((STEPS, tendons))
    first = random.integers(tendons)
    for tendon in {first, (first + 1) % tendons} if tendons > 2 else {first}:
        change = random.uniform(-0.15, 0.2, STEPS) * largest
        walk = np.cumsum(change)
        drives[:, tendon] = np.abs((walk + largest) % (2.0 * largest) - largest)
    return drives


def repeats(stepper: nf.Stepper, before: np.ndarray, drive: np.ndarray) -> bool:
    """Whether a load comes to the same state where rounding changes its tensions."""
    changed = [drive * (1.0 + part) for part in (1e-12, -1e-12, 1e-11, -1e-11, 1e-10, -1e-10)]
    tips = [stepper.step(before, one).flat_values for one in (drive, *changed)]
    return bool(np.ptp(tips, axis=0).max() < 1e-7)


def known_of(problem: Problem, step: nf.Step, last: Response | None) -> Response:
    """Return a step with the slopes of tendons that stick as they last slid."""
    slopes = np.nan_to_num(step.flat_jacobian)
    like = slopes if last is None else last.sliding
    stuck = (slopes[problem.entries] ** 2).sum(0) <= 1e-12 * (like[problem.entries] ** 2).sum(0)
    return Response(step, np.where(stuck, like, slopes), stuck)


def paths() -> None:
    """Print how targets of random forward paths are met."""
    print(f"targets of {PATHS} forward paths of {STEPS} steps, from the same states; {load()}")
    print("robot            met/all  worst mm  silent  larger  (those of states that rounding")
    print("changes: missed, larger)  CPU of a step in solves, in turns: p50  p99  p99.9")
    for name, largest in LARGEST.items():
        robot, random = nf.load_robot(name), np.random.default_rng(24)
        some = make_targets((1.0, 0.0, 9.0), robot, several=False)
        problem, _ = make_problem(robot, some, OPTIONS)
        stepper, entries = problem.stepper, problem.entries
        met = silent = count = 0
        larger, unsure = [0, 0], 0
        errors: list[float] = []
        times: list[tuple[float, float]] = []
        for _ in range(PATHS):
            before, known = stepper.start(), None
            for drive in forward_drives(random, robot.number_of_tendons, largest):
                there = stepper.step(before, drive)
                if not there.converged:
                    break
                one, start = nf.Load(tension=drive.tolist()), time.process_time()
                nf.solve(robot, one)
                solved = time.process_time()
                goal = there.flat_values[entries]
                found = find(problem, before, goal, known)
                found = smallest_tensions(problem, before, goal, found)
                times.append((time.process_time() - solved, solved - start))
                count += 1
                # Solved anew from the same state, as a robot is pulled.
                came_to = stepper.step(before, found.drives).flat_values[entries]
                miss = float(np.linalg.norm(came_to - goal))
                missed = found.failure is not None
                met += not missed
                silent += not missed and miss > 1e-6
                errors.append(0.0 if missed else miss)
                effort = np.linalg.norm(found.drives)
                more = not missed and effort > (1.0 + 1e-6) * np.linalg.norm(drive)
                sure = repeats(stepper, before, drive) if missed or more else True
                larger[int(not sure)] += more
                unsure += missed and not sure
                before, known = there.state, known_of(problem, there, known)
        steps, solves = np.array(times).T
        q = np.quantile(steps, (0.5, 0.99, 0.999)) / np.median(solves)
        print(
            f"{name:15s} {met:5d}/{count:5d}  {max(errors):.1e}  {silent:5d}  {larger[0]:5d}  "
            f"({unsure}, {larger[1]})  {q[0]:8.1f} {q[1]:8.1f} {q[2]:7.1f}",
            flush=True,
        )


def curves_of(radius: float, centre: float) -> dict[str, np.ndarray]:
    """Positions x, y of 500 points there and back, mm."""
    t = np.linspace(0.0, 2.0 * np.pi, 500)
    shapes = {
        "circle": (np.cos(t), np.sin(t)),
        "line": (np.cos(t / 2.0), 0.3 * np.cos(t / 2.0)),
        "lemniscate": (np.cos(t), 0.5 * np.sin(2.0 * t)),
    }
    whole = {name: radius * np.stack(one, axis=1) + (centre, 0.0) for name, one in shapes.items()}
    return {name: np.concatenate([one, one[::-1]]) for name, one in whole.items()}


CURVES = {"pacheco2021-a": (1.5, 2.6, 1), "gao2017": (5.0, 9.0, 1), "two-axis-wrist": (2.0, 0.0, 2)}
"""Radius and centre, mm, and how many of x and y the robot can meet."""


def constant_curvature(robot: nf.Robot, goals: np.ndarray) -> np.ndarray:
    """Tensions for an arc of the whole robot whose angle is proportional to the tension."""
    slick, small = robot.with_value(FRICTION, 0.0), 1e-3
    tendons = robot.number_of_tendons
    rest = nf.solve(slick, nf.Load(tension=[0.0] * tendons))
    bent = nf.solve(slick, nf.Load(tension=[small] + [0.0] * (tendons - 1)))
    stiffness = small / abs(float(bent.total_angle))
    length = float(rest.tip_position[2])
    angle = np.linspace(1e-6, 3.0, 4000)
    reach = length * (1.0 - np.cos(angle)) / angle
    far = np.argmax(reach)
    radius = np.linalg.norm(goals, axis=1) if goals.shape[1] > 1 else goals[:, 0]
    bend = stiffness * np.interp(radius, reach[: far + 1], angle[: far + 1])
    if tendons == 1:
        return bend[:, None]
    toward = np.arctan2(goals[:, 1], goals[:, 0])
    at = np.radians([one.direction_deg for one in robot.tendon])
    return np.maximum(bend[:, None] * np.cos(toward[:, None] - at), 0.0)


def pull_all(robot: nf.Robot, drives: np.ndarray, axes: int) -> np.ndarray:
    """Return the first coordinates of the tip under tensions one after the other, mm."""
    stroke = np.full_like(drives, np.nan)
    return nf.simulate(robot, nf.LoadPath(drives, stroke)).tip_position[:, :axes]


def fed_back(robot: nf.Robot, real: nf.Robot, goals: np.ndarray, axes: int) -> np.ndarray:
    """Tips of a real robot under the controller of another, with a measured tip."""
    free, random = [np.nan] * (3 - axes), np.random.default_rng(24)
    controller = nf.Controller(robot, search=nf.TargetSearch(tolerance=1e-4, solves=12))
    plant = nf.Stepper(real)
    state, seen, tips = plant.rest(), None, []
    for goal in goals:
        found = plant.step(state, controller.step([*goal, *free], measured=seen))
        state, tip = found.state, found.values["tip_position"]
        seen = tip + random.normal(0.0, 0.01, 3)
        tips.append(tip[:axes])
    return np.array(tips)


def curves() -> None:
    """Print the errors of three inverses on three curves."""
    print(
        f"500 points there and back, friction 0.2; root mean square error of the tip, mm; {load()}"
    )
    print("robot, curve                  memory  frictionless  const.curv.  ratio |", end=" ")
    print("10 % wrong, noise: feedback  frictionless  const.curv.")
    for name, (radius, centre, axes) in CURVES.items():
        robot = nf.load_robot(name).with_value(FRICTION, 0.2)
        real = robot.with_value(FRICTION, 0.22)
        stiff = "material.elastic_modulus"
        real = real.with_value(stiff, 0.9 * robot.material.elastic_modulus)
        for curve, positions in curves_of(radius, centre).items():
            goals = positions[:, :axes]
            aim = [[*one, *[None] * (3 - axes)] for one in goals.tolist()]
            exact = nf.follow(robot, {"tip_position": aim})
            slick = nf.follow(robot.with_value(FRICTION, 0.0), {"tip_position": aim})
            ways = {"slick": slick.path.load.tension[slick.step]}
            ways["arc"] = constant_curvature(robot, goals)

            def error(tips: np.ndarray, goals: np.ndarray = goals) -> float:
                return float(np.sqrt(np.mean(np.sum((tips - goals) ** 2, axis=1))))

            memory = error(exact.tip_position[:, :axes])
            others = [error(pull_all(robot, one, axes)) for one in ways.values()]
            wrong = [error(pull_all(real, one, axes)) for one in ways.values()]
            fed = error(fed_back(robot, real, goals, axes))
            print(
                f"{name:15s} {curve:10s}  {memory:9.1e} {others[0]:9.3f} {others[1]:12.3f}"
                f"   {min(others) / memory:8.0f} | {fed:24.4f} {wrong[0]:12.3f} {wrong[1]:12.3f}"
                f"   met {int(exact.reached.sum())}/{len(goals)}",
                flush=True,
            )


def reversal() -> None:
    """Print the error after a reversal, with and without friction history."""
    print("after a reversal at 1.2 rad: largest error of the angle, rad and of the tip, mm")
    angle = np.concatenate([np.linspace(0.2, 1.2, 21), np.linspace(1.2, 0.4, 17)])
    for name in ("pacheco2021-a", "gao2017"):
        robot = nf.load_robot(name)
        found = nf.follow(robot, {"total_angle": angle})
        loading = nf.follow(robot, {"total_angle": np.unique(angle)})
        drives = np.interp(angle, np.unique(angle), loading.tension[:, 0])[:, None]
        plain = nf.simulate(robot, nf.LoadPath(drives, np.full_like(drives, np.nan)))
        tip = np.abs(plain.tip_position - found.tip_position)[21:].max()
        errors = [np.abs(one.total_angle - angle)[21:].max() for one in (plain, found.path)]
        places = found.path.tip_position
        met = np.abs(nf.follow(robot, places).path.tip_position - places)[21:].max()
        print(
            f"{name:15s} by the loading curve {errors[0]:.4f} rad (tip {tip:.3f} mm), "
            f"with friction history {errors[1]:.1e} rad (tip {met:.1e} mm)"
        )


def loop(seconds: float = 60.0) -> None:
    """Print how a controller keeps its rate."""
    for name, rate, largest in (("pacheco2021-a", 1000, 1.8), ("gao2017", 500, 9.0)):
        robot, count = nf.load_robot(name), int(seconds * rate)
        t = np.arange(count) / rate
        pulled = 0.5 + 0.3 * np.sin(np.pi * t) + 0.15 * np.sin(2.6 * np.pi * t)
        drives = largest * pulled[:, None]
        goals = nf.simulate(robot, nf.LoadPath(drives, np.full_like(drives, np.nan))).tip_position
        warm = nf.Controller(robot)
        for goal in goals[:1000]:
            warm.step(goal)
        controller = nf.Controller(robot)  # at rest, as the robot that made the targets was
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        used, wall, missed, late, solves = np.empty(count), np.empty(count), 0, 0, 0
        start = time.perf_counter()
        for number, goal in enumerate(goals):
            begin, cpu = time.perf_counter(), time.thread_time()
            controller.step(goal)
            used[number] = time.thread_time() - cpu
            wall[number] = time.perf_counter() - begin
            missed += not controller.status.reached
            solves = max(solves, controller.status.solves)
            rest = start + (number + 1) / rate - time.perf_counter()
            late += rest < 0.0
            if rest > 0.0:
                time.sleep(rest)
        took = time.perf_counter() - start
        grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - memory
        q, w = (1e6 * np.quantile(one, (0.5, 0.999, 1.0)) for one in (used, wall))
        print(
            f"{name} at {rate} Hz: {count} steps in {took:.2f} s, {late} late; CPU us median "
            f"{q[0]:.0f}, p99.9 {q[1]:.0f}, worst {q[2]:.0f}; wall us median {w[0]:.0f}, p99.9 "
            f"{w[1]:.0f}, worst {w[2]:.0f}; memory +{grown} KiB; {missed} targets missed; "
            f"at most {solves} solves; {load()}",
            flush=True,
        )


if __name__ == "__main__":
    parts = {"paths": paths, "curves": curves, "reversal": reversal, "loop": loop}
    for part in sys.argv[1:] or parts:
        parts[part]()
