"""Whether backbones between disks, and flexures given by numbers, are in balance.

A flexure of a table is a rod of six constant strains, so that the two poses that are reported tell
all of them. Its resultants follow from the numbers of the robot alone, and must be the mean along
it of the force and the moment that act on all beyond.

The curvatures of a backbone are polynomials of arc length, which are read where they are told (at
the nodes); twist, shear and stretch are constant and follow from the poses, which are two numbers
more than that. Moments and forces by the laws of the material must balance in the mean, with the
weights of these polynomials, what acts on all beyond.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss, legval, legvander
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import RigidTransform, Rotation

import notchflex as nf
from notchflex.robot.cuts import NotchCut

from .arcs import BALANCE, POSE, TURNED, ArcLaw, bending
from .forces import State, about_z, height_of
from .rings import Ends
from .sections import left_by, memory_of, round_section

_Z = np.array([0.0, 0.0, 1.0])
# Nodes of the mean over a flexure of a table.
_POINTS, _HALVES = leggauss(12)
_NODES, _WEIGHTS = 0.5 * (_POINTS + 1.0), 0.5 * _HALVES
# A backbone has so many nodes and terms of each curvature; between nodes it is integrated in fours
# of steps.
_TOLD, _TERMS, _FOURS = 5, 3, 2
_AT, _HALF_WEIGHTS = leggauss(_TOLD)
_WEIGHS = 0.5 * _HALF_WEIGHTS
_ENDS = np.concatenate([[0.0], 0.5 * (_AT + 1.0), [1.0]])
_STOPS = np.interp(
    np.linspace(0.0, _TOLD + 1.0, (_TOLD + 1) * 4 * _FOURS + 1), np.arange(_TOLD + 2.0), _ENDS
)
_GAUSS = 0.5 / np.sqrt(3.0)
_NUDGE = 1e-6
# Of all that acts, of a moment that bends a flexure by a tenth of a degree.
_SMALL = 2e-3
# What a rigid direction may give, rad and of the length: rounding of poses.
_RIGID = 1e-9
# By how much more a balance may miss, at 1 rad in a plane, and about two axes; a pose about two
# axes (rad), and at most.
_SHARP, _SEVERAL, _POSED, _MOST = 30.0, 300.0, 2.5e-5, 1e-5
# rad, what is no bending out of a plane
_FLAT = 1e-9


class Bent(NamedTuple):
    """How a flexure of a table is deformed against its free shape.

    Attributes:
        turns: Rotation about x, y, z of the far end, rad.
        moves: Displacement along x, y, z, mm.
        free: Angle about y without loads, rad.
        axis: Distance of the neutral axis from the tube axis, mm.
    """

    turns: np.ndarray
    moves: np.ndarray
    free: float
    axis: float


def judge_rods(state: State) -> tuple[list[str], dict[int, Bent]]:
    """Add up backbones and flexures of tables; return problems, and how the latter are bent."""
    problems: list[str] = []
    bent: dict[int, Bent] = {}
    for i, notch in enumerate(state.robot.notches):
        if isinstance(notch, nf.TableNotch):
            found, bent[i] = _table(state, i, notch)
            problems += found
    return [*problems, *_backbones(state)], bent


def _ends(
    state: State, i: int, axis: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Place and rotation of both ends of the neutral axis of a flexure."""
    frame, off = about_z(state.robot.notches[i].direction_deg), np.array([-axis, 0.0, 0.0])
    start, end = state.rotation[i] @ frame, state.rotation[i + 1] @ frame
    begins = state.point(i, state.length[i] * _Z) + start @ off
    return begins, start, state.origin[i + 1] + end @ off, end


def _local(
    state: State, i: int, places: np.ndarray, turns: np.ndarray
) -> tuple[np.ndarray, np.ndarray, tuple[float, float]]:
    """Moments and forces at places of flexure i, in frames there; sizes of all that acts."""
    force, about, size = state.beyond(i + 1, places[0])
    moments = about + np.cross(places[0] - places, force)
    return (
        np.einsum("gba,gb->ga", turns, moments),
        np.einsum("gba,b->ga", turns, force),
        size,
    )


