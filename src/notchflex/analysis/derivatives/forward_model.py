"""The forward model: from numbers of a robot and its loads to solved states and derivatives.

All derivatives of results use it. Compiled programs compute states and derivatives along the path;
the arrays of a robot are differentiated by its numbers with differences of plain Python.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial

import numpy as np
from jaxtyping import Bool, Float

from notchflex.analysis.derivatives.geometry_slopes import GeometrySlopes, slope
from notchflex.analysis.derivatives.tangent import Change, PathTangents, gradient
from notchflex.analysis.solve import prepare_for
from notchflex.errors import InputError
from notchflex.loads.command import make_commands
from notchflex.loads.load_path import LoadPath
from notchflex.mechanics.chain import ChainTemplate, FlexureOf, assemble, chain_template, laws
from notchflex.results.path import EquilibriumPath
from notchflex.robot import Robot
from notchflex.robot.value_names import number_at
from notchflex.solver.newton import DEFAULT, Settings
from notchflex.solver.programs.prepare import PreparedChain, flat, prepare
from notchflex.solver.programs.run import run
from notchflex.solver.solver_state import SolverState

# Cost of the gradient of one number, in derivatives along single directions.
_ADJOINT = 4
# Numbers of the material on which more depends than the section law.
_OF_THE_CHAIN = ("density", "poisson_ratio")


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

        Numbers that change different parts of the robot, such as dimensions of its notches, are
        varied together.

        Args:
            robot: The robot with the values at which to differentiate.
            load: The loads.
            names: Names of the numbers.

        Raises:
            InputError: A number cannot be varied.
        """
        by_name = {name: self._of_law(robot, name) for name in names if _is_of_law(name)}
        others = tuple(name for name in names if name not in by_name)
        if len(others) == 1:
            at = number_at(robot, others[0])
            moved = partial(robot.with_value, others[0])
            by_name[others[0]] = self.change_along(moved, at, load)
        elif others:
            if others not in self._geometry:
                self._geometry[others] = GeometrySlopes(self.ready, others)
            slopes = self._geometry[others].at(self._moved, robot, load)
            by_name |= zip(others, slopes, strict=True)
        return [by_name[name] for name in names]

    def _of_law(self, robot: Robot, name: str) -> Change:
        """Differentiate the law of the material, or of friction, by a number of its own."""
        section, _, key = name.partition(".")
        part, shape = getattr(robot, section), self._shape(robot)

        def of_laws(value: float) -> np.ndarray:
            return flat(laws(replace(part, **{key: value}), shape))

        chain = np.zeros(self.ready.long.chain_layout.size)
        chain[self._field_indices[section]] = slope(of_laws, getattr(part, key), order=2)
        return Change(None, chain)

    def change_along(
        self, robot_at: Callable[[float], Robot], at: float, load: LoadPath, *, order: int = 6
    ) -> Change:
        """Differentiate arrays and loads along a family of robots.

        Args:
            robot_at: The robot of a number; only its geometry and loads on its mass may vary.
            at: The number at which to differentiate.
            load: The loads.
            order: Order of accuracy, as for `slope`.

        Raises:
            InputError: The number cannot be varied.
        """
        size = self.ready.long.chain_layout.size
        by_number = slope(lambda value: self._packed(robot_at(value), load), at, order=order)
        return Change(by_number[size:].reshape(len(load), -1), by_number[:size])

    def _packed(self, robot: Robot, load: LoadPath) -> Float[np.ndarray, " packed"]:
        """Pack the long chain and the loads of all steps into one vector."""
        return _vector_of(self._prepared(robot), robot, load)

    def _moved(self, robot: Robot, load: LoadPath, flexures: FlexureOf) -> np.ndarray:
        """Pack one of many robots that differ little, from given flexures."""
        chain = self.ready.chain
        ready = PreparedChain(
            assemble(
                robot,
                chain.level,
                loaded=chain.loaded,
                follows=chain.follows,
                refinement=chain.refinement,
                flat=not self.any_load,
                flexures=flexures,
            )
        )
        return _vector_of(self._of_form(ready), robot, load)

    @cached_property
    def _geometry(self) -> dict[tuple[str, ...], GeometrySlopes]:
        return {}

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
        present, shape = self.robot, self._shape(robot)
        if robot is present:
            return self.ready
        # Fits of material and friction constants vary a few numbers of the chain.
        if shape is self._shape(present) and robot.material.density == present.material.density:
            fields = laws(robot.material, shape) | laws(robot.friction, shape)
            return self.ready.with_fields(fields)
        return self._of_form(self._assembled(robot))

    def _of_form(self, ready: PreparedChain) -> PreparedChain:
        """Check that a robot has arrays of the same form."""
        if ready.chain_layout is not self.ready.chain_layout:
            raise InputError.UNSUPPORTED(
                "with these values the robot has another form; it must stay the same"
            )
        return ready

    @cached_property
    def _field_indices(self) -> dict[str, np.ndarray]:
        """Indices in the long chain's vector of the fields of material and of friction."""
        shape = self._shape(self.robot)
        parts = {"material": self.robot.material, "friction": self.robot.friction}
        return {name: self.ready.field_indices(laws(part, shape)) for name, part in parts.items()}

    def _shape(self, robot: Robot) -> ChainTemplate:
        chain = self.ready.chain
        return chain_template(robot, chain.level, chain.refinement)


def _is_of_law(name: str) -> bool:
    """Return whether only the law of the material, or of friction, depends on a number."""
    section, _, key = name.partition(".")
    return section in ("material", "friction") and key not in _OF_THE_CHAIN


def _vector_of(ready: PreparedChain, robot: Robot, load: LoadPath) -> np.ndarray:
    """Pack the long chain and the loads of all steps into one vector."""
    loads, _ = ready.padded_commands(make_commands(load, robot, ready.chain))
    return np.concatenate([ready.long.vector, loads.ravel()])
