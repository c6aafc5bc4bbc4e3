"""Whether arc notches are in balance, by a rod integrated anew in numpy.

An arc notch is a rod along its neutral axis with five strains: bending toward its side and bending
sideways, each constant and linear along the rod, and a constant twist about the shear centre.
Pose of the distal body against the proximal one: six numbers. So the strains follow from the two
poses that are reported, with one number left that must fit. From the strains follow by the law of
the material and of the ends (docs/from_the_drawing.md) the moments inside, and these must balance,
in the mean over the notch, what acts on everything beyond (forces.py) and what tendons on the wall
and closed lips do to the notch. Elastic ends also shear, in the ratio in which one force bends and
shears. What the fibres of a material with hysteresis remember is read from the path and judged.

A mode whose strain is nil may be one that the solver left out for these loads; its balance is not
asked for. (What is left out is told by `moment_error`.)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss
from scipy.spatial.transform import RigidTransform, Rotation

import notchflex as nf

from .forces import State, about_z
from .rings import Ends, ends_of
from .sections import Curve, Left, Memory, fibres, left_by, memory_of, remembered, stress

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
# What the order of turns about two axes may be off by, over the product of their angles: modes are
# read from poses, and what is stiff makes a large moment of a small one.
TURNED = 5e-6
_SHARE = 0.18  # of the end compliance that follows the material
_CLOSING, _CLOSED = {"on-axis": 1.0248, "off-axis": 1.0203}, 0.354
_EDGE = 0.086
# Tries for a curvature or a strain: to 1e-15 of where they begin.
_TRIES = 60
# What a strain may be off for one that is on a curve, over the strain of the notch when closed: the
# strains are fitted to poses.
_ON_CURVE = 1e-6


class ArcLaw(NamedTuple):
    """One arc notch of a robot, between its rings.

    Attributes:
        height: h, mm.
        centroid: Distance of the neutral axis from the tube axis, mm.
        closure: Distance of the lips from the neutral axis, mm.
        lips: Flexibility of the closed lips, mm/N.
        ends: Its lengths with its rings; the height for rigid ends.
        push: Displacement of the rings by the force of a unit of linear bending, mm; and force.
        sway: The same sideways.
        section: Section between the ends.
    """

    height: float
    centroid: float
    closure: float
    lips: float
    ends: Ends
    push: tuple[float, float]
    sway: tuple[float, float]
    section: Left

    @property
    def twist(self) -> float:
        """Distance of the shear centre from the neutral axis, mm."""
        return self.ends.shear_centre - self.centroid


class Arcs(NamedTuple):
    """The arc notches of a robot in one state, their numbers (from 0) and what the fit found.

    Attributes:
        notches: Which notches of the robot.
        modes: Bending toward the side (elastic; constant, linear), sideways, and twist, rad.
        problems: What does not hold.
        laws: How each of them bends.
    """

    notches: list[int]
    modes: np.ndarray
    problems: list[str]
    laws: list[ArcLaw]


def judge_arcs(state: State) -> Arcs:
    """Fit strains to the poses of a state, and add up every arc notch."""
    robot, now = state.robot, state.now
    chosen = [i for i, notch in enumerate(robot.notches) if isinstance(notch, nf.ArcNotch)]
    if not chosen:
        return Arcs([], np.zeros((0, 5)), [], [])
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
    begins = state.origin[before] + _turned(state.rotation[before], lead) + _turned(start, axis)
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
    memory = memory_of(state.path)
    for k, (i, law) in enumerate(zip(chosen, laws, strict=True)):
        node_at = begins[k] + height[k] * places[:, k] @ start[k].T
        node_turn = start[k] @ rotations[:, k]
        force, about, size = state.beyond(i + 1, node_at[2])
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
        lip = now.contact_force[i] * law.closure
        local[:, 1] -= lip
        scale += abs(lip)
        inside, found = _inside(state, i, law, modes[k], memory)
        problems += found
        floor = _SMALL * state.materials[i + 1].elastic_modulus * law.section.weak
        scale += floor / height[k]
        forces = np.stack(
            [
                law.push[1] * modes[k, 1] + across[:, 0],  # of the rings' shear
                law.sway[1] * modes[k, 3] - across[:, 1],
            ],
            axis=-1,
        )
        sheared = [law.push[0] * (_WEIGHTS @ forces[:, 0]), law.sway[0] * (_WEIGHTS @ forces[:, 1])]
        x, y, z = abs(modes[k, 2]) + abs(modes[k, 3]), abs(modes[k, :2]).sum(), abs(modes[k, 4])
        stiff = state.materials[i + 1].elastic_modulus * law.section.strong / law.ends.strong
        allowed = BALANCE * scale + TURNED * (x * y + y * z + z * x) * stiff
        problems += _out_of_balance(i, modes[k], inside - local, sheared, (scale, allowed))
        gap = law.height - law.closure * (precurved[k] + modes[k, 0])
        gap += law.lips * now.contact_force[i]  # as the lips' fibre has it and as they yield
        if abs(gap - now.gap[i]) > POSE * law.height:
            problems.append(f"notch {i + 1}: gap {now.gap[i]:.3g} mm, not {gap:.3g}")
        edge = edge_angle(turn[k], _EDGE * (1.0 - law.height / law.ends.weak) * modes[k, 0])
        if abs(edge - now.edge_angle[i]) > POSE:
            problems.append(f"notch {i + 1}: its edge angle is not {edge:.6g}")
        largest = inside[np.abs(inside[:, 1]).argmax(), 1]
        if abs(largest - now.notch_moment[i]) > BALANCE * scale:
            problems.append(f"notch {i + 1}: notch_moment is not that of its strains")
    return Arcs(chosen, modes, problems, laws)


def _out_of_balance(
    notch: int,
    modes: np.ndarray,
    missing: np.ndarray,
    sheared: list[float],
    sizes: tuple[float, float],
) -> list[str]:
    """Means over the notch of moment inside less moment asked for, by each mode that is used.

    The sizes are that of what acts, and what is allowed.
    """
    scale, allowed = sizes
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
        if (k == 0 or abs(modes[k]) > _NIL) and abs(value) > allowed
    ]


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
    section, material = law.section, state.materials[i + 1]
    modulus = material.elastic_modulus
    shear = modulus / (2.0 * (1.0 + material.poisson_ratio))
    bent, problems = bending(state, i, law, modes[0] + modes[1] * _LINEAR, memory)
    sideways = modulus * section.strong * (modes[2] + modes[3] * _LINEAR) / law.ends.strong
    twist = np.full(len(_NODES), shear * section.torsion * modes[4] / law.ends.torsion)
    return np.stack([sideways, bent, twist], axis=-1), problems


def _fit(
    turn: np.ndarray, move: np.ndarray, precurved: np.ndarray, shear: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Modes that lead to given poses, by Gauss and Newton; and what is left, largest by notch."""
    back = np.swapaxes(turn, 1, 2)

    def off(modes: np.ndarray) -> np.ndarray:
        rotations, places = _rods(modes, precurved, shear)
        turned = Rotation.from_matrix(back @ rotations[-1]).as_rotvec()
        return np.concatenate([turned, _turned(back, places[-1] - move)], axis=-1)

    vector = Rotation.from_matrix(turn).as_rotvec()
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
    frame = RigidTransform.identity(len(modes))
    frames = []
    for one in twist:
        frame = frame * RigidTransform.from_exp_coords(one)
        frames.append(frame)
    kept = frames[_STEPS - 1 :: _STEPS]
    rotations = np.stack([one.rotation.as_matrix() for one in kept])
    return rotations, np.stack([one.translation for one in kept])


