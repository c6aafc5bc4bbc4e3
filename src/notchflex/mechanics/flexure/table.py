"""A flexure of a table: a curve of moment over angle, or a stiffness of six directions.

The strains of its rod are the same all along. For small deflections they are the rotation and the
displacement of the far end against the near one, seen at the middle of the rod, over its length,
and the resultants are moment and force about the middle: stiffness times length is the rigidity of
the rod. The curve is a cubic on each interval with the slopes of parabolas through three points,
limited so that it does not fall (Fritsch and Carlson 1980); beyond its ends it goes on straight, so
that a solve passes there, and such states are refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from jaxtyping import Array, Bool, Float

from notchflex._arrays import xp
from notchflex._jax import constant, jax, jnp
from notchflex.mechanics.flexure.notch_rod import (
    STRAIGHT,
    NeutralAxis,
    StrainModes,
    build_rod,
    rod_quadrature,
    shifted,
)
from notchflex.mechanics.flexure.rod import Rod, Site, rod, section_fibres
from notchflex.mechanics.flexure.rod_gap import ring_section
from notchflex.mechanics.material import FibreSection, Flattening, Law, SectionResponse, section_law
from notchflex.mechanics.material.law import Bending, Strain
from notchflex.mechanics.section import FibresAt, two_walls_fibres
from notchflex.robot import TableNotch, Tube

_PLANAR = (1, 3, 5)  # directions of the plane of bending: about y, along x and z
_WEAK = np.arange(6) == 1
_FAR = 10.0  # an angle that no flexure reaches, rad


class TableLaw(Law):
    """Resultants of the section of a table's rod; the torsion constant, 1, is their factor."""

    lumped = True
    length: Float[Array, ""]  # Length of the rod, mm
    matrix: Float[Array, "6 6"]  # At the angle 0; 0 for rigid directions
    # Of each piece of the curve: side of the angles (1 or -1), start and width (rad), three
    # coefficients of the moment beyond the start
    pieces: Float[Array, "6 pieces"]
    ends: Float[Array, " 2"]  # Angles between which the curve is known, rad

    def curve(self, angle: Float[Array, "*shape"]) -> tuple[Array, Array]:
        """Return moment and energy at an angle, of what the stiffness lacks."""
        side, start, width, first, second, third = jnp.reshape(
            self.pieces, (6, *(1,) * angle.ndim, -1)
        )
        beyond = side * angle[..., None] - start
        part = jnp.clip(beyond, 0.0, width)
        moment = part * (first + part * (second + part * third))
        area = part**2 * (first / 2.0 + part * (second / 3.0 + part * (third / 4.0)))
        area = area + moment * (beyond - part)
        linear = self.matrix[1, 1] * angle
        return jnp.sum(side * moment, -1) - linear, jnp.sum(area, -1) - 0.5 * linear * angle

    def respond(self, strain: Strain, section: FibreSection, memory: Any) -> SectionResponse:
        """Return moments and forces."""
        angle, factor = self.length * strain[..., 1], section.torsion_constant
        moment, slope = jax.jvp(lambda at: self.curve(at)[0], (angle,), (jnp.ones_like(angle),))
        added = jnp.where(_WEAK, (factor * moment)[..., None], 0.0)
        resultants = self.elastic(jnp.moveaxis(strain, -1, 0), section) + added
        slope = factor * self.length * (self.matrix[1, 1] + slope)
        return SectionResponse(resultants, memory, slope)

    def elastic(self, strain: Strain, section: FibreSection) -> Strain:
        """Return those of the stiffness, of components first."""
        resultants = xp.einsum("ik,k...->...i", self.matrix, self.length * strain)
        return section.torsion_constant[..., None] * resultants

    def tangent(self, strain: Strain, slope: Array, section: FibreSection) -> Strain:
        """Return the change of the resultants with many strains, of the slope about y."""
        factor = section.torsion_constant * self.length
        columns = jax.tree.map(lambda leaf: leaf[..., None], section)
        added = jnp.where(_WEAK, (slope - factor * self.matrix[1, 1]) * strain, 0.0)
        return self.elastic(strain.T, columns) + added

    def stored_energy_density(
        self, strain: Strain, section: FibreSection, memory: Any
    ) -> tuple[Array, Flattening]:
        """Return the energy per length; nothing flattens."""
        energy = self.curve(self.length * strain[1])[1] / self.length * section.torsion_constant
        none = Flattening(*[jnp.zeros_like(energy)] * 4)
        return energy + 0.5 * self.elastic(strain, section) @ strain, none

    def bent(self, reduced: Array, section: FibreSection, memory: Any) -> Bending:
        """Return nothing: the strains of the section are not known."""
        none = jnp.zeros_like(reduced)
        return Bending(none, none, memory, none, none)

    def covers(self, strain: Strain, section: FibreSection) -> Bool[Array, "*shape"]:
        """Return whether the curve reaches as far as a section is bent."""
        angle = self.length * strain[..., 1]
        return (self.ends[0] <= angle) & (angle <= self.ends[1])


