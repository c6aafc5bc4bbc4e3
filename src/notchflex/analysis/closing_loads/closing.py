"""Closing of every notch: angle, tension and strain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from notchflex._summary import Displayed, Summary, short
from notchflex.analysis.closing_loads.search import (
    ClosingStatus,
    closing_tensions,
    find_roots,
    statuses,
)
from notchflex.loads.command import tension_commands
from notchflex.mechanics.chain import Chain, assemble
from notchflex.mechanics.contact import closing_angles, free_angle
from notchflex.results.quantities.registry import QUANTITIES
from notchflex.robot import Robot
from notchflex.solver.newton import Settings
from notchflex.solver.programs.contacts import solve_contacts
from notchflex.solver.programs.prepare import PreparedChain, prepare
from notchflex.solver.programs.run import run

_ANGLE = QUANTITIES["total_angle"]
_MAX_ROWS = 12
# Number of steps of the first pull, and its end over the tension that would close the softest notch
# if it were linear and alone; notches that do not close by then are reported as never closing.
_STEPS, _BEYOND_LINEAR = 40, 2.0


@dataclass(frozen=True, repr=False)
class Closing(Displayed):
    """Closing of every notch, base to tip.

    Attributes:
        angle: Notch angle at which its edges touch, precurvature included, rad.
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
        left = len(rows) - _MAX_ROWS
        hint = f"and {left} more notches" if left > 0 else ""
        return Summary("Closing of every notch", rows[:_MAX_ROWS], hint)


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
    closing_angle, free = closing_angles(rods), free_angle(rods)
    height = np.asarray(rods.length.sum(-1))
    section = rods.section
    spine, near = np.asarray(section.edge_spine)[:, 0], np.asarray(section.edge_near)[:, 0]
    arm = moment_arms(chain)
    tendon = np.argmax(arm, axis=1)
    longest = arm[np.arange(len(arm)), tendon]
    if np.isfinite(closing_angle).all():
        tension, status = _tensions(prepare(robot), tendon, longest, closing_angle)
        contact_angle = closing_angle
    else:
        tension, contact_angle, status = _edge_closing(prepare(robot), tendon, longest)
    has_spine = np.isfinite(closing_angle)
    elastic = np.where(has_spine, closing_angle / height, np.nan)
    return Closing(
        angle=np.where(has_spine, closing_angle + free, contact_angle),
        tension=tension,
        status=status,
        tendon=tendon + 1,
        outer_strain=elastic * spine,
        peak_strain=np.abs(elastic) * np.maximum(spine, near),
    )


def moment_arms(chain: Chain) -> Float[np.ndarray, "n t"]:
    """Compute the moment arm of every tendon about the neutral axis of every notch at rest, mm.

    Positive where it bends the notch toward its direction; 0 where it does not run. The chain must
    be assembled with `flat=False`.
    """
    entry_x = np.einsum("nba,tb->nta", chain.notch_frame, chain.tendon_entry)[..., 0]
    spine = np.where(np.asarray(chain.rods.has_closure) > 0.0, chain.rods.end_offset[:, 0], 0.0)
    arm = np.zeros((chain.flexures, chain.tendons))
    for group in chain.groups:
        tendons = list(group.numbers)
        arm[:, tendons] = np.asarray(group.present) * (entry_x[:, tendons] + spine[:, None])
    return arm


