"""A solved state in the frame of the base, with intermediate results for the quantities.

The modes satisfy equilibrium only in a weighted mean along a flexure. The largest local error,
|M_internal - M_required| over the largest |M|, shows whether there are enough modes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property
from typing import Any

from jaxtyping import Array, Float

from notchflex._jax import choose, jax, jnp
from notchflex._quantity import REGISTERED
from notchflex.loads.command import body_wrench
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.flexure import (
    FlexureState,
    Rod,
    fibre_stretch,
    in_space,
    of_rod,
    relative_pose,
)
from notchflex.mechanics.flexure.rod_kinematics import node_poses, rod_end
from notchflex.mechanics.material import Flattening, SectionStrain, section_strain
from notchflex.mechanics.motion import IN_PLANE, Motion, wrench_at
from notchflex.solver.residual import (
    Evaluation,
    SolverState,
    Unknowns,
    body_poses,
    evaluate,
    in_tendon_order,
    is_active,
    warmed,
)


class SolvedState:
    """A solved state in the frame of the base, with results that several formulas share."""

    # Slid lengths, stroke and energy use the robot file's axial stiffness of the tendon; the finite
    # stiffness of the memory only decides which contacts stick.

    def __init__(self, chain: Chain, solved: SolverState) -> None:
        """Take a state of a chain."""
        self.chain, self.solved = chain, solved
        self._evaluated: dict[str, Array] = {}
        self.law = warmed(chain, solved.applied).law

    def quantity(self, name: str) -> Array:
        """Evaluate the formula of a quantity, once."""
        if name not in self._evaluated:
            self._evaluated[name] = REGISTERED[name].formula(self)
        return self._evaluated[name]

    @cached_property
    def evaluation(self) -> Evaluation:
        """The balance of the state."""
        solved = self.solved
        return evaluate(self.chain, solved.point, solved.memory, solved.applied)

    @cached_property
    def relative(self) -> Motion:
        """Pose of every body against the one before."""
        pose = self.evaluation.flexure.pose  # None where the balance did not ask for it
        modes = self.solved.point.unknowns.modes
        return jax.vmap(relative_pose)(self.chain.rods, modes) if pose is None else pose

    @cached_property
    def bodies(self) -> Motion:
        """Pose of every body, base first."""
        poses, frame = body_poses(self.relative), self.chain.frame
        if frame is None:
            return poses
        plane, about = frame[:, IN_PLANE], frame[:, 1:2]
        rotation = plane @ poses.rotation @ plane.T + (about @ about.T)[None]
        return Motion(rotation, poses.translation @ plane.T)

    @cached_property
    def section_strain(self) -> SectionStrain:
        """Strains of the section at every node of every notch; any where they are not known."""
        return self._by_law(section_strain)

    def of_sections(self, values: Array) -> Array:
        """Return values of the sections of all notches; NaN where their strains are not known."""
        # NaN comes last: adjoints multiply what is before it by 0.
        lumped: Any = self.law.lumped
        if lumped is False:
            return values
        return jnp.where(lumped.reshape(-1, *(1,) * (values.ndim - 1)), jnp.nan, values)

    @cached_property
    def stored_energy_density(self) -> tuple[Float[Array, "n nodes"], Flattening]:
        """Energy stored per length, and flattening, at every node of every notch."""
        return self._by_law(lambda law, *state: law.stored_energy_density(*state))

    def _by_law(self, function: Callable[..., Any]) -> Any:
        """Return a function of law, strain, section and memory at every node of every notch."""
        strain, memory = in_space(self.evaluation.flexure.strain), self.solved.memory.material
        law, section = self.law, self.chain.rods.section
        at_nodes = jax.vmap(function, (None, 0, 0, 0))
        return jax.vmap(at_nodes, (law.axis, 0, 0, 0))(law, strain, section, memory)

    @cached_property
    def turning(self) -> Float[Array, "n t 2"]:
        """Turning angles at both edges of all gaps; 0 where a tendon has no contact."""
        angles = self.at_edges(span.crossing.turning for span in self.evaluation.spans)
        return jnp.where(self.by_tendon("visits")[..., None] > 0.0, angles, 0.0)

    @cached_property
    def tensions(self) -> Float[Array, "n t 2"]:
        """Tensions in the gaps and beside the bodies beyond them."""
        spans = self.evaluation.spans
        return self.at_edges(jnp.stack([s.gap_tension, s.body_tension], -1) for s in spans)

    @cached_property
    def contact_pairs(self) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
        """Contact force and gap of every notch."""
        return notch_contact(self.chain, self.solved.point.unknowns, self.evaluation)

    @cached_property
    def base(self) -> Float[Array, " 6"]:
        """Moment and force of the holder on the base, about its origin."""
        chain, wrenches, acting = self.chain, self.evaluation.wrenches, jnp.zeros(6)
        if wrenches is not None and wrenches.on_base is not None:
            on_base = jax.tree.map(lambda leaf: leaf[0], self.solved.applied)
            acting = in_space(
                wrenches.on_base + body_wrench(jnp.eye(on_base.dead_force.shape[-1]), on_base)
            )
            if chain.frame is not None:
                acting = (chain.frame @ acting.reshape(2, 3, 1)).reshape(6)
        tendon_force = self.evaluation.base.base_tension[:, None] * jnp.array([[0.0, 0.0, -1.0]])
        return -acting - jnp.sum(jax.vmap(wrench_at)(chain.tendon_entry, tendon_force), axis=0)

    @cached_property
    def compliance(self) -> Float[Array, "n t"]:
        """Strain of a tendon per tension."""
        return jnp.broadcast_to(1.0 / self.chain.axial_stiffness, self.tensions.shape[:2])

    def by_tendon(self, name: str) -> Float[Array, "n t"]:
        """Return a field of the tendon groups, for every gap and tendon of the robot."""
        return in_tendon_order(
            self.chain, tuple(getattr(group, name) for group in self.chain.groups)
        )

    def at_edges(self, values: Iterable[Float[Array, "n t 2"]]) -> Float[Array, "n t 2"]:
        """Return values per group at both edges of all gaps, in the order of the tendons."""
        swapped = tuple(edges.swapaxes(1, 2) for edges in values)
        return in_tendon_order(self.chain, swapped).swapaxes(1, 2)

    def along_edges(self, values: Float[Array, "n t 2"]) -> Float[Array, "t edges"]:
        """Return values at the edges that each tendon meets, base to tip; NaN beyond its end."""
        # The last edge, where the tendon enters its end body, is not a contact: it is fixed there.
        contacts = self.chain.contacts
        flat = values.swapaxes(0, 1).reshape(values.shape[1], -1)
        met = jnp.take_along_axis(flat, jnp.maximum(contacts, 0), axis=1)
        beyond = jnp.roll(contacts, -1, axis=1).at[:, -1].set(-1)
        return jnp.where(beyond >= 0, met, jnp.nan)

    def along_contacts(self, values: Iterable[Float[Array, "n t 2"]]) -> Float[Array, "t contacts"]:
        """Return values per group at the contacts of each tendon; NaN beyond its end."""
        return self.along_edges(self.at_edges(values))[:, :-1]

    def required(self) -> Float[Array, "n nodes w"]:
        """Return the wrench that loads, tendons and contacts require at every node, in its axes."""
        chain, evaluation, unknowns = self.chain, self.evaluation, self.solved.point.unknowns
        acting = jnp.zeros((chain.flexures, chain.rods.basis.shape[-2]))
        spans = zip(chain.groups, evaluation.spans, strict=True)
        contacts = zip(chain.contact_pairs, unknowns.contact_force, strict=True)
        lengthening = [(group, -span.gap_tension) for group, span in spans]
        lengthening += [(pair, force * pair.has_contact) for pair, force in contacts]
        for group, force in lengthening:
            if group.fibre is not None:
                weights = of_rod(chain.rods, fibre_stretch(group.fibre))
                acting = acting + jnp.einsum("nt,ntc->nc", force, weights)
        required = jnp.broadcast_to(acting[:, None], evaluation.flexure.resultants.shape)
        if evaluation.wrenches is None:
            return required
        return required + jax.vmap(_by_wrench)(
            chain.rods, unknowns.modes, evaluation.flexure, evaluation.wrenches.resultant
        )


def notch_contact(
    chain: Chain, unknowns: Unknowns, evaluation: Evaluation
) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
    """Compute contact force (N) and smallest gap (mm) of every notch."""
    force = jnp.zeros(chain.flexures)
    gap = jnp.full(chain.flexures, jnp.inf)
    for group, forces, contact in zip(
        chain.contact_pairs, unknowns.contact_force, evaluation.contacts, strict=True
    ):
        force = force + jnp.sum(forces, axis=-1)
        # Gaps of contacts that touch are rounding errors.
        touches = is_active(chain, group, forces, contact.gap) | (contact.gap <= 0.0)
        left = jnp.where(touches, 0.0, contact.gap)
        left = jnp.where(group.has_contact > 0.0, left, jnp.inf)
        gap = jnp.minimum(gap, jnp.min(left, axis=-1))
    return force, jnp.where(jnp.isinf(gap), jnp.nan, gap)


def _by_wrench(
    rod: Rod, modes: Float[Array, " modes"], flexure: FlexureState, wrench: Float[Array, " w"]
) -> Float[Array, "nodes w"]:
    """Compute the wrench on all bodies beyond each node, about the node, in its section's axes."""
    assert flexure.pose is not None  # wrenches act on bodies
    assert flexure.configuration is not None
    body, nodes = flexure.pose, node_poses(rod, modes, flexure.configuration)
    if rod.linear_kinematics is not None:
        # Moments of a linear beam are taken on the free shape, under forces in the body's frame.
        is_small = rod.linear_kinematics > 0.0
        start = Motion(rod.start_rotation, rod.start_offset)
        end = Motion(rod_end(rod, modes).rotation, rod.curve_offset)
        free_end = start.then(end).then(Motion(rod.end_rotation, rod.end_offset))
        free = free_end, jax.vmap(start.then)(Motion(rod.node_rotation, rod.node_offset))
        body, nodes = choose(is_small, free, (body, nodes))

    outside = body.wrench(wrench)
    return jax.vmap(lambda node: node.wrench_inside(outside))(nodes)
