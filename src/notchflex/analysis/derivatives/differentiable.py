"""A robot under loads as a function of its numbers that JAX can differentiate, map and compile."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.analysis.derivatives.callback import outputs_function
from notchflex.analysis.derivatives.forward_model import Change, ForwardModel
from notchflex.analysis.derivatives.kinks import Kink, kinks
from notchflex.analysis.outputs import check_outputs
from notchflex.analysis.solve import check_refinement
from notchflex.errors import InputError
from notchflex.loads import Load, LoadPath
from notchflex.loads.load_path import load_path
from notchflex.loads.validation import check_is_robot, short_repr
from notchflex.results.path import EquilibriumPath
from notchflex.robot import Robot
from notchflex.robot.value_names import number_at
from notchflex.solver.newton import DEFAULT, Settings

_TENDONS = ("tension", "stroke")
_TIP = ("tip_force", "tip_moment")
# Largest change of a parameter in one-sided differences.
_ASIDE = 1e-5
# Derivatives by numbers of the robot that are kept.
_REMEMBERED = 256


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
    path = load_path(loads, check_is_robot(robot).number_of_tendons)
    check_refinement(refinement)
    names = (parameters,) if isinstance(parameters, str) else tuple(parameters)
    if not names or len(set(names)) < len(names):
        raise InputError.NO_DATA("parameters must name at least one number, and none of them twice")
    of_loads = (*_TENDONS, *_TIP)
    start: dict[str, Any] = {name: number_at(robot, name) for name in names if name not in of_loads}
    for name in _TENDONS:
        if name in names:
            given = path.tension if name == "tension" else path.stroke
            if np.isnan(given).all():
                raise InputError.NO_DATA(f"the loads give no {name} that could vary")
            start[name] = np.nan_to_num(given)
    for name in _TIP:
        if name in names:
            start[name] = np.array([getattr(one, name) for one in path.external])
    start = {name: jnp.asarray(start[name], float) for name in names}
    return Differentiable(
        robot, path, start, check_outputs(outputs), settings or DEFAULT, refinement
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
        if any(isinstance(value, Tracer) for value in taken.values()):
            return self._traced(taken)
        self._check(taken)
        return self._function(self._flat(taken))

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
            raise InputError.NO_DATA(
                "the direction changes nothing; give a change of some parameter"
            )

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

    def _path(self, values: Mapping[str, Any]) -> EquilibriumPath:
        """Solve the path at some values."""
        return self.model.solve(self._robot(values), self._load(values))

    def _robot(self, values: Mapping[str, Any]) -> Robot:
        numbers = {name: float(values[name]) for name in self.numbers}
        return self.robot.with_values(numbers) if numbers else self.robot

    def _load(self, values: Mapping[str, Any]) -> LoadPath:
        load = self.load
        for name in _TENDONS:
            if name in values:
                given = getattr(load, name)
                value = np.where(np.isnan(given), np.nan, np.asarray(values[name]))
                load = dataclasses.replace(load, **{name: value})
        tip = {name: np.asarray(values[name]) for name in self._tip}
        if tip:
            external = tuple(
                dataclasses.replace(one, **{name: tuple(at[step]) for name, at in tip.items()})
                for step, one in enumerate(load.external)
            )
            load = dataclasses.replace(load, external=external)
        return load

    def _taken(self, values: Mapping[str, Any] | None) -> dict[str, Array]:
        """Values of all parameters, in their shapes."""
        if not isinstance(values, Mapping | None):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise InputError.WRONG_TYPE(
                f"give values by name of the parameter; got {short_repr(values)}"
            )
        given = dict(values or {})
        wrong = [name for name in given if name not in self.start]
        if wrong:
            raise InputError.UNKNOWN_NAME(
                f"`{wrong[0]}` is none of the parameters {', '.join(self.start)}"
            )
        return {name: self._value(name, given.get(name, at)) for name, at in self.start.items()}

    def _check(self, values: dict[str, Array]) -> None:
        """Refuse what no robot or load can have; what is traced is told by `converged` alone."""
        numbers = {name: float(values[name]) for name in self.numbers}
        if numbers != {name: float(self.start[name]) for name in self.numbers}:
            self.robot.with_values(numbers)
        if "tension" in values and not (values["tension"] >= 0.0).all():
            raise InputError.OUT_OF_RANGE("a tendon can only pull; give tensions of 0 N or more")

    def _value(self, name: str, value: Any) -> Array:
        wanted = self.start[name].shape
        if isinstance(value, Tracer) and (value.shape, value.dtype) == (wanted, float):
            return value  # JAX would compile even a conversion that changes nothing
        try:
            return jnp.broadcast_to(jnp.asarray(value, float), wanted)
        except (TypeError, ValueError):
            raise InputError.WRONG_SHAPE(
                f"`{name}` must be numbers of shape {wanted}; got {short_repr(value)}"
            ) from None

    @cached_property
    def numbers(self) -> tuple[str, ...]:
        """Names of the parameters that are numbers of the robot."""
        return tuple(name for name in self.start if name not in (*_TENDONS, *_TIP))

    @cached_property
    def _tip(self) -> tuple[str, ...]:
        return tuple(name for name in _TIP if name in self.start)

    @cached_property
    def model(self) -> ForwardModel:
        """The forward model of the robot and its loads."""
        free = bool(self._tip)
        return ForwardModel(self.robot, self.load, self.settings, self.refinement, any_load=free)

    @cached_property
    def _traced(self) -> Callable[[dict[str, Array]], dict[str, Array]]:
        """The function of named values for JAX, as one program: JAX compiles each step else."""
        return jax.jit(lambda taken: self._function(self._flat(taken)))

    def _flat(self, taken: dict[str, Array]) -> Array:
        return jnp.concatenate([taken[name].ravel() for name in self.start])

    @cached_property
    def _function(self) -> Callable[[Array], dict[str, Array]]:
        """All values as one vector to the outputs, as a function of JAX."""
        start = np.concatenate([np.ravel(self.start[name]) for name in self.start])
        return outputs_function(_Solver(self), start)


class _Solver:
    """Outputs and their Jacobian by compiled programs, for plain vectors of values."""

    def __init__(self, function: Differentiable) -> None:
        self._of = function
        self.last: tuple[bytes, EquilibriumPath] | None = None
        self._kept: dict[Any, Change] = {}

    def values(self, flat: Float[np.ndarray, " k"]) -> dict[str, np.ndarray]:
        """Return the outputs.

        Raises:
            InputError: No robot or load can have these values.
        """
        path = self._path(flat)
        return {name: np.asarray(getattr(path, name)) for name in self._of.outputs}

    def jacobian(
        self, flat: Float[np.ndarray, " k"], outputs: tuple[str, ...]
    ) -> dict[str, np.ndarray]:
        """Return the derivatives of some outputs by every value, as last axis.

        Raises:
            InputError: No robot or load can have these values.
        """
        path = self._path(flat)
        changes = self._changes(path, self._named(flat))
        names = tuple(name for name in outputs if name != "residual")
        found = self._of.model.derivatives(path, changes, names)
        found = {name: np.moveaxis(one, 0, -1) for name, one in found.items()}
        if "residual" in outputs:  # what the solver leaves is no function of the values
            found["residual"] = np.zeros((len(self._of.load), len(flat)))
        return found

    def _named(self, flat: Float[np.ndarray, " k"]) -> dict[str, np.ndarray]:
        shapes = {name: np.shape(at) for name, at in self._of.start.items()}
        ends = np.cumsum([int(np.prod(shape)) for shape in shapes.values()])[:-1]
        parts = zip(shapes.items(), np.split(flat, ends), strict=True)
        return {name: part.reshape(shape) for (name, shape), part in parts}

    def _path(self, flat: Float[np.ndarray, " k"]) -> EquilibriumPath:
        """The path at some values; the last one is kept, as its derivatives are asked for next."""
        if not np.isfinite(flat).all():  # a tension that is no number would mean a slack tendon
            raise InputError.NOT_FINITE("values must be finite numbers")
        key = flat.tobytes()
        if self.last is None or self.last[0] != key:
            self.last = key, self._of._path(self._named(flat))  # pyright: ignore[reportPrivateUsage]
        return self.last[1]

    def _changes(self, path: EquilibriumPath, values: Mapping[str, np.ndarray]) -> Iterator[Change]:
        """Change of loads and chain per unit of every value."""
        of = self._of
        # One program for all: with a change of the chain where any value changes it.
        still = np.zeros(of.model.ready.long.chain_layout.size) if of.numbers else None
        for name, value in values.items():
            if name in of.numbers:
                yield self._by_number(path, values, name)
                continue
            for place in np.ndindex(value.shape):
                varied = np.array(value)
                varied[place] += 1.0  # loads are linear in tension, stroke, tip force and moment
                more = of._load({**values, name: varied})  # pyright: ignore[reportPrivateUsage]
                yield Change(of.model.load_change(path, more), still)

    def _by_number(
        self, path: EquilibriumPath, values: Mapping[str, np.ndarray], name: str
    ) -> Change:
        """Change by a number of the robot.

        The last ones are kept: a control loop asks for the same robot again and again, under other
        tensions and strokes, of which this does not depend.
        """
        of = self._of
        numbers = [float(values[own]) for own in of.numbers]
        tip = [values[own].tobytes() for own in values if own in _TIP]
        key = (name, *numbers, *tip)
        if key not in self._kept:
            if len(self._kept) >= _REMEMBERED:
                del self._kept[next(iter(self._kept))]
            self._kept[key] = of.model.change(path.robot, path.load, name)
        return self._kept[key]