def _tensions(
    ready: PreparedChain,
    tendon: np.ndarray,
    arm: Float[np.ndarray, " n"],
    closing_angle: Float[np.ndarray, " n"],
) -> tuple[Float[np.ndarray, " n"], np.ndarray]:
    """Find the base tension that closes every notch against its spine, and its status."""
    chain = ready.chain
    tension = np.full(chain.flexures, np.nan)
    status = np.full(chain.flexures, ClosingStatus.NEVER, dtype=object)
    notches = np.flatnonzero((arm > 0.0) & (closing_angle > 0.0))
    if len(notches) == 0:
        return tension, status
    stiffness = np.asarray(chain.contact_stiffness)
    # As many rows as notches, whichever are searched: one compiled program.
    which, rows = np.resize(notches, chain.flexures), np.arange(chain.flexures)

    def overlap(tension: Float[np.ndarray, " m"], _: Bool[np.ndarray, " m"]) -> np.ndarray:
        value = np.zeros((chain.flexures, chain.tendons))
        value[rows, tendon[which]] = np.resize(tension, chain.flexures)
        force, gap, converged = solve_contacts(
            ready, tension_commands(value), ready.rest, Settings()
        )
        overlap = force[rows, which] / stiffness[which] - gap[rows, which]
        return np.where(converged, overlap, np.nan)[: len(notches)]

    linear = np.asarray(chain.stiffness)[notches, 0] * closing_angle[notches] / arm[notches]
    tension[notches], status[notches] = closing_tensions(overlap, linear)
    return tension, status


def _edge_closing(
    ready: PreparedChain, tendon: np.ndarray, arm: Float[np.ndarray, " n"]
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"], np.ndarray]:
    """Find tension, angle and status of closing for notches with edges on rigid pieces.

    The tendon is pulled in steps from rest, which brackets the tension where an edge touches.
    """
    tension, angle = (np.full(ready.chain.flexures, np.nan) for _ in range(2))
    status = np.full(ready.chain.flexures, ClosingStatus.NEVER, dtype=object)
    for number in np.unique(tendon):
        pulled = np.flatnonzero((tendon == number) & (arm > 0.0))
        if len(pulled):
            tension[pulled], angle[pulled], status[pulled] = _by_one_tendon(
                ready, int(number), pulled
            )
    return tension, angle, status


def _by_one_tendon(
    ready: PreparedChain, tendon: int, notches: np.ndarray
) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, " m"], np.ndarray]:
    """Find them for some notches, pulling one tendon."""
    free, _ = _pull(ready, tendon, np.zeros(1))
    reach = -free[0, notches]  # the gap at rest: an edge so far from closing
    # Tendon and edges are about as far from the axis.
    linear = np.asarray(ready.chain.contact_stiffness)[notches] * reach
    steps = np.linspace(0.0, _BEYOND_LINEAR * linear.max(), _STEPS + 1)
    overlap, _ = _pull(ready, tendon, steps)
    touching = overlap[:, notches] > 0.0
    closes = touching.any(axis=0)
    after = np.maximum(touching.argmax(axis=0), 1)

    def at(tension: Float[np.ndarray, " m"]) -> tuple[np.ndarray, np.ndarray]:
        """Compute overlap and angle of every notch, each at its own tension, on one path."""
        order = np.argsort(tension)
        back = np.argsort(order)
        overlap, angle = _pull(ready, tendon, tension[order])
        return overlap[back, notches], angle[back, notches]

    low, high = (np.where(closes, steps[step], steps[-1]) for step in (after - 1, after))
    tension, precise = find_roots(lambda tension, _: at(tension)[0], low, high)
    _, angle = at(tension)
    closed = closes & precise & np.isfinite(angle)
    failed = ~np.isfinite(overlap[:, notches]).all(axis=0)
    status = statuses(closed, np.asarray(~closes & ~failed))
    return np.where(closed, tension, np.nan), np.where(closed, angle, np.nan), status


def _pull(
    ready: PreparedChain, tendon: int, tensions: Float[np.ndarray, " s"]
) -> tuple[Float[np.ndarray, "s n"], Float[np.ndarray, "s n"]]:
    """Compute every notch's overlap (contact force / stiffness - gap, mm) and angle (rad)."""
    value = np.zeros((len(tensions), ready.chain.tendons))
    value[:, tendon] = tensions
    states = run(ready, tension_commands(value), ready.rest, Settings(), each_from_start=False)
    stiffness = np.asarray(ready.chain.contact_stiffness)
    overlap = states.quantity("contact_force") / stiffness - states.quantity("gap")
    converged = states.converged[:, None]
    angle = states.quantity("notch_angle")
    return np.where(converged, overlap, np.nan), np.where(converged, angle, np.nan)
