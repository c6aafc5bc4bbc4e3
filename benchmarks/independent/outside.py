"""What acts from outside on a solved state, in the world, and the work it does between two."""

from __future__ import annotations

from typing import Any

import numpy as np
from build import rotation_of, vector_of

Table = dict[str, Any]


def acting(
    state: Any, load: Table, bodies: int
) -> list[tuple[int, np.ndarray, np.ndarray, np.ndarray]]:
    """Return (body, point, force, moment) of every load but tendons and own weight, in the world.

    Body `bodies` is the tip's own frame.
    """
    rotation, place = state.tip_rotation, state.tip_position
    zero = np.zeros(3)
    point = np.asarray(load.get("tip_point", zero), dtype=float)
    force = np.asarray(load.get("tip_force", zero), dtype=float)
    moment = np.asarray(load.get("tip_moment", zero), dtype=float)
    if load.get("following"):
        force, moment = rotation @ force, rotation @ moment
    gravity = np.asarray(load.get("gravity", (0.0, 0.0, -9.81)), dtype=float)
    weight = 1e-3 * load.get("tip_mass", 0.0) * gravity
    rows = [(bodies, place + rotation @ point, force + weight, moment)]
    for one in load.get("body_forces", []):
        body = one["body"]
        turn, origin = state.body_rotation[body], state.body_position[body]
        force, moment = np.asarray(one["force"]), np.asarray(one["moment"])
        if one["following"]:
            force, moment = turn @ force, turn @ moment
        rows.append((body, origin + turn @ np.asarray(one["point"]), force, moment))
    return rows


def has_own_weight(robot: Table, load: Table) -> bool:
    """Whether the robot's own weight counts, whose distribution is not public."""
    return "gravity" in load and robot["material"].get("density") is not None


def base_reaction(robot: Table, state: Any, load: Table) -> tuple[np.ndarray, np.ndarray]:
    """Return force and moment of the holder that balance loads and drives."""
    base = rotation_of(np.asarray(load.get("base_rotation", np.zeros(3)), dtype=float))
    force, moment = np.zeros(3), np.zeros(3)
    for _, point, push, turn in acting(state, load, len(state.body_position)):
        force -= push
        moment -= np.cross(point, push) + turn
    for tendon, tension in zip(robot["tendon"], state.tension, strict=True):
        angle = np.radians(tendon.get("direction_deg", 0.0))
        point = tendon["radius"] * np.array([np.cos(angle), np.sin(angle), 0.0])
        pull = base @ np.array([0.0, 0.0, -tension])
        force -= pull
        moment -= np.cross(base @ point, pull)
    return force, moment


def work_between(first: Any, second: Any, before: Table, after: Table) -> tuple[float, float]:
    """Return the work of outside loads from one state to a near one, and the sum of its sizes."""
    bodies = len(first.body_position)
    total = size = 0.0
    rows = zip(acting(first, before, bodies), acting(second, after, bodies), strict=True)
    for (body, p1, f1, m1), (_, p2, f2, m2) in rows:
        r1 = first.tip_rotation if body == bodies else first.body_rotation[body]
        r2 = second.tip_rotation if body == bodies else second.body_rotation[body]
        parts = (f1 + f2) / 2 * (p2 - p1), (m1 + m2) / 2 * vector_of(r2 @ r1.T)
        total += float(sum(part.sum() for part in parts))
        size += float(sum(np.abs(part).sum() for part in parts))
    return total, size
