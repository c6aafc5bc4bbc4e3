"""One compiled program that solves a load, differentiates it, and moves its drives to a target.

A solved load tells by one linear step how its equilibrium changes with the drives. So Newton's
method need not solve a load for every drive that is tried: the drives and the equilibrium are
corrected together, with the friction history of the same state before, until the balance and the
target are met at once. A correction costs as much as one iteration of a solve.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float, Int

from notchflex._jax import jax, jnp
from notchflex._pytree import choose
from notchflex._quantity import REGISTERED
from notchflex.analysis.outputs import report_quantities
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.solver.actuation import command_residual, stroke, tension_is_bounded
from notchflex.solver.block_elimination import Iterate, gauss_jordan, linear_step
from notchflex.solver.continuation import LoadStepResult, SolverState, solve_load_step
from notchflex.solver.derived.quantities import believable
from notchflex.solver.derived.solved_state import SolvedState
from notchflex.solver.element import Memory
from notchflex.solver.friction_predictor import limit_slack
from notchflex.solver.newton import Settings
from notchflex.solver.programs.compiled import native
from notchflex.solver.programs.pytree_layout import PytreeLayout, lane_sizes
from notchflex.solver.programs.static_structure import StaticStructure
from notchflex.solver.residual import evaluate

LEAST_DRIVES = 1e-10
"""Where drives are redundant the smallest meet the target. This weight decides among those that
meet it equally well, and is too small to act against the target."""
GROWTH, FIRST_PART = 1.0, 0.05
"""A step may change a drive by so many times the largest one, or the first by a part of what closes
a notch."""
SMALL_RELAXATION = 1e-3
"""Redundant drives are as small as they get where a step would change them by this part."""

SLACK = 1e-10
"""Drives within this part of what about closes a notch of their limit are at it."""

# A corrected state is solved where its residual is below this multiple of the tolerance.
_SOLVED = 100.0
# A correction of the drives by less than this part of them is none.
_NO_CHANGE = 1e-11


class Task(NamedTuple):
    """What the program is to do; n numbers of a response, t tendons.

    Attributes:
        goal: What the numbers are to become, (n,).
        weights: What an error of each counts, 0 of one that is free, (n,).
        miss: Weighted differences from the target at the present drives, (n,).
        slopes: Their slopes there; zero where they are not known, (n, t).
        present: Drives to start from, (t,).
        low: Lowest drives, (t,).
        high: Highest drives, (t,).
        band_low: Lower end of the dead band around `present`, (t,).
        band_high: Its upper end, (t,).
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
    band_low: Float[Array, " t"]
    band_high: Float[Array, " t"]
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
    task = Task(*[none] * 3, slopes, *[drives] * 6, turn, *[np.zeros(())] * 5)  # pyright: ignore[reportArgumentType]
    return task._replace(unit=np.ones(()), rounds=np.ones(()))  # pyright: ignore[reportArgumentType]


class SearchLayouts(NamedTuple):
    """How the program takes chain, load, state and task as vectors, and what it reports.

    Attributes:
        chain: Structure and layout of the chain.
        command: Layout of one load.
        state: Layout of a state.
        task: Layout of a task.
        outputs: Names of the quantities.
    """

    chain: StaticStructure
    command: PytreeLayout
    state: PytreeLayout
    task: PytreeLayout
    outputs: tuple[str, ...]


class _At(NamedTuple):
    """Where the corrections of a solved load are.

    Attributes:
        drive: The drives, (t,).
        point: Unknowns and base tensions.
        state: The state there, its history included.
        values: The numbers of the response, (n,).
        slopes: Their slopes by the drives, (t, n).
        error: Weighted distance from the target.
        change: Correction of the drives from here, (t,).
        next_point: Unknowns and base tensions after the correction.
        met: Whether balance and target are met.
        count: How many corrections were made.
    """

    drive: Array
    point: Iterate
    state: SolverState
    values: Array
    slopes: Array
    error: Array
    change: Array
    next_point: Iterate
    met: Bool[Array, ""]
    count: Int[Array, ""]


class _Round(NamedTuple):
    """State of the loop over solved loads."""

    drive: Array
    at: _At
    result: LoadStepResult
    count: Int[Array, ""]


