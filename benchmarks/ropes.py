"""Whether tendons are as the poses of the bodies have them: strokes, turning angles, friction."""

from __future__ import annotations

from typing import Any

import numpy as np
from acting import State, Stop
from arcs import Arcs, about_z
from moments import arc_law

import notchflex as nf

EXACT = 1e-8  # relative, of tensions; of log ratios
# Relative, of what all gaps are shorter or longer by: strains are fitted to poses (arcs.py). And
# rounding, of lengths.
STROKE, LENGTH = 1e-6, 1e-11
# A slip, of the height of a notch, that must bring friction to its bound, and how near.
_SLIDES, _OPPOSES = 1e-7, 1e-6
_Z = np.array([0.0, 0.0, 1.0])


def judge_ropes(state: State, path: nf.EquilibriumPath, arcs: Arcs) -> list[str]:
    """Judge strokes, turning angles, friction and tensions of one step.

    Args:
        state: The bodies, and the spans of straight tendons between them.
        path: The path, for what it reports of the tendons.
        arcs: The strains of the arc notches, which tendons on the wall follow.
    """
    found = []
    for number, tendon in enumerate(state.robot.tendon):
        if tendon.path == "wall-arc":
            shortening, turning, lengths = _on_wall(state, arcs, number)
        else:
            shortening, turning, lengths = _straight(state, number)
        found += _stroke(state, path, number, shortening, lengths)
        found += _friction(state, path, number, turning)
    return [*found, *_opposed(state, path)]


def _opposed(state: State, path: nf.EquilibriumPath) -> list[str]:
    """Friction opposes what a tendon slides: from the last state that entered the history on."""
    run, step, found = path.run, state.step, []
    last = path.prepared.state.unpack(run.between).memory
    now, groups = run.solved.memory, path.chain.groups
    height = np.array([notch.height for notch in state.robot.notches])[:, None, None]
    for k, group in enumerate(groups):
        slip = (np.asarray(now.slid[k][step]) - np.asarray(last.slid[k][step])) / height
        ratio, bound = (np.asarray(part[k][step]) for part in (now.log_ratio, now.bound))
        taut = path.tension[step, list(group.numbers)] > 1e6 * state.rounding
        slides = (np.abs(slip) > _SLIDES) & (bound > 0.0) & taut[None, :, None]
        against = slides & (np.sign(slip) * ratio < bound - _OPPOSES)
        for notch, tendon, _ in np.argwhere(against)[:1]:
            name = f"tendon {group.numbers[tendon] + 1} at notch {notch + 1}"
            found.append(f"{name}: friction does not oppose its sliding")
    return found


