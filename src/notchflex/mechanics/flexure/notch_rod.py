"""Rod of a notch from neutral axis, section, strain modes and closure.

A new notch describes these in the frame of a notch of direction 0: x toward the side to which it
bends, z along the tube, the origin on the tube axis at the proximal face. `build_rod` turns them
to the notch's direction and fills the arrays of a `Rod`.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float
from numpy.typing import ArrayLike

from notchflex._arrays import cached, xp
from notchflex._jax import constant, jax
from notchflex.mechanics.flexure.rod import Rod
from notchflex.mechanics.material import FibreSection
from notchflex.mechanics.material.linear import LinearLaw
from notchflex.mechanics.motion import Motion, outer_twists, rotation_about
from notchflex.mechanics.section import Section, gauss_on, legendre, leggauss, up_to

# Quadrature of a rod.
#
# A rod consists of pieces on which its strains are smooth. Strains and resultants have their own
# nodes, the pose has others, and points between neighbours of these integrate the rotation exactly.
# A flexure evaluates its strains at all points (`every`) at once.


def gauss_nodes(ends: Any, count: int) -> tuple[Array, Array]:
    """Return Gauss's nodes and weights in every interval between neighbouring numbers."""
    ends = xp.asarray(ends, float)[:, None]
    positions, weights = gauss_on(ends[:-1], ends[1:], count)
    return positions.ravel(), weights.ravel()


_BETWEEN = 4  # Gauss's points between neighbouring nodes of the rotation
_BEFORE = up_to(_BETWEEN, gauss_on(0.0, 1.0, _BETWEEN)[0])


@dataclass(frozen=True)
class RodQuadrature:
    """Quadrature nodes along a rod.

    Attributes:
        ends: Ends of its pieces, from 0 to its length, mm.
        nodes: Gauss's nodes of strains and resultants on each piece.
        poses: Those of the pose.
    """

    ends: tuple[float, ...]
    nodes: tuple[int, ...]
    poses: tuple[int, ...]

    def _pieces(self, counts: tuple[int, ...]) -> list[tuple[Array, Array]]:
        pairs = zip(self.ends[:-1], self.ends[1:], counts, strict=True)
        return [gauss_nodes((low, high), count) for low, high, count in pairs]

    @cached_property
    def at_nodes(self) -> tuple[Float[Array, " nodes"], Float[Array, " nodes"]]:
        """Nodes of the strains, and their weights, mm."""
        positions, lengths = map(xp.concatenate, zip(*self._pieces(self.nodes), strict=True))
        return positions, lengths

    @cached_property
    def at_poses(self) -> tuple[Float[Array, " gauss"], Float[Array, " gauss"]]:
        """Nodes of the pose, and their weights, mm."""
        # Between pieces there is one more node, of weight 0: rotations are integrated from node to
        # node, and strains may jump there.
        (positions, lengths), *others = self._pieces(self.poses)
        for low, (more, weights) in zip(self.ends[1:], others, strict=False):
            positions = xp.concatenate([positions, xp.reshape(low, 1), more])
            lengths = xp.concatenate([lengths, np.zeros(1), weights])
        return positions, lengths

    @cached_property
    def between(self) -> tuple[Float[Array, " fine"], Float[Array, " fine"]]:
        """Points between the neighbours of start, nodes of the pose and end, and their lengths."""
        ends = xp.asarray(self.ends)
        return gauss_nodes(xp.concatenate([ends[:1], self.at_poses[0], ends[-1:]]), _BETWEEN)

    @cached_property
    def before(self) -> tuple[Float[Array, " more"], Float[Array, " more"]]:
        """Points between the start, the nodes of the strains and the ends, and their lengths."""
        return gauss_nodes(self._stops, _BETWEEN)

    @cached_property
    def _stops(self) -> Float[Array, " stops"]:
        """The start, the nodes of the strains, and the ends between pieces, rising."""
        nodes = xp.split(self.at_nodes[0], np.cumsum(self.nodes)[:-1])
        starts = xp.asarray(self.ends)[:-1, None]
        return xp.concatenate([part for pair in zip(starts, nodes, strict=True) for part in pair])

    @cached_property
    def unit(self) -> RodQuadrature:
        """The same with pieces of length 1: for what their lengths do not change."""
        return rod_quadrature(tuple(map(float, range(len(self.ends)))), self.nodes, self.poses)

    @cached_property
    def positions(self) -> Float[Array, " every"]:
        """All points, in the order of the properties above."""
        parts = (self.at_nodes, self.at_poses, self.between, self.before)
        return xp.concatenate([positions for positions, _ in parts])

    @property
    def weight(self) -> Float[Array, " every"]:
        """Weights of all points in an integral over the nodes of the strains."""
        weights = self.at_nodes[1]
        return xp.pad(weights, (0, len(self.positions) - len(weights)))

    def fields(
        self,
        curve: Motion,
        basis: Float[Array, "every 6 modes"],
        reference: Float[Array, "every 6"],
    ) -> dict[str, Any]:
        """Return the fields of a rod for its strains and its pose."""
        twists = outer_twists(curve, xp.concatenate([reference[..., None], basis], axis=-1))
        counts = [len(part[0]) for part in (self.at_nodes, self.at_poses, self.between)]
        _, steps, between, before = xp.split(twists, xp.cumsum(counts))
        turns = _grouped(between[:, :3], self.between[1])
        at_node = slice(counts[0])
        unit = self.unit
        stop = np.searchsorted(unit._stops, unit.at_nodes[0]) - 1
        return {
            "length": self.at_nodes[1],
            "basis": basis[at_node],
            "turn": xp.cumsum(turns, axis=0),
            "turn_pair": _pairs(between[:, :3], self.between[1]),
            "step": self.at_poses[1][:, None, None] * steps[:, 3:],
            "node_turn": xp.cumsum(_grouped(before[:, :3], self.before[1]), axis=0)[stop],
            "node_index": np.searchsorted(unit.at_poses[0], unit.at_nodes[0], side="right"),
            "node_reach": unit._reach,
            "node_rotation": curve.rotation[at_node],
            "node_offset": curve.translation[at_node],
        }

    @cached_property
    def _reach(self) -> Float[Array, "nodes gauss"]:
        """Compute the fraction of each pose node's step before each node of the strains."""
        nodes = self.at_nodes[0]
        columns = []
        for low, high, count in zip(self.ends[:-1], self.ends[1:], self.poses, strict=True):
            part = xp.clip((nodes - low) / (high - low), 0.0, 1.0)
            columns += [up_to(count, part) / (0.5 * leggauss(count)[1]), xp.zeros((len(nodes), 1))]
        return xp.concatenate(columns[:-1], axis=1)