def drive_step(
    miss: Float[Array, " n"],
    slopes: Float[Array, "n t"],
    drive: Float[Array, " t"],
    low: Float[Array, " t"],
    high: Float[Array, " t"],
    driven: Float[Array, " t"],
) -> Float[Array, " t"]:
    """Return the step of least squares to a target within limits, that of the smallest drives.

    Drives that the step would carry beyond a limit are set to it, and the others found again.

    Args:
        miss: Weighted differences from the target.
        slopes: Their slopes by the drives.
        drive: The drives, of which the smallest are sought.
        low: Lowest step.
        high: Highest step.
        driven: 1 where a drive may change.
    """
    count = len(drive)
    slopes = slopes * driven
    normal = slopes.T @ slopes
    size = jnp.trace(normal) / jnp.maximum(jnp.sum(driven), 1.0)
    known = size > 0.0
    size = jnp.where(known, size, 1.0)
    small = LEAST_DRIVES * size
    eye = jnp.eye(count)
    hessian, gradient = normal + small * eye, slopes.T @ miss + small * drive * driven
    free, step = driven, jnp.zeros(count)
    for _ in range(count):
        both = free[:, None] * free[None, :]
        matrix = both * hessian + (1.0 - free) * size * eye
        right = -free * (gradient + hessian @ ((1.0 - free) * step))
        step = jnp.where(free > 0.0, gauss_jordan(matrix, right[:, None])[:, 0], step)
        inside = jnp.clip(step, low, high)
        free = free * (inside == step)
        step = inside
    return jnp.where(known, step * driven, 0.0)


@native(5, lambda layouts: lane_sizes(layouts.chain))
def search_drives(
    chain_vector: Float[Array, " chain"],
    before: Float[Array, " state"],
    load: Float[Array, " command"],
    task_vector: Float[Array, " task"],
    numbers: Float[Array, " settings"],
    layouts: SearchLayouts,
) -> tuple[Array, Array, Array, Array, Array]:
    """Solve the load at the drives that the slopes predict, and correct them to the target.

    Returns:
        The state, packed; the numbers asked of it; their slopes by the drives, drives as leading
        axis; the drives; and whether it is solved, whether in one part, whether the target is met,
        its error, and how many loads were solved.
    """
    chain, command = layouts.chain.unpack(chain_vector), layouts.command.unpack(load)
    last, task = layouts.state.unpack(before), layouts.task.unpack(task_vector)
    settings = Settings.of(numbers)
    scale = _scale(task, task.present)

    def again(state: _Round) -> Bool[Array, ""]:
        more = (state.count < task.rounds) & state.result.converged & ~state.at.met
        moves = jnp.max(jnp.abs(state.at.change)) > _NO_CHANGE * scale
        return (state.count == 0) | (more & moves)

    def solve(state: _Round) -> _Round:
        towards = command._replace(target=state.drive)
        result = solve_load_step(chain, towards, last, settings)
        at = _correct(chain, command, result, task, state.drive, settings, layouts.outputs)
        return _Round(at[0], at[1], result, state.count + 1)

    reach = GROWTH * scale
    first = drive_step(
        task.miss,
        task.slopes,
        task.present,
        jnp.maximum(jnp.minimum(task.low - task.band_low, 0.0), -reach),
        jnp.minimum(jnp.maximum(task.high - task.band_high, 0.0), reach),
        task.driven,
    )
    edge = jnp.where(first > 0.0, task.band_high, task.band_low)
    start = jnp.where(first == 0.0, task.present, edge + first)
    start = _within(task, start)
    found = jax.lax.while_loop(again, solve, _nowhere(chain, last, start, task))
    at, result = found.at, found.result
    good = result.converged & believable(SolvedState(chain, at.state).quantity)
    good = good & tension_is_bounded(chain, command, at.point.base_tension)
    flags = [good, result.parts == 1, at.met & good, at.error, found.count]
    status = jnp.stack([jnp.asarray(one, float) for one in flags])
    return layouts.state.pack(at.state), at.values, at.slopes, at.drive, status


def _scale(task: Task, drive: Float[Array, " t"]) -> Float[Array, ""]:
    """Size of the drives, that of a first step at least."""
    return jnp.maximum(jnp.max(jnp.abs(drive)), FIRST_PART * task.unit)


def _within(task: Task, drive: Float[Array, " t"]) -> Float[Array, " t"]:
    """Drives within their limits, exactly at them where rounding leaves a difference."""
    near = SLACK * task.unit
    inside = jnp.where(drive <= task.low + near, task.low, jnp.minimum(drive, task.high))
    return jnp.where(task.driven > 0.0, inside, task.present)


def _nowhere(chain: Chain, last: SolverState, start: Array, task: Task) -> _Round:
    """The loop before anything is solved."""
    zero, none = jnp.zeros(()), jnp.zeros(len(start))
    no, count = jnp.array(False), jnp.zeros((), int)
    at = _At(
        start,
        last.point,
        last,
        jnp.zeros(len(task.goal)),
        jnp.zeros(task.slopes.T.shape),
        zero,
        none,
        last.point,
        no,
        count,
    )
    result = LoadStepResult(last, zero, count, jnp.array(True), zero, count, last, zero)
    return _Round(start, at, result, count)


