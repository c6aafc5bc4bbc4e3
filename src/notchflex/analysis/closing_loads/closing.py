"""When does every notch close? Angle, tension and strain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from notchflex._summary import Displayed, Summary, short
from notchflex.analysis.closing_loads.edges import edge_closing
from notchflex.analysis.closing_loads.search import ClosingStatus, closing_tensions
from notchflex.loads.command import tension_commands
from notchflex.mechanics.chain import Chain, assemble
from notchflex.mechanics.contact import closing_travel, free_angle
from notchflex.results.quantities.registry import QUANTITIES
from notchflex.robot import Robot
from notchflex.solver.newton import Settings
from notchflex.solver.programs.prepare import PreparedChain, prepare
from notchflex.solver.programs.run import solve_contacts

_ANGLE = QUANTITIES["total_angle"]
_MOST_ROWS = 12


@dataclass(frozen=True, repr=False)
class Closing(Displayed):
    """Closing of every notch, base to tip.

    Attributes:
        angle: Notch angle at which its solve_contacts meet, precurvature included, rad.
        tension: Base tension that closes it, N, loading from rest; NaN where none was found.
        status: A `ClosingStatus`: "closes"; "never", no tension up to 64 times the one that
            would close a linear notch alone (twice that of the softest for slots); or "not found",
            the solver did not converge at the tensions in question.
        tendon: The tendon pulled for it, counted from 1: the one with the longest lever.
        outer_strain: Strain of the outer fibre on the spine when closed (Pacheco 2021, eq. 16).
        peak_strain: Largest strain of any fibre when closed.
    """

    angle: Float[np.ndarray, " n"]
    tension: Float[np.ndarray, " n"]
    status: np.ndarray
    tendon: np.ndarray
    outer_strain: Float[np.ndarray, " n"]
    peak_strain: Float[np.ndarray, " n"]

    def _summary(self) -> Summary:
        rows = [
            (
                f"notch {notch + 1}",
                f"{short(float(angle) * _ANGLE.scale)} {_ANGLE.unit}, "
                + (f"{short(float(tension))} N" if tension == tension else "no tension found"),
            )
            for notch, (angle, tension) in enumerate(zip(self.angle, self.tension, strict=True))
        ]
        left = len(rows) - _MOST_ROWS
        hint = f"and {left} more notches" if left > 0 else ""
        return Summary("Closing of every notch", rows[:_MOST_ROWS], hint)


def closing(robot: Robot) -> Closing:
    """Find the angle, tension and strain at which every notch closes.

    The tension is found on the solver itself, with friction and all other notches: the root of
    contact force / stiffness - gap, which rises through zero where a notch closes.

    Args:
        robot: The robot.

    Returns:
        The closing of every notch.

    Example:
        >>> from notchflex import load_robot
        >>> table = closing(load_robot("pacheco2021-a"))
        >>> print(f"{np.degrees(table.angle[0]):.2f} deg, {table.tension[0]:.3f} N")
        30.63 deg, 1.615 N
    """
    chain = assemble(robot, flat=False)
    rods = chain.rods
    travel, free = closing_travel(rods), free_angle(rods)
    height = np.asarray(rods.length.sum(-1))
    section = rods.section
    spine, near = np.asarray(section.edge_spine)[:, 0], np.asarray(section.edge_near)[:, 0]
    arm = moment_arms(chain)
    tendon = np.argmax(arm, axis=1)
    longest = arm[np.arange(len(arm)), tendon]
    if np.isfinite(travel).all():
        tension, status = _tensions(prepare(robot), tendon, longest, travel)
        met = travel
    else:
        tension, met, status = edge_closing(prepare(robot), tendon, longest)
    has_spine = np.isfinite(travel)
    elastic = np.where(has_spine, travel / height, np.nan)
    return Closing(
        angle=np.where(has_spine, travel + free, met),
        tension=tension,
        status=status,
        tendon=tendon + 1,
        outer_strain=elastic * spine,
        peak_strain=np.abs(elastic) * np.maximum(spine, near),
    )


def moment_arms(chain: Chain) -> Float[np.ndarray, "n t"]:
    """Lever of every tendon about the neutral axis of every notch in the free robot, mm.

    The chain is one of space.

    Positive where it bends the notch toward its direction; 0 where it does not go.
    """
    place = np.einsum("nba,tb->nta", chain.notch_frame, chain.tendon_place)[..., 0]
    spine = np.where(np.asarray(chain.rods.has_closure) > 0.0, chain.rods.end_offset[:, 0], 0.0)
    arm = np.zeros((chain.flexures, chain.tendons))
    for group in chain.groups:
        own = list(group.numbers)
        arm[:, own] = np.asarray(group.present) * (place[:, own] + spine[:, None])
    return arm


def _tensions(
    ready: PreparedChain,
    tendon: np.ndarray,
    arm: Float[np.ndarray, " n"],
    travel: Float[np.ndarray, " n"],
) -> tuple[Float[np.ndarray, " n"], np.ndarray]:
    """Base tension that closes every notch against its spine, pulling its own tendon; status."""
    chain = ready.chain
    found = np.full(chain.flexures, np.nan)
    status = np.full(chain.flexures, ClosingStatus.NEVER, dtype=object)
    notches = np.flatnonzero((arm > 0.0) & (travel > 0.0))
    if len(notches) == 0:
        return found, status
    stiffness = np.asarray(chain.contact_stiffness)
    # Always as many rows as notches, whichever are searched: one compiled program.
    which, rows = np.resize(notches, chain.flexures), np.arange(chain.flexures)

    def overlap(tension: Float[np.ndarray, " m"]) -> np.ndarray:
        value = np.zeros((chain.flexures, chain.tendons))
        value[rows, tendon[which]] = np.resize(tension, chain.flexures)
        force, gap, converged = solve_contacts(
            ready, tension_commands(value), ready.rest, Settings()
        )
        overlap = force[rows, which] / stiffness[which] - gap[rows, which]
        return np.where(converged, overlap, np.nan)[: len(notches)]

    linear = np.asarray(chain.stiffness)[notches, 0] * travel[notches] / arm[notches]
    found[notches], status[notches] = closing_tensions(overlap, linear)
    return found, status
