"""How fast is a workspace, and from how many states is its hull right?

    python benchmarks/workspace_figures.py [--robot two-axis-wrist] [--states 1000000]

Explores the workspace of a robot with half of the states and with all, after a small one that
compiles. No state is kept from one to the next.
"""

from __future__ import annotations

import resource

import numpy as np
from harness import options, show, timed

import notchflex as nf


def explore(robot: nf.Robot, states: int) -> dict[str, object]:
    """Explore a workspace, with its hulls, its voxels and the spread of its maps."""
    with timed() as exploring:
        found = nf.workspace(robot, states=states)
    with timed() as of_hull:
        hull = found.hull
    with timed() as of_alpha:
        alpha = found.alpha_size()
    with timed() as of_voxels:
        voxels = found.voxels()
    return {
        "states": found.tried,
        "kept": len(found),
        "not converged": found.failed,
        "wall, s": exploring["wall"],
        "CPU, s": exploring["cpu"],
        "CPU a state, us": 1e6 * exploring["cpu"] / found.tried,
        f"convex hull, {hull.unit} (s)": f"{hull.size:.4f} ({of_hull['wall']:.1f})",
        "alpha shape (s)": f"{alpha:.2f} ({of_alpha['wall']:.1f})",
        "voxels (s)": f"{len(voxels)} of {voxels.size:.3f} mm ({of_voxels['wall']:.1f})",
        "dexterity, mean": float(voxels.dexterity.mean()),
        "dexterity, largest": float(voxels.dexterity.max()),
        "hysteresis up to, mm": float(np.nanmax(found.hysteresis)),
        "memory, GB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6,
    }


if __name__ == "__main__":
    chosen = options(__doc__, robot="two-axis-wrist", states=1_000_000)
    robot = nf.load_robot(chosen.robot)
    nf.workspace(robot, states=3 * 4096)  # compiles
    columns = [explore(robot, states) for states in (chosen.states // 2, chosen.states)]
    show({robot.name: key, "half": columns[0][key], "all": columns[1][key]} for key in columns[0])