def _grouped(values: Float[Array, "fine ..."], lengths: Float[Array, " fine"]) -> Any:
    """Integrate over every run of points."""
    weighted = lengths.reshape(-1, *(1,) * (values.ndim - 1)) * values
    return weighted.reshape(-1, _BETWEEN, *values.shape[1:]).sum(axis=1)


def _pairs(
    turning: Float[Array, "fine 3 hat"], lengths: Float[Array, " fine"]
) -> Float[Array, "places 3 hat hat"]:
    """Compute the second term of the Magnus series on every run of points, for pairs of modes."""
    # It is half the integral of a(t) x a(s) over t < s, for a motion in the moving frame.
    modes = turning.shape[-1]
    rates, weights = turning.reshape(-1, _BETWEEN, 3 * modes), lengths.reshape(-1, _BETWEEN, 1)
    so_far = weights.sum(axis=1, keepdims=True) * (_BEFORE @ rates)
    products = (xp.swapaxes(weights * so_far, 1, 2) @ rates).reshape(-1, 3, modes, 3, modes)
    pairs = 0.5 * xp.stack(
        [products[:, k - 2, :, k - 1] - products[:, k - 1, :, k - 2] for k in range(3)], axis=1
    )
    return 0.5 * (pairs + xp.swapaxes(pairs, -1, -2))


rod_quadrature = cached(64)(RodQuadrature)
"""The same, kept: notches that only differ by site share it."""

_ABOUT_X, _ABOUT_Y, _ABOUT_Z, _ALONG_X, _ALONG_Y, _ALONG_Z = xp.eye(6)
STRAIGHT = _ALONG_Z
"""Strains of a straight, unloaded rod: a stretch of 1 along z."""


