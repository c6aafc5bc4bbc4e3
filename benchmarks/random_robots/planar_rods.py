"""Whether rods that stay in a plane are in balance, by other means than modes.

A strip of Liu 2022 and an arc notch with rigid ends are rods of one section: from the forces on all
that is beyond (see forces.py) their curve is integrated anew from the far end back to the near one,
by the law of the material alone, and must arrive there. The solver has a few polynomials for the
curvature; what these miss is `moment_error`, and so much is allowed for. The moments of a strip are
those along its own curve, which the curvature told at its nodes integrates to.

A U-link of Gao 2017 has another section everywhere, and so have strips with elastic ends. Of these
is asked that the bending moment is one that the forces beyond have about some point of the strip.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Chebyshev, Legendre
from numpy.polynomial.legendre import leggauss
from scipy.integrate import solve_ivp

import notchflex as nf

from .forces import State, about_z
from .sections import left_by, strain_of, stress

_Z = np.array([0.0, 0.0, 1.0])
_ACCURATE = 1e-10
_LEAST = 1e-30  # instead of nothing
_DEGREE = 60  # of polynomials for the places along a curve
# Relative, of all that acts; the modes hold the balance to less.
MOMENT = 1e-6


class Rod(NamedTuple):
    """A rod in a plane, from its far end back to its near one.

    Attributes:
        far: Place of its far end in the world, and its direction there, out of the rod.
        near: The same of its near end.
        length: mm.
        rest: Curvature when free, 1/mm.
        couple: Moment all along, of tendons on the wall and lips, N mm.
        edge: Distance of the outermost fibre, mm.
        second_moment: mm^4.
        misses: Of pose (rad, and lengths) that is nothing, and times what the moment error bends.
    """

    far: tuple[np.ndarray, np.ndarray]
    near: tuple[np.ndarray, np.ndarray]
    length: float
    rest: float
    couple: float
    edge: float
    second_moment: float
    misses: tuple[float, float]


def judge_planar_rods(state: State) -> list[str]:
    """Problems of the rods of a state; none where the robot leaves its plane."""
    if state.undecided or not lies_flat(state):
        return []
    robot, problems = state.robot, []
    # The error is that over the largest moment asked for, which is larger than told by at most it.
    error = float(state.now.moment_error)
    missed = error / (1.0 - error) * float(np.abs(state.now.notch_moment).max())
    for i, notch in enumerate(robot.notches):
        material = state.materials[i + 1]
        if isinstance(notch, nf.RodGap | nf.TableNotch):
            continue
        if notch.has_elastic_ends or not isinstance(material, nf.Linear | nf.Superelastic):
            rod = None
        elif isinstance(notch, nf.ArcNotch):
            rod = _arc(state, i, notch)
        else:
            large = isinstance(notch, nf.StripNotch) and notch.deflection == "large"
            rod = _strip(state, i, notch) if large else None
        if rod is not None:
            problems += _integrated(state, i, rod, missed)
        elif not isinstance(notch, nf.ArcNotch):
            problems += _link(state, i, notch, 2.0 * missed)
    return problems


def lies_flat(state: State) -> bool:
    """Whether all notches bend in one plane and the robot is in it."""
    first, *others = (about_z(notch.direction_deg)[:, 1] for notch in state.robot.notches)
    if any(np.abs(np.cross(first, other)).max() > 1e-9 for other in others):
        return False
    return bool(np.abs(state.rotation @ first - state.rotation[0] @ first).max() <= 1e-9)


def _frames(state: State, i: int) -> tuple[np.ndarray, np.ndarray]:
    """Frames of the bodies before and behind a notch, x toward its bend and y about it."""
    turn = about_z(state.robot.notches[i].direction_deg)
    return state.rotation[i] @ turn, state.rotation[i + 1] @ turn


def _strip(state: State, i: int, notch: nf.StripNotch) -> Rod:
    """The strip of a notch, across the tube: five polynomials give 1e-7 on Liu's robot."""
    tube = state.robot.tube
    length, thickness = notch.strip_length_in(tube), notch.strip_thickness
    before, behind = (frame[:, 0] for frame in _frames(state, i))
    clamp = state.point(i, (state.length[i] + notch.height) * _Z) - 0.5 * length * before
    return Rod(
        (state.origin[i + 1] + 0.5 * length * behind, behind),
        (clamp, before),
        length,
        rest=0.0,
        couple=0.0,
        edge=0.5 * thickness,
        second_moment=notch.wall_width_in(tube) * thickness**3 / 12.0,
        misses=(1e-6, 3.0),
    )


