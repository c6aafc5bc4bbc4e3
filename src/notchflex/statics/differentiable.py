"""A robot under loads as a function of its numbers that JAX can differentiate, map and compile."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.errors import InputError
from notchflex.robot import Robot
from notchflex.robot.paths import number_at
from notchflex.statics.actuation import Command
from notchflex.statics.command import command
from notchflex.statics.given import robot_given, shown
from notchflex.statics.kinks import Kink, kinks
from notchflex.statics.load import Load, LoadPath, load_path
from notchflex.statics.newton import DEFAULT, Settings
from notchflex.statics.numbers import with_slopes
from notchflex.statics.outputs import followed, known_outputs
from notchflex.statics.packing import Form
from notchflex.statics.path import EquilibriumPath
from notchflex.statics.prepare import Prepared, prepared
from notchflex.statics.run import run
from notchflex.statics.sensitivity import answered, solved_path
from notchflex.statics.solve import check_refinement, prepared_for
from notchflex.statics.stepping import at_rest

_TENDONS = ("tension", "stroke")
_TIP = ("tip_force", "tip_moment")
# Largest change of a parameter in one-sided differences.
_ASIDE = 1e-5


def differentiable(
    robot: Robot,
    loads: Load | LoadPath | Iterable[Load],
    parameters: Sequence[str],
    *,
    outputs: Sequence[str] = ("total_angle", "tip_position", "converged"),
    settings: Settings | None = None,
    refinement: int = 0,
) -> Differentiable:
    """Make a robot under loads a function of some of its numbers.

    The function takes a table of values by name and returns a table of outputs by name. `jax.jvp`,
    `jax.grad`, `jax.vmap` and `jax.jit` compose with it. Loads are followed one after the other
    with friction that remembers, and so are the derivatives. Where a contact changes between
    sticking and sliding, lips meet or the material's law has a kink, so has the function, and the
    derivative is that of one side: `kinks` lists such contacts and notches, `one_sided` gives the
    derivatives of both sides. With friction it is NaN from a load on that was so hard that it
    was solved in three parts or more: what contacts remember of the parts is not followed. Smaller
    steps help.

    Args:
        robot: The robot.
        loads: A path, or loads in order.
        parameters: What may vary: numbers of the robot by name (as for `Robot.with_value`, in the
            units of the robot file), and of the loads "tension" (N, steps by tendons), "stroke"
            (mm), "tip_force" (N, steps by 3) and "tip_moment" (N mm).
        outputs: What to return, by names of `EquilibriumPath`.
        settings: How hard the solver tries.
        refinement: More strain modes, as for `simulate`.

    Returns:
        The function; its `start` are the present values.

    Raises:
        InputError: There is no such number, output or refinement, or the loads are none.

    Inside a program that JAX traces, numbers that no robot can have are told by `converged` being
    false, and by slopes that are NaN.

    Example:
        >>> import jax
        >>> from notchflex import load_robot, pull
        >>> wrist = load_robot("pacheco2021-a")
        >>> bend = differentiable(wrist, pull(1.0, 1.0, steps=1), ["notch.depth", "tension"])
        >>> by = jax.grad(lambda values: bend(values)["total_angle"][-1])(bend.start)
        >>> f"{by['notch.depth']:.2f} rad/mm, {by['tension'][0, 0]:.3f} rad/N"
        '13.30 rad/mm, 1.520 rad/N'
    """
    path = load_path(loads, robot_given(robot).number_of_tendons)
    check_refinement(refinement)
    names = (parameters,) if isinstance(parameters, str) else tuple(parameters)
    if not names or len(set(names)) < len(names):
        raise InputError("parameters must name at least one number, and none of them twice")
    of_loads = (*_TENDONS, *_TIP)
    start: dict[str, Any] = {name: number_at(robot, name) for name in names if name not in of_loads}
    for name in _TENDONS:
        if name in names:
            given = path.tension if name == "tension" else path.stroke
            if np.isnan(given).all():
                raise InputError(f"the loads give no {name} that could vary")
            start[name] = np.nan_to_num(given)
    for name in _TIP:
        if name in names:
            start[name] = np.array([getattr(one, name) for one in path.external])
    start = {name: jnp.asarray(start[name], float) for name in names}
    return Differentiable(
        robot, path, start, known_outputs(outputs), settings or DEFAULT, refinement
    )


@dataclass(frozen=True, eq=False)
class Differentiable:
    """A robot under loads as a function of some of its numbers; see `differentiable`.

    Attributes:
        robot: The robot as it is.
        load: The loads.
        start: Present values of the parameters.
        outputs: Names of what is returned.
        settings: How hard the solver tries.
        refinement: More strain modes.
    """

    robot: Robot
    load: LoadPath
    start: dict[str, Array]
    outputs: tuple[str, ...]
    settings: Settings
    refinement: int

    def __call__(self, values: Mapping[str, Any] | None = None) -> dict[str, Array]:
        """What is asked of every state, loads as leading axis.

        Args:
            values: By name of the parameter, in the shape of `start`; those not given stay.

        Raises:
            InputError: Values of another name or shape, or, where nothing is traced, a robot that
                cannot be.
        """
        taken = self._taken(values)
        if not any(isinstance(value, Tracer) for value in taken.values()):
            self._check(taken)
        arrays = self.traced(jnp.array([taken[name] for name in self.numbers], float))
        loads = {name: value for name, value in taken.items() if name in (*_TENDONS, *_TIP)}
        given = {name: getattr(self.load, name) for name in _TENDONS}
        return _followed(self._program, arrays, loads, given, np.array(self.settings.numbers))

    def kinks(self, values: Mapping[str, Any] | None = None, *, within: float = 1e-6) -> list[Kink]:
        """List the contacts and notches at a switch, where derivatives are those of one side.

        Args:
            values: As for a call.
            within: Distance from the switch up to which they count; see `Kink.distance`.

        Raises:
            InputError: Values of another name or shape, or a robot that cannot be.
        """
        return kinks(self._path(self._taken(values)), within)

    def one_sided(
        self, direction: Mapping[str, Any], values: Mapping[str, Any] | None = None
    ) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        """Find the derivatives along a direction from its two sides, by differences.

        Away from kinks both are the directional derivative that JAX gives; at a kink that one is
        one of the two.

        Args:
            direction: Change of the parameters by name, in the shape of `start`; those not given
                stay.
            values: Where; as for a call.

        Returns:
            The derivatives of every output that is no truth value, against the direction and along
            it, right to about 1e-7 of the output per unit of the direction.

        Raises:
            InputError: Values of another name or shape, a robot that cannot be, or a load that does
                not converge.
        """
        at, along = self._taken(values), self._taken(direction)
        along = {name: along[name] if name in direction else 0.0 * along[name] for name in along}
        size = max(float(jnp.max(jnp.abs(step))) for step in along.values())
        if size == 0.0:
            raise InputError("the direction changes nothing; give a change of some parameter")

        def outputs(part: float) -> dict[str, np.ndarray]:
            moved = {name: at[name] + part * along[name] for name in at}
            path = self._path(moved).raise_if_failed()
            every = {name: np.asarray(getattr(path, name)) for name in self.outputs}
            return {name: one for name, one in every.items() if one.dtype != bool}

        middle = outputs(0.0)
        sides: list[dict[str, np.ndarray]] = []
        for sign in (-1.0, 1.0):
            step = sign * _ASIDE / size
            near, far = outputs(step), outputs(2.0 * step)
            sides.append(
                {
                    name: (4.0 * near[name] - 3.0 * middle[name] - far[name]) / (2.0 * step)
                    for name in middle
                }
            )
        return sides[0], sides[1]

    def _path(self, values: dict[str, Array]) -> EquilibriumPath:
        """Solve the path at some values."""
        numbers = {name: float(values[name]) for name in self.numbers}
        robot = self.robot.with_values(numbers) if numbers else self.robot
        load = self.load
        for name in _TENDONS:
            if name in values:
                given = getattr(load, name)
                value = np.where(np.isnan(given), np.nan, np.asarray(values[name]))
                load = dataclasses.replace(load, **{name: value})
        if self._tip:
            external = tuple(
                dataclasses.replace(
                    one,
                    **{name: tuple(np.asarray(values[name])[step].tolist()) for name in self._tip},
                )
                for step, one in enumerate(load.external)
            )
            load = dataclasses.replace(load, external=external)
        ready = self._prepared(robot)
        came = run(
            ready, command(load, robot, ready.chain), None, self.settings, each_from_start=False
        )
        return EquilibriumPath(robot, load, ready, came, settings=self.settings)

    def _taken(self, values: Mapping[str, Any] | None) -> dict[str, Array]:
        """Values of all parameters, in their shapes."""
        given = dict(values or {})
        wrong = [name for name in given if name not in self.start]
        if wrong:
            raise InputError(f"`{wrong[0]}` is none of the parameters {', '.join(self.start)}")
        return {name: self._value(name, given.get(name, at)) for name, at in self.start.items()}

    def _check(self, values: dict[str, Array]) -> None:
        """Refuse what no robot or load can have; what is traced is told by `converged` alone."""
        numbers = {name: float(values[name]) for name in self.numbers}
        if numbers != {name: float(self.start[name]) for name in self.numbers}:
            self.robot.with_values(numbers)
        if "tension" in values and not (values["tension"] >= 0.0).all():
            raise InputError("a tendon can only pull; give tensions of 0 N or more")

    def _value(self, name: str, value: Any) -> Array:
        wanted = self.start[name].shape
        try:
            return jnp.broadcast_to(jnp.asarray(value, float), wanted)
        except (TypeError, ValueError):
            raise InputError(
                f"`{name}` must be numbers of shape {wanted}; got {shown(value)}"
            ) from None

    @cached_property
    def numbers(self) -> tuple[str, ...]:
        """Names of the parameters that are numbers of the robot."""
        return tuple(name for name in self.start if name not in (*_TENDONS, *_TIP))

    @cached_property
    def _tip(self) -> tuple[str, ...]:
        return tuple(name for name in _TIP if name in self.start)

    def _prepared(self, robot: Robot) -> Prepared:
        if self._tip:  # may point anywhere
            return prepared(robot, "space", loaded=True, refinement=self.refinement, flat=False)
        return prepared_for(robot, self.load, None, self.refinement)

    @cached_property
    def ready(self) -> Prepared:
        """The robot as it is, as arrays."""
        return self._prepared(self.robot)

    @cached_property
    def command_form(self) -> Form:
        """Form of one load."""
        return self.ready.command_form(command(self.load, self.robot, self.ready.chain))

    @cached_property
    def traced(self) -> Any:
        """From numbers of the robot to all arrays as one vector."""
        present = np.array([float(self.start[name]) for name in self.numbers])
        return with_slopes(self._arrays, len(self._arrays(present)))

    def _arrays(self, numbers: Float[np.ndarray, " k"]) -> Float[np.ndarray, " all"]:
        """Chain, loads without those at the tip that vary, and loads of 1 N or N mm at the tip."""
        values = {name: float(at) for name, at in zip(self.numbers, numbers, strict=True)}
        robot = self.robot.with_values(values) if values else self.robot
        ready = self._prepared(robot)
        if ready.chain_form is not self.ready.chain_form:
            raise InputError(f"with {values} the robot has another form; it must stay the same")
        nothing: dict[str, Any] = dict.fromkeys(self._tip, (0.0, 0.0, 0.0))
        bare = self.load.loaded(**nothing)
        units: list[dict[str, Any]] = [{name: row} for name in self._tip for row in np.eye(3)]
        unit = [bare.loaded(**one) for one in units]
        packed = [
            self.command_form.pack(command(path, robot, ready.chain), leading=1).ravel()
            for path in (bare, *unit)
        ]
        return np.concatenate([ready.chain_form.pack(ready.chain), *packed])

    @cached_property
    def _program(self) -> _Program:
        return _Program(self.ready.chain_form, self.command_form, self._tip, self.outputs)


@dataclass(frozen=True)
class _Program:
    """What a compiled program is made for: robots and loads of one form share it."""

    chain_form: Form
    command_form: Form
    tip: tuple[str, ...]
    outputs: tuple[str, ...]

    def commands(
        self,
        packed: Float[Array, " loads"],
        values: dict[str, Array],
        given: dict[str, Float[Array, "s t"]],
    ) -> Command:
        """The loads, with the values of parameters in them."""
        form = self.command_form
        every = packed.reshape(1 + 3 * len(self.tip), -1, form.size)
        bare: Command = form.unpack(every[0])
        applied = bare.applied
        for number, name in enumerate(self.tip):
            for axis in range(3):
                unit: Command = form.unpack(every[1 + 3 * number + axis])
                along = values[name][:, axis]
                applied = jax.tree.map(partial(_added, along), applied, bare.applied, unit.applied)
        value = bare.value
        if "tension" in values:
            pulled = jnp.where(values["tension"] < 0.0, jnp.nan, values["tension"])
            value = jnp.where(~jnp.isnan(given["tension"]), pulled, value)
        if "stroke" in values:
            value = jnp.where(~jnp.isnan(given["stroke"]), values["stroke"], value)
        return bare._replace(value=value, applied=applied)


def _added(along: Array, total: Array, none: Array, unit: Array) -> Array:
    return total + along.reshape(-1, *(1,) * (unit.ndim - 1)) * (unit - none)


# Without options of the compiler: JAX takes them only where nothing else is traced around.
@partial(jax.jit, static_argnums=0)
def _followed(
    program: _Program,
    arrays: Float[Array, " all"],
    values: dict[str, Array],
    given: dict[str, Float[Array, "s t"]],
    numbers: Float[Array, " settings"],
) -> dict[str, Array]:
    size = program.chain_form.size
    chain = program.chain_form.unpack(arrays[:size])
    commands = program.commands(arrays[size:], values, given)
    start, settings = at_rest(chain), Settings.of(numbers)
    # Solved once, and looked at again for the slopes: nothing that iterates is differentiated.
    items: Any = (commands, solved_path(chain, commands, start, settings))
    return followed(chain, items, start, settings, program.outputs, answered)


__all__ = ["Differentiable", "differentiable"]