class NeutralAxis(NamedTuple):
    """Neutral axis of a notch, along which its rod is integrated (mm).

    Attributes:
        quadrature: Points along it.
        start: Pose of the first section; its z is along the rod, its x points to the cut side.
        end: Pose of the distal body, in the frame of the last section.
        curve: Poses along the free axis in the frame of its start, at `quadrature.positions` and
            last at its end: only motion relative to it is then integrated. None integrates all.
        strain: Strains of the free rod at `quadrature.positions`, (points, 6); None is straight.
    """

    quadrature: RodQuadrature
    start: Motion
    end: Motion
    curve: Motion | None = None
    strain: Float[Array, "every 6"] | None = None


class StrainModes(NamedTuple):
    """Strain modes of a rod.

    Attributes:
        basis: Strains (about x, y, z; along x, y, z) at `quadrature.positions` per unit of a mode.
        levels: Numbers of modes, from the first, for tendons alone, for loads in the plane of
            bending (about y), and for loads in space (all).
    """

    basis: Float[Array, "every 6 modes"]
    levels: tuple[int, int, int]


def shifted(x: float = 0.0, z: float = 0.0) -> Motion:
    """Make the pose of a frame displaced along x and z, mm, without rotation."""
    return Motion(constant(xp.eye(3)), constant([x, 0.0, z]))


def between(outer: Motion, inner: Motion) -> Motion:
    """Return the inner pose, or many, in the outer frame."""
    return Motion(outer.rotation.T @ inner.rotation, outer.point_inside(inner.translation))


def legendre_modes(
    quadrature: RodQuadrature,
    bending: int,
    sideways: int,
    twist: int,
    *,
    tendon_modes: int | None = None,
    shear_centre: float = 0.0,
    shear: tuple[float, float] = (0.0, 0.0),
) -> StrainModes:
    """Make modes of curvature and twist that are Legendre polynomials of arc length.

    Args:
        quadrature: Points along the rod.
        bending: Polynomials of the curvature about y, in the plane of bending.
        sideways: Those of the curvature about x.
        twist: Those of the twist, about the shear centre.
        tendon_modes: Bending modes that tendons alone need; all where not given.
        shear_centre: Distance of the shear centre from the neutral axis, mm.
        shear: Displacement of the rod's end, mm, in the plane of bending and sideways, by a
            force across the rod whose moment has the curvature P_1/length. That shear is constant
            along the rod and belongs to the linear mode of bending.

    Returns:
        The modes; a unit of the first bends the rod by 1 rad.
    """
    length = quadrature.ends[-1]
    polynomials = legendre(2.0 * quadrature.positions / length - 1.0, max(bending, sideways, twist))
    # Of dM/ds = n x e_z: a force along x lowers the moment about y, along y it raises that about x.
    sheared = {0: -shear[0] * _ALONG_X, 1: shear[1] * _ALONG_Y}
    # Twist about the shear centre shears the neutral axis, which lies off it, sideways.
    turning = _ABOUT_Z + shear_centre * _ALONG_Y
    strains = [
        polynomials[:, degree, None] * strain + (sheared.get(number, 0.0) if degree == 1 else 0.0)
        for number, (strain, count) in enumerate(
            ((_ABOUT_Y, bending), (_ABOUT_X, sideways), (turning, twist))
        )
        for degree in range(count)
    ]
    modes = xp.stack(strains, axis=-1)
    fewest = bending if tendon_modes is None else tendon_modes
    return StrainModes(modes / length, (fewest, bending, modes.shape[-1]))


def about_neutral_axis(section: Section, torsion_constant: ArrayLike | None = None) -> FibreSection:
    """Refer a section to its neutral axis; another torsion constant may replace its own, mm^4."""
    values = section._asdict()
    values["shear_centre"] = section.shear_centre - values.pop("centroid")
    if torsion_constant is not None:
        values["torsion_constant"] = constant(torsion_constant)
    return FibreSection(**values)


