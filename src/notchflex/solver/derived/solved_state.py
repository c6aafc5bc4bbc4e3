"""A solved state in the frame of the base, with intermediate results for the quantities."""

from __future__ import annotations

from functools import cached_property

from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex._quantity import REGISTERED
from notchflex.loads.applied import BodyLoads, body_wrench
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.flexure import FlexureState, in_space, relative_pose
from notchflex.mechanics.material import Flattening
from notchflex.mechanics.motion import IN_PLANE, Motion, wrench_at
from notchflex.solver.body_poses import body_poses
from notchflex.solver.element import Unknowns
from notchflex.solver.residual import BaseReaction, Evaluation, evaluate
from notchflex.solver.solver_state import SolverState
from notchflex.solver.tendon_spans import in_tendon_order

# Tolerance of the cosine between the directions of two notches: less than 0.3 degrees.
_IN_PLANE = 1e-5


class SolvedState:
    """A solved state in the frame of the base, with results that several formulas share.

    Slid lengths, stroke and energy use the robot file's axial stiffness of the tendon; the finite
    stiffness of the memory only decides which contacts stick.
    """

    def __init__(self, chain: Chain, solved: SolverState) -> None:
        """Take a state of a chain."""
        self.chain, self.solved = chain, solved
        self._found: dict[str, Array] = {}

    def quantity(self, name: str) -> Array:
        """Evaluate the formula of a quantity, once."""
        if name not in self._found:
            self._found[name] = REGISTERED[name].formula(self)
        return self._found[name]

    @cached_property
    def at(self) -> Evaluation:
        """The balance of the state."""
        solved = self.solved
        return evaluate(self.chain, solved.point, solved.memory, solved.applied)

    @cached_property
    def relative(self) -> Motion:
        """Pose of every body against the one before."""
        pose = self.at.flexure.pose  # None where the balance did not ask for it
        modes = self.solved.point.unknowns.modes
        return jax.vmap(relative_pose)(self.chain.rods, modes) if pose is None else pose

    @cached_property
    def bodies(self) -> Motion:
        """Pose of every body, base first."""
        return _in_space(self.chain, body_poses(self.relative))

    @cached_property
    def fibre_strain(self) -> Float[Array, "n nodes"]:
        """Strain of the fibre farthest from the neutral axis at every node, its magnitude."""
        section = self.chain.rods.section
        farthest = jnp.maximum(section.edge_spine, section.edge_near)
        return jnp.abs(self.curvature) * farthest

    @cached_property
    def curvature(self) -> Float[Array, "n nodes"]:
        """Curvature in the plane of every notch."""
        return in_space(self.at.flexure.strain)[..., 1]

    @cached_property
    def stored_energy_density(self) -> tuple[Float[Array, "n nodes"], Flattening]:
        """Energy stored per length, and flattening, at every node of every notch."""
        strain, memory = in_space(self.at.flexure.strain), self.solved.memory.material
        return jax.vmap(jax.vmap(self.chain.law.stored_energy_density))(
            strain, self.chain.rods.section, memory
        )

    @cached_property
    def turning(self) -> tuple[Array, Array]:
        """Turning angles at both edges of all gaps; 0 where a tendon has no contact."""
        chain = self.chain
        visited = self.by_tendon("visits") > 0.0
        angles = [(s.crossing.exit_turning, s.crossing.entry_turning) for s in self.at.spans]
        first, second = paired(chain, angles)
        return jnp.where(visited, first, 0.0), jnp.where(visited, second, 0.0)

    @cached_property
    def tensions(self) -> tuple[Float[Array, "n t"], Float[Array, "n t"]]:
        """Tensions in the gaps and beside the bodies beyond them."""
        return paired(self.chain, [(s.gap_tension, s.body_tension) for s in self.at.spans])

    @cached_property
    def contact_pairs(self) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
        """Contact force and gap of every notch."""
        return notch_contact(self.chain, self.solved.point.unknowns, self.at)

    @cached_property
    def base(self) -> Float[Array, " 6"]:
        """Moment and force of the holder on the base."""
        return base_wrench(self.chain, self.at.base, self.solved.applied)

    @cached_property
    def compliance(self) -> Float[Array, "n t"]:
        """Strain of a tendon per tension."""
        return jnp.broadcast_to(1.0 / self.chain.axial_stiffness, self.tensions[0].shape)

    def by_tendon(self, name: str) -> Float[Array, "n t"]:
        """Return a field of the tendon groups, for every gap and tendon of the robot."""
        return in_tendon_order(
            self.chain, tuple(getattr(group, name) for group in self.chain.groups)
        )