def curve_of(notch: nf.TableNotch) -> tuple[CubicHermiteSpline, float, float]:
    """Return moment over angle (rad) of a table, and the ends of its angles.

    Cubics with the slopes of parabolas through three points, held between 0 and three times the
    flatter one of the neighbouring chords; where all angles have one sign it is odd.
    """
    if not notch.angle_deg:
        numbers = notch.stiffness or ()
        stiff = numbers[7 if len(numbers) == 36 else 1]
        angle, moment = np.array([-np.pi, 0.0, np.pi]), stiff * np.array([-np.pi, 0.0, np.pi])
    else:
        angle, moment = np.radians(notch.angle_deg), np.array(notch.moment)
        if angle.min() >= 0.0 or angle.max() <= 0.0:
            angle, moment = angle[angle != 0.0], moment[angle != 0.0]
            angle, moment = np.append(-angle, angle), np.append(-moment, moment)
        if not (angle == 0.0).any():
            angle, moment = np.append(angle, 0.0), np.append(moment, 0.0)
        order = angle.argsort()
        angle, moment = angle[order], moment[order]
    width = np.diff(angle)
    chord = np.diff(moment) / width
    slope = np.empty(len(angle))
    for k in range(len(angle)):
        first = min(max(k - 1, 0), len(angle) - 3)
        three = slice(first, first + 3)
        slope[k] = np.polyfit(angle[three] - angle[k], moment[three], 2)[1]
    flatter = np.minimum(np.append(chord, np.inf), np.append(np.inf, chord))
    return (
        CubicHermiteSpline(angle, moment, np.clip(slope, 0.0, 3.0 * flatter)),
        angle[0],
        angle[-1],
    )


def _table(state: State, i: int, notch: nf.TableNotch) -> tuple[list[str], Bent]:
    name, length = f"notch {i + 1}", notch.length
    begins, start, ends, end = _ends(state, i, notch.axis_offset)
    seen = RigidTransform.from_components(
        start.T @ (ends - begins), Rotation.from_matrix(start.T @ end)
    )
    twist = seen.as_exp_coords()
    free = np.radians(notch.precurvature_deg)
    off = twist - [0.0, free, 0.0, 0.0, 0.0, length]
    bent = Bent(off[:3], off[3:], free, notch.axis_offset)
    numbers = np.array(notch.stiffness or [np.inf] * 6)
    matrix = numbers.reshape(6, 6) if len(numbers) == 36 else np.diag(numbers)
    curve, low, high = curve_of(notch)
    matrix[1, 1] = 0.0
    rigid = np.isinf(np.diag(matrix))
    matrix[rigid, rigid] = 0.0
    inside = matrix @ off
    inside[1] += curve(off[1])
    along = [RigidTransform.from_exp_coords(part * twist) for part in _NODES]
    places = begins + np.array([one.translation for one in along]) @ start.T
    turns = start @ np.array([one.rotation.as_matrix() for one in along])
    moments, forces, size = _local(state, i, places, turns)
    asked = np.append(_WEIGHTS @ moments, _WEIGHTS @ forces)
    scale = np.repeat([size[1], size[0]], 3)
    for number, tendon in enumerate(state.robot.tendon):
        if tendon.path == "wall-arc" and i < state.end_body(number):
            place = about_z(notch.direction_deg).T @ state.tendon_place(number)
            pull = state.tension[number, 2 * i + 1]
            x, y = place[0] + notch.axis_offset, place[1]
            asked += pull * np.array([-y, x, 0.0, 0.0, 0.0, -1.0])
            scale += abs(pull) * np.repeat([np.hypot(x, y), 1.0], 3)
    found = []
    press, gap = state.now.contact_force[i], np.nan
    if notch.closing_angle_deg is not None:
        arm = length / np.radians(notch.closing_angle_deg)
        asked[1] -= press * arm
        asked[5] += press
        scale += abs(press) * np.repeat([arm, 1.0], 3)
        gap = length + off[5] - arm * twist[1]
        if abs(gap - state.now.gap[i]) > POSE * length:
            found.append(f"{name}: gap {state.now.gap[i]:.3g} mm, not {gap:.3g}")
    stiff = curve(1e-4) / 1e-4
    scale[:3] += _SMALL * stiff
    scale[3:] += _SMALL * stiff / length
    missing = np.abs(inside - asked) / scale
    for direction in np.flatnonzero(~rigid & (missing > BALANCE)):
        what = f"{'about' if direction < 3 else 'along'} {'xyz'[direction % 3]}"
        found.append(f"{name}: {what} out of balance by {missing[direction]:.1e}")
    given = np.abs(off / np.repeat([1.0, length], 3))[rigid].max(initial=0.0)
    if given > _RIGID * (1.0 + state.reach / length):
        found.append(f"{name}: a rigid direction gives by {given:.1e}")
    if not low - _RIGID <= off[1] <= high + _RIGID:
        found.append(f"{name}: {np.degrees(off[1]):.4g} deg are beyond the ends of its curve")
    if abs(state.now.notch_moment[i] - inside[1]) > BALANCE * scale[1]:
        found.append(f"{name}: notch_moment is not that of its table")
    return found, bent