def build_rod(
    axis: NeutralAxis,
    section: FibreSection,
    modes: StrainModes,
    closure: float | None = None,
    *,
    stop_flexibility: float = 0.0,
    direction_deg: float = 0.0,
    linear_kinematics: bool = False,
    has_chord: bool = False,
) -> Rod:
    """Build the rod of a notch.

    Args:
        axis: Its neutral axis.
        section: Its section: one for the whole rod, or one per point of `quadrature.positions`.
        modes: Its strain modes.
        closure: Distance across the section, from the neutral axis toward the cut, of the fibre
            that has no length left when the notch is closed, mm. None where the notch has no solid
            spine: then the edges of its openings (`Notch.openings`) meet.
        stop_flexibility: Flexibility of the closed notch over that of the open one.
        direction_deg: Side toward which the notch bends, deg.
        linear_kinematics: Whether displacements are proportional to the strains.
        has_chord: Whether the angle of the chord from start to end is an output (Liu 2022).

    Returns:
        The rod.
    """
    points = axis.quadrature
    nodes = len(points.at_nodes[0])
    strain = xp.tile(STRAIGHT, (len(points.positions), 1)) if axis.strain is None else axis.strain
    # Written out, so that opposite directions are exact mirror images.
    cosine, sine = xp.cos(xp.radians(direction_deg)), xp.sin(xp.radians(direction_deg))
    turned = xp.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    curve, reference = axis.curve, 0.0 * strain
    if curve is None:  # a point, so that all motion is relative to it
        count = len(strain) + 1
        curve, reference = Motion(xp.stack([xp.eye(3)] * count), xp.zeros((count, 3))), strain
    curve_end = curve.pick(-1)

    def at_nodes(values: Array, axes: int = 0) -> Array:
        values = constant(values)
        is_uniform = values.ndim == axes
        return xp.broadcast_to(values, (nodes, *values.shape)) if is_uniform else values[:nodes]

    return Rod(
        start_rotation=turned @ axis.start.rotation,
        start_offset=turned @ axis.start.translation,
        curve_rotation=curve_end.rotation,
        curve_offset=curve_end.translation,
        end_rotation=axis.end.rotation @ turned.T,
        end_offset=axis.end.translation,
        **points.fields(curve.pick(slice(-1)), modes.basis, reference),
        reference_strain=strain[:nodes],
        section=dataclasses.replace(
            jax.tree.map(at_nodes, dataclasses.replace(section, fibres=None)),
            fibres=jax.tree.map(partial(at_nodes, axes=1), section.fibres),
        ),
        closure=constant([0.0 if closure is None else closure, 0.0]),
        has_closure=constant(float(closure is not None)),
        stop_flexibility=constant(stop_flexibility),
        linear_kinematics=constant(float(linear_kinematics)),
        chord=constant(float(has_chord)),
        padding_mask=xp.zeros(modes.basis.shape[-1]),
        levels=modes.levels,
    )


# Strain modes of a curved rod: strains by forces and moments on its end.
#
# A moment m and a force n on the end of a rod act on a section as the force n and the moment m +
# lever x n. For small displacements the strains by these resultants are exact, with one constant
# for each component of m and n; only the change of the levers is missing, which is of second order.
# The direction of n couples stretch and shear (Gao 2017, eq. 1-5): independent polynomials for them
# are far less accurate.


def course_poses(
    along: Array, above: Array, heading: Array, middle: Float[Array, " 3"], hand: float
) -> Motion:
    """Compute poses along a free rod in the x-z plane: z along it, y out of the plane."""
    # Along the strip and along the tube from its middle, mm; the mirror image for `hand` -1.
    position = xp.stack([-hand * along, 0.0 * along, above], axis=-1)
    turns = rotation_about(constant((hand * (heading - 0.5 * np.pi))[:, None] * _ABOUT_Y[:3]))
    return Motion(turns, constant(middle + position))


