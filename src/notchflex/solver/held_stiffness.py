"""Stiffness of the whole robot by its modes, with sticking contacts held; stability.

Tension ratios, contact forces and base tensions are eliminated: a sticking contact holds its
tendon, a sliding one keeps its tension ratio at the bound, which changes with the shape. The
stiffness is then not symmetric. The rows of every flexure are those of Newton's linear step; here
they are assembled to one dense matrix per state, for many states at once.

An equilibrium is stable where every eigenvalue has a positive real part. A positive definite
symmetric part, which costs a fraction of the eigenvalues, is sufficient. It is not necessary (a
sticking contact adds the product of two different vectors), so elsewhere the eigenvalues are
computed.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from jaxtyping import Array, Bool, Float

from notchflex._jax import jnp
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.solver.linear_step import (
    LinearisedRows,
    StateJacobians,
    UnitRows,
    linearise,
    unit_rows,
)
from notchflex.solver.programs.compiled import Native
from notchflex.solver.programs.prepare import PreparedChain
from notchflex.solver.residual import Memory, SolverState, bound_side, command_slopes, evaluate
from notchflex.solver.sheaths import aimed

# Springs this much stiffer than the notches hold closed contacts and tendons driven by stroke;
# otherwise their forces would be multipliers and the stiffness undefined.
_HOLDING_STIFFNESS = 1e3
# Slip assumed for a contact at its bound, which goes on sliding, mm.
_SLIP = 1e-3
# Inextensible tendons that a stroke leaves slack by less than this part of a notch's height count
# as held: no drive sets strokes so well. Their strokes, with a norm of 1 over the modes, depend on
# each other where a combination of them falls below the second number. The third is the tension, in
# closing forces of a notch, below which no tendon is stressed.
_NEARLY_HELD, _DEPENDENT, _UNSTRESSED = 1e-3, 1e-6, 1e-9
# Number of states computed at once.
_BATCH = 16


def held_stiffness(
    prepared: PreparedChain, commands: Command, solved: SolverState
) -> Iterator[tuple[Float[np.ndarray, "s modes modes"], Float[np.ndarray, " s"]]]:
    """Yield the stiffness of the robot by its modes (N mm, NaN where not finite), and a sign."""
    # The second is the sign of the determinant of the whole system, with all that is eliminated: 0
    # where the strokes of inextensible tendons depend on each other, so that many tensions answer
    # them. A tendon driven by stroke is held, one driven by tension moves.
    long, chain = prepared.long, prepared.chain
    loads = prepared.packed_commands(commands)
    states = prepared.packed_states(np.asarray(prepared.state.pack(solved, leading=1)))
    form = unit_rows(chain)
    modes = np.arange(chain.flexures)[:, None] * form.unknowns + np.arange(len(form.modes))
    unpadded = modes[np.asarray(chain.rods.padding_mask) == 0.0]
    for start in range(0, len(loads.numbers), _BATCH):
        some = slice(start, start + _BATCH)
        tables = (table._replace(numbers=table.numbers[some]) for table in (loads, states))
        *rows, slopes = _rows.map(long.packed, *tables)
        rows = LinearisedRows(*(table[:, : chain.flexures] for table in rows))
        by_stroke = None if commands.by_stroke is None else np.asarray(commands.by_stroke)[some]
        matrix, strokes = _assemble(chain, form, rows, slopes, by_stroke)
        others = np.setdiff1d(np.arange(matrix.shape[-1]), modes)
        finite = np.isfinite(matrix).all(axis=(1, 2))
        stiffness = np.full((len(matrix), len(unpadded), len(unpadded)), np.nan)
        sign = np.full(len(matrix), np.nan)
        good = matrix[finite]
        response = np.linalg.solve(
            good[:, others[:, None], others], good[:, others[:, None], unpadded]
        )
        stiffness[finite] = (
            good[:, unpadded[:, None], unpadded] - good[:, unpadded[:, None], others] @ response
        )
        sign[finite] = np.linalg.slogdet(good)[0]
        if by_stroke is not None:
            missing = np.asarray(solved.stroke)[some] - np.asarray(commands.target)[some]
            # Whether the strokes of the inextensible tendons that are held are independent.
            nearly = _NEARLY_HELD * float(np.asarray(chain.rods.length).sum(axis=-1).min())
            held = by_stroke & np.asarray(chain.inextensible) & (missing < nearly)
            scaled = strokes / np.sqrt(np.asarray(chain.stiffness).ravel())
            scaled = scaled / np.maximum(np.linalg.norm(scaled, axis=-1, keepdims=True), 1e-300)
            determinate = np.array(
                [
                    np.linalg.matrix_rank(rows[which], tol=_DEPENDENT) == which.sum()
                    for rows, which in zip(scaled, held, strict=True)
                ],
                bool,
            )
            tension = np.asarray(solved.point[1])[some]
            stressed = tension > _UNSTRESSED * float(chain.closing_force)
            sign = np.where(determinate | ~stressed.any(axis=-1), sign, 0.0)
        yield stiffness, sign


@Native
def _rows(chain: Chain, command: Command, solved: SolverState) -> tuple[Array, ...]:
    """Compute the rows of all flexures of a state, and slopes of the command."""
    unknowns = solved.point.unknowns
    evaluation = evaluate(chain, solved.point, solved.memory, solved.applied)
    slid = tuple(
        span.slid - _SLIP * bound_side(ratio, span.bound)
        for span, ratio in zip(evaluation.spans, unknowns.log_ratio, strict=True)
    )
    bound = tuple(span.bound for span in evaluation.spans)
    memory, sheath = Memory(unknowns.log_ratio, slid, bound, solved.memory.material), None
    if (last := solved.memory.sheath) is not None:
        side = bound_side(last.level[:, 0] - last.level[:, -1], last.limit)
        sheath = last._replace(stroke=last.stroke - _SLIP * side)
    form = unit_rows(chain)
    jacobians = StateJacobians(chain, unknowns, memory, solved.applied, evaluation, form)
    slopes = command_slopes(chain, aimed(chain, command, last), sheath, evaluation.base)
    return (*linearise(jacobians), jnp.stack(slopes))


def _assemble(
    chain: Chain,
    form: UnitRows,
    rows: LinearisedRows,
    slopes: Float[np.ndarray, "s 3 t t"],
    by_stroke: np.ndarray | None,
) -> tuple[Float[np.ndarray, "s m m"], Float[np.ndarray, "s t modes"]]:
    """Assemble the matrix over the unknowns, then base tensions, and the slopes of the strokes."""
    states, flexures, count = rows.residual.shape[:3]
    order = np.array([] if by_stroke is None else chain.tendon_order, int)
    tensions = flexures * count + np.arange(len(order))
    size = flexures * count + len(order)
    unit = np.broadcast_to(np.eye(size), (states, size, size))
    # Rows of what is carried to each flexure, over all unknowns: only base tensions to the first.
    carried = [np.zeros((states, form.carried, size))]
    carried[0][:, form.carried - len(order) :] = unit[:, tensions[order]]
    columns = [slice(number * count, (number + 1) * count) for number in range(flexures)]
    for number in range(flexures - 1):
        operands = np.concatenate([unit[:, columns[number]], carried[-1]], axis=1)
        carried.append(np.asarray(rows.to_next)[:, number, :, : operands.shape[1]] @ operands)
    matrix, back = np.zeros((states, size, size)), np.zeros((states, form.beyond, size))
    tension_length = np.zeros((states, len(chain.tendon_order), size))
    for number in reversed(range(flexures)):
        operands = np.concatenate([unit[:, columns[number]], carried[number], back], axis=1)
        matrix[:, columns[number]] = np.asarray(rows.residual)[:, number] @ operands
        back = np.asarray(rows.to_previous)[:, number] @ operands
        tension_length += np.asarray(rows.tension_length)[:, number] @ operands
    first = np.arange(flexures)[:, None] * count
    modes = first + np.arange(len(form.modes))
    matrix[:, modes] *= np.asarray(chain.stiffness)[..., None]
    contacts = first + np.arange(len(form.modes), form.unknowns - 2 * len(chain.tendon_order))
    natural_gap = np.asarray(chain.rods.length).sum(-1)
    compliance = 1.0 / (_HOLDING_STIFFNESS * np.asarray(chain.contact_stiffness) * natural_gap)
    matrix[:, contacts, contacts] += compliance[:, None]
    if by_stroke is None:
        return matrix, np.zeros((states, 0, modes.size))
    tension_length = tension_length[:, np.argsort(order)]
    at_exit = back[:, form.beyond - len(order) :][:, np.argsort(order)]
    released = at_exit - tension_length / np.asarray(chain.memory_stiffness)[:, None]
    matrix[:, tensions] = slopes[:, 1] @ released + slopes[:, 2] @ tension_length
    matrix[:, tensions[:, None], tensions] += slopes[:, 0]
    soft = by_stroke / (_HOLDING_STIFFNESS * np.asarray(chain.stroke_stiffness))
    matrix[:, tensions, tensions] += soft
    return matrix, released[..., modes.ravel()]


def stable(
    prepared: PreparedChain, commands: Command, solved: SolverState
) -> Bool[np.ndarray, " s"]:
    """Return whether every state is stable, with sticking contacts held."""
    verdicts = [
        sign > 0.0 and bool(_positive_definite(stiffness) or _smallest(stiffness) > 0.0)
        for batch in held_stiffness(prepared, commands, solved)
        for stiffness, sign in zip(*batch, strict=True)
    ]
    return np.array(verdicts, bool)


def stability(
    prepared: PreparedChain, commands: Command, solved: SolverState
) -> tuple[Float[np.ndarray, " s"], Float[np.ndarray, " s"]]:
    """Return the smallest real part of the eigenvalues and the determinant's sign, by state."""
    batches = zip(*held_stiffness(prepared, commands, solved), strict=True)
    stiffness, sign = map(np.concatenate, batches)
    return np.array([_smallest(matrix) for matrix in stiffness]), sign


def _positive_definite(stiffness: Float[np.ndarray, "m m"]) -> bool:
    """Return whether the symmetric part is positive definite."""
    try:
        np.linalg.cholesky(stiffness + stiffness.T)
    except np.linalg.LinAlgError:
        return False
    return True


def _smallest(stiffness: Float[np.ndarray, "m m"]) -> float:
    """Return the smallest real part of the eigenvalues; NaN for a state that is not finite."""
    if not np.isfinite(stiffness).all():
        return float("nan")
    return float(np.real(np.linalg.eigvals(stiffness)).min())