def backbone_law(notch: nf.RodGap) -> ArcLaw:
    """Return how a backbone bends, as an arc notch with rigid ends that never closes."""
    length, section = notch.length, round_section(notch)
    sheared = length**3 / (12.0 * section.weak)
    ends = Ends(length, length, length, 0.0, 0.0, sheared, sheared, 0.0, 0.0)
    return ArcLaw(length, 0.0, section.spine, 0.0, ends, (0.0, 0.0), (0.0, 0.0), section)


class Backbones(NamedTuple):
    """Strains of n backbones, times their length, and where these lead.

    Attributes:
        curved: Bending about x and y at the nodes, of the free shape included, rad.
        terms: Its polynomials: terms by backbones, about x and y.
        twist: About z.
        moves: Shear along x and y, and stretch: 1 without any.
        turns: Rotation of every node against the start.
        places: Place of every node, over the length.
        miss: How far the pose is off the one reported, rad and over the length.
    """

    curved: np.ndarray
    terms: np.ndarray
    twist: np.ndarray
    moves: np.ndarray
    turns: np.ndarray
    places: np.ndarray
    miss: np.ndarray


def _rotations(terms: np.ndarray, twist: np.ndarray) -> np.ndarray:
    """Rotations of backbones at all stops, by Magnus to fourth order: stops, backbones, 3, 3."""
    size = np.diff(_STOPS)
    middle = 0.5 * (_STOPS[1:] + _STOPS[:-1])
    both = [
        np.stack([*legval(2.0 * (middle + side * _GAUSS * size) - 1.0, terms), spun], axis=-1)
        for side in (-1.0, 1.0)
        for spun in [np.broadcast_to(twist[:, None], (len(twist), len(size)))]
    ]
    size = size[:, None]
    step = 0.5 * size * (both[0] + both[1])
    step += np.sqrt(3.0) / 12.0 * size**2 * np.cross(both[0], both[1])
    steps = Rotation.from_rotvec(step.reshape(-1, 3)).as_matrix().reshape(*step.shape, 3)
    turns = [np.broadcast_to(np.eye(3), (len(twist), 3, 3))]
    for one in np.swapaxes(steps, 0, 1):
        turns.append(turns[-1] @ one)
    return np.array(turns)


