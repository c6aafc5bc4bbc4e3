"""Whether solved states hold, judged outside the solver: `wrong(robot, loads, path)`.

Everything is put together in numpy from what a result reports, the description of the robot and
the loads. Asked for:

- the commands are met, and what they do not name is slack;
- bodies are turned by rotations, notch angles and the tip are those of the poses;
- holder, drives and loads balance on the whole robot;
- every arc notch is in balance (arcs.py), strips and U-links in a plane are (strips.py);
- tensions and contact forces are not negative, gaps neither, one of force and gap is nil;
- tendons turn as the poses say, friction is within its bound there, opposes what slides, and
  tensions fall by it; strokes are those of the poses (ropes.py).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import numpy as np
from acting import State
from arcs import judge_arcs
from ropes import judge_ropes
from strips import judge_strips

import notchflex as nf

EXACT = 1e-8  # relative, of what is added up
SHARP = 1e-10  # of rotations
# Scaled as the solver scales its imbalance: a stroke over the length, a force over the largest.
_NEAR = 1e-7


def wrong(robot: nf.Robot, loads: Any, path: nf.EquilibriumPath) -> list[str]:
    """Tell what does not hold of the solved steps of a path.

    NaN would pass for right here; it is looked for by `silent` in robustness.py.

    Args:
        robot: The robot.
        loads: A load, loads in order, or a path of loads.
        path: What `nf.simulate(robot, loads)` returned.

    Returns:
        One sentence for everything that does not hold; nothing of steps that are not converged.
    """
    tension, stroke = _demanded(loads, robot.number_of_tendons)
    found: list[str] = []
    for step in np.flatnonzero(path.converged):
        state = State(robot, path, int(step))
        arcs = judge_arcs(state, path)
        found += [
            *_commands(tension[step], stroke[step], state, path),
            *_poses(state, path),
            *_whole(state, path),
            *([] if state.undecided else arcs.problems),
            *judge_strips(state, path),
            *_contacts(state, path),
            *judge_ropes(state, path, arcs),
        ]
    return found


def plain(reason: str) -> str:
    """A reason without its numbers, so that equal ones are counted together."""
    number = r"-?\d+(\.\d+)?(e[+-]?\d+)?"
    return re.sub(rf"{number}(, {number})*", "#", reason)


def _demanded(loads: Any, tendons: int) -> tuple[np.ndarray, np.ndarray]:
    """Tensions and strokes of a path, steps by tendons; NaN where nothing is commanded."""
    if isinstance(loads, nf.LoadPath):
        return loads.tension, loads.stroke
    every = [loads] if isinstance(loads, nf.Load) else list(loads)
    demanded = np.full((2, len(every), tendons), np.nan)
    for step, load in enumerate(every):
        for kind, given in enumerate((load.tension, load.stroke)):
            values = given if isinstance(given, list | tuple) else [given]
            demanded[kind, step, : len(values)] = values  # None becomes NaN
    return demanded[0], demanded[1]


def _commands(
    tension: np.ndarray, stroke: np.ndarray, state: State, path: nf.EquilibriumPath
) -> Iterator[str]:
    """Tensions and strokes are as demanded; a tendon with too much length is slack."""
    near = _NEAR * state.height
    pulled, drawn = path.tension[state.step], path.stroke[state.step]
    for number in range(len(pulled)):
        name = f"tendon {number + 1}"
        if np.isnan(stroke[number]):
            asked = np.nan_to_num(tension[number])
            if abs(pulled[number] - asked) > EXACT * asked + state.rounding:
                yield f"{name}: {pulled[number]:.6g} N, not {asked:.6g}"
            continue
        over = drawn[number] - stroke[number]
        if over < -near or (over > near and pulled[number] > state.rounding):
            yield f"{name}: {drawn[number]:.6g} mm, not {stroke[number]:.6g}"


def _poses(state: State, path: nf.EquilibriumPath) -> list[str]:
    """Rotations are rotations; angles and tip are those of the bodies."""
    found = []
    step, turn = state.step, state.rotation
    off = np.abs(np.swapaxes(turn, 1, 2) @ turn - np.eye(3)).max()
    if off > SHARP or np.abs(np.linalg.det(turn) - 1.0).max() > SHARP:
        found.append(f"bodies are turned by what is no rotation (by {off:.1e})")
    if np.abs(state.tip - path.tip_position[step]).max() > SHARP * state.reach:
        found.append("the tip is not where the last body has it")
    sides = np.radians([notch.direction_deg for notch in state.robot.notches])
    relative = np.swapaxes(turn[:-1], 1, 2) @ turn[1:]
    zero = np.zeros_like(sides)
    x = np.stack([np.cos(sides), np.sin(sides), zero], axis=-1)
    z = np.array([0.0, 0.0, 1.0])
    sine = np.einsum("ni,nij,j->n", x, relative, z) - np.einsum("i,nij,nj->n", z, relative, x)
    cosine = np.einsum("ni,nij,nj->n", x, relative, x) + relative[:, 2, 2]
    off = np.abs(np.arctan2(sine, cosine) - path.notch_angle[step]).max()
    if off > SHARP:
        found.append(f"notch angles are not those of the bodies (by {off:.1e})")
    return found


def _whole(state: State, path: nf.EquilibriumPath) -> list[str]:
    """Holder, drives and loads balance; moments are about the proximal end."""
    step, origin = state.step, np.zeros(3)
    force, moment, sizes = state.beyond_with_size(0, origin)
    # Inner forces cancel but count for the size: tendons and edges are larger than what is left.
    force, moment = force + path.base_force[step], moment + path.base_moment[step]
    for number, tension in enumerate(path.tension[step]):
        pull = state.rotation[0] @ [0.0, 0.0, -tension]
        at = np.cross(state.rotation[0] @ state.tendon_place(number), pull)
        force, moment = force + pull, moment + at
        sizes = sizes[0] + np.linalg.norm(pull), sizes[1] + np.linalg.norm(at)
    found = []
    sums = (("force", force, sizes[0], 1.0), ("moment", moment, sizes[1], state.reach))
    for name, left, size, lever in sums:
        off = float(np.linalg.norm(left))
        if off > EXACT * size + state.rounding * lever:
            found.append(
                f"{name} of the whole out of balance by {off:.1e} (all that acts: {size:.1e})"
            )
    return found


def _contacts(state: State, path: nf.EquilibriumPath) -> list[str]:
    """Closed notches: force and gap not negative, one of them nil, gaps those of the poses."""
    step, found = state.step, []
    force, gap = path.contact_force[step], path.gap[step]
    height = np.array([notch.height for notch in state.robot.notches])
    closes = ~np.isnan(gap)
    largest = np.abs(path.notch_moment[step]).max() / state.robot.tube.outer_radius
    if (force < -state.rounding).any():
        found.append(f"lips pull with {-force.min():.1e} N")
    if (gap[closes] < -1e-8 * np.maximum(height, 1.0)[closes]).any():
        found.append(f"lips overlap by {-np.nanmin(gap):.1e} mm")
    pressed = force > _NEAR * largest + state.rounding
    both = pressed & (np.where(closes, gap, np.inf) > _NEAR * height)
    if both.any():
        found.append(f"lips press over a gap of {gap[both].max():.1e} mm")
    edges = np.isfinite(state.gap)
    off = np.abs(state.gap - gap)[edges] / height[edges]
    if off.size and not off.max() < 1e-9 * (1.0 + state.reach / height.min()):
        found.append(f"gaps of edges are not those of the poses (by {off.max():.1e} of the height)")
    return found
