"""Tables of a draw made into the library's values, and the same draw seen in other ways."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from generator import LENGTHS_OF

import notchflex as nf

Table = dict[str, Any]
NOTCHES = {"arc": nf.ArcNotch, "strip": nf.StripNotch, "u-link": nf.ULink}
MATERIALS = {"linear": nf.Linear, "superelastic": nf.Superelastic}
FRICTIONS = {"capstan": nf.Capstan, "corner": nf.Corner, "frictionless": nf.Frictionless}


def make_robot(table: Table) -> nf.Robot:
    """Return the robot of a table.

    Raises:
        InputError: The library does not take it.
    """
    return nf.Robot(
        name=table["name"],
        tube=nf.Tube(**table["tube"]),
        notch=tuple(NOTCHES[notch["kind"]](**notch) for notch in table["notch"]),
        tendon=tuple(nf.Tendon(**tendon) for tendon in table["tendon"]),
        material=MATERIALS[table["material"]["kind"]](**table["material"]),
        friction=FRICTIONS[table["friction"]["kind"]](**table["friction"]),
    )


def make_loads(tables: list[Table]) -> list[nf.Load]:
    """Return the loads of tables.

    Raises:
        InputError: The library does not take one.
    """
    loads = []
    for table in tables:
        table = dict(table)
        bodies = [nf.BodyForce(**one) for one in table.pop("body_forces", [])]
        loads.append(nf.Load(**table, body_forces=bodies))
    return loads


def turned(
    robot: Table, loads: list[Table], angle_deg: float
) -> tuple[Table, list[Table], np.ndarray]:
    """Return everything turned about the tube axis, and the rotation."""
    robot, loads = copy.deepcopy(robot), [copy.deepcopy(load) for load in loads]
    for part in robot["notch"] + robot["tendon"]:
        part["direction_deg"] = part.get("direction_deg", 0.0) + angle_deg
    turn = rotation_of(np.array([0.0, 0.0, np.radians(angle_deg)]))
    return robot, [_mapped(load, turn, turn) for load in loads], turn


def mirrored(robot: Table, loads: list[Table]) -> tuple[Table, list[Table], np.ndarray]:
    """Return the mirror image in the plane of x and z: moments and turns are axial vectors."""
    robot, loads = copy.deepcopy(robot), [copy.deepcopy(load) for load in loads]
    for part in robot["notch"] + robot["tendon"]:
        part["direction_deg"] = -part.get("direction_deg", 0.0)
    polar = np.diag([1.0, -1.0, 1.0])
    return robot, [_mapped(load, polar, -polar) for load in loads], polar


def _mapped(load: Table, polar: np.ndarray, axial: np.ndarray) -> Table:
    """Return loads with all vectors mapped."""
    load = dict(load)
    for key in ("tip_force", "tip_point", "gravity"):
        if key in load:
            load[key] = polar @ np.asarray(load[key])
    for key in ("tip_moment", "base_rotation"):
        if key in load:
            load[key] = axial @ np.asarray(load[key])
    if "body_forces" in load:
        load["body_forces"] = [
            one
            | {"force": polar @ one["force"], "point": polar @ one["point"]}
            | {"moment": axial @ one["moment"]}
            for one in load["body_forces"]
        ]
    return load


def enlarged(robot: Table, loads: list[Table], factor: float) -> tuple[Table, list[Table]]:
    """Return everything with lengths times a factor, forces times its square, equal stresses."""
    robot, loads = copy.deepcopy(robot), [copy.deepcopy(load) for load in loads]
    for part in [robot["tube"], *robot["notch"], *robot["tendon"]]:
        for key in LENGTHS_OF:
            if part.get(key) is not None:
                part[key] *= factor
        if "axial_stiffness" in part:
            part["axial_stiffness"] *= factor**2
    powers = {"tip_force": 2, "tip_moment": 3, "tip_mass": 3, "tip_point": 1, "gravity": -1}
    for load in loads:
        if "tip_mass" in load and "gravity" not in load:
            load["tip_mass"] /= factor  # its weight counts, and gravity stays
        for key in ("tension", "stroke"):
            power = 2 if key == "tension" else 1
            load[key] = [None if x is None else x * factor**power for x in load[key]]
        for key, power in powers.items():
            if key in load:
                load[key] = np.asarray(load[key]) * factor**power
        if "tip_mass" in load:
            load["tip_mass"] = float(load["tip_mass"])
        for one in load.get("body_forces", []):
            one["force"], one["moment"] = one["force"] * factor**2, one["moment"] * factor**3
            one["point"] = one["point"] * factor
    return robot, loads


def rotation_of(vector: np.ndarray) -> np.ndarray:
    """Return the rotation matrix of a rotation vector (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = np.asarray(vector) / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def vector_of(rotation: np.ndarray) -> np.ndarray:
    """Return the rotation vector of a rotation matrix of less than half a turn."""
    axial = np.array(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    sine, cosine = np.linalg.norm(axial) / 2, (np.trace(rotation) - 1) / 2
    return axial / 2 * (np.arctan2(sine, cosine) / sine if sine > 1e-12 else 1.0)
