"""Whether arc notches are in balance, by a rod integrated anew in numpy.

An arc notch is a rod along its neutral axis with five strains: bending toward its side and bending
sideways, each constant and linear along the rod, and a constant twist about the shear centre.
Pose of the distal body against the proximal one: six numbers. So the strains follow from the two
poses that are reported, with one number left that must fit. From the strains follow by the law of
the material and of the ends the moments inside (moments.py), and these must balance, in the mean
over the notch, what acts on everything beyond (acting.py) and what tendons on the wall and closed
lips do to the notch. Elastic ends also shear, in the ratio in which one force bends and shears.

A mode whose strain is nil may be one that the solver left out for these loads; its balance is not
asked for. (What is left out is told by `moment_error`.)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from acting import State
from fibres import Memory, memory_of
from moments import ArcLaw, arc_law, bending
from numpy.polynomial.legendre import leggauss

import notchflex as nf

# Seven Gauss nodes all along, those of the solver: where the law of the material has a kink within
# the notch, the mean over other nodes would differ.
_POINTS, _HALVES = leggauss(7)
_NODES, _WEIGHTS = 0.5 * (_POINTS + 1.0), 0.5 * _HALVES
_LINEAR = 2.0 * _NODES - 1.0
# Between nodes the rod is integrated in so many steps.
_STEPS = 3
_ENDS = np.concatenate([[0.0], _NODES, [1.0]])
_PLACES = np.arange(float(len(_ENDS)))
_STOPS = np.interp(np.linspace(0.0, _PLACES[-1], (len(_ENDS) - 1) * _STEPS + 1), _PLACES, _ENDS)
_NUDGE = 1e-6  # rad, for slopes
_FITTED = 1e-12  # rad, where the fit of the strains ends
_NIL = 1e-7  # rad, of a mode
# The solver integrates the pose in its own way, to better than this (rad, and lengths over the
# notch's height) as long as a notch bends by less than half a turn.
POSE = 1e-6
# Relative to what acts, and of the moment that bends the notch by a tenth of a degree.
BALANCE, _SMALL = 1e-6, 2e-3


class Arcs(NamedTuple):
    """The arc notches of a robot in one state, their numbers (from 0) and what the fit found.

    Attributes:
        notches: Which notches of the robot.
        modes: Bending toward the side (elastic; constant, linear), sideways, and twist, rad.
        misfit: What of the relative poses no strains explain, rad and heights.
        problems: What does not hold.
        laws: How each of them bends.
    """

    notches: list[int]
    modes: np.ndarray
    misfit: np.ndarray
    problems: list[str]
    laws: list[ArcLaw]


def judge_arcs(state: State, path: nf.EquilibriumPath) -> Arcs:
    """Fit strains to the poses of one step, and add up every arc notch.

    Args:
        state: The forces on the bodies.
        path: The path, for contact forces, gaps and moments that it reports.
    """
    robot, step = state.robot, state.step
    chosen = [i for i, notch in enumerate(robot.notches) if isinstance(notch, nf.ArcNotch)]
    if not chosen:
        return Arcs([], np.zeros((0, 5)), np.zeros(0), [], [])
    notches = [robot.notches[i] for i in chosen]
    laws = [arc_law(state, i) for i in chosen]
    centroid, height = (np.array([getattr(one, k) for one in laws]) for k in ("centroid", "height"))
    shear = np.array([(one.twist, -one.push[0], one.sway[0]) for one in laws])
    precurved = np.radians([one.precurvature_deg for one in notches])
    frames = np.array([about_z(one.direction_deg) for one in notches])
    before, behind = np.array(chosen), np.array(chosen) + 1
    axis = np.stack([-centroid, 0 * centroid, 0 * centroid], axis=-1)
    lead = np.stack([0 * height, 0 * height, state.length[before]], axis=-1)
    start = state.rotation[before] @ frames
    begins = _at(state.origin[before], state.rotation[before], lead) + _turned(start, axis)
    end = state.rotation[behind] @ frames
    ends = state.origin[behind] + _turned(end, axis)
    turn = np.swapaxes(start, 1, 2) @ end
    move = _turned(np.swapaxes(start, 1, 2), ends - begins) / height[:, None]
    modes, misfit = _fit(turn, move, precurved, shear / height[:, None])
    rotations, places = (one[:-1] for one in _rods(modes, precurved, shear / height[:, None]))
    problems = [
        f"notch {i + 1}: no strains of an arc lead to its pose (by {miss:.1e})"
        for i, miss in zip(chosen, misfit, strict=True)
        if miss > POSE
    ]
    memory = memory_of(path, step)
    for k, (i, law) in enumerate(zip(chosen, laws, strict=True)):
        node_at = begins[k] + height[k] * places[:, k] @ start[k].T
        node_turn = start[k] @ rotations[:, k]
        force, about, size = state.beyond_with_size(i + 1, node_at[2])
        asked = about + np.cross(node_at[2] - node_at, force)
        local = np.einsum("gba,gb->ga", node_turn, asked)
        across = np.einsum("gba,b->ga", node_turn, force)
        local[:, 2] += law.twist * across[:, 1]
        scale = size[1]
        for number, tendon in enumerate(robot.tendon):
            if tendon.path == "wall-arc" and i < state.end_body(number):
                place = frames[k].T @ state.tendon_place(number) - axis[k]
                pull = state.tension[number, 2 * i + 1]
                local[:, 0] -= pull * place[1]
                local[:, 1] += pull * place[0]
                scale += abs(pull) * float(np.hypot(place[0], place[1]))
        lip = path.contact_force[step, i] * law.closure
        local[:, 1] -= lip
        scale += abs(lip)
        inside, found = _inside(state, i, law, modes[k], memory)
        problems += found
        floor = _SMALL * robot.material.elastic_modulus * float(law.section.second_moment_weak)
        scale += floor / height[k]
        forces = np.stack(
            [
                law.push[1] * modes[k, 1] + across[:, 0],  # of the rings' shear
                law.sway[1] * modes[k, 3] - across[:, 1],
            ],
            axis=-1,
        )
        sheared = [law.push[0] * (_WEIGHTS @ forces[:, 0]), law.sway[0] * (_WEIGHTS @ forces[:, 1])]
        problems += _out_of_balance(i, modes[k], inside - local, sheared, scale)
        problems += _disagreeing(state, path, i, modes[k], precurved[k], law)
        edge = edge_angle(turn[k], law.edge * modes[k, 0])
        if abs(edge - path.edge_angle[step, i]) > POSE:
            problems.append(f"notch {i + 1}: its edge angle is not {edge:.6g}")
        largest = inside[np.abs(inside[:, 1]).argmax(), 1]
        if abs(largest - path.notch_moment[step, i]) > BALANCE * scale:
            problems.append(f"notch {i + 1}: notch_moment is not that of its strains")
    return Arcs(chosen, modes, misfit, problems, laws)


def _out_of_balance(
    notch: int, modes: np.ndarray, missing: np.ndarray, sheared: list[float], scale: float
) -> list[str]:
    """Means over the notch of moment inside less moment asked for, by each mode that is used."""
    left = {
        "bending": _WEIGHTS @ missing[:, 1],
        "linear bending": _WEIGHTS @ (_LINEAR * missing[:, 1]) + sheared[0],
        "sideways bending": _WEIGHTS @ missing[:, 0],
        "linear sideways bending": _WEIGHTS @ (_LINEAR * missing[:, 0]) + sheared[1],
        "twist": _WEIGHTS @ missing[:, 2],
    }
    return [
        f"notch {notch + 1}: {name} out of balance by {abs(value) / scale:.1e}"
        for k, (name, value) in enumerate(left.items())
        if (k == 0 or abs(modes[k]) > _NIL) and abs(value) > BALANCE * scale
    ]


def _disagreeing(
    state: State,
    path: nf.EquilibriumPath,
    notch: int,
    modes: np.ndarray,
    precurved: float,
    law: ArcLaw,
) -> list[str]:
    """Gap as the lips' fibre has it and as they yield."""
    step, found = state.step, []
    gap = law.height - law.closure * (precurved + modes[0])
    gap += law.lips * path.contact_force[step, notch]
    if abs(gap - path.gap[step, notch]) > POSE * law.height:
        found.append(f"notch {notch + 1}: gap {path.gap[step, notch]:.3g} mm, not {gap:.3g}")
    return found


