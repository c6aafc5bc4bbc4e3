"""When does every notch close? Angle, tension and strain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.optimize import elementwise

from notchflex.chain import Chain, assemble
from notchflex.robot import Robot
from notchflex.statics.load import LoadPath
from notchflex.statics.newton import Settings
from notchflex.statics.path import command
from notchflex.statics.run import lips
from notchflex.statics.stepping import at_rest
from notchflex.tendon.wall_arc import WallArc

# Where a tension of this many times the one that would close a linear notch does not close it,
# it is said not to close.
_BEYOND_LINEAR = 64.0
_PRECISION = 1e-11  # relative, of the tension


@dataclass(frozen=True)
class Closing:
    """Closing of every notch, base to tip.

    Attributes:
        angle: Notch angle at which its lips meet, precurvature included, rad.
        tension: Base tension that closes it, N, loading from rest; NaN where none does.
        tendon: The tendon pulled for it, counted from 1: the one with the longest lever.
        outer_strain: Strain of the outer fibre on the spine when closed (Pacheco 2021, eq. 16).
        peak_strain: Largest strain of any fibre when closed.
    """

    angle: Float[np.ndarray, " n"]
    tension: Float[np.ndarray, " n"]
    tendon: np.ndarray
    outer_strain: Float[np.ndarray, " n"]
    peak_strain: Float[np.ndarray, " n"]


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
    chain = assemble(robot)
    rods = chain.rods
    height = np.asarray(rods.length.sum(-1))
    lever = np.asarray(rods.lip[:, 0])
    free = np.asarray((rods.length * rods.reference_strain[..., 1]).sum(-1))
    angle = height / lever
    elastic = (angle - free) / height
    section = rods.section
    spine, near = np.asarray(section.edge_spine)[:, 0], np.asarray(section.edge_near)[:, 0]
    arm = _moment_arms(chain)
    tendon = np.argmax(arm, axis=1)
    longest = arm[np.arange(len(arm)), tendon]
    return Closing(
        angle=angle,
        tension=_tensions(chain, tendon, longest, angle - free),
        tendon=tendon + 1,
        outer_strain=elastic * spine,
        peak_strain=np.abs(elastic) * np.maximum(spine, near),
    )


def _moment_arms(chain: Chain) -> Float[np.ndarray, "n t"]:
    """Lever of every tendon about the neutral axis of every notch in the free robot, mm."""
    arm = np.zeros((chain.flexures, chain.tendons))
    for group in chain.groups:
        across = (
            group.across[..., 0]
            if isinstance(group, WallArc)
            else (
                np.einsum("nab,ntb->nta", chain.rods.end_rotation, group.entry)[..., 0]  # type: ignore[attr-defined]
                + np.asarray(chain.rods.end_offset)[:, None, 0]
            )
        )
        arm[:, list(group.numbers)] = np.asarray(group.present) * np.asarray(across)
    return arm


def _tensions(
    chain: Chain,
    tendon: np.ndarray,
    arm: Float[np.ndarray, " n"],
    travel: Float[np.ndarray, " n"],
) -> Float[np.ndarray, " n"]:
    """Base tension that closes every notch, pulling its own tendon."""
    found = np.full(chain.flexures, np.nan)
    notches = np.flatnonzero((arm > 0.0) & (travel > 0.0))
    if len(notches) == 0:
        return found
    stiffness = np.asarray(chain.lip_stiffness)
    rest = at_rest(chain)

    def pressed(tension: Float[np.ndarray, " m"], notch: Float[np.ndarray, " m"]) -> np.ndarray:
        # Always as many rows as notches, whichever are still searched: one compiled program.
        which = np.resize(notch.astype(int), chain.flexures)
        rows = np.arange(chain.flexures)
        value = np.full((chain.flexures, chain.tendons), np.nan)
        value[rows, tendon[which]] = np.resize(tension, chain.flexures)
        load = LoadPath(value, np.full_like(value, np.nan))
        force, gap, converged = lips(chain, command(load), rest, Settings())
        overlap = force[rows, which] / stiffness[which] - gap[rows, which]
        return np.where(converged, overlap, np.nan)[: len(notch)]

    linear = np.asarray(chain.stiffness)[notches, 0] * travel[notches] / arm[notches]
    high = linear.copy()
    for _ in range(int(np.log2(_BEYOND_LINEAR)) + 1):
        short = ~(pressed(high, notches) > 0.0)
        if not short.any():
            break
        high = np.where(short, 2.0 * high, high)
    root = elementwise.find_root(
        pressed,
        (np.zeros_like(high), high),
        args=(notches.astype(float),),
        tolerances={"xatol": 0.0, "xrtol": _PRECISION, "fatol": 0.0, "frtol": 0.0},
    )
    found[notches] = np.where(root.success, root.x, np.nan)
    return found
