r"""Compliance of a strip with its roots out of its plane, from its compliance in the plane.

Turned about the strip's axis or the tube's, the strip's two walls, the distance c from the tube
axis, move in the plane against each other: one up and one down, or one to each side. By their
compliances $C_{zz}$, $C_{xx}$, $C_{xz}$ together in the plane (z along the tube, x along the
strip) that is

$$\frac1{C_{\text{strip}}} = \gamma\frac{c^2}{C_{zz}} + \alpha\frac{2\,G J_w}{L},\qquad
C_{\text{tube}} = \Bigl(\beta_0+\beta_1\frac{r_i}{r_o}\Bigr)\frac{C_{xx}}{c^2},\qquad
C_{\text{both}} = -\eta\,\frac{C_{xz}}{c^2},$$

where the walls, of the torsion constant $J_w$ and the length L, are twisted besides. The constants
were fitted to the cells of finite elements that `rooted_strip` names, the papers' link counting
four times. Half of each is put into the strip and half, with what couples the two, into the runs
along the walls: that stays positive definite while the coupling is below half of the root of the
product; the cells have 0.29 at most, and more than 0.49 is not taken.
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from notchflex._jax import constant
from notchflex.mechanics.material import FibreSection
from notchflex.mechanics.motion import Motion
from notchflex.mechanics.section.two_walls import rectangle_torsion_constant


class Sideways(NamedTuple):
    """Constants of the rule, for sharp or for round ends of slots.

    Attributes:
        against: γ, of the walls moved against each other along the tube.
        twist: α, of their torsion.
        across: β₀ and β₁, of the walls moved against each other along the strip.
        coupling: η.
    """

    against: float
    twist: float
    across: tuple[float, float]
    coupling: float


ROUND = Sideways(0.9841, 0.6533, (0.9868, 1.4764), 0.7012)
SHARP = Sideways(0.9841, 1.1015, (0.6014, 0.8737), 0.6053)
# Shares of the compliances to moments about the strip and the tube that lie in the walls.
_ON_WALLS = (0.5, 0.5)
# Most of the coupling, over the root of the product of what it couples.
_MAX_COUPLING = 0.49


class Walls(NamedTuple):
    """The two walls of a strip.

    Attributes:
        outer: Outer radius of the tube, mm.
        inner: Inner radius, mm.
        width: Width of each wall, mm.
        thickness: Thickness of the strip, mm.
        length: Length over which they are twisted, mm.
    """

    outer: float
    inner: float
    width: float
    thickness: float
    length: float


def plane_compliance(
    poses: Motion,
    length: Float[np.ndarray, " nodes"],
    section: FibreSection,
    middle: Float[np.ndarray, " 3"],
    poisson_ratio: float,
) -> Float[np.ndarray, "2 2"]:
    """Compute E times the compliance to forces across and along the tube at the middle.

    Args:
        poses: Pose of the free rod at every node.
        length: Length that each node stands for, mm.
        section: Its section at every node.
        middle: Middle of the strip, mm.
        poisson_ratio: For the ratio of the moduli.
    """
    ratio, ends = 2.0 * (1.0 + poisson_ratio), section.ends
    assert ends is not None
    bending = (1.0 + np.asarray(ends.weak)) / np.asarray(section.second_moment_weak)
    along = (1.0 + np.asarray(ends.axial)) / np.asarray(section.area)
    across = ratio * (1.0 + np.asarray(ends.push)) / np.asarray(section.area)
    lever = np.asarray(poses.translation) - middle
    # Of unit forces along x and z: moments about y, then the forces in the frames of the sections.
    moment = np.stack([-lever[:, 2], lever[:, 0]], axis=-1)
    force = np.asarray(poses.rotation)[:, [0, 2]]
    parts = (bending, moment), (across, force[..., 0]), (along, force[..., 2])
    return sum(
        (np.einsum("k,ki,kj->ij", length * soft, by, by) for soft, by in parts), np.zeros((2, 2))
    )


def turned_compliance(
    walls: Walls, plane: Float[np.ndarray, "2 2"], rule: Sideways, poisson_ratio: float
) -> tuple[float, float, float]:
    """Compute E times the compliance to moments about the strip and the tube, and of both.

    Args:
        walls: The walls.
        plane: E times their compliance in the plane, see `plane_compliance`.
        rule: The constants.
        poisson_ratio: For the ratio of the moduli.
    """
    arm = 0.25 * (walls.outer + walls.inner) ** 2
    torsion = 2.0 * float(rectangle_torsion_constant(walls.width, walls.thickness))
    twisted = rule.twist * torsion / (2.0 * (1.0 + poisson_ratio)) / walls.length
    strip = 1.0 / (rule.against * arm / plane[1, 1] + twisted)
    tube = (rule.across[0] + rule.across[1] * walls.inner / walls.outer) * plane[0, 0] / arm
    limit = _MAX_COUPLING * float(np.sqrt(strip * tube))
    return strip, tube, float(np.clip(-rule.coupling * plane[0, 1] / arm, -limit, limit))


def with_sideways(
    section: FibreSection,
    length: Float[np.ndarray, " nodes"],
    on_wall: Float[np.ndarray, " nodes"],
    turned: tuple[float, float, float],
    poisson_ratio: float,
) -> FibreSection:
    """Put the compliance to moments out of the plane into the sections of a rod.

    Args:
        section: Sections at the nodes, those on the walls along the tube.
        length: Length that each node stands for, mm.
        on_wall: Whether each lies on a wall.
        turned: E times the compliance, as `turned_compliance` finds it.
        poisson_ratio: For the ratio of the moduli.
    """
    strip, tube, both = turned
    assert section.ends is not None
    wall = length[on_wall].sum()
    rest = length[~on_wall].sum()
    of_strip, of_tube = _ON_WALLS
    block = np.linalg.inv(np.array([[of_strip * strip, both], [both, of_tube * tube]]) / wall)
    # About x and z of the section: strip and tube on a wall, tube and strip elsewhere.
    about_x = np.where(on_wall, block[0, 0], rest / ((1.0 - of_tube) * tube))
    about_z = np.where(on_wall, block[1, 1], rest / ((1.0 - of_strip) * strip))
    torsion = np.asarray(section.torsion_constant) / (2.0 * (1.0 + poisson_ratio))
    ends = dataclasses.replace(
        section.ends,
        strong=constant(np.asarray(section.second_moment_strong) / about_x - 1.0),
        torsion=constant(torsion / about_z - 1.0),
        oblique=constant(np.where(on_wall, block[0, 1], 0.0)),
    )
    return dataclasses.replace(section, ends=ends)
