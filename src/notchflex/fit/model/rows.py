"""What a robot is predicted to do at every measured row, and how that changes with its numbers.

Rows are paths of loads: one step from rest, or all steps of a pull with friction that remembers.
They run side by side over the cores; derivatives go through the solution (implicit function
theorem, `solver.sensitivity`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.analysis.axis_points import AxisPlaces, points_on_axis
from notchflex.analysis.derivatives.numbers import slope
from notchflex.analysis.outputs import followed
from notchflex.analysis.solve import prepared_for
from notchflex.errors import InputError
from notchflex.loads import LoadPath
from notchflex.loads.applied import is_unloaded
from notchflex.loads.command import Command, filled
from notchflex.mechanics.chain import Chain
from notchflex.results.path import command
from notchflex.robot import Robot
from notchflex.solver.continuation import at_rest
from notchflex.solver.newton import DEFAULT, Settings
from notchflex.solver.programs.kept_xla import kept
from notchflex.solver.programs.prepare import Prepared, lengthened
from notchflex.solver.programs.pytree_layout import Form
from notchflex.solver.programs.threads import number_of_cores, on_cores
from notchflex.solver.sensitivity import answered, solved_path

SENSOR = ("sensor.force_offset", "sensor.stroke_slack")
"""Numbers of the measurement itself: what a force gauge shows at no force (N), and the stroke that
only takes up slack (mm)."""

# Paths in one call of the program, and numbers that are varied in it, so that few programs serve
# any number of them: compiling takes longer than what is done in vain.
_PIECES = (1, 8, 48)
_NUMBERS = (4, 8, 16, 32, 64, 128)


class Predicted(NamedTuple):
    """Outputs at every row.

    Attributes:
        values: By name, rows as leading axis.
        converged: Whether the row was solved, (P,).
        slopes: By name, numbers and then rows as leading axes.
    """

    values: dict[str, np.ndarray]
    converged: np.ndarray
    slopes: dict[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class Rows:
    """A robot under the loads of a measurement, as a function of some of its numbers.

    Attributes:
        robot: The robot as it is.
        load: Loads of all rows; tensions may be those of a gauge with an offset, below 0 too.
        paths: Rows of every path, in order.
        names: Numbers that vary: of the robot by name, or of `SENSOR`.
        outputs: What is predicted, by names of `EquilibriumPath`; "axis_points" for
            those at `places`.
        measured: Tension (N) or stroke (mm) as measured, rows by tendons.
        flexures: How many flexures the arrays have, so that unlike robots share a program.
        places: Points of the tube axis; None where none are asked.
        settings: How hard the solver tries.
    """

    robot: Robot
    load: LoadPath
    paths: tuple[tuple[int, ...], ...]
    names: tuple[str, ...]
    outputs: tuple[str, ...]
    measured: Float[np.ndarray, "p t"]
    flexures: int
    places: AxisPlaces | None = None
    settings: Settings = DEFAULT

    @cached_property
    def own(self) -> tuple[str, ...]:
        """Names of the robot's numbers among those that vary."""
        return tuple(name for name in self.names if name not in SENSOR)

    def robot_with(self, numbers: Sequence[float]) -> Robot:
        """The robot with other numbers, in the order of `names`.

        Raises:
            InputError: No robot can have them.
        """
        values = dict(zip(self.names, map(float, numbers), strict=True))
        own = {name: values[name] for name in self.own}
        return self.robot.with_values(own) if own else self.robot

    @cached_property
    def _ready(self) -> Prepared:
        return self._prepared(self.robot)

    def _prepared(self, robot: Robot) -> Prepared:
        ready = prepared_for(robot, self.load)
        return lengthened(ready, max(self.flexures, ready.chain.flexures), self.edges)

    @cached_property
    def edges(self) -> int:
        """Most edges at which a tendon may meet the wall, with as many flexures."""
        own = prepared_for(self.robot, self.load).chain
        more = max(self.flexures - own.flexures, 0)
        return own.contacts.shape[1] + 2 * more

    @cached_property
    def _command_form(self) -> Form:
        return self._ready.command_form(self._commands(self.robot, self._ready))

    def _commands(self, robot: Robot, ready: Prepared) -> Any:
        own = prepared_for(robot, self.load).chain
        by_stroke = not np.isnan(self.load.stroke).all()
        return filled(command(self.load, robot, own), ready.chain.flexures, by_stroke)

    def _vector(self, own: Float[np.ndarray, " k"]) -> Float[np.ndarray, " all"]:
        """Chain and, where they depend on the robot (weights), loads, as one vector."""
        values = dict(zip(self.own, own.tolist(), strict=True))
        robot = self.robot.with_values(values) if values else self.robot
        ready = self._prepared(robot)
        if ready.chain_form is not self._ready.chain_form:
            raise InputError.UNSUPPORTED(
                f"with {values} {robot.name} has another form; it must stay the same"
            )
        packed = ready.chain_form.pack(ready.chain)
        if is_unloaded(self.load):
            return packed
        commands = self._commands(robot, ready)
        return np.concatenate([packed, self._command_form.pack(commands, leading=1).ravel()])

    @cached_property
    def _still_commands(self) -> Float[np.ndarray, "p command"]:
        return self._command_form.pack(self._commands(self.robot, self._ready), leading=1)

    def at(self, numbers: Float[np.ndarray, " k"]) -> Predicted:
        """Outputs at every row, and their derivatives by all numbers.

        Args:
            numbers: In the order of `names`.

        Raises:
            InputError: No robot can have these numbers.
        """
        place = [self.names.index(name) for name in self.own]
        own = np.asarray(numbers, float)[place]
        vector = self._vector(own)
        ways = next((size for size in _NUMBERS if size >= len(self.names)), len(self.names))
        tangents = np.zeros((ways, len(vector)))
        turns = np.zeros((ways, len(SENSOR)))
        for index, row in enumerate(place):
            tangents[row] = slope(self._vector, own, index, halvings=1)
        for row, name in enumerate(self.names):
            turns[row] = [name == one for one in SENSOR]
        sensor = np.array([self._sensor(name, numbers) for name in SENSOR])
        return self._run(vector, tangents, sensor, turns)

    def _sensor(self, name: str, numbers: Float[np.ndarray, " k"]) -> float:
        return float(numbers[self.names.index(name)]) if name in self.names else 0.0

    def _run(
        self, vector: np.ndarray, tangents: np.ndarray, sensor: np.ndarray, turns: np.ndarray
    ) -> Predicted:
        size = self._ready.chain_form.size
        commands, moved = self._still_commands, np.zeros((len(tangents), 0, 0))
        if len(vector) > size:
            commands = vector[size:].reshape(commands.shape)
            moved = tangents[:, size:].reshape(-1, *commands.shape)
        steps = max(map(len, self.paths))
        # A shorter path repeats its last load, which changes nothing.
        rows = np.array([(*path, *(path[-1],) * (steps - len(path))) for path in self.paths])
        piece = _piece(len(rows))
        index = np.minimum(np.arange(-(-len(rows) // piece) * piece), len(rows) - 1)
        forms = (self._ready.chain_form, self._command_form, self.outputs)
        chain = (vector[:size], tangents[:, :size])

        def some(start: int) -> Any:
            mine = rows[index[start : start + piece]]
            changes = moved[:, mine] if moved.size else None
            given = (commands[mine], changes, self.measured[mine], sensor, turns)
            found = _follow_all(*chain, *given, self._numbers, self.places, *forms)
            return jax.tree.map(np.asarray, found)

        starts = range(0, len(index), piece)
        found = [some(0)] if len(starts) == 1 else list(on_cores(some, starts))
        return self._gathered(found)

    @cached_property
    def _numbers(self) -> np.ndarray:
        return np.array(self.settings.numbers)

    def _gathered(self, found: list[Any]) -> Predicted:
        """Paths by steps as rows again."""
        number = np.concatenate([np.asarray(path) for path in self.paths])
        where = [(p, s) for p, path in enumerate(self.paths) for s in range(len(path))]
        path, step = np.array(where).T
        back = np.argsort(number)

        def rows(leaves: list[np.ndarray], axis: int) -> np.ndarray:
            whole = np.concatenate(leaves, axis=axis)
            taken = whole[path, step] if axis == 0 else whole[:, path, step]
            return taken[back] if axis == 0 else taken[:, back]

        values = {name: rows([one[0][name] for one in found], 0) for name in found[0][0]}
        converged = values.pop("converged") > 0.0
        own = len(self.names)
        slopes = {name: rows([one[1][name] for one in found], 1)[:own] for name in values}
        return Predicted(values, converged, slopes)


def _piece(paths: int) -> int:
    """How many paths are solved in one call of the program, so that all cores have work."""
    each = -(-paths // number_of_cores())
    return next((size for size in _PIECES if size >= each), _PIECES[-1])


@kept(9, 10, 11)
def _follow_all(
    chain: Float[Array, " chain"],
    chain_moves: Float[Array, "k chain"],
    commands: Float[Array, "b s command"],
    command_moves: Float[Array, "k b s command"] | None,
    measured: Float[Array, "b s t"],
    sensor: Float[Array, " 2"],
    sensor_moves: Float[Array, "k 2"],
    numbers: Float[Array, " settings"],
    places: AxisPlaces | None,
    chain_form: Form,
    command_form: Form,
    outputs: tuple[str, ...],
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Outputs of paths, and how they change, numbers as leading axis."""
    settings = Settings.of(numbers)
    bodies = ("body_position", "body_rotation") if places is not None else ()
    plain = tuple(name for name in outputs if name != "axis_points")
    asked = tuple(dict.fromkeys((*plain, *bodies, "converged")))

    def loads(path: Array, gauge: Array, shown: Array) -> Command:
        given: Command = command_form.unpack(path)
        true = jnp.maximum(given.either(shown - gauge[1], shown - gauge[0]), 0.0)
        return given._replace(value=jnp.where(jnp.isnan(shown), given.value, true))

    def one(path: Array, moves: Array | None, shown: Array) -> tuple[Any, Any]:
        # Solved once, and looked at again for its slopes: nothing that iterates is differentiated.
        parts: Chain = chain_form.unpack(chain)
        ways = solved_path(parts, loads(path, sensor, shown), at_rest(parts), settings)

        def told(vector: Array, given: Array, gauge: Array) -> dict[str, Array]:
            parts: Chain = chain_form.unpack(vector)
            items: Any = (loads(given, gauge, shown), ways)
            found = followed(parts, items, at_rest(parts), settings, asked, answered)
            if places is not None:
                poses = (found["body_position"], found["body_rotation"])
                found |= {"axis_points": jax.vmap(partial(points_on_axis, places))(*poses)}
            return {name: found[name].astype(float) for name in (*outputs, "converged")}

        nothing = jnp.zeros_like(path) if moves is None else None
        values, along = jax.linearize(told, chain, path, sensor)

        def move(by: tuple[Array, Array | None, Array]) -> Any:
            return along(by[0], nothing if by[1] is None else by[1], by[2])

        return values, jax.vmap(move)((chain_moves, moves, sensor_moves))

    axes = (0, None if command_moves is None else 1, 0)
    return jax.vmap(one, in_axes=axes, out_axes=(0, 1))(commands, command_moves, measured)


__all__ = ["SENSOR", "Predicted", "Rows"]
