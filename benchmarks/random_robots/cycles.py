"""Whether strains and the limit line of fatigue give the margins that are told.

The strains of sections are read where they are told, at the nodes: stretch, curvature and sideways
curvature, which arcs.py and rods.py hold against the moments. Places on the boundary of a section,
the straight limit line and the factor at the corners of a cut are written again from their pages
(docs/fatigue.md): 33 points along the arc of the spine, 8 along each face to the corner of the cut.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

import notchflex as nf

from .forces import State
from .sections import left_by, outer_depth

_EXACT = 1e-9  # of strains
_ARC, _FACE = np.linspace(-1.0, 1.0, 33), np.linspace(0.0, 1.0, 9)[1:]
LINES = {
    "cao2020": ((0.0, 0.03, 0.07), (0.0055, 0.0016, 0.0016)),
    "pelton2003": ((0.0, 0.015), (0.004, 0.004)),
}


def corner_factor(robot: nf.Robot, i: int) -> float:
    """Factor at the corners of notch i (from 0); NaN where it is not known."""
    fatigue, notch, tube = robot.fatigue, robot.notches[i], robot.tubes[i + 1]
    outer = tube.outer_diameter
    if isinstance(notch, nf.RodGap):
        return 1.0  # nothing is cut
    if fatigue.corner_radius is None:
        return fatigue.corner_factor or 1.0
    if not isinstance(notch, nf.ArcNotch) or notch.cut != "on-axis":
        return np.nan
    radius, depth = fatigue.corner_radius / outer, outer_depth(notch, tube) / outer
    # Rings are the uncut lengths beside it; a held base acts as the longest one.
    around = (*robot.notches[: i + 2], None)
    beside = [one.spacing(after) for one, after in pairwise(around)][max(i - 1, 0) : i + 1]
    ring = 2.4 if i == 0 else max(beside) / outer
    known = 0.006 <= radius <= 0.1 and 0.68 <= depth <= 0.92 and ring >= 0.2
    if not known:
        return np.nan
    size, left, long = np.log(radius), np.log(1.0 - depth), np.log(min(ring, 2.4))
    terms = {
        0.7805: 1.0,
        0.0492: size,
        0.0535: size**2,
        -0.0341: size * long,
        0.2288: left,
        0.1467: left * long,
        0.2345: long,
        -0.0496: long**2,
    }
    return float(np.exp(sum(factor * term for factor, term in terms.items())))


def boundary(
    notch: nf.ArcNotch | nf.RodGap, tube: nf.Tube
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places (toward the spine, and sideways) on the boundary of a section; which are corners."""
    if isinstance(notch, nf.RodGap):
        turn = np.pi * _ARC
        radius = 0.5 * notch.diameter
        return radius * np.cos(turn), radius * np.sin(turn), np.zeros(33, bool)
    depth, outer, inner = outer_depth(notch, tube), tube.outer_radius, tube.inner_radius
    half = np.arccos((depth - outer) / outer)
    turn = half * _ARC
    off = left_by(notch, tube).centroid
    x, y = outer * np.cos(turn) - off, outer * np.sin(turn)
    # The far end of a face: on the inner surface of a radial cut that is deeper than the axis.
    near = inner if notch.cut == "on-axis" and depth > outer else outer
    near_x, near_y = near * np.cos(half) - off, near * np.sin(half)
    x_face, y_face = x[-1] + _FACE * (near_x - x[-1]), y[-1] + _FACE * (near_y - y[-1])
    corner = np.zeros(49, bool)
    corner[[40, 48]] = True
    return np.concatenate([x, x_face, x_face]), np.concatenate([y, y_face, -y_face]), corner


def margin(
    robot: nf.Robot, mean: np.ndarray, amplitude: np.ndarray, corner: np.ndarray, factor: float
) -> float:
    """Smallest margin of a notch below the limit line; NaN where it is not known at a point."""
    fatigue = robot.fatigue
    means, amplitudes = LINES[fatigue.line] if fatigue.line else (fatigue.mean, fatigue.amplitude)
    rises = np.where(corner, factor, 1.0)
    at = rises * np.abs(mean)
    left = np.interp(at, means, amplitudes) - rises * amplitude
    known = (at >= means[0]) & (at <= means[-1])
    return float(left.min()) if known.all() and np.isfinite(at).all() else np.nan


def judge_margin(state: State) -> list[str]:
    """Compare the margins of a state with those of its strains."""
    robot = state.robot
    if not (robot.fatigue.line or robot.fatigue.mean):
        return []
    told, found = state.now.fatigue_margin, []
    strains = state.path.solver_quantity("notch_strain")[0]
    for i, notch in enumerate(robot.notches):
        if not isinstance(notch, nf.ArcNotch | nf.RodGap):
            continue
        x, y, corner = boundary(notch, robot.tubes[i + 1])
        stretch, curvature, sideways = np.moveaxis(strains[i], -1, 0)[..., None]
        half = 0.5 * (stretch + curvature * x + sideways * y)
        factor = corner_factor(robot, i)
        due = margin(robot, half, np.abs(half), corner, factor)
        means = (robot.fatigue.mean or LINES[robot.fatigue.line or ""][0])[-1]
        at_end = np.abs(np.abs(half).max() * max(1.0, factor) / means - 1.0) < 1e-6
        same = abs(due - told[i]) <= _EXACT or (np.isnan(due) and np.isnan(told[i]))
        if not (same or at_end):
            found.append(f"notch {i + 1}: its margin is {told[i]:.6g}, not {due:.6g}")
    return found


def judge_cycle(path: nf.EquilibriumPath) -> list[str]:
    """Compare mean and amplitude of the strains between the solved states of a path."""
    robot, solved = path.robot, np.flatnonzero(path.converged)
    if len(solved) < 2 or not (robot.fatigue.line or robot.fatigue.mean):
        return []
    cycle = nf.strain_cycle([path[int(step)] for step in solved])
    every, found = path.solver_quantity("notch_strain")[solved], []
    for i, notch in enumerate(robot.notches):
        if not isinstance(notch, nf.ArcNotch | nf.RodGap):
            continue
        x, y, corner = boundary(notch, robot.tubes[i + 1])
        stretch, curvature, sideways = np.moveaxis(every[:, i], -1, 0)[..., None]
        strains = stretch + curvature * x + sideways * y
        mean = 0.5 * (strains.max(axis=0) + strains.min(axis=0))
        amplitude = 0.5 * np.ptp(strains, axis=0)
        for what, own, told in (
            ("mean", mean, cycle.mean[i, :, : len(x)]),
            ("amplitude", amplitude, cycle.amplitude[i, :, : len(x)]),
        ):
            off = np.abs(own - told).max()
            if not off < _EXACT:
                found.append(f"notch {i + 1}: the {what} of its cycle is off by {off:.1e}")
        factor = corner_factor(robot, i)
        due, told = margin(robot, mean, amplitude, corner, factor), cycle.smallest_margin[i]
        last = (robot.fatigue.mean or LINES[robot.fatigue.line or ""][0])[-1]
        at_end = abs(np.abs(mean).max() * max(1.0, factor) / last - 1.0) < 1e-6
        if not (abs(due - told) <= _EXACT or (np.isnan(due) and np.isnan(told)) or at_end):
            found.append(f"notch {i + 1}: the margin of its cycle is {told:.6g}, not {due:.6g}")
    return found
