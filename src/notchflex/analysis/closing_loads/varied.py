"""Tensions that close the notches of many robots that differ by a few numbers, found in batches."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int

from notchflex.analysis.closing_loads.closing import closing, moment_arms
from notchflex.analysis.closing_loads.search import closing_tensions
from notchflex.analysis.outputs import follow_row
from notchflex.analysis.varied.varied_chains import VariedChains, varied_chains
from notchflex.loads import LoadPath
from notchflex.loads.command import tension_commands
from notchflex.mechanics.chain import assemble
from notchflex.mechanics.contact import closing_angles
from notchflex.robot.value_names.varied import VariedRobots
from notchflex.solver.newton import DEFAULT
from notchflex.solver.programs.threads import on_cores

# Number of rows in one call of the program.
_BATCH = 1024
# First tension, relative to that of the robot that is varied.
_FIRST = 1.05
# Relative precision of a tension: limits are compared to 1e-6.
_PRECISION = 1e-9
_OUTPUTS = ("contact_force", "gap", "converged")


def closing_tensions_of(robots: VariedRobots) -> Float[np.ndarray, "robots n"]:
    """Find the tension that closes every notch of many robots, as `closing` does for one.

    Args:
        robots: The robots, all of them valid.

    Returns:
        Base tensions, N; NaN where none was found.
    """
    own = closing(robots.robot)
    chain = assemble(robots.robot, flat=False)
    closing_angle, arm = closing_angles(chain.rods), moment_arms(chain)
    unit = np.eye(chain.tendons)[own.tendon - 1]
    load = LoadPath(np.ones((1, chain.tendons)), np.full((1, chain.tendons), np.nan))
    chains = varied_chains(robots, load, 0) if np.isfinite(closing_angle).all() else None
    if chains is None:  # edges of rigid pieces, or no polynomial: one robot after the other
        return np.reshape([closing(one).tension for one in robots], (len(robots), -1))
    longest = arm[np.arange(len(arm)), own.tendon - 1]
    notches = np.flatnonzero((longest > 0.0) & (np.asarray(closing_angle) > 0.0))
    tension = np.full((len(robots), chain.flexures), np.nan)
    if len(notches) == 0:
        return tension
    with np.errstate(divide="ignore"):
        linear = np.asarray(chain.stiffness)[:, 0] * np.asarray(closing_angle) / longest
    guess = np.where(np.isfinite(own.tension), _FIRST * own.tension, linear)[notches]
    search = _Rows(chains, notches, unit[notches], np.asarray(chain.contact_stiffness)[notches])
    closing_tension, _ = closing_tensions(search.overlap, np.tile(guess, len(robots)), _PRECISION)
    tension[:, notches] = closing_tension.reshape(len(robots), -1)
    return tension


class _Rows:
    """Rows of a batch: one per robot and notch to close."""

    def __init__(
        self,
        chains: VariedChains,
        notches: Int[np.ndarray, " k"],
        unit: Float[np.ndarray, "k t"],
        stiffness: Float[np.ndarray, " k"],
    ) -> None:
        """Store chains, notches to close, unit tensions that pull them, and their stiffness."""
        self.chains, self.notches, self.unit, self.stiffness = chains, notches, unit, stiffness
        self.robots = chains.rows(slice(None))[0]

    def overlap(
        self, tension: Float[np.ndarray, " rows"], mask: Bool[np.ndarray, " rows"]
    ) -> Float[np.ndarray, " rows"]:
        """Compute contact force / stiffness - gap of the masked rows, mm; NaN for others."""
        rows = np.flatnonzero(mask)
        values_of_rows = np.full(len(tension), np.nan)
        pieces = [rows[k : k + _BATCH] for k in range(0, len(rows), _BATCH)]
        solving = on_cores(lambda one: self._overlap(one, tension[one]), pieces)
        for piece, values in zip(pieces, solving, strict=True):
            values_of_rows[piece] = values
        return values_of_rows

    def _overlap(
        self, rows: Int[np.ndarray, " m"], tension: Float[np.ndarray, " m"]
    ) -> Float[np.ndarray, " m"]:
        robot, notch = np.divmod(rows, len(self.notches))
        commands = tension_commands(tension[:, None] * self.unit[notch])
        layout = self.chains.ready.command_layout(commands)
        packed = layout.pack(commands, leading=1)[:, None]
        settings = np.array(DEFAULT.numbers)
        layouts = (self.chains.structure, layout, _OUTPUTS)
        by_row = (True, True, False)
        states = follow_row.rows(by_row, self.robots[robot], packed, settings, *layouts)
        own = np.arange(len(rows)), 0, self.notches[notch]
        # The root does not depend on the stiffness: that of one robot serves for all.
        overlap = states["contact_force"][own] / self.stiffness[notch] - states["gap"][own]
        return np.where(states["converged"][:, 0], overlap, np.nan)
