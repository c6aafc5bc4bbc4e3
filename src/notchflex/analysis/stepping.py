"""Steps of a robot whose next drives depend on its state: control, learning, estimation.

`simulate` takes all loads of a path in advance. Here the state is returned and passed back, and all
that stays the same is packed once: robot, external loads, what is reported.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np
from jaxtyping import Array, Bool, Float, Int

from lanewise import WIDTH, FixedVector
from notchflex._arrays import xp
from notchflex._jax import choose, jax, jnp
from notchflex._quantity import REGISTERED
from notchflex._summary import Displayed, Summary
from notchflex.analysis.batch import number_of_threads, range_of
from notchflex.analysis.outputs import (
    OF_STATE,
    Arrays,
    check_outputs,
    report_quantities,
    slices_of,
    unpadded_entries,
)
from notchflex.analysis.solve import prepare_for, simulate
from notchflex.errors import Failure, InputError
from notchflex.loads import Load, LoadPath
from notchflex.loads.command import Command, make_commands
from notchflex.loads.load import (
    check_bool,
    check_integer,
    check_is_robot,
    one_or_several,
    rotation_of,
    short_repr,
)
from notchflex.loads.load_path import load_path
from notchflex.mechanics.chain import Chain
from notchflex.results.path import EquilibriumPath
from notchflex.results.state import State, check_robot, state_of
from notchflex.robot import Robot
from notchflex.solver.continuation import before_tendons, solve_load_step
from notchflex.solver.newton import DEFAULT, Settings
from notchflex.solver.programs.compiled import Native, Packed, on_cores
from notchflex.solver.programs.prepare import PreparedChain
from notchflex.solver.programs.static_structure import (
    PytreeLayout,
    pad_rows,
    padded_indices,
)
from notchflex.solver.quantities import believable
from notchflex.solver.residual import SolverState
from notchflex.solver.sensitivity import attach_to_part
from notchflex.solver.solved_state import SolvedState

States = Float[np.ndarray, "*k state"]
"""Packed states, alone or as rows."""

Drive = Literal["tension", "stroke"]
"""What a tendon is commanded: its tension (N) or its stroke (mm)."""

_NOTHING = Load()
# A contact that slides may exceed its bound by this part of it, by rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False, repr=False)
class Step(Displayed):
    """One step of a robot; with rows of it, rows are the leading axis of everything.

    A row that did not converge keeps its state; its values and slopes are NaN.

    Attributes:
        stepper: What made the step.
        before: The state before, packed.
        drives: The drives, N or mm.
        state: The state after, packed: the next step starts from it.
        flat_values: All values, one after the other as in `Stepper.places`.
        flat_jacobian: Change of these per unit of every drive, drives as last axis; no drives where
            none is computed.
        converged: Whether the drives have an equilibrium.
    """

    stepper: Stepper
    before: States
    drives: Float[np.ndarray, "*k t"]
    state: States
    flat_values: Float[np.ndarray, "*k m"]
    flat_jacobian: Float[np.ndarray, "*k m t"]
    converged: Bool[np.ndarray, "*k"]

    @cached_property
    def values(self) -> Arrays:
        """The outputs by name, in the world as those of a path; mm, N, rad."""
        return {
            name: part
            if REGISTERED[name].kind is float
            else np.nan_to_num(part).astype(REGISTERED[name].kind)
            for name, part in self.stepper.named(self.flat_values).items()
        }

    @cached_property
    def jacobian(self) -> Arrays:
        """Change of the outputs per unit of every drive (N or mm), by name, drives as last axis.

        It is the derivative of `values` by the drives of this step, the state before unchanged:
        going on as the step went. A contact that slid goes on sliding, one that stuck goes on
        sticking; at a switch it is that of one side. NaN where a step with friction was so hard
        that it was solved in parts.
        """
        parts = self.stepper.named(self.flat_jacobian.swapaxes(-1, -2))
        return {
            name: np.moveaxis(part, self.converged.ndim, -1)
            for name, part in parts.items()
            if REGISTERED[name].kind is float and self.stepper.jacobian
        }

    @property
    def dead_band(self) -> Float[np.ndarray, "*k t 2"]:
        """Lowest and highest value of every drive between which nothing moves, N or mm."""
        return self.stepper.dead_band(self.state)

    @cached_property
    def code(self) -> Any:
        """Name of the `Failure`, "" where it converged; with rows a list.

        `Stepper.path` gives the reason as a sentence.
        """
        codes = np.full(self.converged.shape, "", object)
        for row in map(tuple, np.argwhere(~self.converged)):
            failure, _ = self.stepper.path(self.before[row], self.drives[row]).failures[0]
            codes[row] = (failure or Failure.NO_EQUILIBRIUM).name
        return codes.tolist()

    def _summary(self) -> Summary:
        rows = [(name, range_of(name, values)) for name, values in self.values.items()]
        rows.append(("converged", range_of("converged", self.converged)))
        hint = ".values and .jacobian by name; .state is where the next step starts"
        return Summary(f"Step of {self.stepper.robot.name}", rows, hint)


@dataclass(frozen=True, eq=False, repr=False)
class Stepper(Displayed):
    """A robot that is driven step by step, each step from the state that the one before left.

    It is for loops in which the next drives depend on the state: control, learning, estimation.
    Everything that stays the same is prepared once. Many robots of one kind, each with its own
    history, are rows of a state: they are solved together, on several cores.

    Args:
        robot: The robot.
        outputs: Quantities to report, by names of `EquilibriumPath`.
        drives: Whether a tendon is commanded by "tension" (N) or by "stroke" (mm): one word for
            all, or one per tendon.
        jacobian: Whether the slopes of the outputs by the drives are computed.
        loads: External loads and rotation of the base in all steps; its tendons are not commanded.
        from_state: A state that steps will start from, see `start`.
        settings: Tolerance and limits of the solver.
        refinement: More strain modes, as for `simulate`.
        cores: Number of cores for rows; all where not given.

    Raises:
        InputError: Anything that cannot be used.

    Example:
        >>> from notchflex import load_robot
        >>> stepper = Stepper(load_robot("pacheco2021-a"), "total_angle", jacobian=True)
        >>> state = stepper.rest()
        >>> for tension in (0.5, 1.0, 0.5):
        ...     step = stepper.step(state, [tension])
        ...     state = step.state
        >>> round(float(step.values["total_angle"]), 3), step.dead_band.round(3).tolist()
        (0.495, [[0.5, 0.513]])
        >>> step.jacobian["total_angle"].shape
        (1,)
    """

    robot: Robot
    outputs: Sequence[str] = ("tip_position", "tip_rotation", "total_angle")
    drives: Drive | Sequence[Drive] = "tension"
    jacobian: bool = False
    loads: Load = _NOTHING
    from_state: State | None = None
    settings: Settings = DEFAULT
    refinement: int = 0
    cores: int | None = None

    def __post_init__(self) -> None:
        """Check the arguments."""
        count = check_is_robot(self.robot).number_of_tendons
        form = 'drives are "tension" or "stroke"'
        words = one_or_several(self.drives, str, form)
        words = tuple(count * words if len(words) == 1 else words)
        if len(words) != count or not set(words) <= set(get_args(Drive)):
            raise InputError.UNKNOWN_NAME(
                f"{form}, one word for all tendons or one for each of {count}; "
                f"got {short_repr(self.drives)}"
            )
        loads: Any = self.loads
        if not isinstance(loads, Load) or (loads.tension, loads.stroke) != (None, None):
            raise InputError.CONFLICT(
                "loads are a notchflex.Load that leaves tension and stroke to the drives of each "
                f"step; got {short_repr(loads)}"
            )
        if self.from_state is not None:
            check_robot(self.from_state, self.robot)
        check_bool(self.jacobian, "jacobian")
        number_of_threads(self.cores)
        vars(self).update(outputs=check_outputs(self.outputs, OF_STATE), drives=words)
        _ = self.prepared  # what cannot be prepared is refused now

    def rest(self, rows: int | None = None) -> States:
        """Return the free robot with slack tendons, as a state to step from.

        Args:
            rows: Number of rows; a single robot where not given.
        """
        return _repeated(self.prepared.rest_vector, rows)

    def start(self, rows: int | None = None) -> States:
        """Return `from_state` as a state to step from; rest where none was given.

        Args:
            rows: Number of rows; a single robot where not given.
        """
        ready = self.prepared
        start = self.from_state.fitted(ready.chain) if self.from_state else ready.rest
        return _repeated(np.asarray(ready.state.pack(start)), rows)

    def step(self, state: States, drives: Any) -> Step:
        """Move the tendons, from a state.

        The result is that of `simulate` with `from_state`: to the last digit for a single robot, to
        rounding for rows.

        Args:
            state: Where it starts: `rest()`, or the `state` of a step; with rows as leading axis.
            drives: Tension (N) or stroke (mm) of every tendon, (t,); for k rows (k, t).

        Returns:
            The state after it, and what was asked.

        Raises:
            InputError: Drives or a state of another shape, or not finite; a negative tension.
        """
        before, towards = self._checked(state, drives)
        solve = self._single if before.ndim == 1 else self._parallel
        after, flat, converged = solve(before, towards)
        turn = rotation_of(tuple(self.loads.base_rotation))
        for name, part in {} if turn is None else self.named(flat).items():
            part[...] = REGISTERED[name].turned(part, turn)
        values, slopes = flat[..., 0, :], flat[..., 1:, :].swapaxes(-1, -2)
        if not converged.all():
            values[~converged] = np.nan
        return Step(self, before, towards, after, values, slopes, converged)

    def named(self, flat: Float[np.ndarray, "*k m"]) -> Arrays:
        """Return views of flat values, on the last axis, by the names of the outputs."""
        leading = flat.shape[:-1]
        return {
            name: flat[..., place].reshape(leading + shape)
            for name, (place, shape) in self.places.items()
        }

    def drives_of(self, state: States) -> Float[np.ndarray, "*k t"]:
        """Return what every tendon is at in a state: its tension (N), or its stroke (mm)."""
        return state[..., self._drive_places]

    def dead_band(self, state: States) -> Float[np.ndarray, "*k t 2"]:
        """Return between which drives nothing moves, while those of the other tendons stay.

        There the first contact of a tendon sticks: its tension passes nothing on until it has
        changed by the friction of that contact, and by that of its sheath. A stroke always moves
        something: for one behind a sheath there is no band, though the robot may stand still. With
        a `constant_loss` of friction the band is approximate, to a part of that loss.

        Args:
            state: A state of this stepper.

        Returns:
            Lowest and highest drive as last axis, N or mm.
        """
        ratio, bound = state[..., self.contact_places[:2, :, 0]].swapaxes(0, -2)
        places: Any = self.prepared.state.unpack_indices()
        if (sheath := places.memory.sheath) is not None:
            ratio = ratio + state[..., sheath.level[:, 0]] - state[..., sheath.level[:, -1]]
            bound = bound + state[..., sheath.limit]
        return np.stack(dead_band(self.drives_of(state), ratio, bound, self._by_stroke), axis=-1)

    def path(self, state: Float[np.ndarray, " state"], drives: Any) -> EquilibriumPath:
        """Return a step of a single robot as a path: all quantities, and why it failed.

        Args:
            state: The state before.
            drives: Tension (N) or stroke (mm) of every tendon.
        """
        before, towards = self._checked(state, drives)
        return simulate(
            self.robot,
            self._load(towards),
            from_state=self.unpacked(before),
            settings=self.settings,
            refinement=self.refinement,
        )

    def unpacked(self, state: Float[np.ndarray, " state"]) -> State:
        """Return a state of a single robot to save, or to `simulate` from."""
        return state_of(self.robot, self.prepared.chain, self.prepared.state.unpack(state.copy()))

    @cached_property
    def places(self) -> dict[str, tuple[slice, tuple[int, ...]]]:
        """Where in `Step.flat_values` the numbers of each output are, and their shape."""
        parts = slices_of(self._indices)
        return {name: (parts[name], index.shape) for name, index in self._indices.items()}

    def _summary(self) -> Summary:
        rows = [("outputs", ", ".join(self.outputs)), ("drives", ", ".join(self.drives))]
        hint = ".rest() is a state to begin with; .step(state, drives) goes on from it"
        return Summary(f"Stepper of {self.robot.name}", rows, hint)

    def _checked(self, state: Any, drives: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return copies of a state and drives."""
        size, tendons = self.prepared.state.size, len(self.drives)
        if not isinstance(state, np.ndarray) or state.shape[-1:] != (size,) or state.ndim > 2:
            raise InputError.WRONG_TYPE(
                "a state is what rest(), start() or a step of this stepper returned; "
                f"got {short_repr(state)}"
            )
        try:
            towards = np.array(drives)
        except ValueError:  # rows of unlike lengths
            towards = np.zeros(0, object)
        shape = (*state.shape[:-1], tendons)
        if towards.dtype.kind not in "iuf" or towards.shape != shape:
            raise InputError.WRONG_SHAPE(
                f"drives of this state are numbers of the shape {shape}, one for each tendon, with "
                f"rows as leading axis; got {short_repr(drives)}"
            )
        if not (np.isfinite(towards) & (self._by_stroke | (towards >= 0.0))).all():
            raise InputError.OUT_OF_RANGE(
                f"a drive is finite, and a tension 0 N or more; got {short_repr(drives)}"
            )
        return state.copy(), towards.astype(float)

    @cached_property
    def _single(self) -> Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, ...]]:
        """Solves one load by the padded chain, as `simulate` does."""
        ready, long = self.prepared, self.prepared.long
        loads, chain = ready.packed_commands(self._command), long.packed
        load, numbers = FixedVector(loads.numbers[0]), FixedVector(self.settings.numbers)
        program = _step.bound(
            "once",
            chain,
            Packed(long.rest_vector, long.state),
            Packed(load, loads.layout),
            np.zeros(len(self.drives)),
            numbers,
            *(long.state, self.outputs, self.jacobian),
        )
        places = padded_indices(ready.state, long.state)

        def solve(state: np.ndarray, drives: np.ndarray) -> tuple[np.ndarray, ...]:
            padded = pad_rows(state, ready.state, long.state)
            after, flat, converged = program((chain.numbers, padded, load, drives, numbers))
            return after[places], flat[:, self.entries], converged

        return solve

    def _parallel(self, states: np.ndarray, drives: np.ndarray) -> tuple[np.ndarray, ...]:
        """Solve a load for every row, in pieces on several cores."""
        ready, cores, command = self.prepared, number_of_threads(self.cores), self._command
        load = Packed(command.packed()[0], ready.command_layout(command))
        others = np.array(self.settings.numbers, float), ready.state, self.outputs, self.jacobian
        size = max(1, -(-len(states) // (cores * WIDTH))) * WIDTH

        def solve(start: int) -> tuple[np.ndarray, ...]:
            rows = slice(start, start + size)
            before = Packed(states[rows], ready.state, True)
            return _step.rows(ready.packed, before, load, Packed(drives[rows], None, True), *others)

        starts = range(0, max(1, len(states)), size)
        with closing(on_cores(solve, starts, cores)) as solving:
            after, flat, converged = map(np.concatenate, zip(*solving, strict=True))
        return after, flat[..., :-1], converged

    def _load(self, drives: Float[np.ndarray, " t"]) -> Load:
        """Return one load, with its commands."""
        commanded = {
            word: [
                float(value) if drive == word else None
                for drive, value in zip(self.drives, drives, strict=True)
            ]
            for word in get_args(Drive)
        }
        return replace(self.loads, **commanded)

    @cached_property
    def _by_stroke(self) -> Bool[np.ndarray, " t"]:
        return np.array(self.drives) == "stroke"

    @cached_property
    def _drive_places(self) -> Int[np.ndarray, " t"]:
        indices: Any = self.prepared.state.unpack_indices()
        return np.where(self._by_stroke, indices.stroke, indices.tension)

    @cached_property
    def _one_load(self) -> LoadPath:
        """A load whose drives are replaced in every step."""
        return load_path(self._load(np.zeros(len(self.drives))), len(self.drives))

    @cached_property
    def prepared(self) -> PreparedChain:
        """The robot as arrays, with modes enough for its loads and for the state before."""
        return prepare_for(self.robot, self._one_load, self.from_state, self.refinement)

    @cached_property
    def _command(self) -> Command:
        return make_commands(self._one_load, self.robot, self.prepared.chain)

    @cached_property
    def _indices(self) -> dict[str, Int[np.ndarray, ...]]:
        return unpadded_entries(self.prepared, self.outputs)

    @cached_property
    def entries(self) -> Int[np.ndarray, " m"]:
        """Where a program of the padded chain reports the values."""
        return np.concatenate([index.ravel() for index in self._indices.values()])

    @cached_property
    def contact_places(self) -> Int[np.ndarray, "3 t contacts"]:
        """Where a state has log ratio, bound and slid length of all contacts; -1 beyond the end."""
        edges = np.asarray(self.prepared.chain.contacts)
        memory: Any = self.prepared.state.unpack_indices().memory
        places = np.full((3, *edges.shape), -1)
        fields = memory.log_ratio, memory.bound, memory.slid
        for group, *numbers in zip(self.prepared.chain.groups, *fields, strict=True):
            for column, tendon in enumerate(group.numbers):
                met = edges[tendon] >= 0
                flexure, edge = np.divmod(edges[tendon, met], 2)
                places[:, tendon, met] = [indices[flexure, column, edge] for indices in numbers]
        return places


def dead_band(drive: Any, ratio: Any, bound: Any, by_stroke: Any) -> tuple[Any, Any]:
    """Return the drives (N or mm) between which the first contact of each tendon sticks."""
    # The ratio of a contact that slides misses its bound by rounding, to either side.
    still = by_stroke | (xp.abs(ratio) > (1.0 + _ROUNDING) * bound)
    low, high = (drive * xp.exp(-ratio + side * bound) for side in (-1.0, 1.0))
    low = xp.where(still, drive, xp.minimum(low, drive))
    return low, xp.where(still, drive, xp.maximum(high, drive))


def _repeated(state: Float[np.ndarray, " state"], rows: int | None) -> States:
    if rows is None:
        return state.copy()
    if check_integer(rows, "rows") < 0:
        raise InputError.OUT_OF_RANGE(f"rows must be 0 or more; got {rows}")
    return np.repeat(state[None], rows, axis=0)


@Native
def _step(
    robot: Chain,
    last: SolverState,
    command: Command,
    drives: Float[Array, " t"],
    numbers: Float[Array, " settings"],
    state_layout: PytreeLayout,
    outputs: tuple[str, ...],
    jacobian: bool,
) -> tuple[Array, Array, Array]:
    """Solve one load from a state; return state, table of outputs, and whether it converged."""
    # After a failure the state is that before. Further rows of the table are changes of the outputs
    # by every drive; its last column is NaN.
    command = command._replace(target=drives)
    result = solve_load_step(robot, command, last, Settings.of(numbers))
    converged = result.converged & believable(SolvedState(robot, result.solved).quantity)
    # What the contacts remember of parts of the step changes with the drives, unseen.
    seen = before_tendons(robot, last, result.fraction_before) if robot.remembers else True

    def flat(solved: SolverState) -> Array:
        quantities = report_quantities(robot, solved, outputs)
        return jnp.concatenate([jnp.ravel(quantities[name]) for name in outputs], dtype=float)

    def moved(target: Array) -> Array:
        towards = command._replace(target=target)
        return flat(attach_to_part(robot, towards, result.between, result.solved, converged & seen))

    if jacobian:
        values, by_drives = jax.linearize(moved, drives)
        table = jnp.concatenate([values[None], jax.lax.map(by_drives, jnp.eye(len(drives)))])
    else:
        table = flat(result.solved)[None]
    table = jnp.pad(table, ((0, 0), (0, 1)), constant_values=jnp.nan)
    packed = state_layout.pack(choose(converged, result.solved, last))
    return packed, table, converged
