"""Whether tendons are as the poses of the bodies have them: strokes, turning angles, friction."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

import notchflex as nf

from .arcs import Arcs, arc_law
from .forces import State, Stop, about_z, height_of
from .rods import Bent
from .sections import bounds

EXACT = 1e-8  # relative, of tensions; of log ratios
# Relative, of what all gaps are shorter or longer by: strains are fitted to poses (arcs.py). And
# rounding, of lengths.
STROKE, LENGTH = 1e-6, 1e-11
# A slip, of the height of a notch, that must bring friction to its bound, and how near.
_SLIDES, _OPPOSES = 1e-7, 1e-6
_Z = np.array([0.0, 0.0, 1.0])


def judge_tendons(state: State, arcs: Arcs, tables: dict[int, Bent]) -> list[str]:
    """Judge strokes, slid lengths, turning angles, friction and tensions of a state.

    Args:
        state: The bodies, and the spans of straight tendons between them.
        arcs: The strains of the arc notches, which tendons on the wall follow.
        tables: Those of flexures given by numbers, by their number from 0.
    """
    found = []
    for number, tendon in enumerate(state.robot.tendon):
        if tendon.path == "wall-arc":
            shortening, turning, lengths = _on_wall(state, arcs, tables, number)
        else:
            shortening, turning, lengths = _straight(state, number)
        found += _slid(state, number, shortening, lengths)
        found += _friction(state, number, turning)
    return [*found, *_opposed(state)]


def _opposed(state: State) -> list[str]:
    """Friction opposes what a tendon slides: from the last state that entered the history on."""
    path, found = state.path, []
    last = path.prepared.state.unpack(path.run.between).memory
    now = path.run.solved.memory
    height = np.array([height_of(notch) for notch in state.robot.notches])[:, None, None]
    for k, group in enumerate(path.chain.groups):
        slip = (np.asarray(now.slid[k][0]) - np.asarray(last.slid[k][0])) / height
        ratio, bound = (np.asarray(part[k][0]) for part in (now.log_ratio, now.bound))
        taut = state.now.tension[list(group.numbers)] > 1e6 * state.rounding
        slides = (np.abs(slip) > _SLIDES) & (bound > 0.0) & taut[None, :, None]
        against = slides & (np.sign(slip) * ratio < bound - _OPPOSES)
        for notch, tendon, _ in np.argwhere(against)[:1]:
            name = f"tendon {group.numbers[tendon] + 1} at notch {notch + 1}"
            found.append(f"{name}: friction does not oppose its sliding")
    return found


def _on_wall(
    state: State, arcs: Arcs, tables: dict[int, Bent], number: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Tendon on the arc of the wall: what every gap is shorter by, turning, lengths at rest."""
    tube, notches = state.robot.tube, state.robot.notches
    place = state.tendon_place(number)
    shorter, turning, lengths = [], [], [tube.base_length]
    # It ends at the far edge of the wall on its side, as a straight one does.
    tendon = state.robot.tendon[number]
    stops = state.way(tendon.direction_deg, tendon.radius)
    for i in range(state.end_body(number)):
        if i in tables:
            bent = tables[i]
            off, longer, free = bent.axis, bent.moves[2], bent.free
            sideways, toward_side = bent.turns[:2]
        else:
            k = arcs.notches.index(i)
            off, longer, free = arcs.laws[k].centroid, 0.0, np.radians(notches[i].precurvature_deg)
            toward_side, sideways = arcs.modes[k, [0, 2]]
        side = np.radians(notches[i].direction_deg)
        toward = place @ [np.cos(side), np.sin(side), 0.0] + off
        beside = place @ [-np.sin(side), np.cos(side), 0.0]
        shorter.append(toward * toward_side - beside * sideways - longer)
        turning += [0.5 * np.hypot(free + toward_side, sideways)] * 2
        between = stops[i + 1].leaves - stops[i + 1].enters
        lengths += [height_of(notches[i]) - toward * free, between]
    return np.array(shorter), np.array(turning), np.array(lengths)


