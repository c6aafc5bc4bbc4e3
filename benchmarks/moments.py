"""Moments inside an arc notch by its ends, its flattening and its material, computed anew.

Equations of docs/from_the_drawing.md. What the fibres of a material with hysteresis remember is
read from the path and judged: it must be a state that its strains allow, and follow from that of
the last state that entered the history.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from acting import State
from fibres import Curve, Memory, fibres, remembered
from shells import ends_of, outer_depth, rings

import notchflex as nf

_SECTIONS = {"on-axis": nf.annular_sector, "off-axis": nf.annular_segment}
_SHARE = 0.25  # of the end compliance that follows the material
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
        twist: Distance of the shear centre from the neutral axis, mm.
        closure: Distance of the lips from the neutral axis, mm.
        lips: Flexibility of the closed lips, mm/N.
        weak: Length of the bending, over the height; 1 for rigid ends.
        strong: The same sideways.
        torsion: The same of torsion.
        odd: Flattening: q = 1 + odd θ + even θ².
        even: Its other number.
        push: Displacement of the rings by the force of a unit of linear bending, mm; and force.
        sway: The same sideways.
        section: Section between the ends.
        share: Of the end compliance that follows the material.
        edge: What an edge angle lacks of the elastic angle.
    """

    height: float
    centroid: float
    twist: float
    closure: float
    lips: float
    weak: float
    strong: float
    torsion: float
    odd: float
    even: float
    push: tuple[float, float]
    sway: tuple[float, float]
    section: nf.Section
    edge: float


def arc_law(state: State, i: int) -> ArcLaw:
    """The law of notch i (from 0)."""
    robot = state.robot
    notch, tube, material = robot.notches[i], robot.tube, robot.material
    height, modulus = notch.height, material.elastic_modulus
    left = left_by(notch, tube)
    centroid, centre = float(left.centroid), float(left.shear_centre)
    second, other = float(left.second_moment_weak), float(left.second_moment_strong)
    closure = tube.outer_radius + centroid
    weak = strong = torsion = height
    lips = odd = even = edge = 0.0
    push = sway = (0.0, 0.0)
    if notch.has_elastic_ends:
        sides = rings(robot, state.length, i)
        ends = ends_of(notch, tube, material.poisson_ratio, sides)
        if notch.closing == "elastic":
            closure /= _CLOSING[notch.cut]
            wall, radius = tube.outer_radius - tube.inner_radius, tube.outer_radius
            radius -= 0.5 * wall
            # Of the lips alone, beside the open notch.
            lips = closure**2 / (_CLOSED * modulus * wall * radius**2)
        if notch.ends == "shell":
            weak, strong, torsion = ends.weak, ends.strong, ends.torsion
            centroid -= ends.coupling / weak
            centre, odd, even = ends.shear_centre, ends.odd, ends.even
            edge = _EDGE * (weak - height) / weak
            push, sway = (
                (shear * (2 * moment / (height * length)), 2 * modulus * moment / (height * length))
                for shear, moment, length in (
                    (ends.push - height**2 * weak / (12 * second), second, weak),
                    (ends.sway - height**2 * strong / (12 * other), other, strong),
                )
            )
    return ArcLaw(
        height=height,
        centroid=centroid,
        twist=centre - centroid,
        closure=closure,
        lips=lips,
        weak=weak / height,
        strong=strong / height,
        torsion=torsion / height,
        odd=odd,
        even=even,
        push=push,
        sway=sway,
        section=left,
        edge=edge,
    )


@lru_cache(maxsize=256)
def left_by(notch: nf.ArcNotch, tube: nf.Tube) -> nf.Section:
    """What the cut of an arc notch leaves of the tube."""
    return _SECTIONS[notch.cut](tube.outer_radius, tube.inner_radius, outer_depth(notch, tube))


def stress(material: nf.Linear | nf.Superelastic, strain: np.ndarray) -> np.ndarray:
    """Stress of a fibre (Pacheco 2021, eq. 13), MPa."""
    if isinstance(material, nf.Linear):
        return material.elastic_modulus * strain
    size = np.abs(strain)
    first = np.minimum(size, material.transition_strain)
    second = np.clip(size, material.transition_strain, material.plastic_strain)
    third = np.maximum(size - material.plastic_strain, 1e-300)
    hardening = material.plastic_modulus * np.exp(material.plastic_exponent / third)
    flat = material.superelastic_modulus * (second - material.transition_strain)
    return np.sign(strain) * (material.elastic_modulus * first + flat + hardening)


class Bent(NamedTuple):
    """The bending inside a notch at its nodes.

    Attributes:
        moment: About the weak axis, N mm.
        problems: What does not hold of the memory of its fibres.
    """

    moment: np.ndarray
    problems: list[str]


def bending(state: State, i: int, law: ArcLaw, angle: np.ndarray, memory: Memory | None) -> Bent:
    """Moments of notch i at elastic angles, as if the notch were bent so all along, rad."""
    q = 1.0 + law.odd * angle + law.even * angle**2
    reduced = angle / (q * law.height)
    section, material = law.section, state.robot.material
    modulus, second = material.elastic_modulus, float(section.second_moment_weak)
    soft = (1.0 - _SHARE) * (law.weak - 1.0) / (modulus * second)
    own = 1.0 + _SHARE * (law.weak - 1.0)
    if isinstance(material, nf.Linear):
        return Bent(modulus * second * reduced / (law.weak * q), [])
    if isinstance(material, nf.Superelastic):
        spine = float(section.edge_spine)

        def moment(curvature: np.ndarray) -> np.ndarray:
            return second / spine * stress(material, curvature * spine)

        curvature = _bisected(lambda k: own * k + soft * moment(k) - reduced, np.abs(reduced))
        return Bent(moment(curvature) / q, [])
    arm, area, off = fibres(state, i, section)
    if memory is not None:
        used = np.asarray(state.node_length)[i] > 0.0  # the rods of other kinds have more nodes
        past, now = memory.before[i][used], memory.after[i][used]
        moved = now @ (area * arm) / second
        curvature = (reduced + soft * modulus * second * moved) / law.weak
        strain = (now @ area / area.sum())[..., None] + curvature[..., None] * arm
        closed = law.closure / law.height
        near = _ON_CURVE * np.abs(arm).max() / closed / law.height
        problems = remembered(i, material, strain, past, now, near)
        return Bent(modulus * second * (curvature - moved) / q, [*off, *problems])
    curve = Curve(material)

    def sums(curvature: np.ndarray) -> np.ndarray:
        """Moment at the strain of the neutral axis at which the forces vanish."""
        bent = curvature[..., None] * arm
        most = np.abs(bent).max(axis=-1)
        middle = _bisected(lambda e: curve(e[..., None] + bent) @ area, most)
        return curve(middle[..., None] + bent) @ (area * arm)

    curvature = _bisected(lambda k: own * k + soft * sums(k) - reduced, np.abs(reduced))
    return Bent(sums(curvature) / q, off)


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
