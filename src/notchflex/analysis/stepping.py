"""Incremental batches: rows of one robot, each with a friction history, loaded step by step.

`simulate_batch` takes all loads of a path in advance. In a control loop the next load depends on
the state, so the states of all rows are returned and passed back.
"""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Array, Bool, Float

from lanewise import WIDTH
from notchflex._jax import choose
from notchflex.analysis.outputs import report_quantities
from notchflex.analysis.solve import prepare_for, simulate
from notchflex.loads import Load
from notchflex.loads.command import make_commands
from notchflex.loads.load_path import load_path
from notchflex.results.path import EquilibriumPath
from notchflex.results.state import State
from notchflex.robot import Robot
from notchflex.solver.continuation import solve_load_step
from notchflex.solver.newton import (
    DEFAULT,
    Settings,
)
from notchflex.solver.programs.compiled import (
    native,
    number_of_cores,
    on_cores,
)
from notchflex.solver.programs.prepare import PreparedChain
from notchflex.solver.programs.static_structure import PytreeLayout, StaticStructure, lane_sizes
from notchflex.solver.quantities import believable
from notchflex.solver.solved_state import SolvedState

States = Float[np.ndarray, "k state"]


@dataclass(frozen=True, eq=False)
class BatchStepper:
    """A robot simulated in many independent rows, step by step.

    Attributes:
        robot: The robot.
        outputs: Quantities that a step returns; the base is not turned.
        cores: Number of cores to use; all where not given.

    Example:
        >>> from notchflex import load_robot
        >>> stepper = BatchStepper(load_robot("pacheco2021-a"), ("total_angle",))
        >>> states = stepper.at_rest(3)
        >>> for tension in (1.0, 2.0, 1.0):
        ...     states, found, good = stepper.step(states, np.full((3, 1), tension))
        >>> found["total_angle"].shape, bool(good.all())
        ((3,), True)
    """

    robot: Robot
    outputs: tuple[str, ...]
    cores: int | None = None

    def at_rest(self, rows: int) -> States:
        """Return a number of rows of the free robot with slack tendons, packed."""
        return np.repeat(self._prepared.rest_vector[None], rows, axis=0)

    def step(
        self, states: States, tension: Float[np.ndarray, "k t"]
    ) -> tuple[States, dict[str, np.ndarray], Bool[np.ndarray, " k"]]:
        """Pull the tendons of every row from its state.

        Args:
            states: Packed states before.
            tension: Tension of every tendon, N.

        Returns:
            States, outputs by name, and which rows converged. A row that did not converge keeps its
            state.
        """
        loads = np.repeat(self._load[None], len(states), axis=0)
        loads[:, self._targets] = tension
        cores = self.cores or number_of_cores()
        size = max(1, -(-len(states) // (cores * WIDTH))) * WIDTH
        starts = range(0, len(states), size)

        def solve(start: int) -> tuple[np.ndarray, dict[str, np.ndarray], np.ndarray]:
            some = slice(start, start + size)
            vectors = self._prepared.dynamic_vector, states[some], loads[some], self._numbers
            return _step_row.rows((False, True, True, False), *vectors, *self._layouts)

        if len(starts) < 2:
            return solve(0)
        with closing(on_cores(solve, starts, cores)) as solving:
            results = list(solving)
        outputs = {name: np.concatenate([one[1][name] for one in results]) for name in self.outputs}
        stack = np.concatenate
        return stack([one[0] for one in results]), outputs, stack([one[2] for one in results])

    def path(
        self, state: Float[np.ndarray, " state"], tension: Float[np.ndarray, " t"]
    ) -> EquilibriumPath:
        """Return the next step of one row as a path of one load, with all quantities.

        Args:
            state: Packed state before.
            tension: Tension of every tendon, N.
        """
        chain = self._prepared.chain
        solved = self._prepared.state.unpack(state)
        before = State(self.robot.name, solved, chain.level, chain.loaded, 0, self.robot)
        return simulate(self.robot, Load(tension=tuple(tension)), from_state=before)

    @cached_property
    def _prepared(self) -> PreparedChain:
        return prepare_for(self.robot, self._slack)

    @cached_property
    def _slack(self) -> Any:
        tendons = self.robot.number_of_tendons
        return load_path(Load(tension=(0.0,) * tendons), tendons)

    @cached_property
    def _command(self) -> tuple[np.ndarray, PytreeLayout]:
        commands = make_commands(self._slack, self.robot, self._prepared.chain)
        layout = self._prepared.command_layout(commands)
        return np.asarray(layout.pack(commands, leading=1))[0], layout

    @property
    def _load(self) -> Float[np.ndarray, " command"]:
        return self._command[0]

    @cached_property
    def _targets(self) -> np.ndarray:
        return self._command[1].indices[0]  # the first field of a `Command`

    @cached_property
    def _layouts(self) -> tuple[StaticStructure, PytreeLayout, PytreeLayout, tuple[str, ...]]:
        ready = self._prepared
        return ready.static_structure, self._command[1], ready.state, self.outputs

    @cached_property
    def _numbers(self) -> np.ndarray:
        return np.array(DEFAULT.numbers, float)


@native(4, lane_sizes)
def _step_row(
    chain: Float[Array, " chain"],
    before: Float[Array, " state"],
    load: Float[Array, " command"],
    numbers: Float[Array, " settings"],
    chain_layout: StaticStructure,
    command_layout: PytreeLayout,
    state_layout: PytreeLayout,
    outputs: tuple[str, ...],
) -> tuple[Array, dict[str, Array], Array]:
    """Solve one load from a state; a failure returns that state."""
    robot, last = chain_layout.unpack(chain), state_layout.unpack(before)
    result = solve_load_step(robot, command_layout.unpack(load), last, Settings.of(numbers))
    converged = result.converged & believable(SolvedState(robot, result.solved).quantity)
    solved = choose(converged, result.solved, last)
    return state_layout.pack(solved), report_quantities(robot, solved, outputs), converged