def bending_angle(
    notch_frame: Float[Array, "n 3 3"],
    notch_angle: Float[Array, "*s n"],
    tip_rotation: Float[Array, "*s 3 3"],
) -> Float[Array, "*s"]:
    """Compute the bending angle of a whole robot, rad.

    Where all notches bend in one plane, the sum of their angles, toward the first one's bend
    positive; otherwise the angle between the axes of base and tip.
    """
    along = notch_frame[:, :, 0] @ notch_frame[0, :, 0]
    in_plane = jnp.all(jnp.abs(jnp.abs(along) - 1.0) <= _IN_PLANE)
    across = tip_rotation[..., 0, 2] ** 2 + tip_rotation[..., 1, 2] ** 2
    straight = across == 0.0  # where the angle has a kink, and no derivative
    sine = jnp.where(straight, 0.0, jnp.sqrt(jnp.where(straight, 1.0, across)))
    between = jnp.arctan2(sine, tip_rotation[..., 2, 2])
    return jnp.where(in_plane, notch_angle @ jnp.sign(along), between)


def notch_contact(
    chain: Chain, unknowns: Unknowns, at: Evaluation
) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
    """Compute contact force (N) and smallest gap (mm) of every notch."""
    force = jnp.zeros(chain.flexures)
    gap = jnp.full(chain.flexures, jnp.inf)
    for group, own, contact in zip(
        chain.contact_pairs, unknowns.contact_force, at.contacts, strict=True
    ):
        force = force + jnp.sum(own * group.has_contact, axis=-1)
        gap = jnp.minimum(
            gap, jnp.min(jnp.where(group.has_contact > 0.0, contact.gap, jnp.inf), axis=-1)
        )
    return force, jnp.where(jnp.isinf(gap), jnp.nan, gap)


def largest_moment(flexure: FlexureState) -> Float[Array, " n"]:
    """Return the bending moment in the plane of each notch, largest along it, with its sign."""
    moment = in_space(flexure.resultants)[..., 1]
    where = jnp.argmax(jnp.abs(moment), axis=-1)
    return jnp.take_along_axis(moment, where[:, None], axis=-1)[:, 0]


def base_wrench(chain: Chain, base: BaseReaction, applied: BodyLoads | None) -> Float[Array, " 6"]:
    """Compute the reaction at the base: moment about the base's origin, and force.

    It balances the loads, and the tendon tensions where the tendons enter the base.
    """
    acting = jnp.zeros(6)
    if applied is not None and base.external is not None:
        on_base = jax.tree.map(lambda leaf: leaf[0], applied)
        acting = in_space(
            base.external + body_wrench(jnp.eye(on_base.dead_force.shape[-1]), on_base)
        )
        if chain.frame is not None:
            acting = (chain.frame @ acting.reshape(2, 3, 1)).reshape(6)
    tendon_force = base.base_tension[:, None] * jnp.array([[0.0, 0.0, -1.0]])
    return -acting - jnp.sum(jax.vmap(wrench_at)(chain.tendon_entry, tendon_force), axis=0)


def notch_angles(chain: Chain, relative: Float[Array, "n d d"]) -> Float[Array, " n"]:
    """Compute the rotation of every body against the previous one, about its notch's bending axis.

    The axis is y of the notch's frame, turned by the notch's direction about the tube; angles of
    up to half a turn are distinguished.
    """
    across = chain.notch_frame[..., IN_PLANE]
    if chain.frame is not None:
        across = chain.frame[:, IN_PLANE].T @ across
    turned = jnp.einsum("nba,nbc,ncd->nad", across, relative, across)
    return jnp.atan2(turned[:, 0, 1] - turned[:, 1, 0], turned[:, 0, 0] + turned[:, 1, 1])


def paired(chain: Chain, pairs: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Return both values of pairs per group, each in the order of the robot's tendons."""
    first, second = zip(*pairs, strict=True)
    return in_tendon_order(chain, first), in_tendon_order(chain, second)


def _in_space(chain: Chain, poses: Motion) -> Motion:
    """Transform poses of a chain, which may be planar, to the frame of the base."""
    if chain.frame is None:
        return poses
    frame = chain.frame
    plane = frame[:, IN_PLANE]
    about = frame[:, 1:2]
    rotation = plane @ poses.rotation @ plane.T + (about @ about.T)[None]
    return Motion(rotation, poses.translation @ plane.T)


def along_edges(
    chain: Chain, exit_value: Float[Array, "n t"], entry_value: Float[Array, "n t"]
) -> Float[Array, "t edges"]:
    """Return the values at the edges that each tendon meets, base to tip; NaN beyond its end."""
    pairs = jnp.stack([exit_value, entry_value], axis=1)
    flat = pairs.reshape(-1, pairs.shape[-1]).T
    met = jnp.take_along_axis(flat, jnp.maximum(chain.contacts, 0), axis=1)
    beyond = jnp.roll(chain.contacts, -1, axis=1).at[:, -1].set(-1)
    # The last edge, where the tendon enters its end body, is not a contact: it is fixed there.
    return jnp.where(beyond >= 0, met, jnp.nan)


def along_contacts(
    chain: Chain, exit_value: Float[Array, "n t"], entry_value: Float[Array, "n t"]
) -> Float[Array, "t contacts"]:
    """Return the values at the contacts of each tendon, base to tip; NaN beyond its end."""
    return along_edges(chain, exit_value, entry_value)[:, :-1]
