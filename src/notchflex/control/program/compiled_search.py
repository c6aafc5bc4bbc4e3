"""One compiled program that solves a load, differentiates it, and moves its drives to a target.

One linear step at a solved load gives the change of its equilibrium with the drives. So Newton's
method need not solve a load for every drive that is tried: the drives and the equilibrium are
corrected together, with the friction history of the same state before, until balance and target
are nearly met. A correction costs as much as a few iterations of a solve. Then the load is solved
anew, from the state before: other states may be in balance under it, and this is the one that the
robot comes to.
"""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float, Int

from notchflex import Settings
from notchflex._jax import jax, jnp
from notchflex.analysis.outputs import report_quantities
from notchflex.analysis.stepping import dead_band
from notchflex.control.program.drive_step import FIRST_PART, GROWTH, NO_SLOPE, SLACK, drive_step
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.solver.continuation import LoadStepResult, solve_load_step
from notchflex.solver.linear_step import linear_step
from notchflex.solver.newton import limit_slack
from notchflex.solver.programs.compiled import Native
from notchflex.solver.programs.static_structure import PytreeLayout
from notchflex.solver.quantities import believable
from notchflex.solver.residual import (
    Evaluation,
    Iterate,
    Memory,
    SolverState,
    command_residual,
    evaluate,
    state_at,
    tension_is_bounded,
)
from notchflex.solver.solved_state import SolvedState
from notchflex.support import REGISTERED


class SearchState(NamedTuple):
    """State of the corrections of a solved load.

    Attributes:
        drive: The drives, (t,).
        point: Unknowns and base tensions.
        state: The state there, its history included.
        values: The numbers of the response, (n,).
        slopes: Their slopes by the drives, (t, n).
        error: Weighted distance from the target.
        sticks: 1 where a tendon sticks, (t,).
        change: Correction of the drives from here, (t,).
        next_point: Unknowns and base tensions after the correction.
        stuck: Whether a tendon sticks that must move.
        beyond: Drives to solve next, beyond the dead bands of tendons that stick, (t,).
        close: Whether one more correction meets the target.
        falls: Whether the last correction has brought it nearer.
        met: Whether balance and target are met.
        corrected: How many corrections were made.
    """

    drive: Array
    point: Iterate
    state: SolverState
    values: Array
    slopes: Array
    sticks: Array
    error: Array
    change: Array
    next_point: Iterate
    stuck: Bool[Array, ""]
    beyond: Array
    close: Bool[Array, ""]
    falls: Bool[Array, ""]
    met: Bool[Array, ""]
    corrected: Int[Array, ""]


class LinearResponse(NamedTuple):
    """Linear response of a point.

    Attributes:
        residual: Largest residual there.
        values: The numbers of the response there, (n,).
        state: The state there.
        points: Changes of the point by a step to the balance, and by a unit of every drive, as
            leading axis, 1 + t.
        changes: The same of the numbers, (1 + t, n).
    """

    residual: Array
    values: Array
    state: SolverState
    points: Iterate
    changes: Array


class SolvedRound(NamedTuple):
    """State of the loop over solved loads."""

    drive: Array
    at: SearchState
    result: LoadStepResult
    solved: Int[Array, ""]


class Task(NamedTuple):
    """Task of the program; n numbers of a response, t tendons.

    Attributes:
        goal: What the numbers are to become, (n,).
        weights: What an error of each counts, 0 of one that is free, (n,).
        miss: Weighted differences from the target at the present drives, (n,).
        slopes: Their slopes there, of a tendon that sticks as it last slid; zero where they are not
            known, (n, t).
        present: Drives to start from, (t,).
        low: Lowest drives, (t,).
        high: Highest drives, (t,).
        driven: 1 where a tendon is driven, 0 where it is held, (t,).
        turn: Rotation from the base to the world, (3, 3).
        tolerance: Weighted error at which the target is met.
        unit: Drive that about closes a notch, N or mm.
        rounds: How many loads may be solved.
        corrections: How many times the drives may be corrected after each.
        redundant: 1 where drives are made as small as the target allows.
    """

    goal: Float[Array, " n"]
    weights: Float[Array, " n"]
    miss: Float[Array, " n"]
    slopes: Float[Array, "n t"]
    present: Float[Array, " t"]
    low: Float[Array, " t"]
    high: Float[Array, " t"]
    driven: Float[Array, " t"]
    turn: Float[Array, "3 3"]
    tolerance: Float[Array, ""]
    unit: Float[Array, ""]
    rounds: Float[Array, ""]
    corrections: Float[Array, ""]
    redundant: Float[Array, ""]