def course_rod(
    points: RodQuadrature,
    poses: Motion,
    section: FibreSection,
    middle: Float[Array, " 3"],
    mode_counts: tuple[int, int],
    distal: float,
    poisson_ratio: float,
    free: Array | None = None,
    **options: Any,
) -> Rod:
    """Build the rod of a strip from wall to wall; the distal frame is `distal` mm up the tube."""
    # The poses are those at all points, at the start and at the end.
    along, start, end = map(poses.pick, (slice(-2), -2, -1))
    moment_modes, force_modes = mode_counts
    # In the plane the moment about y is constant, or goes with a lever along x or z, and from the
    # fourth mode on with the Legendre polynomials P_2, P_3 ... of arc length (P_1 is nearly a
    # lever); then come forces along x and along z, times P_0, P_1 ... in pairs. Out of the plane
    # come a constant moment about x, one about z and the moment of a sideways force at the middle,
    # then moments about x and z times P_2, P_3 ... as far as in the plane, and that force. A unit
    # is about 1 rad of the end for a moment, and a mean strain of 1 for a force.
    length, lever = points.weight, along.translation - middle
    reach = xp.abs(lever).max(axis=0)
    polynomials = legendre(
        2.0 * points.positions / points.ends[-1] - 1.0, max(moment_modes - 1, force_modes)
    )[..., None]
    higher = [polynomials[:, degree] for degree in range(2, moment_modes - 1)]
    lever_x, lever_z = lever[:, :1], lever[:, 2:]
    sizes = [polynomials[:, 0], lever_x / reach[0], lever_z / reach[2], *higher]
    bending = [size * _ABOUT_Y for size in sizes]
    pulls = [polynomials[:, k] * pull for k in range(force_modes) for pull in (_ALONG_X, _ALONG_Z)]
    sideways = [size * about for size in sizes[:1] + higher for about in (_ABOUT_X, _ABOUT_Z)]
    sideways.insert(2, (lever_x * _ABOUT_Z - lever_z * _ABOUT_X) / reach[0])
    wrenches = [*bending, *pulls, *sideways, polynomials[:, 0] * _ALONG_Y]
    counts = len(bending), len(pulls), len(sideways), 1
    of_force = np.repeat([False, True, False, True], counts)

    resultants = in_sections(along, wrenches)
    strain = strains_of(section, poisson_ratio, resultants)
    work = xp.einsum("k,kmc,kmc->m", length, resultants, strain)
    scaled = strain * (xp.where(of_force, length.sum(), 1.0) / work)[:, None]
    in_plane = len(bending) + len(pulls)
    modes = StrainModes(xp.moveaxis(scaled, 1, 2), (in_plane, in_plane, len(wrenches)))
    to_end = Motion(*(xp.concatenate([part[:-2], part[-1:]]) for part in poses))
    curve, body = between(start, to_end), between(end, shifted(z=distal))
    return build_rod(NeutralAxis(points, start, body, curve, free), section, modes, **options)


def unit_forces(poses: Motion, middle: Float[Array, " 3"]) -> Float[Array, "nodes wrenches 6"]:
    """Compute the resultants of unit forces at the middle, along x and along z."""
    lever = poses.translation - middle
    forces = [_ALONG_X - lever[:, 2:] * _ABOUT_Y, _ALONG_Z + lever[:, :1] * _ABOUT_Y]
    return in_sections(poses, forces)


def in_sections(
    poses: Motion, wrenches: list[Float[Array, "nodes 6"]]
) -> Float[Array, "nodes wrenches 6"]:
    """Turn moments and forces on sections to the axes of the sections."""
    pairs = xp.stack(wrenches).reshape(len(wrenches), -1, 2, 3)
    turned = xp.einsum("kji,mkpj->kmpi", poses.rotation, pairs)
    return turned.reshape(*turned.shape[:2], 6)


# Only sideways bending and torsion are coupled, with each other.
_COUPLED, _PARTNER = xp.array([1.0, 0.0, 1.0, 0.0, 0.0, 0.0]), np.array([2, 1, 0, 3, 4, 5])


def strains_of(
    section: FibreSection, poisson_ratio: float, resultants: Float[Array, "nodes wrenches 6"]
) -> Float[Array, "nodes wrenches 6"]:
    """Compute strains by resultants, times Young's modulus."""
    law = LinearLaw(constant(1.0), constant(0.5 / (1.0 + poisson_ratio)))
    stiffness = law.stiffness(section)
    direct = xp.diagonal(stiffness, axis1=-2, axis2=-1)
    mixed = stiffness[:, 0, 2, None] * _COUPLED
    part = mixed / direct[:, _PARTNER]
    free = resultants - part[:, None] * resultants[..., _PARTNER]
    return free / (direct - part * mixed)[:, None]
