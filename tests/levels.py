"""Solve with a chain of a given level, whatever the loads ask for."""

from __future__ import annotations

import notchflex as nf
from notchflex.loads.conversion import load_path
from notchflex.loads.make_commands import make_commands
from notchflex.results.path import EquilibriumPath
from notchflex.solver.newton import Settings
from notchflex.solver.programs.prepare import prepare
from notchflex.solver.programs.run import run


def simulate_at(robot: nf.Robot, loads, level: str, *, loaded: bool = False) -> EquilibriumPath:
    """`nf.simulate` with modes for "tendons" alone, loads in the "plane", or "space"."""
    load = load_path(loads, robot.number_of_tendons)
    ready = prepare(robot, level, loaded=loaded)
    commands = make_commands(load, robot, ready.chain)
    came = run(ready, commands, ready.rest, Settings(), each_from_start=False)
    return EquilibriumPath(robot, load, ready, came)
