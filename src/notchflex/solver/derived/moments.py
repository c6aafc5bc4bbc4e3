"""Error of the internal moment of the strain modes against the moment required by the loads.

The modes satisfy equilibrium only in a weighted mean along a flexure. The largest local error,
|M_internal - M_required| over the largest |M|, shows whether there are enough modes.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.flexure import FlexureState, Rod, fibre_stretch, of_rod
from notchflex.mechanics.flexure.rod_kinematics import node_poses, rod_end
from notchflex.mechanics.motion import Motion
from notchflex.solver.element import Unknowns
from notchflex.solver.residual import Evaluation

# Smaller moments do not count, as a fraction of the largest stiffness of a mode (per rad).
_MIN_RELATIVE_MOMENT = 1e-12


def moment_error(chain: Chain, unknowns: Unknowns, at: Evaluation) -> Float[Array, ""]:
    """Return the largest imbalance of bending moment at any node, over the largest moment."""
    # Bending about x and y in space, about y in the plane.
    bending = np.array([0, 1]) if chain.frame is None else np.array([0])
    internal = at.flexure.resultants[..., bending]
    required = _along_wall(chain, unknowns, at)
    if at.wrenches is not None:
        required = required + jax.vmap(_required)(
            chain.rods, unknowns.modes, at.flexure, at.wrenches.resultant
        )
    real = jnp.any(chain.rods.padding_mask == 0.0, axis=-1)
    has_length = (real[:, None] & (chain.rods.length > 0.0))[..., None]
    carried = 1.0 * jnp.any(chain.rods.basis[..., bending, :] != 0.0, axis=(1, 3))[:, None]
    error = jnp.max(jnp.abs(internal - required[..., bending]) * has_length * carried)
    largest = jnp.max(jnp.abs(required[..., bending]) * has_length)
    # Smaller moments are rounding errors.
    bends = largest > _MIN_RELATIVE_MOMENT * jnp.max(chain.stiffness)
    return jnp.where(bends, error / jnp.where(bends, largest, 1.0), 0.0)


def _required(
    rod: Rod, modes: Float[Array, " modes"], flexure: FlexureState, wrench: Float[Array, " w"]
) -> Float[Array, "nodes w"]:
    """Compute the wrench on all bodies beyond each node, about the node, in its section's axes."""
    assert flexure.pose is not None  # wrenches act on bodies
    assert flexure.configuration is not None
    body, nodes = flexure.pose, node_poses(rod, modes, flexure.configuration)
    if rod.linear_kinematics is not None:
        # Moments of a linear beam are taken on the free shape, under forces in the body's frame.
        is_small = rod.linear_kinematics > 0.0
        shapes = (body, nodes), (_about_free_end(rod, modes), _free_nodes(rod))
        body, nodes = jax.tree.map(lambda large, small: jnp.where(is_small, small, large), *shapes)

    def at_node(node: Motion) -> Array:
        across = node.rotation.T @ body.rotation
        offset = (body.translation - node.translation) @ node.rotation
        return Motion(across, offset).wrench(wrench)

    return jax.vmap(at_node)(nodes)


def _about_free_end(rod: Rod, modes: Float[Array, " modes"]) -> Motion:
    """Compute the pose of the distal body, rotated by the modes but not displaced."""
    end = Motion(rod_end(rod, modes).rotation, rod.curve_offset)
    start = Motion(rod.start_rotation, rod.start_offset)
    return start.then(end).then(Motion(rod.end_rotation, rod.end_offset))


def _free_nodes(rod: Rod) -> Motion:
    """Compute the section poses at the nodes of the free rod, in the proximal frame."""
    start = Motion(rod.start_rotation, rod.start_offset)
    return jax.vmap(start.then)(Motion(rod.node_rotation, rod.node_offset))


def _along_wall(chain: Chain, unknowns: Unknowns, at: Evaluation) -> Float[Array, "n nodes w"]:
    """Compute the resultants required by tendons and contacts that act along the wall."""
    acting = jnp.zeros((chain.flexures, chain.rods.basis.shape[-2]))
    for group, span in zip(chain.groups, at.spans, strict=True):
        if group.fibre is not None:
            weights = of_rod(chain.rods, fibre_stretch(group.fibre))
            acting = acting - jnp.einsum("nt,ntc->nc", span.gap_tension, weights)
    for group, force in zip(chain.contact_pairs, unknowns.contact_force, strict=True):
        fibre = group.fibre(chain.rods)
        if fibre is not None:
            weights = of_rod(chain.rods, fibre_stretch(fibre))
            acting = acting + (force * group.has_contact) * weights
    return jnp.broadcast_to(acting[:, None], at.flexure.resultants.shape)