def _correct(
    chain: Chain,
    command: Command,
    result: LoadStepResult,
    task: Task,
    drive: Float[Array, " t"],
    settings: Settings,
    outputs: tuple[str, ...],
) -> tuple[Float[Array, " t"], _At]:
    """Correct drives and equilibrium together, from a solved load.

    Returns:
        Drives from which to solve again, and where the corrections ended: at the solved load itself
        where they do not meet the target.
    """
    memory = result.between.memory
    here = _evaluate_at(chain, command, memory, task, settings, outputs)
    count = jnp.zeros((), int)
    solved = here(drive, result.solved.point, count)
    # Where the load was cut into parts, the history of the last one depends on the drives; and a
    # notch that can snap is solved whole.
    allowed = task.corrections
    if chain.rods.section.ends is not None:
        allowed = jnp.zeros(())
    allowed = jnp.where(result.converged & (result.parts == 1), allowed, 0.0)

    def proceed(at: _At) -> Bool[Array, ""]:
        return ~at.met & (at.count < allowed) & jnp.isfinite(at.error)

    def step(at: _At) -> _At:
        drive, point = _within(task, at.drive + at.change), at.next_point
        tension = command.either(point.base_tension, drive)
        return here(drive, point._replace(base_tension=tension), at.count + 1)

    last = jax.lax.while_loop(proceed, step, solved)
    exact = solved._replace(state=result.solved)
    return _within(task, drive + solved.change), choose(last.met & (last.count > 0), last, exact)


def _evaluate_at(
    chain: Chain,
    command: Command,
    memory: Memory,
    task: Task,
    settings: Settings,
    outputs: tuple[str, ...],
) -> Callable[[Array, Iterate, Array], _At]:
    """Return a function that evaluates a point and finds the next one."""

    def state_at(point: Iterate) -> SolverState:
        at = evaluate(chain, point.unknowns, memory, point.base_tension, command.applied)
        return SolverState(
            point,
            Memory(
                log_ratio=point.unknowns.log_ratio,
                slid=tuple(span.slid for span in at.spans),
                bound=tuple(span.bound for span in at.spans),
                material=at.flexure.memory,
            ),
            stroke(chain, point.base_tension, at.base),
            command.applied,
        )

    def flat(point: Iterate) -> Array:
        found = report_quantities(chain, state_at(point), outputs)
        turned = [REGISTERED[name].turned(found[name], task.turn) for name in outputs]
        return jnp.concatenate([jnp.ravel(one) for one in turned])

    def evaluated(drive: Array, point: Iterate, count: Array) -> _At:
        unknowns, tension = point
        at = evaluate(chain, unknowns, memory, tension, command.applied)
        demand = command_residual(chain, command._replace(target=drive), tension, at.base)
        residual = jnp.max(jnp.abs(ravel_pytree((at.residual, demand))[0]))

        def step_to(target: Array) -> Iterate:
            towards = command._replace(target=target)
            return linear_step(chain, towards, unknowns, memory, tension, at)

        step, by_drive = jax.linearize(step_to, drive)
        step = limit_slack(chain, point, step)
        values, by_point = jax.linearize(flat, point)

        def column(none: Array, unit: Array) -> tuple[Array, Any]:
            first = 1.0 - jnp.sum(unit)
            moved = jax.tree.map(lambda own, by: first * own + by, step, by_drive(unit))
            return none, (moved, by_point(moved))

        units = jnp.concatenate([jnp.zeros((1, len(drive))), jnp.eye(len(drive))])
        moves, changes = jax.lax.scan(column, jnp.zeros(()), units)[1]
        miss = task.weights * (values - task.goal)
        ahead = miss + task.weights * changes[0]
        slopes = changes[1:]
        reach = GROWTH * _scale(task, drive)
        change = drive_step(
            ahead,
            (task.weights * slopes).T,
            drive,
            jnp.maximum(task.low - drive, -reach),
            jnp.minimum(task.high - drive, reach),
            task.driven,
        )
        by_change = jnp.concatenate([jnp.ones(1), change])
        next_point = jax.tree.map(
            lambda value, by: value + jnp.tensordot(by_change, by, 1), point, moves
        )
        error = jnp.linalg.norm(miss)
        settled = jnp.max(jnp.abs(change)) <= SMALL_RELAXATION * _scale(task, drive)
        met = (error <= task.tolerance) & (residual <= _SOLVED * settings.tolerance)
        met = met & (settled | (task.redundant == 0.0))
        return _At(drive, point, state_at(point), values, slopes, error, change, next_point, met,
                   count)  # fmt: skip

    return evaluated
