"""Whether strips and U-links that stay in a plane are in balance, by other means than modes.

A strip of Liu 2022 is a straight rod of one section: from the forces on all that is beyond it (see
acting.py) its curve is integrated anew by Runge and Kutta from its far end back to where it is
clamped, by the law of the material alone, and must arrive there. The solver has a few polynomials
for the curvature; what these miss is `moment_error`, and so much is allowed for.

A U-link of Gao 2017 has another section everywhere, and so have strips with elastic ends. Of these
is asked that the bending moment is one that the forces beyond have about some point of the strip.
"""

from __future__ import annotations

import numpy as np
from acting import State
from moments import stress
from numpy.polynomial.legendre import leggauss

import notchflex as nf

_Z = np.array([0.0, 0.0, 1.0])
_PARTS = 100  # of the strip, for a method of fourth order
# Where the solver tells moments: ten Gauss nodes along the strip; between the parts moments are
# interpolated to this, of the largest.
_NODES = 0.5 * (leggauss(10)[0] + 1.0)
_BETWEEN = 1e-4
# Rad and lengths over the strip's; five polynomials give 1e-7 on Liu's robot.
POSE = 1e-6
# How much more than its mean a moment that is missed may bend the strip by its own lever.
_LEVER = 3.0
# Relative, of all that acts; the modes hold the balance to less.
MOMENT = 1e-6


def judge_strips(state: State, path: nf.EquilibriumPath) -> list[str]:
    """Problems of the strips and U-links of one step; none where the robot leaves its plane."""
    robot, step = state.robot, state.step
    normal = plane_normal(state)
    if normal is None or state.undecided:
        return []
    error = float(path.moment_error[step])
    largest = float(np.abs(path.notch_moment[step]).max())
    problems = []
    for i, notch in enumerate(robot.notches):
        moment = float(path.notch_moment[step, i])
        elastic = notch.has_elastic_ends
        if isinstance(notch, nf.StripNotch) and notch.deflection == "large" and not elastic:
            problems += _strip(state, i, notch, moment, error)
        elif not isinstance(notch, nf.ArcNotch):
            problems += _link(state, i, notch, moment, 2.0 * error * largest)
    return problems


def plane_normal(state: State) -> np.ndarray | None:
    """Normal of the plane in which all notches bend and the robot is; None if there is none."""
    sides = np.radians([notch.direction_deg for notch in state.robot.notches])
    if np.abs(np.sin(sides - sides[0])).max() > 1e-9:
        return None
    normal = state.rotation[0] @ [-np.sin(sides[0]), np.cos(sides[0]), 0.0]
    inside = np.array([-np.sin(sides[0]), np.cos(sides[0]), 0.0])
    if np.abs(state.rotation @ inside - normal).max() > 1e-9:
        return None
    return normal


def _axes(state: State, body: int, direction_deg: float) -> tuple[np.ndarray, np.ndarray]:
    """Directions of a body toward the bend of a notch, and of its axis of bending."""
    side = np.radians(direction_deg)
    toward = state.rotation[body] @ [np.cos(side), np.sin(side), 0.0]
    return toward, state.rotation[body] @ [-np.sin(side), np.cos(side), 0.0]


