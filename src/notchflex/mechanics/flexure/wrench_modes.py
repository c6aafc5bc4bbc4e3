"""Strain modes of a curved rod: strains by forces and moments on its end.

A moment m and a force n on the end of a rod act on a section as the force n and the moment
m + lever x n. For small displacements the strains by these resultants are exact, with one constant
for each component of m and n; only the change of the levers is missing, which is of second order.
The direction of n couples stretch and shear (Gao 2017, eq. 1-5): independent polynomials for them
are far less accurate.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from notchflex._arrays import decide, xp
from notchflex.mechanics.flexure.rod_kinematics import legendre
from notchflex.mechanics.material import FibreSection
from notchflex.mechanics.motion import Motion

_X, _Y, _Z = xp.eye(3)


def wrench_modes(
    poses: Motion,
    part: Float[np.ndarray, " nodes"],
    length: Float[np.ndarray, " nodes"],
    section: FibreSection,
    middle: Float[np.ndarray, " 3"],
    moment_modes: int,
    force_modes: int,
    poisson_ratio: float,
) -> Float[np.ndarray, "nodes 6 modes"]:
    """Compute the modes of a rod in the x-z plane, those out of the plane last.

    In the plane the moment about y is constant, or goes with a lever along x or z, and from the
    fourth mode on with the Legendre polynomials P_2, P_3 ... of arc length (P_1 is nearly a
    lever); then come forces along x and along z, times P_0, P_1 ... in pairs. Out of the plane
    come a constant moment about x, one about z and the moment of a sideways force at the middle,
    then moments about x and z times P_2, P_3 ... as far as in the plane, and that force.

    Args:
        poses: Pose of the free rod at every node, base to tip, as leading axis.
        part: Position of every node along the rod, from -1 to 1.
        length: Quadrature weight of each node, mm.
        section: Its section at every node, with the shear centre in the centroid.
        middle: Point from which levers are counted, mm.
        moment_modes: Modes of the moment in the plane, 3 or more.
        force_modes: Pairs of modes of the force in the plane.
        poisson_ratio: For the ratio of the moduli.

    Returns:
        Strain at each node per unit of mode, which is about 1 rad of the end for a moment, and a
        mean strain of 1 for a force.
    """
    whole = length.sum()
    rotation, lever = poses.rotation, poses.translation - middle
    reach = xp.abs(lever).max(axis=0)
    polynomials = legendre(part, max(moment_modes - 1, force_modes))

    moment = [xp.ones_like(length), lever[:, 0] / reach[0], lever[:, 2] / reach[2]]
    moment += [polynomials[:, degree] for degree in range(2, moment_modes - 1)]
    force = [(polynomials[:, k], along) for k in range(force_modes) for along in (_X, _Z)]
    none = xp.zeros_like(lever)
    wrenches = [(size[:, None] * _Y, none) for size in moment]
    wrenches += [(none, size[:, None] * along) for size, along in force]
    sideways = xp.cross(lever, _Y) / reach[0]
    out_of_plane = [about + none for about in (_X, _Z, sideways)]
    out_of_plane += [
        polynomials[:, degree, None] * about
        for degree in range(2, moment_modes - 1)
        for about in (_X, _Z)
    ]
    wrenches += [(about, none) for about in out_of_plane] + [(none, _Y + none)]
    of_force = xp.arange(len(wrenches)) >= moment_modes
    of_force[-len(out_of_plane) - 1 : -1] = False

    parts = xp.stack([part for wrench in wrenches for part in wrench])
    in_frame = xp.einsum("kji,mpkj->kmpi", rotation, parts.reshape(len(wrenches), 2, -1, 3))
    in_frame = in_frame.reshape(len(length), len(wrenches), 6)
    strain = _strains(section, poisson_ratio, in_frame)
    work = xp.einsum("k,kmc,kmc->m", length, in_frame, strain)
    return xp.moveaxis(strain * (xp.where(of_force, whole, 1.0) / work)[:, None], 1, 2)


def _strains(
    section: FibreSection, poisson_ratio: float, resultants: Float[np.ndarray, "nodes modes 6"]
) -> Float[np.ndarray, "nodes modes 6"]:
    """Compute strains by resultants, times Young's modulus."""
    compliance = _compliance(section, poisson_ratio)[:, None]
    strain = compliance * resultants
    if section.ends is None or not decide(xp.any(section.ends.oblique)):
        return strain
    oblique = xp.asarray(section.ends.oblique)[:, None]
    # The inverse of the stiffness of sideways bending and torsion together.
    part = 1.0 - oblique**2 * compliance[..., 0] * compliance[..., 2]
    crossed = oblique * compliance[..., 0] * compliance[..., 2]
    about_x = (strain[..., 0] - crossed * resultants[..., 2]) / part
    twist = (strain[..., 2] - crossed * resultants[..., 0]) / part
    return xp.stack([about_x, strain[..., 1], twist, *xp.moveaxis(strain[..., 3:], -1, 0)], axis=-1)


def _compliance(section: FibreSection, poisson_ratio: float) -> Float[np.ndarray, "nodes 6"]:
    """Compute strains per resultant, times Young's modulus."""
    ratio = 2.0 * (1.0 + poisson_ratio)  # E / G
    stiffness = [
        section.second_moment_strong,
        section.second_moment_weak,
        section.torsion_constant / ratio,
        section.area / ratio,
        section.area / ratio,
        section.area,
    ]
    compliance = 1.0 / xp.stack([xp.asarray(one) for one in stiffness], axis=-1)
    if (ends := section.ends) is None:
        return compliance
    added = (ends.strong, ends.weak, ends.torsion, ends.push, ends.sway, ends.axial)
    parts = xp.broadcast_arrays(*map(xp.asarray, added))
    return compliance * (1.0 + xp.stack(parts, axis=-1))
