"""States of a path at which derivatives are one-sided.

A contact about to slip and a notch just closing are switches: the slopes differ on their two sides.
A contact that slid in a step has a slip
and lies on its bound; one that stuck has neither. At the switch it lies on its bound without a
slip, as after a step that changed nothing. A notch at the switch is closed without a force.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from jaxtyping import Float

from notchflex.mechanics.chain import Chain
from notchflex.solver.programs.run import SolverRun
from notchflex.solver.solver_state import SolverState
from notchflex.solver.tendon_spans import slip_mask

if TYPE_CHECKING:  # for the type only: a path tells its kinks
    from notchflex.results.path import EquilibriumPath


@dataclass(frozen=True)
class Kink:
    """A contact or a notch at a switch, where derivatives are one-sided.

    Attributes:
        step: Step of the path, from 0.
        kind: "contact" (about to slip, or to stop) or "notch" (about to close or to open).
        index: Which contact along its tendon, from 1 at the base, or which notch, from 1.
        tendon: The tendon of a contact, from 1; None for a notch.
        distance: Distance of the state from the switch: for a contact the log ratio to its bound,
            or its slip in heights of the notch; for a notch its gap, or its contact force over its
            stiffness, in heights.
    """

    step: int
    kind: Literal["contact", "notch"]
    index: int
    tendon: int | None
    distance: float


def kinks(path: EquilibriumPath, within: float = 1e-6) -> list[Kink]:
    """List the contacts and notches of a path that lie at a switch, or nearly so.

    Args:
        path: The path, as solved (not as read from a file).
        within: Distance from the switch up to which they count.

    Returns:
        One record each, by step; none where a step did not converge.
    """
    if not isinstance(path.run, SolverRun):
        return []
    solved, before = path.run.solved, path.prepared.state.unpack(path.run.between)
    every = [*_contacts(path.chain, solved, before, within), *_notches(path, within)]
    converged = np.asarray(path.converged)
    return sorted((one for one in every if converged[one.step]), key=lambda one: one.step)


def _contacts(chain: Chain, solved: SolverState, before: SolverState, within: float) -> list[Kink]:
    height = np.asarray(chain.rods.length).sum(-1)[:, None, None]
    edges = np.asarray(chain.contacts)
    contacts: list[Kink] = []
    for k, group in enumerate(chain.groups):
        ratio, bound = (
            np.asarray(one[k]) for one in (solved.memory.log_ratio, solved.memory.bound)
        )
        slip = np.abs(np.asarray(solved.memory.slid[k]) - np.asarray(before.memory.slid[k]))
        left = np.maximum(bound - np.abs(ratio), 0.0)
        distance = np.maximum(left, slip / height)
        can_slide = np.asarray(slip_mask(group)) > 0.0
        tension = np.asarray(solved.point.base_tension)[:, list(group.numbers)]
        loaded = (tension > 0.0)[:, None, :, None]
        at_switch = (distance < within) & can_slide & loaded & (bound > 0.0)
        for step, flexure, column, edge in np.argwhere(at_switch):
            tendon = group.numbers[column]
            index = int(np.flatnonzero(edges[tendon] == 2 * flexure + edge)[0])
            gap = float(distance[step, flexure, column, edge])
            contacts.append(Kink(int(step), "contact", index + 1, tendon + 1, gap))
    return contacts


def _notches(path: EquilibriumPath, within: float) -> list[Kink]:
    chain = path.chain
    height = np.asarray(chain.rods.length).sum(-1)
    travel = path.contact_force / np.asarray(chain.contact_stiffness)
    distance: Float[np.ndarray, "s n"] = np.maximum(np.abs(path.gap), travel) / height
    return [
        Kink(int(step), "notch", int(notch) + 1, None, float(distance[step, notch]))
        for step, notch in np.argwhere(distance < within)  # NaN where a notch has no contact
    ]