def _bracket(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    turn = np.cross(one[..., :3], other[..., :3])
    move = np.cross(one[..., :3], other[..., 3:]) + np.cross(one[..., 3:], other[..., :3])
    return np.concatenate([turn, move], axis=-1)


def _turned(rotation: np.ndarray, vector: np.ndarray) -> np.ndarray:
    return np.einsum("nij,nj->ni", rotation, vector)


def arc_law(state: State, i: int) -> ArcLaw:
    """The law of notch i (from 0)."""
    robot = state.robot
    notch, tube, material = robot.notches[i], state.tubes[i + 1], state.materials[i + 1]
    height, modulus, left = notch.height, material.elastic_modulus, left_by(notch, tube)
    closure, lips = tube.outer_radius + left.centroid, 0.0
    sheared = [height**3 / (12.0 * moment) for moment in (left.weak, left.strong)]
    ends = Ends(height, height, height, 0.0, left.shear_centre, *sheared, 0.0, 0.0)
    if notch.closing == "elastic" and notch.has_elastic_ends:
        wall = tube.outer_radius - tube.inner_radius
        closure /= _CLOSING[notch.cut]
        # Of the lips alone, beside the open notch.
        lips = closure**2 / (_CLOSED * modulus * wall * (tube.outer_radius - 0.5 * wall) ** 2)
    if notch.ends == "shell":
        ends = ends_of(robot, i)

    def slides(compliance: float, moment: float, length: float) -> tuple[float, float]:
        force = 2.0 * moment / (height * length)
        return (compliance - height**2 * length / (12.0 * moment)) * force, modulus * force

    return ArcLaw(
        height=height,
        centroid=left.centroid - ends.coupling / ends.weak,
        closure=closure,
        lips=lips,
        ends=ends,
        push=slides(ends.push, left.weak, ends.weak),
        sway=slides(ends.sway, left.strong, ends.strong),
        section=left,
    )


def bending(
    state: State, i: int, law: ArcLaw, angle: np.ndarray, memory: Memory | None
) -> tuple[np.ndarray, list[str]]:
    """Moments of notch i at elastic angles (rad), as if it were bent so all along; problems."""
    robot, second, spine = state.robot, law.section.weak, law.section.spine
    q = 1.0 + law.ends.odd * angle + law.ends.even * angle**2
    reduced, added = angle / (q * law.height), law.ends.weak / law.height - 1.0
    material = state.materials[i + 1]
    rigidity = material.elastic_modulus * second
    if isinstance(material, nf.Linear):
        return rigidity * reduced / ((1.0 + added) * q), []
    soft, whole = (1.0 - _SHARE) * added / rigidity, 1.0 + _SHARE * added
    # The rings' part of the flattening follows the moment.
    warped = whole * law.ends.warped * law.height
    own, soft = whole - warped * reduced, soft + warped * reduced / rigidity
    if isinstance(material, nf.Superelastic):
        problems: list[str] = []
        memory = None  # that of a notch of another material

        def moment(curvature: np.ndarray) -> np.ndarray:
            return second / spine * stress(material, curvature * spine)

    else:
        arm, area, problems = fibres(state.fibres, i, robot.notches[i], state.tubes[i + 1])
        memory = memory if getattr(material, "unloading_stress", None) is not None else None
        curve = None if memory else Curve(material)

        def moment(curvature: np.ndarray) -> np.ndarray:
            """Moment at the strain of the neutral axis at which the forces vanish."""
            bent = curvature[..., None] * arm
            most = np.abs(bent).max(axis=-1)
            middle = _bisected(lambda e: curve(e[..., None] + bent) @ area, most)
            return curve(middle[..., None] + bent) @ (area * arm)

    if memory is not None:
        used = np.asarray(state.node_length)[i] > 0.0  # the rods of other kinds have more nodes
        past, now = memory.before[i][used], memory.after[i][used]
        moved = now @ (area * arm) / second
        curvature = (reduced + soft * rigidity * moved) / (1.0 + added)
        strain = (now @ area / area.sum())[..., None] + curvature[..., None] * arm
        near = _ON_CURVE * np.abs(arm).max() / law.closure
        problems += remembered(i, material, strain, past, now, near)
        return (1.0 + warped * moved) * rigidity * (curvature - moved) / q, problems
    most = np.abs(reduced) / np.minimum(own, 1.0)
    curvature = _bisected(lambda k: own * k + soft * moment(k) - reduced, most)
    bends = moment(curvature)
    return (1.0 + warped * (curvature - bends / rigidity)) * bends / q, problems


def _bisected(rising, most: np.ndarray) -> np.ndarray:
    """Where a rising function is nil, between -most and most: false position (Illinois)."""
    low, high = -most, most.copy()
    at_low, at_high = rising(low), rising(high)
    enough = 1e-15 * np.maximum(np.abs(at_low), np.abs(at_high))
    best = low
    side = np.zeros(np.shape(most))
    for _ in range(_TRIES):
        steep = np.where(at_high > at_low, at_high - at_low, 1.0)
        best = np.clip(low - at_low * (high - low) / steep, low, high)
        value = rising(best)
        under = value < 0.0
        # An end that stays twice counts half.
        at_high = np.where(under & (side < 0.0), 0.5 * at_high, at_high)
        at_low = np.where(~under & (side > 0.0), 0.5 * at_low, at_low)
        low, at_low = np.where(under, best, low), np.where(under, value, at_low)
        high, at_high = np.where(under, high, best), np.where(under, at_high, value)
        side = np.where(under, -1.0, 1.0)
        if np.all(np.abs(value) <= enough) or np.all(high - low <= 1e-16 * most):
            break
    return best