def blank_task(numbers: int, tendons: int, turn: np.ndarray) -> Task:
    """Return the task of solving one load, without drives and without a target.

    Args:
        numbers: How many numbers a response has.
        tendons: Number of tendons.
        turn: Rotation from the base to the world.
    """
    none, drives, slopes = np.zeros(numbers), np.zeros(tendons), np.zeros((numbers, tendons))
    number, one = np.zeros(()), np.ones(())
    fields: list[Any] = [none, none, none, slopes, *[drives] * 4, turn]
    fields += [number, one, one, number, number]  # one load, no correction
    return Task._make(fields)


class SearchLayouts(NamedTuple):
    """Layout of a state, and the reported quantities.

    Attributes:
        state: Layout of a state.
        first_contact: Where a packed state has the log ratios of the first contacts of all tendons,
            and their largest.
        outputs: Names of the quantities.
    """

    state: PytreeLayout
    first_contact: tuple[tuple[int, ...], tuple[int, ...]]
    outputs: tuple[str, ...]


# Redundant drives are minimal if a step would change them by less than this part.
_SMALL_RELAXATION = 1e-3
# A corrected state is solved where its residual is below this multiple of the tolerance.
_SOLVED = 100.0
# A tendon sticks where its slopes, squared, are `NO_SLOPE` of those with which it last slid,
# and, beside others, does not move if it must slide by less than this part of its dead band.
_SMALL_LEAP = 1e-3
# If it still sticks beyond its dead band, the next step is this part of the distance from the
# present drive.
_ONWARD = 0.5
# Corrections continue while each reduces the error to this part at most, or the error is above this
# multiple of the tolerance.
_MAX_FALL, _NEAR_TARGET = 0.5, 100.0
# The next correction leaves about the square of the error, over the size of what the drives move:
# it meets the target where that is this part of the tolerance.
_CLOSE = 0.1
# Smallest relative correction of the drives.
_NO_CHANGE = 1e-11


@Native
def search_drives(
    chain: Chain,
    last: SolverState,
    command: Command,
    task: Task,
    numbers: Float[Array, " settings"],
    layouts: SearchLayouts,
) -> tuple[Array, Array, Array, Array, Array, Array]:
    """Solve the load at the drives that the slopes predict, and correct them to the target.

    Returns:
        The state, packed; the numbers asked of it; their slopes by the drives, drives as leading
        axis; 1 where a tendon sticks; the drives; and whether it is solved, whether in one part,
        whether the target is met, its error, and how many loads were solved.
    """
    search = _Search(chain, command, last, task, Settings.of(numbers), layouts)
    final = jax.lax.while_loop(search.goes_on, search.solve, search.begin())
    at, result = final.at, final.result
    accepted = result.converged & believable(SolvedState(chain, at.state).quantity)
    accepted = accepted & tension_is_bounded(chain, command, at.point)
    flags = [accepted, result.substeps == 1, at.met & accepted, at.error, final.solved]
    status = jnp.stack([jnp.asarray(one, float) for one in flags])
    return layouts.state.pack(at.state), at.values, at.slopes, at.sticks, at.drive, status


def _scale(task: Task, drive: Float[Array, " t"]) -> Float[Array, ""]:
    """Size of the drives, that of a first step at least."""
    return jnp.maximum(jnp.max(jnp.abs(drive)), FIRST_PART * task.unit)


def _within(task: Task, drive: Float[Array, " t"]) -> Float[Array, " t"]:
    """Drives within their limits, exactly at them where rounding leaves a difference."""
    near = SLACK * task.unit
    inside = jnp.where(drive <= task.low + near, task.low, jnp.minimum(drive, task.high))
    return jnp.where(task.driven > 0.0, inside, task.present)


