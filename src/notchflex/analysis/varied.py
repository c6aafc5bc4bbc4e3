"""Chains and commands of robots that differ from one by a few numbers, as rows of a batch."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from notchflex._jax import jax
from notchflex.analysis.solve import prepare_for
from notchflex.loads import LoadPath
from notchflex.loads.command import Command, make_commands
from notchflex.mechanics.chain import Chain
from notchflex.robot import Robot
from notchflex.robot.value_names.numbers import apart, parts_of, places_of
from notchflex.robot.value_names.paths import parse_path
from notchflex.robot.value_names.varied import VariedRobots
from notchflex.solver.programs.assembled import AssembledRobots
from notchflex.solver.programs.prepare import PreparedChain
from notchflex.solver.programs.static_structure import PytreeLayout, StaticStructure

# Fewer robots are assembled in Python before programs for them are compiled.
_MIN_ROBOTS = 256


@dataclass(frozen=True, eq=False)
class VariedChains:
    """Chains and commands of varied robots, as the rows of a batch.

    Attributes:
        robots: The robots.
        load: The loads of every robot.
        refinement: More strain modes, as for `simulate`.
        ready: The chain of the robot that is varied.
        programs: Programs that make the chains.
        numbers: All numbers of every robot.
        command: Layout of one load.
    """

    robots: VariedRobots
    load: LoadPath
    refinement: int
    ready: PreparedChain
    programs: AssembledRobots
    numbers: Float[np.ndarray, "robots numbers"]
    command: PytreeLayout

    @property
    def structure(self) -> StaticStructure:
        """Layout of the chains for programs."""
        return self.programs.joined.structure

    def rows(self, index: slice) -> tuple[np.ndarray, np.ndarray, Int[np.ndarray, " m"]]:
        """Return chains and commands of some robots, packed for programs.

        Returns:
            Chains, commands (robots and then steps as leading axes), and which of the robots have
            a chain of another form: theirs are wrong.
        """
        chains, alike = self.programs.chains(self.numbers[index])
        commands = make_commands(self.load, self.robots.robot, self._bodies(chains))
        if commands.applied is None:
            packed = self.command.pack(commands, leading=1)[None].repeat(len(chains), axis=0)
        else:
            shape = (len(chains), *np.shape(commands.target))
            targets: list[Any] = [
                None if values is None else np.broadcast_to(values, shape)
                for values in (commands.target, commands.by_stroke)
            ]
            commands = Command(targets[0], targets[1], commands.applied)
            packed = self.command.pack(commands, leading=2)
        return chains, packed, np.flatnonzero(~alike)

    def _bodies(self, chains: Float[np.ndarray, "k chain"]) -> Chain:
        """Return the chain with the masses and lengths of the bodies of every robot."""
        form = self.structure.form
        indices: Chain = jax.tree.unflatten(form.structure, form.indices)
        names = ("body_length", "body_mass", "body_centre")
        values: dict[str, Any] = {
            name: chains[:, self.structure.indices_of(getattr(indices, name))] for name in names
        }
        return dataclasses.replace(self.ready.chain, **values)


def varied_chains(robots: VariedRobots, load: LoadPath, refinement: int) -> VariedChains | None:
    """Return chains of varied robots under one path of loads.

    Args:
        robots: The robots.
        load: The loads of every robot.
        refinement: More strain modes, as for `simulate`.

    Returns:
        The chains; None where each robot is assembled by itself.
    """
    if len(robots) < _MIN_ROBOTS or not robots.valid().all():
        return None
    # Values of all notches come before those of one, as in a robot file.
    names = sorted(robots.names, key=lambda name: parse_path(name).number is not None)
    robot, programs, ready = _programs(robots.robot, (*names,), load, refinement)
    if programs is None:
        return None
    form = programs.form
    numbers = np.tile(form.numbers_of(parts_of(robot)), (len(robots), 1))
    for name in names:
        places = places_of(robot, name)
        if not set(places) <= set(form.places):  # a direction, or no finite number
            return None
        for place in places:
            numbers[:, form.places.index(place)] = robots.values[name]
    if programs.joined.structure.form is not ready.chain_layout:
        return None
    commands = make_commands(load, robot, ready.chain)
    command = ready.command_layout(commands)
    return VariedChains(robots, load, refinement, ready, programs, numbers, command)


@lru_cache(maxsize=8)
def _programs(
    robot: Robot, names: tuple[str, ...], load: LoadPath, refinement: int
) -> tuple[Robot, AssembledRobots | None, PreparedChain]:
    """Return the robot with a notch of its own for every name of one, and programs for others."""
    robot = apart(robot, names)
    ready = prepare_for(robot, load, None, refinement)
    varied = [place for name in names for place in places_of(robot, name)]
    return robot, AssembledRobots.tried(robot, ready.chain, varied), ready