def edge_angle(turn: np.ndarray, beyond: float) -> float:
    """Angle between the faces of a notch: its ends, turned back by what bends beyond the faces.

    Args:
        turn: Rotation of the distal end against the proximal one, in the frame of the notch.
        beyond: Bending about y beyond the two faces together, half of it at each, rad.
    """
    cosine, sine = np.cos(0.5 * beyond), np.sin(0.5 * beyond)
    back = np.array([[cosine, 0.0, -sine], [0.0, 1.0, 0.0], [sine, 0.0, cosine]])
    faces = back @ turn @ back
    return float(np.arctan2(faces[0, 2] - faces[2, 0], faces[0, 0] + faces[2, 2]))


def _inside(
    state: State, i: int, law: ArcLaw, modes: np.ndarray, memory: Memory | None
) -> tuple[np.ndarray, list[str]]:
    """Moments about x, y, z at the nodes by the laws of material and ends, N mm; and problems."""
    section, material = law.section, state.robot.material
    modulus = material.elastic_modulus
    shear = modulus / (2.0 * (1.0 + material.poisson_ratio))
    sideways = (modes[2] + modes[3] * _LINEAR) / law.height
    bent = bending(state, i, law, modes[0] + modes[1] * _LINEAR, memory)
    twist = np.full(len(_NODES), modes[4] / law.height)
    moments = [
        modulus * float(section.second_moment_strong) * sideways / law.strong,
        bent.moment,
        shear * float(section.torsion_constant) * twist / law.torsion,
    ]
    return np.stack(moments, axis=-1), bent.problems