def _fitted(state: State, chosen: list[int], free: np.ndarray, length: np.ndarray) -> Backbones:
    """Find the strains of backbones: curvatures as they are told, all others by their poses.

    The twist alone turns the end further; then the places depend on shear and stretch linearly.
    """
    told = state.path.solver_quantity("notch_strain")[0]
    used = [np.flatnonzero(np.asarray(state.node_length)[i] > 0.0)[:_TOLD] for i in chosen]
    curved = np.array([told[i][nodes][:, [2, 1]] for i, nodes in zip(chosen, used, strict=True)])
    curved = curved * length[:, None, None]
    curved[..., 1] += free[:, None]
    powers = legvander(_AT, _TERMS - 1)
    ends = [_ends(state, i, 0.0) for i in chosen]
    turn = np.array([start.T @ end for _, start, _, end in ends])
    move = np.array([start.T @ (end - begin) for begin, start, end, _ in ends]) / length[:, None]
    terms = np.moveaxis(np.linalg.pinv(powers) @ curved, 0, -1)  # terms, about x and y, backbones

    def missed(twist: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        turns = _rotations(terms, twist)
        return turns, Rotation.from_matrix(np.swapaxes(turn, 1, 2) @ turns[-1]).as_rotvec()

    twist = np.zeros(len(chosen))
    turns, off = missed(twist)
    further = (missed(twist + _NUDGE)[1] - off) / _NUDGE
    for _ in range(3):
        twist = twist - np.sum(further * off, axis=1) / np.sum(further**2, axis=1)
        turns, off = missed(twist)
    # By Boole over every four steps: places of the nodes, and of the end.
    fours = np.stack([turns[k : len(turns) - 4 + k : 4] for k in range(5)], axis=-1)
    width = 4.0 * np.diff(_STOPS)[::4, None, None, None]
    panels = width / 90.0 * (fours @ [7.0, 32.0, 12.0, 32.0, 7.0])
    reached = np.cumsum(panels, axis=0)[_FOURS - 1 :: _FOURS]
    moves = np.linalg.solve(reached[-1], move[..., None])[..., 0]
    places = np.einsum("gnij,nj->ngi", reached[:-1], moves)
    at_nodes = np.swapaxes(turns[4 * _FOURS : -1 : 4 * _FOURS], 0, 1)
    return Backbones(curved, terms, twist, moves, at_nodes, places, np.abs(off).max(axis=1))


def _backbones(state: State) -> list[str]:
    """Add up all backbones."""
    notches = state.robot.notches
    chosen = [i for i, notch in enumerate(notches) if isinstance(notch, nf.RodGap)]
    if not chosen:
        return []
    length = np.array([notches[i].length for i in chosen])
    free = np.radians([notches[i].precurvature_deg for i in chosen])
    fits = _fitted(state, chosen, free, length)
    memory = memory_of(state.path)
    found: list[str] = []
    for k, i in enumerate(chosen):
        bends, problems = bending(
            state, i, backbone_law(notches[i]), fits.curved[k, :, 1] - free[k], memory
        )
        found += problems + _added_up(state, i, fits, k, bends)
    return found


def _added_up(state: State, i: int, fits: Backbones, k: int, bends: np.ndarray) -> list[str]:
    """Compare what backbone i carries, the kth of the fits, with what acts on all beyond."""
    name, notch, material = f"notch {i + 1}", state.robot.notches[i], state.materials[i + 1]
    length, section = notch.length, round_section(notch)
    powers, found = legvander(_AT, _TERMS - 1), []
    off = np.abs(powers @ fits.terms[:, :, k] - fits.curved[k]).max()
    if not off < POSE:
        found.append(f"{name}: its curvature is no polynomial (by {off:.1e})")
    begins, start, _, _ = _ends(state, i, 0.0)
    places = begins + length * fits.places[k] @ start.T
    moments, forces, size = _local(state, i, places, start @ fits.turns[k])
    modulus = material.elastic_modulus
    shear = 0.5 * modulus / (1.0 + material.poisson_ratio)
    stiff = modulus * section.weak / length
    scale, pulled = size[1] + _SMALL * stiff, size[0] + _SMALL * stiff / length
    sideways, twist = stiff * fits.curved[k, :, 0], 2.0 * shear / modulus * stiff * fits.twist[k]
    # Where it bends sharply the solver's integral of the pose is less accurate, and more so about
    # several axes: it takes states that are off by 1e-5 rad.
    angles = *np.abs(fits.curved[k]).max(axis=0), abs(fits.twist[k])
    angle = sum(angles)
    several = 0.5 * (angle**2 - np.square(angles).sum())
    if not fits.miss[k] < POSE + min(_POSED * several, _MOST):
        found.append(f"{name}: no twist of its backbone leads to its pose (by {fits.miss[k]:.1e})")
    balance = BALANCE * (1.0 + _SHARP * angle**2 + _SEVERAL * several)
    balance += 2.0 * float(state.now.moment_error) ** 2  # what its polynomials miss is told
    flat = max(np.abs(fits.curved[k, :, 0]).max(), abs(fits.twist[k])) < _FLAT
    for what, missing in (
        ("bending", (_WEIGHS * (bends - moments[:, 1])) @ powers),
        ("sideways", (_WEIGHS * (sideways - moments[:, 0])) @ powers),
        ("twist", twist - _WEIGHS @ moments[:, 2]),
    ):
        # In a plane there is no term out of it, and nothing to balance.
        left = np.abs(missing).max() / scale
        if not left < balance and (what == "bending" or not flat):
            found.append(f"{name}: {what} out of balance by {left:.1e}")
    rigid = section.area * np.array([shear, shear, modulus])
    missing = np.abs(rigid * (fits.moves[k] - _Z) - _WEIGHS @ forces)
    # Of a thin one even rounding of the poses, and of the integral, is a large force.
    seen = rigid * (
        1e-12 * (1.0 + state.reach / length) + 4e-7 * (angle**4 + angle**6) + TURNED * several
    )
    for direction, what in enumerate(("shear", "shear sideways", "stretch")):
        out = not missing[direction] < balance * pulled + seen[direction]
        if out and (what != "shear sideways" or not flat):
            left = missing[direction] / pulled
            found.append(f"{name}: {what} out of balance by {left:.1e}")
    largest = bends[np.abs(bends).argmax()]
    if not abs(largest - state.now.notch_moment[i]) < balance * scale:
        found.append(f"{name}: notch_moment is not that of its strains")
    return found


def taken(cut: NotchCut, tube: nf.Tube, end: float) -> float:
    """Volume that a cut takes out of a tube up to its end, mm³."""
    corners, radius = np.array(cut.corners), max(cut.radii)
    # Slices along the tube, with their middles; many, for the rule is of second order.
    edges = np.linspace(corners[0, 0], corners[-1, 0], 2001)
    place = 0.5 * (edges[1:] + edges[:-1])
    bottom = np.interp(place, *corners.T)
    beside = np.minimum(np.minimum(place - edges[0], edges[-1] - place), radius)
    bottom += radius - np.sqrt(radius**2 - (radius - beside) ** 2)
    outer, inner = (
        r**2 * np.arccos(c := np.clip(bottom / r, -1.0, 1.0)) - r**2 * c * np.sqrt(1.0 - c**2)
        for r in (tube.outer_radius, tube.inner_radius)
    )
    return float(np.clip(np.diff(np.minimum(edges, end)), 0.0, None) @ (outer - inner))


def masses(state: State) -> list[str]:
    """Whether all weighs what the robot says: the sum, and of straight backbones its moment.

    Of strips across the tube it is the tube less its cuts; where one of them reaches into a notch
    that differs, what it takes there is not known.
    """
    robot, chain, mass, first = state.robot, state.path.chain, 0.0, 0.0
    place, rounding, along = 0.0, 1e-9, nf.RodGap | nf.TableNotch | nf.ArcNotch
    layouts = (None, *robot.geometry.cuts)
    end = state.length[0] + sum(layout.length for layout in layouts[1:])
    for i, notch in enumerate((None, *robot.notches)):
        tube, density = state.tubes[i], state.materials[i].density or 0.0
        ring = np.pi * (tube.outer_radius**2 - tube.inner_radius**2)
        parts = [(ring * state.length[i], state.length[i], getattr(notch, "disk_mass", None))]
        if notch is not None:
            area, height = ring, layouts[i].length - state.length[i]
            if isinstance(notch, nf.RodGap | nf.ArcNotch):
                is_round = isinstance(notch, nf.RodGap)
                area = (round_section(notch) if is_round else left_by(notch, tube)).area
            elif not isinstance(notch, along):
                cuts = [taken(cut, tube, end) for cut in layouts[i].cuts]
                own = place + height + state.length[i]
                over = sum(cuts) - sum(taken(cut, tube, own) for cut in layouts[i].cuts)
                # Two cuts that meet there take their share once.
                follows = robot.notches[i] if i < len(robot.notches) else notch
                meets = over > 0.0 and not (
                    follows.kind == notch.kind
                    and follows.direction_deg == notch.direction_deg
                    and follows.tube == notch.tube
                    and follows.height >= notch.height
                )
                rounding = max(rounding, 1e-3) + meets * over / ring / height
                parts.append((-sum(cuts), 0.0, None))
            parts.insert(0, (area * height, height, None))
        for volume, length, given in parts:
            weight = 1e-6 * density * volume if given is None else given
            mass, first = mass + weight, first + weight * (place + 0.5 * length)
            place += length
    told = np.asarray(chain.body_mass)
    heights = [height_of(notch) for notch in robot.notches]
    starts = np.append(0.0, np.cumsum(state.length[:-1] + heights))
    lever = told @ (starts + np.asarray(chain.body_centre)[:, 2])
    straight = all(isinstance(n, nf.RodGap) and not n.precurvature_deg for n in robot.notches)
    off = abs(told.sum() - mass) / (mass or 1.0), straight * abs(lever - first) / (first or 1.0)
    found = [f"its bodies weigh other than it says (by {max(off):.1e})"]
    return found if max(off) > rounding else []
