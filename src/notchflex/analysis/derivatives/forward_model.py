"""The forward model: from numbers of a robot and its loads to solved states and derivatives.

All derivatives of results use it. Compiled programs compute states, and derivatives of the arrays
of a robot and along the path.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from notchflex.analysis.derivatives.differences import nearby, slope
from notchflex.analysis.derivatives.tangent import Change, PathTangents, gradient
from notchflex.analysis.solve import prepare_for
from notchflex.errors import InputError
from notchflex.loads.command import Command, load_slopes, make_commands
from notchflex.loads.load_path import LoadPath
from notchflex.mechanics.chain import ChainTemplate, chain_template, laws
from notchflex.results.path import EquilibriumPath
from notchflex.robot import Robot
from notchflex.robot.value_names import number_at
from notchflex.robot.value_names.numbers import (
    PartsForm,
    Place,
    apart,
    differing,
    parts_of,
    places_of,
)
from notchflex.robot.value_names.paths import parse_path
from notchflex.solver.newton import DEFAULT, Settings
from notchflex.solver.programs.assembled import assembled_chain, chain_slopes
from notchflex.solver.programs.prepare import PreparedChain, prepare
from notchflex.solver.programs.run import run
from notchflex.solver.programs.static_structure import pad_rows
from notchflex.solver.solver_state import SolverState

# Cost of the gradient of one number, in derivatives along single directions.
_ADJOINT = 4


@dataclass(frozen=True, eq=False)
class ForwardModel:
    """A robot under loads as a function of its numbers and of the loads.

    Attributes:
        robot: The nominal robot.
        load: The nominal loads.
        settings: Tolerance and limits of the solver.
        refinement: More strain modes, as for `simulate`.
        from_rest: Which steps start from rest, (s,); the others from the step before.
        any_load: Whether loads on the bodies may vary, and so may point anywhere.
    """

    robot: Robot
    load: LoadPath
    settings: Settings = DEFAULT
    refinement: int = 0
    from_rest: bool | Bool[np.ndarray, " s"] = False
    any_load: bool = False

    @cached_property
    def ready(self) -> PreparedChain:
        """The nominal robot as arrays."""
        return self._assembled(self.robot)

    def solve(
        self, robot: Robot, load: LoadPath, start: SolverState | None = None
    ) -> EquilibriumPath:
        """Solve loads with a robot that has other numbers.

        Args:
            robot: The robot.
            load: Loads of the same kind as those of the model.
            start: The state to start from; rest where not given.

        Raises:
            InputError: The arrays of the robot have another form than those of the model's.
        """
        ready = self._prepared(robot)
        commands = make_commands(load, robot, ready.chain)
        came = run(ready, commands, start, self.settings, each_from_start=self.from_rest)
        return EquilibriumPath(robot, load, ready, came, settings=self.settings)

    def change(self, robot: Robot, load: LoadPath, name: str) -> Change:
        """Differentiate arrays and loads by a number of the robot; as `changes` does."""
        return self.changes(robot, load, (name,))[0]

    def changes(self, robot: Robot, load: LoadPath, names: Sequence[str]) -> list[Change]:
        """Differentiate arrays and loads by numbers of the robot.

        Args:
            robot: The robot with the values at which to differentiate.
            load: The loads.
            names: Names of the numbers.

        Raises:
            InputError: A number cannot be varied.
        """
        moved = {name: _moved(robot, name, names) for name in names}
        for name in set(names) - self._can_be_varied:
            nearby(moved[name], number_at(robot, name), 2)
            self._can_be_varied.add(name)
        robot = apart(robot, names)
        # A number of one notch is not that of all notches.
        single = {name: places_of(robot, name) for name in names if _is_of_one(name)}
        of_one = {place for own in single.values() for place in own}
        places = [
            single.get(name) or [one for one in places_of(robot, name) if one not in of_one]
            for name in names
        ]
        every = [place for own in places for place in own]
        numbers = set(PartsForm.of(parts_of(robot), every).places)
        traced = [own for own in places if numbers.issuperset(own)]

        def units(form: PartsForm) -> Float[np.ndarray, "k numbers"]:
            return np.array([[place in own for place in form.places] for own in traced], float)

        every = [place for own in traced for place in own]
        slopes = iter((self._along(robot, load, every, units) if traced else None) or [])
        return [
            (next(slopes, None) if own in traced else None)
            or self._differences(moved[name], number_at(robot, name), load)
            for name, own in zip(names, places, strict=True)
        ]

    def change_along(
        self, robot_at: Callable[[float], Robot], at: float, load: LoadPath, *, order: int = 6
    ) -> Change:
        """Differentiate arrays and loads along a family of robots.

        Args:
            robot_at: The robot of a number; only its geometry and loads on its mass may vary.
            at: The number at which to differentiate.
            load: The loads.
            order: Order of accuracy of the slopes of the robot's numbers, as for `slope`.

        Raises:
            InputError: The number cannot be varied.
        """
        robot, parts = robot_at(at), parts_of(robot_at(at))

        def difference(form: PartsForm) -> Float[np.ndarray, "1 numbers"]:
            return slope(lambda v: form.numbers_of(parts_of(robot_at(v))), at, order=order)[None]

        varied = differing(parts, parts_of(nearby(robot_at, at, order)))
        slopes = None if varied is None else self._along(robot, load, varied, difference)
        return self._differences(robot_at, at, load, order) if slopes is None else slopes[0]

    def _along(
        self,
        robot: Robot,
        load: LoadPath,
        varied: Collection[Place],
        changes: Callable[[PartsForm], np.ndarray],
    ) -> list[Change] | None:
        """Differentiate along changes of numbers; None where the form changes with them."""
        ready = self._prepared(robot)
        slopes = chain_slopes(robot, ready.chain, varied, changes)
        if slopes is None:
            return None
        loads: Any = [None] * len(slopes)
        if ready.chain.loaded:
            by = load_slopes(load, robot, ready.chain, ready.chain_layout.unpack(slopes))
            commands = make_commands(load, robot, ready.chain)
            none: Any = np.zeros((len(slopes), *np.shape(commands.target)))
            form, long = ready.command_layout(commands), ready.long.command_layout(commands)
            still = Command(none, None if commands.by_stroke is None else none, by)
            loads = pad_rows(form.pack(still, leading=2), form, long)
        return [Change(*both) for both in zip(loads, ready.long_slopes(slopes), strict=True)]

    def _differences(
        self, robot_at: Callable[[float], Robot], at: float, load: LoadPath, order: int = 6
    ) -> Change:
        """Differentiate by what decides the form, such as a direction, by differences."""
        size = self.ready.long.chain_layout.size
        by_number = slope(lambda value: self._packed(robot_at(value), load), at, order=order)
        return Change(by_number[size:].reshape(len(load), -1), by_number[:size])

    def _packed(self, robot: Robot, load: LoadPath) -> Float[np.ndarray, " packed"]:
        """Pack the long chain and the loads of all steps into one vector."""
        ready = self._prepared(robot)
        loads, _ = ready.padded_commands(make_commands(load, robot, ready.chain))
        return np.concatenate([ready.long.vector, loads.ravel()])

    def load_change(self, path: EquilibriumPath, load: LoadPath) -> Float[np.ndarray, "s command"]:
        """Compute the difference of other loads from those of a path, packed for the long chain."""
        ready, robot = path.prepared, path.robot
        present, _ = ready.padded_commands(path.commands)
        target, _ = ready.padded_commands(make_commands(load, robot, ready.chain))
        return target - present

    def derivatives(
        self,
        path: EquilibriumPath,
        changes: Iterable[Change],
        outputs: tuple[str, ...],
        *,
        remembers: bool = True,
    ) -> dict[str, np.ndarray]:
        """Differentiate a solved path.

        Args:
            path: As `solve` returns it.
            changes: Directions, one or more.
            outputs: Quantities that the solver reports as floats.
            remembers: Whether changes pass from state to state through the memory of the contacts.

        Returns:
            By name, directions and then steps as leading axes, in the world. NaN from the first
            step that did not converge, or whose derivatives are not known.
        """
        directions = tuple(changes)
        shapes = {name: np.shape(path.quantity(name)) for name in outputs}
        if not remembers or not self.takes_adjoint(path, outputs, len(directions)):
            tangents = PathTangents(path, outputs, remembers)
            columns = [tangents.along(one) for one in directions]
            return {name: np.stack([one[name] for one in columns]) for name in outputs}
        derivatives = {name: np.empty((len(directions), *shape)) for name, shape in shapes.items()}
        for name, shape in shapes.items():
            for index in np.ndindex(shape):
                weight = np.zeros(shape)
                weight[index] = 1.0
                by = gradient(path, {name: weight})
                derivatives[name][:, *index] = [by.along(one) for one in directions]
        return derivatives

    def takes_adjoint(
        self, path: EquilibriumPath, outputs: tuple[str, ...], directions: int
    ) -> bool:
        """Return whether the adjoint is cheaper for a number of directions."""
        numbers = sum(np.asarray(path.quantity(name)).size for name in outputs)
        return _ADJOINT * numbers <= directions

    def _assembled(self, robot: Robot) -> PreparedChain:
        if self.any_load:
            return prepare(robot, "space", loaded=True, refinement=self.refinement, flat=False)
        return prepare_for(robot, self.load, None, self.refinement)

    @cached_property
    def _prepared(self) -> Callable[[Robot], PreparedChain]:
        """Function that prepares a robot with other numbers; the last results are cached."""
        return lru_cache(maxsize=4)(self._varied)

    def _varied(self, robot: Robot) -> PreparedChain:
        if robot is self.robot:
            return self.ready
        changed = differing(parts_of(self.robot), parts_of(robot))
        # Fits of material and friction constants vary a few numbers of the chain.
        if changed is not None and not {key for part, key in changed if _is_of_chain(part, key)}:
            fields = laws(robot.material, self._template) | laws(robot.friction, self._template)
            return self.ready.with_fields(fields)
        chain = assembled_chain(robot, self.ready.chain)
        ready = self._assembled(robot) if chain is None else PreparedChain(chain)
        if ready.chain_layout is not self.ready.chain_layout:
            raise InputError.UNSUPPORTED(
                "with these values the robot has another form; it must stay the same"
            )
        return ready

    @cached_property
    def _can_be_varied(self) -> set[str]:
        return set()

    @cached_property
    def _template(self) -> ChainTemplate:
        chain = self.ready.chain
        return chain_template(self.robot, chain.level, chain.refinement)


def _moved(robot: Robot, name: str, names: Iterable[str]) -> Callable[[float], Robot]:
    """Return the robot as a function of a number; what has a name of its own stays."""
    others = [] if _is_of_one(name) else filter(_is_of_one, names)
    kept = {other: number_at(robot, other) for other in others}
    return lambda value: robot.with_values({name: value, **kept})


def _is_of_one(name: str) -> bool:
    """Return whether a number is of one notch or tendon."""
    return parse_path(name).number is not None


def _is_of_chain(part: int, key: str) -> bool:
    """Return whether more of a chain depends on a number than the laws."""
    return part not in (1, 2) or key in ("density", "poisson_ratio")