def _on_wall(state: State, arcs: Arcs, number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Tendon on the arc of the wall: what every gap is shorter by, turning, lengths at rest."""
    tube, notches = state.robot.tube, state.robot.notches
    place = state.tendon_place(number)
    shorter, turning, lengths = [], [], [tube.base_length]
    # It ends at the far edge of the wall on its side, as a straight one does.
    tendon = state.robot.tendon[number]
    stops = state.way(tendon.direction_deg, tendon.radius)
    for k, i in enumerate(arcs.notches):
        if i >= state.end_body(number):
            break
        notch, modes = notches[i], arcs.modes[k]
        side, free = np.radians(notch.direction_deg), np.radians(notch.precurvature_deg)
        toward = place @ [np.cos(side), np.sin(side), 0.0] + arcs.laws[k].centroid
        beside = place @ [-np.sin(side), np.cos(side), 0.0]
        shorter.append(toward * modes[0] - beside * modes[2])
        turning += [0.5 * np.hypot(free + modes[0], modes[2])] * 2
        lengths += [notch.height - toward * free, stops[i + 1].leaves - stops[i + 1].enters]
    return np.array(shorter), np.array(turning), np.array(lengths)


def _straight(state: State, number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Straight tendon: the same, its lengths at rest from the free robot."""
    spans, stops = state.spans[number], state.stops(number)
    free = _free_lengths(state, number, stops)
    turning = [angle for span in spans for angle in (span.exit_turning, span.entry_turning)]
    lengths = [stops[0].leaves]
    for gap, stop in zip(free, stops[1:], strict=True):
        lengths += [gap, max(stop.leaves - stop.enters, 0.0)]
    now = [span.length for span in spans]
    return np.subtract(free, now), np.array(turning), np.array(lengths)


def _free_lengths(state: State, number: int, stops: list[Stop]) -> list[float]:
    """Lengths of the gaps of a straight tendon in the free robot, whose notches may be bent."""
    place = state.tendon_place(number)
    bodies = [(np.zeros(3), np.eye(3))]
    for notch, length in zip(state.robot.notches, state.length, strict=False):
        origin, rotation = bodies[-1]
        # The origin of the next body lies a notch's height beyond this one: of a strip level with
        # its middle, of a link at its proximal face.
        rise = getattr(notch, "rise", 0.0)
        over, turn = np.array([0.0, 0.0, notch.height + rise]), np.eye(3)
        if notch.precurvature_deg:
            over, turn = _free_arc(notch, arc_law(state, len(bodies) - 1).centroid)
        bodies.append((origin + rotation @ (over + length * _Z), rotation @ turn))
    leaves, enters = (
        [
            bodies[one.body][0] + bodies[one.body][1] @ (place + where * _Z)
            for one, where in ((stop, getattr(stop, name)) for stop in stops)
        ]
        for name in ("leaves", "enters")
    )
    return [
        float(np.linalg.norm(there - here)) for here, there in zip(leaves, enters[1:], strict=False)
    ]


def _free_arc(notch: nf.ArcNotch, off: float) -> tuple[np.ndarray, np.ndarray]:
    """From the near face of a free arc notch, whose neutral axis is a circle, to its far one."""
    frame = about_z(notch.direction_deg)
    angle = np.radians(notch.precurvature_deg)
    cosine, sine = np.cos(angle), np.sin(angle)
    turn = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
    radius = notch.height / angle
    over = np.array([radius * (1.0 - cosine) - off, 0.0, radius * sine]) + turn @ [off, 0.0, 0.0]
    return frame @ over, frame @ turn @ frame.T


def _stroke(
    state: State, path: nf.EquilibriumPath, number: int, shorter: np.ndarray, lengths: np.ndarray
) -> list[str]:
    """The stroke is what the poses set free and what the tendon is stretched."""
    tendon, tension = state.robot.tendon[number], state.tension[number]
    along = tension[~np.isnan(tension)]
    along = np.append(along, along[-1])  # in its end body it has the tension of the last gap
    stretch = along @ lengths + along[0] * tendon.free_length
    drawn = float(shorter.sum()) + stretch / tendon.axial_stiffness
    size, reach = float(np.abs(shorter).sum()), state.reach + state.height
    told = path.stroke[state.step, number]
    if abs(drawn - told) > STROKE * (size + abs(stretch / tendon.axial_stiffness)) + LENGTH * reach:
        return [f"tendon {number + 1}: stroke {told:.6g} mm, not {drawn:.6g}"]
    return []


def _friction(
    state: State, path: nf.EquilibriumPath, number: int, turning: np.ndarray
) -> list[str]:
    """Tensions are not negative, fall by the log ratios, and these are within their bound."""
    step, name, found = state.step, f"tendon {number + 1}", []
    ratio = path.contact_log_ratio[step, number]
    there = ~np.isnan(ratio)
    ratio, bound = ratio[there], path.contact_bound[step, number][there]
    told = path.contact_turning[step, number][there]
    tension = state.tension[number][~np.isnan(state.tension[number])]
    if len(tension) != len(ratio) + 1 or len(turning) != len(ratio) + 1:
        return [f"{name}: {len(tension)} tensions, {len(ratio)} contacts, {len(turning)} edges"]
    if (tension < -state.rounding).any():
        found.append(f"{name}: pushed with {-tension.min():.1e} N")
    off = np.abs(tension[1:] - tension[:-1] * np.exp(-ratio)).max(initial=0.0)
    if off > EXACT * tension[0] + state.rounding:
        found.append(f"{name}: tensions do not fall by their log ratios")
    if (np.abs(ratio) > bound + EXACT).any():
        found.append(f"{name}: friction beyond its bound by {(np.abs(ratio) - bound).max():.1e}")
    friction = state.robot.friction
    chord = getattr(friction, "turning", None) == "chord"
    edges = slice(0, None, 2) if chord else slice(None)
    off = np.abs(told - turning[:-1])[edges].max(initial=0.0)
    if off > _turning_error(state):
        found.append(f"{name}: turns by other angles than the poses have (by {off:.1e})")
    own = np.append(told, turning[-1])
    off = np.abs(bound - _bounds(friction, own)).max(initial=0.0)
    # Of the last edge, where it counts ahead, only the fit knows the turning.
    if off > (1e-6 if getattr(friction, "wrap", None) == "whole-before" else EXACT):
        found.append(f"{name}: the bound of its friction is off by {off:.1e}")
    return found


def _turning_error(state: State) -> float:
    """Angles of short spans carry the rounding of the poses; those on the wall that of the fit."""
    spans = [span.length for one in state.spans for span in one]
    return 1e-6 + 1e-13 * state.reach / max(min(spans, default=1.0), 1e-9)


def _bounds(friction: Any, turning: np.ndarray) -> np.ndarray:
    """Largest log ratios at all contacts by the law of friction, the fixed end left out."""
    if isinstance(friction, nf.Frictionless):
        return np.zeros(len(turning) - 1)
    if isinstance(friction, nf.Corner):
        return 2.0 * np.arctanh(friction.coefficient * np.tan(0.5 * turning[:-1]))
    if friction.wrap == "whole-before":
        whole = np.zeros_like(turning)
        whole[0::2] = turning[0::2] + turning[1::2]
        turning = whole
    return friction.coefficient * turning[:-1]