@lru_cache(maxsize=64)
def _pieces(angles: Sequence[float], moments: Sequence[float]) -> Float[np.ndarray, "6 pieces"]:
    """Return the pieces of the curve through points, first those that begin at the angle 0."""
    angle, moment = np.radians(angles), np.array(moments)
    width, secant = np.diff(angle), np.diff(moment) / np.diff(angle)
    steepest = 3.0 * np.minimum(np.append(secant, np.inf), np.append(np.inf, secant))
    slope = np.clip(np.gradient(moment, angle, edge_order=2), 0.0, steepest)
    right = angle[:-1] >= 0.0
    near, far = np.where(right, [slope[:-1], slope[1:]], [slope[1:], slope[:-1]])
    second, third = (
        (3.0 * secant - 2.0 * near - far) / width,
        (near + far - 2.0 * secant) / width**2,
    )
    start = np.where(right, angle[:-1], -angle[1:])
    inside = np.stack([np.where(right, 1.0, -1.0), start, width, near, second, third])
    outer, none = np.array([angle[-1], -angle[0]]), np.zeros(2)
    beyond = np.stack([[1.0, -1.0], outer, none + _FAR, slope[[-1, 0]], none, none])
    pieces = np.hstack([inside[:, np.argsort(start)], beyond])
    # Numbers of pieces are powers of two, so that tables share programs.
    count = pieces.shape[1]
    return np.pad(pieces, ((0, 0), (0, (1 << (count - 1).bit_length()) - count)))


def _stiffness(notch: TableNotch) -> Float[np.ndarray, "6 6"]:
    """Return the stiffness at the angle 0, infinite where a flexure is rigid."""
    numbers = np.array(notch.stiffness or [np.inf] * 6)
    matrix = numbers.reshape(6, 6) if len(numbers) == 36 else np.diag(numbers)
    matrix[1, 1] = _pieces(*notch.curve)[3, 0]
    return matrix


@section_law.register
def _(notch: TableNotch) -> TableLaw:
    matrix, (angles, _) = _stiffness(notch), notch.curve
    finite = np.where(np.isinf(matrix), 0.0, matrix)
    ends = np.radians([angles[0], angles[-1]])
    return TableLaw(*map(constant, (notch.length, finite, _pieces(*notch.curve), ends)))


@rod.register
def _(notch: TableNotch, tube: Tube, refinement: int = 0, site: Site | None = None) -> Rod:
    points = rod_quadrature((0.0, notch.length), (1,), (10,))
    free = [k for k in (*_PLANAR, 0, 2, 4) if np.isfinite(_stiffness(notch)[k, k])]
    few = sum(k in _PLANAR for k in free) if notch.stays_in_plane else len(free)
    everywhere = np.ones(len(points.unit.positions))
    basis = everywhere[:, None, None] * np.eye(6)[:, free] / notch.length
    strain = STRAIGHT + xp.radians(notch.precurvature_deg) * basis[..., 0]
    offset, radius = notch.axis_offset, tube.outer_radius
    closing = notch.closing_angle_deg
    section = replace(
        ring_section(tube.outer_diameter, tube.inner_diameter),
        torsion_constant=constant(1.0),
        edge_spine=constant(radius - offset),
        edge_near=constant(radius + offset),
    )
    return build_rod(
        NeutralAxis(points, shifted(-offset), shifted(offset), strain=strain),
        section,
        StrainModes(constant(basis), (few, few, len(free))),
        None if closing is None else notch.length / xp.radians(closing),
        direction_deg=notch.direction_deg,
    )


@section_fibres.register
def _(notch: TableNotch, tube: Tube) -> FibresAt:
    # Fibres of any rectangle: where other notches have a law of fibres, it is evaluated here too.
    return two_walls_fibres