def _straight(state: State, number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Straight tendon: the same, its lengths at rest from the free robot."""
    spans, stops, holes = state.spans[number], state.stops(number), state.holes(number)
    free = _free_lengths(state, number, stops)
    turning = [angle for span in spans for angle in (span.exit_turning, span.entry_turning)]
    lengths = [stops[0].leaves]
    for gap, stop in zip(free, stops[1:], strict=True):
        hole = holes[stop.body]
        lengths += [gap, max(stop.leaves - stop.enters, 0.0) / hole.along[2]]
    now = [span.length for span in spans]
    return np.subtract(free, now), np.array(turning), np.array(lengths)


def _free_lengths(state: State, number: int, stops: list[Stop]) -> list[float]:
    """Lengths of the gaps of a straight tendon in the free robot, whose notches may be bent."""
    holes, bodies = state.holes(number), [(np.zeros(3), np.eye(3))]
    for notch, length in zip(state.robot.notches, state.length, strict=False):
        origin, rotation = bodies[-1]
        # The origin of the next body lies a notch's height beyond this one: of a strip level with
        # its middle, of a link at its proximal face.
        rise = getattr(notch, "rise", 0.0)
        over, turn = np.array([0.0, 0.0, height_of(notch) + rise]), np.eye(3)
        if notch.precurvature_deg:
            off = getattr(notch, "axis_offset", 0.0)
            if isinstance(notch, nf.ArcNotch):
                off = arc_law(state, len(bodies) - 1).centroid
            over, turn = _free_arc(notch, off)
        bodies.append((origin + rotation @ (over + length * _Z), rotation @ turn))
    leaves, enters = (
        [
            bodies[one.body][0]
            + bodies[one.body][1] @ (getattr(holes[one.body], name) + getattr(one, name) * _Z)
            for one in stops
        ]
        for name in ("leaves", "enters")
    )
    return [
        float(np.linalg.norm(there - here)) for here, there in zip(leaves, enters[1:], strict=False)
    ]


def _free_arc(
    notch: nf.ArcNotch | nf.RodGap | nf.TableNotch, off: float
) -> tuple[np.ndarray, np.ndarray]:
    """From the near face of a free arc notch, whose neutral axis is a circle, to its far one."""
    frame, angle = about_z(notch.direction_deg), np.radians(notch.precurvature_deg)
    turn = Rotation.from_rotvec([0.0, angle, 0.0]).as_matrix()
    radius = height_of(notch) / angle
    over = np.array([radius * (1.0 - np.cos(angle)) - off, 0.0, radius * np.sin(angle)])
    over += turn @ [off, 0.0, 0.0]
    return frame @ over, frame @ turn @ frame.T


def _slid(state: State, number: int, shorter: np.ndarray, lengths: np.ndarray) -> list[str]:
    """What slides at the edges of gaps is what these get shorter by, less what is stretched."""
    tendon, tension, found = state.robot.tendon[number], state.tension[number], []
    along = tension[~np.isnan(tension)]
    along = np.append(along, along[-1])  # in its end body it has the tension of the last gap
    stretch = along * lengths / tendon.axial_stiffness
    stretch[0] += along[0] * tendon.free_length / tendon.axial_stiffness
    size = float(np.abs(shorter).sum() + np.abs(stretch).sum())
    near = STROKE * size + LENGTH * (state.reach + state.height)
    off = abs(shorter.sum() + stretch.sum() - state.drawn[number])
    if off > near:
        found.append(f"tendon {number + 1}: its stroke is off by {off:.1e} mm")
    there = ~np.isnan(state.now.contact_log_ratio[number])
    slid = state.now.contact_slid[number][there]
    slid = np.concatenate([[state.drawn[number]], slid, [0.0]])
    grown = stretch.copy()
    grown[1::2] += shorter
    # Where it enters its end body is no contact: last gap and end are one piece.
    grown = np.append(grown[:-2], grown[-2:].sum())
    off = np.abs(np.diff(slid) + grown).max()
    if off > near:
        found.append(f"tendon {number + 1}: slid lengths are off by {off:.1e} mm")
    return found


def _friction(state: State, number: int, turning: np.ndarray) -> list[str]:
    """Tensions are not negative, fall by the log ratios, and these are within their bound."""
    now, name, found = state.now, f"tendon {number + 1}", []
    there = ~np.isnan(now.contact_log_ratio[number])
    ratio, bound, told, moves = (
        getattr(now, f"contact_{what}")[number][there]
        for what in ("log_ratio", "bound", "turning", "state")
    )
    tension = state.tension[number][~np.isnan(state.tension[number])]
    if len(tension) != len(ratio) + 1 or len(turning) != len(ratio) + 1:
        return [f"{name}: {len(tension)} tensions, {len(ratio)} contacts, {len(turning)} edges"]
    if (tension < -state.rounding).any():
        found.append(f"{name}: pushed with {-tension.min():.1e} N")
    if abs(tension[0] - state.pull[number]) > EXACT * tension[0] + state.rounding:
        found.append(f"{name}: its first span has not the tension of its base")
    off = np.abs(tension[1:] - tension[:-1] * np.exp(-ratio)).max(initial=0.0)
    if off > EXACT * tension[0] + state.rounding:
        found.append(f"{name}: tensions do not fall by their log ratios")
    if (np.abs(ratio) > bound + EXACT).any():
        found.append(f"{name}: friction beyond its bound by {(np.abs(ratio) - bound).max():.1e}")
    off = np.abs(ratio - moves * bound)[(moves != 0) & (tension[0] > 1e6 * state.rounding)]
    if off.max(initial=0.0) > _OPPOSES:
        found.append(f"{name}: slips below its bound by {off.max():.1e}")
    friction = state.robot.friction
    chord = getattr(friction, "turning", None) == "chord"
    edges = slice(0, None, 2) if chord else slice(None)
    off = np.abs(told - turning[:-1])[edges]
    if (off > _turning_error(state, number, len(turning))[:-1][edges]).any():
        found.append(f"{name}: turns by other angles than the poses have (by {off.max():.1e})")
    own = np.append(told, turning[-1])
    off = np.abs(bound - bounds(friction, own)).max(initial=0.0)
    # Of the last edge, where it counts ahead, only the fit knows the turning.
    if off > (1e-6 if getattr(friction, "wrap", None) == "whole-before" else EXACT):
        found.append(f"{name}: the bound of its friction is off by {off:.1e}")
    return found


def _turning_error(state: State, number: int, edges: int) -> np.ndarray:
    """Angles of short spans carry the rounding of the poses; those on the wall that of the fit."""
    lengths = [span.length for span in state.spans[number] for _ in range(2)]
    return 1e-6 + 1e-13 * state.reach / np.maximum(lengths or [1.0] * edges, 1e-300)
