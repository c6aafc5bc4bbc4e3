"""Solved states with their memory; the first is the free robot."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import constant
from notchflex.loads.command import BodyLoads
from notchflex.mechanics.chain import Chain
from notchflex.solver.element import Iterate, Memory, Unknowns


class SolverState(NamedTuple):
    """A solved state with its memory, which the next state needs; it can be saved.

    Attributes:
        point: Unknowns and base tensions.
        memory: History of contacts and material, as of this state.
        stroke: Tendon drawn out at the base, mm.
        applied: External loads on the bodies; None for a chain assembled for tendons alone.
    """

    point: Iterate
    memory: Memory
    stroke: Float[Array, " t"]
    applied: BodyLoads | None


def at_rest(chain: Chain) -> SolverState:
    """Return the state of the free robot, with slack tendons."""
    none = tuple(constant(np.zeros((*group.present.shape, 2))) for group in chain.groups)
    unknowns = Unknowns(
        modes=constant(np.zeros(chain.stiffness.shape)),
        contact_force=tuple(
            constant(np.zeros(group.has_contact.shape)) for group in chain.contact_pairs
        ),
        log_ratio=none,
    )
    slack = constant(np.zeros(chain.tendons))
    memory = Memory(none, none, none, chain.law.rest(chain.rods.section))
    return SolverState(Iterate(unknowns, slack), memory, slack, unloaded(chain))


def unloaded(chain: Chain) -> BodyLoads | None:
    """Return zero loads on all bodies of the chain; None where it takes no loads."""
    if not chain.loaded:
        return None
    bodies = chain.flexures + 1
    d, a = (3, 3) if chain.frame is None else (2, 1)
    shapes = ((d,), (a,), (d, d), (a + d,))
    return BodyLoads(*(constant(np.zeros((bodies, *shape))) for shape in shapes))