class _Search:
    """The loop over solved loads, as it is traced."""

    def __init__(
        self,
        chain: Chain,
        command: Command,
        last: SolverState,
        task: Task,
        settings: Settings,
        layouts: SearchLayouts,
    ) -> None:
        """Take what stays the same."""
        self.chain, self.command, self.last = chain, command, last
        self.task, self.settings, self.layouts = task, settings, layouts

    def begin(self) -> SolvedRound:
        """Return the loop before anything is solved, with the drives that the slopes predict."""
        task, start = self.task, self.task.present
        change = self._step(task.miss, task.slopes, start)
        drive = self._beyond(self.last, start, change, jnp.array(True))
        zero, none, count = jnp.zeros(()), jnp.zeros(len(start)), jnp.zeros((), int)
        slopes, no = jnp.zeros(task.slopes.T.shape), jnp.array(False)
        values = jnp.zeros(len(task.goal))
        at = SearchState(
            drive, self.last.point, self.last, values, slopes, none, zero, none, self.last.point,
            no, drive, no, no, no, count,
        )  # fmt: skip
        last = self.last
        result = LoadStepResult(last, zero, count, ~no, zero, count, last, zero, none > 0.0)
        return SolvedRound(drive, at, result, count)

    def goes_on(self, state: SolvedRound) -> Bool[Array, ""]:
        """Return whether another load is solved."""
        task, at = self.task, state.at
        more = (state.solved < task.rounds) & state.result.converged & ~at.met
        size = _NO_CHANGE * _scale(task, task.present)
        moves = jnp.max(jnp.abs(at.beyond - at.drive)) > size
        return (state.solved == 0) | (more & moves)

    def solve(self, state: SolvedRound) -> SolvedRound:
        """Solve a load, and correct drives and equilibrium together from there."""
        towards = self.command._replace(target=state.drive)
        result = solve_load_step(self.chain, towards, self.last, self.settings)
        memory, task = result.between.memory, self.task
        evaluation = self._evaluate(memory, state.drive, result.solved.point, jnp.zeros((), int))
        # Where the load was cut into parts, the history of the last one depends on the drives; and
        # a notch that can snap is solved whole.
        whole = (result.substeps == 1) if self.chain.rods.section.ends is None else jnp.array(False)
        allowed = jnp.where(result.converged & whole & ~evaluation.stuck, task.corrections, 0.0)

        def proceed(at: SearchState) -> Bool[Array, ""]:
            return ~at.met & ~at.close & (at.corrected < allowed) & at.falls

        def correct(at: SearchState) -> SearchState:
            drive, point = _within(task, at.drive + at.change), at.next_point
            tension = self.command.either(point.base_tension, drive)
            point = point._replace(base_tension=tension)
            new = self._evaluate(memory, drive, point, at.corrected + 1)
            target_error = jnp.maximum(_MAX_FALL * at.error, _NEAR_TARGET * task.tolerance)
            return new._replace(falls=new.error <= target_error)

        last = jax.lax.while_loop(proceed, correct, evaluation)
        # What counts is the load solved from the state before, as a robot is pulled.
        corrected = _within(task, last.drive + last.change)
        onward = jnp.where((last.corrected > 0) & last.falls, corrected, evaluation.beyond)
        at = evaluation._replace(state=result.solved, beyond=onward)
        return SolvedRound(onward, at, result, state.solved + 1)

    def _step(self, miss: Array, slopes: Array, drive: Array) -> Array:
        """Step of the drives to the target, within their limits."""
        task = self.task
        scale = _scale(task, drive)
        low = jnp.maximum(task.low - drive, -GROWTH * scale)
        high = jnp.minimum(task.high - drive, GROWTH * scale)
        return drive_step(miss, slopes, drive, low, high, task.driven, scale)

    def _beyond(
        self, state: SolverState, drive: Array, change: Array, stuck: Array
    ) -> Float[Array, " t"]:
        """Drives after a change; of tendons that stick that beyond their dead bands."""
        packed, command = self.layouts.state.pack(state), self.command
        ratio, bound = (packed[np.array(at)] for at in self.layouts.first_contact)
        actual = command.either(state.stroke, state.point.base_tension)
        by_stroke = False if command.by_stroke is None else command.by_stroke
        low, high = dead_band(actual, ratio, bound, by_stroke)
        up, down = jnp.maximum(high - drive, 0.0), jnp.minimum(low - drive, 0.0)
        leap = jnp.where(change > 0.0, up, down)
        several = jnp.sum(self.task.driven) > 1.0
        # Beyond the band a notch that is pressed together may hold on: the way so far tells how far
        # it can be.
        onward = jnp.sign(change) * _ONWARD * jnp.abs(drive - self.task.present)
        held = (jnp.abs(leap) <= SLACK * self.task.unit) & ~several
        leap = jnp.where(jnp.where(by_stroke, False, held), onward, leap)
        leap = jnp.where(stuck & (change != 0.0), leap, 0.0)
        small = several & (jnp.abs(change) <= _SMALL_LEAP * jnp.abs(leap))
        return _within(self.task, drive + jnp.where(small, 0.0, change + leap))

    def _values(self, memory: Memory, point: Iterate) -> tuple[Array, tuple[Evaluation, Any]]:
        """Quantities of a point in the world, its residual, and the state with its history."""
        chain, applied, outputs = self.chain, self.command.applied, self.layouts.outputs
        at = evaluate(chain, point, memory, applied)
        state = state_at(chain, point, at, applied)
        quantities = report_quantities(chain, state, outputs)
        turned = [REGISTERED[name].turned(quantities[name], self.task.turn) for name in outputs]
        return jnp.concatenate([jnp.ravel(one) for one in turned]), (at, state)

    def _moves(self, memory: Memory, drive: Array, point: Iterate) -> LinearResponse:
        """Linear response of a point to a step to the balance, and to a unit of every drive."""
        chain, command = self.chain, self.command
        values, by_point, (at, state) = jax.linearize(
            partial(self._values, memory), point, has_aux=True
        )
        demand = command_residual(chain, command._replace(target=drive), at.base)
        residual = jnp.max(jnp.abs(ravel_pytree((at.residual, demand))[0]))

        def step_to(target: Array) -> Iterate:
            towards = command._replace(target=target)
            return linear_step(chain, towards, point, memory, at)

        step, by_drive = jax.linearize(step_to, drive)
        step = limit_slack(chain, point, step)

        def column(none: Array, unit: Array) -> tuple[Array, Any]:
            first = 1.0 - jnp.sum(unit)
            moved = jax.tree.map(lambda own, by: first * own + by, step, by_drive(unit))
            return none, (moved, by_point(moved))

        units = jnp.concatenate([jnp.zeros((1, len(drive))), jnp.eye(len(drive))])
        moves, changes = jax.lax.scan(column, jnp.zeros(()), units)[1]
        return LinearResponse(residual, values, state, moves, changes)

    def _evaluate(
        self, memory: Memory, drive: Array, point: Iterate, corrected: Array
    ) -> SearchState:
        """Evaluate a point, and find the way on."""
        task = self.task
        residual, values, state, moves, changes = self._moves(memory, drive, point)
        miss = task.weights * (values - task.goal)
        slopes = changes[1:]
        weights = task.weights[None]
        own, last = ((weights * one) ** 2 for one in (slopes, task.slopes.T))
        stuck = jnp.sum(own, axis=1) <= NO_SLOPE * jnp.sum(last, axis=1)
        weighted = jnp.where(stuck[:, None], task.slopes.T, weights * slopes)
        change = self._step(miss + task.weights * changes[0], weighted.T, drive)
        by_change = jnp.concatenate([jnp.ones(1), change])
        next_point = jax.tree.map(
            lambda value, by: value + jnp.tensordot(by_change, by, 1), point, moves
        )
        error = jnp.linalg.norm(miss)
        size = jnp.linalg.norm(weighted) * _scale(task, drive)
        settled = jnp.max(jnp.abs(change)) <= _SMALL_RELAXATION * _scale(task, drive)
        met = (error <= task.tolerance) & (residual <= _SOLVED * self.settings.tolerance)
        return SearchState(
            drive=drive,
            point=point,
            state=state,
            values=values,
            slopes=slopes,
            sticks=1.0 * stuck,
            error=error,
            change=change,
            next_point=next_point,
            stuck=jnp.any(stuck & (change != 0.0)),
            beyond=self._beyond(state, drive, change, stuck),
            met=met & (settled | (task.redundant == 0.0)),
            close=error**2 <= _CLOSE * task.tolerance * size,
            falls=jnp.isfinite(error),
            corrected=corrected,
        )
