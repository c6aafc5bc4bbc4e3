"""Where things are: pieces, channels and rest shapes of arc notches, from the robot's table."""

from __future__ import annotations

from typing import Any

import numpy as np
from sections import arc_section

Table = dict[str, Any]


def notches_of(robot: Table) -> list[Table]:
    """Return one table a notch, `repeat` written out."""
    rows: list[Table] = []
    for notch in robot["notch"]:
        for count in range(notch["repeat"]):
            row = dict(notch)
            if notch["kind"] == "u-link" and count % 2:
                row["proximal_slot"] = {"away": "toward", "toward": "away"}[row["proximal_slot"]]
            rows.append(row)
    return rows


def piece_lengths(robot: Table) -> np.ndarray:
    """Return from the origin of every body to the next notch or the tip, base first [mm]."""
    rows = notches_of(robot)
    lengths = [robot["tube"]["base_length"]]
    for row, after in zip(rows, [*rows[1:], None], strict=True):
        length = row["uncut_length"] + row.get("strip_thickness", 0.0)
        if row["kind"] == "u-link":
            length = row["strip_thickness"]
            if after is None or after["kind"] != "u-link":
                length += 2 * row["slot_radius"] + row["uncut_length"]
        lengths.append(length)
    return np.array(lengths)


def toward(notch: Table) -> np.ndarray:
    """Return the unit vector toward which a notch bends."""
    angle = np.radians(notch.get("direction_deg", 0.0))
    return np.array([np.cos(angle), np.sin(angle), 0.0])


def channel(tendon: Table) -> np.ndarray:
    """Return where a tendon's channel crosses the plane of a body's frame [mm]."""
    angle = np.radians(tendon.get("direction_deg", 0.0))
    return tendon["radius"] * np.array([np.cos(angle), np.sin(angle), 0.0])


def free_pose(robot: Table, notch: Table) -> tuple[np.ndarray, np.ndarray]:
    """Return rotation and place of the body beyond an arc notch when nothing pulls."""
    angle = np.radians(notch.get("precurvature_deg", 0.0))
    length = notch["height"] - arc_section(robot["tube"], notch)[0] * angle
    side = toward(notch)
    axis = np.cross([0.0, 0.0, 1.0], side)
    cross = np.cross(axis, np.eye(3)).T  # column i is axis x e_i
    rotation = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    if angle == 0.0:
        return rotation, np.array([0.0, 0.0, length])
    up = length * np.sin(angle) / angle
    out = length * (1 - np.cos(angle)) / angle
    return rotation, up * np.array([0.0, 0.0, 1.0]) + out * side


def straight_gap(
    tendon: Table, rotation: np.ndarray, place: np.ndarray
) -> tuple[float, float, float]:
    """Return length of a straight span over an arc notch and its two turnings.

    Args:
        tendon: The tendon.
        rotation: Rotation of the body beyond against the body before.
        place: Its origin from the end of the body before, in that body's frame.
    """
    point = channel(tendon)
    span = place + rotation @ point - point
    length = float(np.linalg.norm(span))
    start, end = np.array([0.0, 0.0, 1.0]), rotation[:, 2]
    angles = [
        float(np.arctan2(np.linalg.norm(np.cross(span, axis)), span @ axis))
        for axis in (start, end)
    ]
    return length, angles[0], angles[1]


def lies_flat(robot: Table, loads: list[Table]) -> bool:
    """Whether all that bends and pulls lies in the plane of x and z."""
    parts = robot["notch"] + robot["tendon"]
    if any(abs(np.sin(np.radians(part.get("direction_deg", 0.0)))) > 1e-12 for part in parts):
        return False
    for load in loads:
        forces = [load.get("tip_force"), load.get("tip_point"), load.get("gravity")]
        turns = [load.get("tip_moment"), load.get("base_rotation")]
        for one in load.get("body_forces", []):
            forces += [one["force"], one["point"]]
            turns.append(one["moment"])
        if any(vector is not None and vector[1] for vector in forces):
            return False
        if any(vector is not None and (vector[0] or vector[2]) for vector in turns):
            return False
    return True