def _arc(state: State, i: int, notch: nf.ArcNotch) -> Rod:
    """The neutral axis of an arc notch, along the tube."""
    tube = state.tubes[i + 1]
    left = left_by(notch, tube)
    before, behind = _frames(state, i)
    face = state.point(i, state.length[i] * _Z)
    couple = -float(state.now.contact_force[i]) * (tube.outer_radius + left.centroid)
    inward = about_z(notch.direction_deg)[:, 0]
    for number, tendon in enumerate(state.robot.tendon):
        if tendon.path == "wall-arc" and i < state.end_body(number):
            arm = state.tendon_place(number) @ inward + left.centroid
            couple += state.tension[number, 2 * i + 1] * arm
    return Rod(
        (state.origin[i + 1] - left.centroid * behind[:, 0], behind[:, 2]),
        (face - left.centroid * before[:, 0], before[:, 2]),
        notch.height,
        rest=np.radians(notch.precurvature_deg) / notch.height,
        couple=couple,
        edge=left.spine,
        second_moment=left.weak,
        # The moment error is that at the nodes; a law with kinks has more between them.
        misses=(1e-7, 1.0 if isinstance(state.materials[i + 1], nf.Linear) else 3.0),
    )


def _integrated(state: State, i: int, rod: Rod, missed: float) -> list[str]:
    """Integrate a rod from its far end back to its near one, and compare."""
    far, onward = rod.far
    axis = _frames(state, i)[1][:, 1]
    across = np.cross(axis, onward)
    force, moment, _ = state.beyond(i + 1, far)
    # In the plane: place along `onward` and `across`, and the angle of the rod from `onward`.
    pull = force @ onward, force @ across
    about = float(moment @ axis) + rod.couple

    def asked(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Moment, positive about the axis: from `onward` to `across`."""
        return about - x * pull[1] + y * pull[0]

    def bend(value: float) -> float:
        return strain_of(state.materials[i + 1], value * rod.edge / rod.second_moment) / rod.edge

    def slope(_: float, here: np.ndarray) -> list[float]:
        return [-np.cos(here[2]), -np.sin(here[2]), -rod.rest - bend(asked(*here[:2]))]

    # What the modes may miss of the moment bends the rod by so much, where it is softest: that need
    # not be where the moment is largest. More than the material bears is nothing to compare.
    high = max(np.abs(state.now.notch_moment[i]), abs(about), _LEAST)
    moments = np.linspace(0.0, high, 40)
    law = np.array([[bend(m), bend(m + missed)] for m in moments])
    if not np.isfinite(law).all():
        return []
    allowed = rod.misses[0] + rod.misses[1] * rod.length * float(np.diff(law).max())
    # A curve that is off has other arms of the force, which turns it further: angles grow by
    # sinh(x) / x with x = length sqrt(force / stiffness).
    softness = np.diff(law[:, 0]).max() / moments[1]
    x = max(rod.length * np.sqrt(softness * np.linalg.norm(pull)), _LEAST)
    allowed *= np.sinh(x) / x
    x, y, turn = solve_ivp(
        slope,
        (0.0, rod.length),
        np.zeros(3),
        method="DOP853",
        rtol=_ACCURATE,
        atol=_ACCURATE * rod.length,
    ).y[:, -1]
    found, off = [], _astray(rod, across, x, y, turn)
    if not off <= allowed:
        found.append(f"notch {i + 1}: its rod misses its end by {off:.1e} of {allowed:.1e}")
    if isinstance(state.robot.notches[i], nf.StripNotch):
        found += _as_told(state, i, rod, asked, missed)
    return found


def _astray(rod: Rod, across: np.ndarray, x: float, y: float, turn: float) -> float:
    """How far a curve from the far end ends from the near one: rad, or parts of the length."""
    (far, onward), (near, begins) = rod.far, rod.near
    angle = np.arctan2(begins @ across, begins @ onward) - turn
    away = far + x * onward + y * across - near
    angle = abs(np.remainder(angle + np.pi, 2.0 * np.pi) - np.pi)
    return max(angle, np.abs(away).max() / rod.length)


def _as_told(
    state: State,
    i: int,
    rod: Rod,
    asked: Callable[[np.ndarray, np.ndarray], np.ndarray],
    missed: float,
) -> list[str]:
    """Compare the moments of a strip with those asked for, along the curve of its told curvature.

    The curve that the forces alone integrate to is none for that. From the far end on its moment
    grows by what it is off, which bends it further: a difference at the far end becomes up to
    cosh(length sqrt(force / stiffness)) times as large.
    """
    far, onward = rod.far
    across = np.cross(_frames(state, i)[1][:, 1], onward)
    used = np.asarray(state.node_length)[i] > 0.0  # rods of other kinds have more nodes
    curvature = state.path.solver_quantity("notch_strain")[0][i, used, 1]
    node, weight = leggauss(len(curvature))
    ends, places = (0.0, rod.length), 0.5 * rod.length * (1.0 + node)  # from the near end
    bent = Legendre.fit(places, curvature, len(places) - 1, domain=ends)
    turn = bent.integ(lbnd=rod.length)
    slope_x = Chebyshev.interpolate(lambda place: np.cos(turn(place)), _DEGREE, ends)
    slope_y = Chebyshev.interpolate(lambda place: np.sin(turn(place)), _DEGREE, ends)
    x, y = (slope.integ(lbnd=rod.length) for slope in (slope_x, slope_y))
    found, off = [], _astray(rod, across, x(0.0), y(0.0), turn(0.0))
    if not off <= rod.misses[0]:
        found.append(f"notch {i + 1}: bent as told it misses its end by {off:.1e}")

    carried = rod.second_moment / rod.edge * stress(state.materials[i + 1], curvature * rod.edge)
    told, largest = float(state.now.notch_moment[i]), np.abs(carried).max()
    off = max(np.abs(carried - told).min(), abs(largest - abs(told)))
    if not off <= _ACCURATE * largest:
        found.append(f"notch {i + 1}: {told:.3g} N mm, {off:.1e} off the largest of its curvature")
    nothing = MOMENT * state.beyond(i + 1, far)[2][1] + state.rounding * state.reach
    missing = carried - asked(x(places), y(places))
    off = float(np.abs(missing).max())
    if not off <= missed + nothing:
        found.append(f"notch {i + 1}: bent by moments {off:.1e} N mm off what it carries")
    # Curvatures that are constant or linear are among the polynomials: of these nothing is missed.
    off = float(np.abs([missing @ weight, missing @ (weight * node)]).max())
    if not off <= nothing:
        found.append(f"notch {i + 1}: out of balance by {off:.1e} N mm")
    return found


def _link(state: State, i: int, notch: nf.ULink | nf.StripNotch, missed: float) -> list[str]:
    """Compare the moment of a strip with those that the forces have about its points."""
    moment, axis = float(state.now.notch_moment[i]), _frames(state, i)[1][:, 1]
    rise = 0.5 * notch.strip_thickness if isinstance(notch, nf.ULink) else 0.0
    middle = state.point(i + 1, rise * _Z)
    force, about, size = state.beyond(i + 1, middle)
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
