"""How well targets are met, and how fast a controller is.

    python benchmarks/control.py [accuracy] [speed] [rate] [viewer] [--paths 200] [--seconds 60]

`accuracy`: tips of random forward paths of 20 steps, each to be reached from the state before it.
`speed`: a controller in a loop of a fixed rate; times of the processor, beside the load of the
machine, and of the wall. `rate`: a controller whose drives change by a twentieth of the largest
tension in a step, with all notches pulled together and let go. `viewer`: updates of the viewer,
beside solves of the same loads; all else in an update is drawing. What friction history and
feedback are worth is on docs/control.md (`docs/make/control.py`).
"""

from __future__ import annotations

import resource
import time

import numpy as np
from harness import options, show, timed

import notchflex as nf

STEPS = 20
LARGEST = {
    "pacheco2021-a": 1.9,
    "pacheco2021-b": 1.4,
    "pacheco2021-c": 1.4,
    "liu2022": 8.0,
    "gao2017": 10.0,
    "two-axis-wrist": 3.0,
}
"""Largest tension, N."""
LOOPS = {"pacheco2021-a": (1000, 1.8), "gao2017": (500, 9.0)}
"""Steps a second, and the largest tension, N."""


def forward_drives(random: np.random.Generator, tendons: int, largest: float) -> np.ndarray:
    """Tensions of one path: of one tendon, or of two neighbours of four, to and fro."""
    drives = np.zeros((STEPS, tendons))
    first = random.integers(tendons)
    for tendon in {first, (first + 1) % tendons} if tendons > 2 else {first}:
        walk = np.cumsum(random.uniform(-0.15, 0.2, STEPS) * largest)
        drives[:, tendon] = np.abs((walk + largest) % (2.0 * largest) - largest)
    return drives


def accuracy(name: str, paths: int) -> dict[str, object]:
    """Reach the tips of forward paths, and solve anew for the tensions that were found."""
    robot, random = nf.load_robot(name), np.random.default_rng(24)
    met, misses, larger, seconds = [], [0.0], 0, []
    for _ in range(paths):
        state = None
        for drive in forward_drives(random, robot.number_of_tendons, LARGEST[name]):
            there = nf.solve(robot, nf.Load(tension=drive.tolist()), from_state=state)
            if not there.converged:
                break
            with timed() as taken:
                found = nf.reach(robot, there.tip_position, state=state, approach="direct")
            seconds.append(taken["cpu"])
            met.append(found.reached)
            if found.reached:
                pulled = nf.Load(tension=found.tension.tolist())
                came_to = nf.solve(robot, pulled, from_state=state).tip_position
                misses.append(float(np.linalg.norm(came_to - there.tip_position)))
                larger += np.linalg.norm(found.tension) > (1 + 1e-6) * np.linalg.norm(drive)
            state = there.state
    times = 1e3 * np.quantile(seconds, (0.5, 0.99))
    return {
        "robot": name,
        "met": f"{sum(met)} of {len(met)}",
        "worst, mm": f"{max(misses):.1e}",
        "met, but off by 1e-6 mm": sum(miss > 1e-6 for miss in misses),
        "by larger tensions": larger,
        "CPU of a call, median and 99 %, ms": times.round(2).tolist(),
    }


def speed(name: str, seconds: float) -> dict[str, object]:
    """Run a controller at a fixed rate."""
    robot, (rate, largest) = nf.load_robot(name), LOOPS[name]
    t = np.arange(int(seconds * rate)) / rate
    tension = largest * (0.5 + 0.3 * np.sin(np.pi * t) + 0.15 * np.sin(2.6 * np.pi * t))[:, None]
    path = nf.simulate(robot, nf.LoadPath(tension, np.full_like(tension, np.nan)))
    warm = nf.Controller(robot)
    for goal in path.tip_position[:1000]:
        warm.step(goal)
    controller = nf.Controller(robot)  # at rest, as the robot that made the targets was
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    used, missed, late, solves, start = [], 0, 0, 0, time.perf_counter()
    for number, goal in enumerate(path.tip_position, 1):
        begin, cpu = time.perf_counter(), time.thread_time()
        controller.step(goal)
        used.append((time.thread_time() - cpu, time.perf_counter() - begin))
        missed += not controller.status.reached
        solves = max(solves, controller.status.solves)
        rest = start + number / rate - time.perf_counter()
        late += rest < 0.0
        time.sleep(max(rest, 0.0))
    cpu, wall = (1e3 * np.quantile(used, (0.5, 0.999, 1.0), axis=0)).T
    return {
        "robot": name,
        "Hz": rate,
        "steps": len(used),
        "late": late,
        "missed": missed,
        "most solves": solves,
        "CPU, median, 99.9 %, most, ms": cpu.round(3).tolist(),
        "wall": wall.round(3).tolist(),
        "more memory, KiB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - memory,
    }


def limited_rate(name: str) -> dict[str, object]:
    """Follow a pull that closes all notches and a release twice as fast as the rate; then wait."""
    robot = nf.load_robot(name)
    largest = 1.3 * float(nf.closing(robot).tension.max())
    controller = nf.Controller(robot, limits=nf.Limits(rate=0.05 * largest))
    tension = largest * np.concatenate([np.linspace(0, 1, 27), np.linspace(1, 0, 9), np.zeros(20)])
    goals = nf.simulate(robot, [nf.Load(tension=float(force)) for force in tension]).tip_position
    reached, commands = [], []
    for goal in goals:
        commands.append(float(controller.step(goal)[0]))
        reached.append(controller.status.reached)
    back = reached.index(True, 36) - 26 if any(reached[36:]) else "never"
    return {
        "robot": name,
        "met on the way up": f"{sum(reached[:27])} of 27",
        "steps from the top to the rest": back,
        "largest command, last one, N": [round(max(commands), 3), round(commands[-1], 3)],
    }


def viewer_updates(name: str) -> dict[str, object]:
    """Pull a tendon in the viewer and let go; solve the same loads without it."""
    from notchflex.viewer import Viewer

    robot, (_, largest) = nf.load_robot(name), LOOPS[name]
    viewer = Viewer(robot, port=18190)
    up = np.linspace(0.02, 1.0, 40) * largest
    tensions = np.concatenate([[0.01 * largest], up, up[::-1]]).tolist()
    updates, solves, state = [], [], None
    for tension in tensions:
        with timed() as taken:
            viewer.advance(viewer.session.controls.with_tendon(0, "tension", tension))
        updates.append(taken["cpu"])
        with timed() as taken:
            state = nf.solve(robot, nf.Load(tension=tension), from_state=state).state
        solves.append(taken["cpu"])
    viewer.server.stop()
    update, solve = (1e3 * float(np.mean(seconds[1:])) for seconds in (updates, solves))
    return {
        "robot": name,
        "update, CPU ms": update,
        "solve, CPU ms": solve,
        "ratio": update / solve,
    }


if __name__ == "__main__":
    chosen = options(__doc__, ("accuracy", "speed", "rate", "viewer"), paths=200, seconds=60.0)
    if "accuracy" in chosen.cases:
        show(accuracy(name, chosen.paths) for name in LARGEST)
    if "speed" in chosen.cases:
        show(speed(name, chosen.seconds) for name in LOOPS)
    if "rate" in chosen.cases:
        show(limited_rate(name) for name in LARGEST if name.startswith("pacheco"))
    if "viewer" in chosen.cases:
        show(viewer_updates(name) for name in LOOPS)