def _fit(
    turn: np.ndarray, move: np.ndarray, precurved: np.ndarray, shear: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Modes that lead to given poses, by Gauss and Newton; and what is left, largest by notch."""
    back = np.swapaxes(turn, 1, 2)

    def off(modes: np.ndarray) -> np.ndarray:
        rotations, places = _rods(modes, precurved, shear)
        left = [_unskew(back @ rotations[-1]), _turned(back, places[-1] - move)]
        return np.concatenate(left, axis=-1)

    vector = _unskew(turn)
    angle = np.arctan2(np.linalg.norm(vector, axis=-1), 0.5 * (np.trace(turn.T) - 1.0))
    vector = vector / np.maximum(np.sinc(angle / np.pi), 1e-3)[:, None]
    modes = np.zeros((len(turn), 5))
    modes[:, 0], modes[:, 2], modes[:, 4] = vector[:, 1] - precurved, vector[:, 0], vector[:, 2]
    here = off(modes)
    for attempt in range(12):
        if attempt in (0, 3):
            slope = [(off(modes + nudge) - here) / _NUDGE for nudge in _NUDGE * np.eye(5)]
            inverse = np.linalg.pinv(np.stack(slope, axis=-1))
        change = np.einsum("nij,nj->ni", inverse, here)
        modes = modes - change
        here = off(modes)
        if np.abs(change).max() < _FITTED:
            break
    return modes, np.abs(here).max(axis=-1)


def _rods(
    modes: np.ndarray, precurved: np.ndarray, shear: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Rotations and places (over the height) of the rods at all nodes and, last, at their ends."""
    constant, linear = np.zeros((2, len(modes), 6))
    constant[:, 1], constant[:, 0] = precurved + modes[:, 0], modes[:, 2]
    constant[:, 2], constant[:, 5] = modes[:, 4], 1.0
    constant[:, 3] = shear[:, 1] * modes[:, 1]
    constant[:, 4] = shear[:, 0] * modes[:, 4] + shear[:, 2] * modes[:, 3]
    linear[:, 1], linear[:, 0] = 2.0 * modes[:, 1], 2.0 * modes[:, 3]
    size = np.diff(_STOPS)[:, None, None]
    middle = constant + (0.5 * (_STOPS[1:] + _STOPS[:-1]) - 0.5)[:, None, None] * linear
    # Magnus to fourth order, of a strain that is linear in the place.
    twist = size * middle + size**3 / 12.0 * _bracket(middle, np.broadcast_to(linear, middle.shape))
    by, to = _exponential(twist)
    rotation = np.broadcast_to(np.eye(3), (len(modes), 3, 3))
    place = np.zeros((len(modes), 3))
    rotations, places = [], []
    for k in range(len(by)):
        place = place + _turned(rotation, to[k])
        rotation = rotation @ by[k]
        if (k + 1) % _STEPS == 0:
            rotations.append(rotation)
            places.append(place)
    return np.stack(rotations), np.stack(places)


def _exponential(twist: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotation and displacement along a constant twist (angular, linear) of small angle."""
    angular, linear = twist[..., :3], twist[..., 3:]
    square = np.sum(angular**2, axis=-1)
    angle = np.sqrt(square)
    first = np.sinc(angle / np.pi)[..., None]
    second = 0.5 * np.sinc(0.5 * angle / np.pi)[..., None] ** 2
    series = 1 - square / 20 * (1 - square / 42 * (1 - square / 72 * (1 - square / 110)))
    once = np.cross(angular, linear)
    moved = linear + second * once + series[..., None] / 6.0 * np.cross(angular, once)
    matrix = np.cross(np.eye(3), angular[..., None, :])  # its rows are e_i x w
    turned = np.eye(3) + first[..., None] * matrix + second[..., None] * (matrix @ matrix)
    return turned, moved


def _bracket(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    turn = np.cross(one[..., :3], other[..., :3])
    move = np.cross(one[..., :3], other[..., 3:]) + np.cross(one[..., 3:], other[..., :3])
    return np.concatenate([turn, move], axis=-1)


def _unskew(matrix: np.ndarray) -> np.ndarray:
    above = matrix[:, [2, 0, 1], [1, 2, 0]]
    return 0.5 * (above - matrix[:, [1, 2, 0], [2, 0, 1]])


def about_z(degrees: float) -> np.ndarray:
    """Rotation about the tube axis."""
    turn = np.radians(degrees)
    cosine, sine = np.cos(turn), np.sin(turn)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def _turned(rotation: np.ndarray, vector: np.ndarray) -> np.ndarray:
    return np.einsum("nij,nj->ni", rotation, vector)


def _at(origin: np.ndarray, rotation: np.ndarray, inside: np.ndarray) -> np.ndarray:
    return origin + _turned(rotation, inside)