def _strip(state: State, i: int, notch: nf.StripNotch, told: float, error: float) -> list[str]:
    """Integrate a strip from its free end back to its clamp."""
    tube, material = state.robot.tube, state.robot.material
    length, thickness = notch.strip_length_in(tube), notch.strip_thickness
    second_moment = notch.wall_width_in(tube) * thickness**3 / 12.0
    toward, axis = _axes(state, i + 1, notch.direction_deg)
    across = np.cross(axis, toward)
    at = state.origin[i + 1] + 0.5 * length * toward
    force, moment = state.beyond(i + 1, at)
    bend = _Curvature(material, 0.5 * thickness, second_moment)

    # In the plane: place along `toward` and `across`, and the angle of the rod from `toward`.
    pull = np.array([force @ toward, force @ across])
    about = float(moment @ axis)

    def slope(here: np.ndarray) -> np.ndarray:
        x, y, turn = here
        # Positive about the axis is from `toward` to `across`.
        asked = about + (-x) * pull[1] - (-y) * pull[0]
        return np.array([np.cos(turn), np.sin(turn), bend(asked)])

    here, size = np.zeros(3), -length / _PARTS
    along = [about]
    for _ in range(_PARTS):
        one = slope(here)
        two = slope(here + 0.5 * size * one)
        three = slope(here + 0.5 * size * two)
        four = slope(here + size * three)
        here = here + size / 6.0 * (one + 2.0 * two + 2.0 * three + four)
        along.append(about - here[0] * pull[1] + here[1] * pull[0])
    most = float(np.abs(along).max())
    begins, _ = _axes(state, i, notch.direction_deg)
    clamp = state.point(i, (state.length[i] + notch.height) * _Z) - 0.5 * length * begins
    x, y, turn = here
    missed = at + x * toward + y * across - clamp
    angle = np.arctan2(begins @ across, begins @ toward) - turn
    off = max(abs(np.arctan2(np.sin(angle), np.cos(angle))), np.abs(missed).max() / length)
    softest = getattr(material, "superelastic_modulus", material.elastic_modulus)
    softest = min(softest, material.elastic_modulus) * second_moment
    allowed = POSE + _LEVER * error * most * length / softest
    found = []
    if off > allowed:
        found.append(f"notch {i + 1}: the strip misses its clamp by {off:.1e} of {allowed:.1e}")
    at_nodes = np.interp(_NODES, np.linspace(1.0, 0.0, _PARTS + 1)[::-1], along[::-1])
    off = abs(told - at_nodes[np.abs(at_nodes).argmax()])
    # Where both ends of the strip carry about the same, either may be told.
    off = min(off, abs(told - at_nodes[0]), abs(told - at_nodes[-1]))
    if off > (_BETWEEN + error) * most + state.rounding * state.reach:
        found.append(f"notch {i + 1}: {told:.3g} N mm, {off:.1e} off what the strip carries")
    return found


class _Curvature:
    """Curvature that carries a moment, 1/mm: the law of the material backwards."""

    def __init__(self, material: nf.Linear | nf.Superelastic, edge: float, second_moment: float):
        self.material, self.edge, self.scale = material, edge, second_moment / edge
        self.transition = getattr(material, "transition_strain", np.inf)

    def __call__(self, moment: float) -> float:
        wanted = abs(moment) / self.scale
        strain = wanted / self.material.elastic_modulus
        if strain > self.transition:
            low, high = strain if self._stress(strain) < wanted else self.transition, strain
            while self._stress(high) < wanted:
                low, high = high, 2.0 * high
            for _ in range(60):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if self._stress(middle) < wanted else (low, middle)
            strain = high
        return float(np.copysign(strain, moment)) / self.edge

    def _stress(self, strain: float) -> float:
        return float(stress(self.material, np.array(strain)))


def _link(
    state: State, i: int, notch: nf.ULink | nf.StripNotch, moment: float, missed: float
) -> list[str]:
    """Compare the moment of a strip with those that the forces have about its points."""
    _, axis = _axes(state, i + 1, notch.direction_deg)
    rise = 0.5 * notch.strip_thickness if isinstance(notch, nf.ULink) else 0.0
    middle = state.point(i + 1, rise * _Z)
    force, about, size = state.beyond_with_size(i + 1, middle)
    reach = state.robot.tube.outer_radius + 2.0 * notch.strip_thickness
    if isinstance(notch, nf.ULink):
        reach = 0.5 * notch.span + notch.slot_radius + notch.strip_thickness
        if notch.has_elastic_ends:
            reach += 2.0 * notch.strip_thickness + notch.slot_radius
    rounding = state.rounding * state.reach
    allowed = np.linalg.norm(force) * reach + missed + MOMENT * size[1] + rounding
    off = abs(moment - about @ axis)
    if off > allowed:
        return [f"notch {i + 1}: {moment:.3g} N mm, {off:.1e} off, {allowed:.1e} allowed"]
    return []
