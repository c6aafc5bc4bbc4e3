"""How fast is a workspace, and from how many states is its hull right?

    python benchmarks/workspace_figures.py [--robot two-axis-wrist] [--states 1000000] [--tension N]

Explores the workspace of a robot with some states and with half of them, after a small one that
compiles. Prints seconds, seconds of the processor, the memory of the process, both convex hulls and
how far they differ, the alpha shape, dexterity, and the spread of the maps. No state is kept from
one to the next.
"""

from __future__ import annotations

import argparse
import resource
import time

import numpy as np

import notchflex as nf


def explored(robot, tension, states):
    """A workspace with the seconds and the processor seconds that it took."""
    began, cpu = time.perf_counter(), time.process_time()
    found = nf.workspace(robot, states=states, tension=tension)
    return found, time.perf_counter() - began, time.process_time() - cpu


def main():
    """Explore twice and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--robot", default="two-axis-wrist")
    parser.add_argument("--states", type=int, default=1_000_000)
    parser.add_argument("--tension", type=float)
    options = parser.parse_args()
    robot = nf.load_robot(options.robot)
    nf.workspace(robot, states=3 * 4096, tension=options.tension)  # compiles
    half, *_ = explored(robot, options.tension, options.states // 2)
    small = half.hull.size
    del half
    found, seconds, cpu = explored(robot, options.tension, options.states)
    print(f"{robot.name}: {len(found)} of {found.tried} states kept, {found.failed} not converged")
    each = 1e6 * cpu / found.tried
    print(f"  {seconds:.1f} s, {cpu:.1f} s of the processor, {each:.1f} µs a state")
    began = time.perf_counter()
    hull = found.hull
    print(f"  convex hull {hull.size:.2f} {hull.unit} in {time.perf_counter() - began:.1f} s")
    print(f"  from half the states {small:.2f}, {100 * abs(small / hull.size - 1):.3f} % off")
    began = time.perf_counter()
    print(f"  alpha shape {found.alpha_size():.2f} in {time.perf_counter() - began:.1f} s")
    began = time.perf_counter()
    voxels = found.voxels()
    print(f"  {len(voxels)} voxels of {voxels.size:.3f} mm in {time.perf_counter() - began:.1f} s")
    print(f"  dexterity {voxels.dexterity.mean():.4f}, largest {voxels.dexterity.max():.4f}")
    print(f"  hysteresis up to {np.nanmax(found.hysteresis):.3f} mm")
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(f"  largest memory of the process {memory:.2f} GB")


if __name__ == "__main__":
    main()
