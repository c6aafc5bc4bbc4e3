"""Balance of planar arc notches: a rod integrated anew under the forces beyond its cut."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from checks import Finding, above, all_gaps
from outside import acting, has_own_weight
from sections import arc_section
from shape import channel, notches_of, piece_lengths, toward

Table = dict[str, Any]
STEPS = 60


def strain_of(material: Table, value: float) -> float:
    """Return the strain that belongs to a stress: `stress`, solved for it; NaN where none does."""
    size, modulus = abs(value), material["elastic_modulus"]
    if material["kind"] == "linear":
        return value / modulus
    first, second = material["transition_strain"], material.get("plastic_strain", 0.1)
    low = modulus * first
    high = low + (second - first) * material["superelastic_modulus"]
    if size <= low:
        strain = size / modulus
    elif size <= high:
        strain = first + (size - low) / material["superelastic_modulus"]
    else:
        part = (size - high) / material.get("plastic_modulus", 1000.0)
        if part >= 1.0:
            return np.nan
        strain = second + material.get("plastic_exponent", -0.01) / np.log(part)
    return float(np.copysign(strain, value))


def check_rods(robot: Table, path: Any, load: Table, step: int) -> Iterator[Finding]:
    """Find arc notches of planar robots whose body beyond is not where its loads push it."""
    if has_own_weight(robot, load):
        return
    state, rows, ends = path[step], notches_of(robot), piece_lengths(robot)
    forces = acting(state, load, len(state.body_position))
    for j, notch in enumerate(rows):
        crossing = [
            (t, tendon)
            for t, tendon in enumerate(robot["tendon"])
            if (tendon.get("end_body") or len(rows)) > j and state.tension[t] > 0
        ]
        known = all(tendon["path"] in ("wall-arc", "straight") for _, tendon in crossing)
        known &= all(all_gaps(robot, path, t) for t, _ in crossing)
        if notch["kind"] != "arc" or not known:
            continue
        turn, origin = state.body_rotation[j], state.body_position[j]
        beyond = turn.T @ state.body_rotation[j + 1]
        side, up = toward(notch), np.array([0.0, 0.0, 1.0])
        axis = np.cross(up, side)
        centroid, second = arc_section(robot["tube"], notch)
        edge = robot["tube"]["outer_diameter"] / 2 - centroid
        start = up * ends[j] - side * centroid
        end = turn.T @ (state.body_position[j + 1] - origin) - beyond @ side * centroid
        force, moment, constant = np.zeros(3), 0.0, 0.0
        for body, point, push, couple in forces:
            if body > j:
                push, point = turn.T @ push, turn.T @ (point - origin)
                force += push
                moment += float((np.cross(point - start, push) + turn.T @ couple) @ axis)
        for t, tendon in crossing:
            tension, at = state.span_tension[t, 2 * j + 1], channel(tendon)
            if tendon["path"] == "wall-arc":
                constant += tension * (at @ side + centroid)
                continue
            near = at + up * ends[j]
            far = turn.T @ (state.body_position[j + 1] - origin) + beyond @ at
            push = tension * (near - far) / np.linalg.norm(near - far)
            force += push
            moment += float(np.cross(far - start, push) @ axis)
        # the lips close by (r_o + centroid) times the angle, and press with the same lever
        reach = robot["tube"]["outer_diameter"] / 2 + centroid
        left = notch["height"] - reach * float(state.notch_angle[j])
        off = abs(left - float(state.gap[j])) / notch["height"]
        yield from above("gap is not that of the angle", step, off, 1e-7, f"notch {j + 1}")
        constant -= float(state.contact_force[j]) * reach
        yield from _compare(
            robot,
            path,
            step,
            j,
            notch,
            (start, end, beyond),
            (force, moment, constant),
            (edge, second),
        )


def _compare(
    robot: Table, path: Any, step: int, j: int, notch: Table, poses: Any, loads: Any, sizes: Any
) -> Iterator[Finding]:
    """Integrate the rod and compare its end."""
    (start, end, beyond), (force, moment, constant), (edge, second) = poses, loads, sizes
    side, up = toward(notch), np.array([0.0, 0.0, 1.0])
    axis = np.cross(up, side)
    height = notch["height"]
    bent = np.radians(notch.get("precurvature_deg", 0.0)) / height

    def slope(now: np.ndarray) -> np.ndarray:
        place = now[1] * side + now[2] * up
        there = moment - float(np.cross(place, force) @ axis) + constant
        curvature = strain_of(robot["material"], there * edge / second) / edge
        return np.array([bent + curvature, np.sin(now[0]), np.cos(now[0])])

    now, part = np.zeros(3), height / STEPS
    for _ in range(STEPS):
        one = slope(now)
        two = slope(now + part / 2 * one)
        three = slope(now + part / 2 * two)
        now = now + part / 6 * (one + 2 * two + 2 * three + slope(now + part * three))
    angle = float(np.arctan2(beyond[:, 2] @ side, beyond[:, 2] @ up))
    told = float(path.notch_angle[step, j])
    off = abs(np.remainder(told - angle + np.pi, 2 * np.pi) - np.pi)
    yield from above("notch angle is not of the bodies", step, off, 1e-9, f"notch {j + 1}")
    # What the strain modes may miss of the moment bends the rod by so much, where it is softest:
    # that need not be where the moment is largest. If it asks for more than the material can bear
    # there is nothing to compare.
    miss = float(path.moment_error[step]) * np.abs(path.notch_moment[step]).max()
    high = max(abs(float(path.notch_moment[step, j])), abs(moment + constant))
    law = [
        [strain_of(robot["material"], m * edge / second) / edge for m in (at, at + miss)]
        for at in np.linspace(0.0, high, 40)
    ]
    if not np.isfinite(law).all():
        return
    allowed = 1e-7 + height * float(np.diff(law).max())
    more = f"notch {j + 1}, angle {told:.6f}, moment error {float(path.moment_error[step]):.1e}"
    yield from above("rod bends otherwise", step, abs(now[0] - told), allowed, more)
    place = start + now[1] * side + now[2] * up
    far = float(np.abs(place - end).max()) / height
    yield from above("rod ends elsewhere", step, far, allowed, more)
