"""The stiffness of the whole robot against its modes, its tendons held where they stick.

Tension ratios, contact forces and base tensions are eliminated: a contact that sticks holds its
tendon, one that slides keeps its tension ratio at the bound, which moves with the shape. The
stiffness is not symmetric then.

The rows of every flexure are those of Newton's linear step (`linearisation.py`). What is carried
along the chain is put in here flexure by flexure, for many states at once.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.solver.actuation import command_residual
from notchflex.solver.continuation import SolverState
from notchflex.solver.element import Memory, bound_side
from notchflex.solver.linearisation import LinearisedRows, linearise
from notchflex.solver.programs.capacity import pad_rows
from notchflex.solver.programs.compiled import native
from notchflex.solver.programs.prepare import PreparedChain
from notchflex.solver.programs.pytree_layout import PytreeLayout, lane_sizes
from notchflex.solver.programs.static_structure import StaticStructure
from notchflex.solver.residual import evaluate
from notchflex.solver.row_layout import RowLayout, row_layout

# Closed lips and tendons drawn by stroke are held by springs this much stiffer than the notches:
# they only stiffen; without it their forces would be multipliers and the stiffness not defined.
_HOLDING_STIFFNESS = 1e3
# A contact on its bound goes on sliding: it is taken as having slid by so much (mm).
_SLIP = 1e-3
# So many states at once.
_PIECE = 16


class HeldStiffness(NamedTuple):
    """Stiffness of some states.

    Attributes:
        stiffness: Against the modes, N mm per unit of mode squared (N mm/rad for arc notches).
        sign: Sign of the determinant of the whole system, with all that is eliminated.
    """

    stiffness: Float[np.ndarray, "s modes modes"]
    sign: Float[np.ndarray, " s"]


def held_stiffness(
    prepared: PreparedChain, commands: Command, solved: SolverState
) -> Iterator[HeldStiffness]:
    """Find the stiffness of the whole robot in every state, some states at a time.

    Args:
        prepared: The robot.
        commands: What is demanded of the tendons, states as leading axis: by stroke a tendon is
            held, by tension it gives way.
        solved: The equilibria.

    Yields:
        The stiffness of the next states; NaN where a state is none.
    """
    long = prepared.long
    loads, command_layout = prepared.padded_commands(commands)
    packed = np.asarray(prepared.state.pack(solved, leading=1))
    states = pad_rows(packed, prepared.state, long.state)
    form = row_layout(prepared.chain, by_stroke=commands.by_stroke is not None)
    forms = (long.static_structure, command_layout, long.state)
    for start in range(0, len(loads), _PIECE):
        some = slice(start, start + _PIECE)
        given = (np.zeros(1), long.dynamic_vector, loads[some], states[some])
        *rows, slopes = _rows.along((False, False, True, True), *given, *forms)
        rows = LinearisedRows(*(one[:, : prepared.chain.flexures] for one in rows))
        by_stroke = None if commands.by_stroke is None else np.asarray(commands.by_stroke)[some]
        matrix = _whole(prepared.chain, form, rows, slopes, by_stroke)
        yield _condensed(prepared.chain, form, matrix)


@native(4, lane_sizes)
def _rows(
    carried: Float[Array, " one"],
    vector: Float[Array, " chain"],
    load: Float[Array, " command"],
    state: Float[Array, " state"],
    chain_layout: StaticStructure,
    command_layout: PytreeLayout,
    state_layout: PytreeLayout,
) -> tuple[Array, tuple[Array, ...]]:
    """Rows of all flexures of a state, and slopes of what is demanded of the tendons.

    Nothing is carried from state to state.
    """
    solved = state_layout.unpack(state)
    rows, slopes = _linearised(chain_layout.unpack(vector), command_layout.unpack(load), solved)
    return carried, (*rows, slopes)


def _linearised(
    chain: Chain, command: Command, solved: SolverState
) -> tuple[LinearisedRows, Array]:
    unknowns, tension = solved.point.unknowns, solved.point.base_tension
    at = evaluate(chain, unknowns, solved.memory, tension, solved.applied)
    slid = tuple(
        span.slid - _SLIP * bound_side(ratio, span.bound)
        for span, ratio in zip(at.spans, unknowns.log_ratio, strict=True)
    )
    memory = Memory(unknowns.log_ratio, slid, tuple(span.bound for span in at.spans))
    form = row_layout(chain, by_stroke=command.by_stroke is not None)
    rows = linearise(chain, unknowns, memory, solved.applied, at, form)

    def demand(tension: Array, released_length: Array, stretch: Array) -> Array:
        base = at.base._replace(released_length=released_length, stretch=stretch)
        return command_residual(chain, command, tension, base)

    slopes = jax.jacfwd(demand, argnums=(0, 1, 2))(
        tension, at.base.released_length, at.base.stretch
    )
    return rows, jnp.stack(slopes)


def _whole(
    chain: Chain,
    form: RowLayout,
    rows: LinearisedRows,
    slopes: Float[np.ndarray, "s 3 t t"],
    by_stroke: np.ndarray | None,
) -> Float[np.ndarray, "s m m"]:
    """The linear system over the unknowns of all flexures, base to tip, then base tensions."""
    states, flexures, own = rows.residual.shape[:3]
    order = list(chain.tendon_order)
    tensions = flexures * own + np.arange(len(order))
    size = flexures * own + (0 if by_stroke is None else len(order))
    cut = np.cumsum([own, form.carried])

    def put(part: np.ndarray, number: int) -> np.ndarray:
        wide = np.zeros((states, part.shape[1], size))
        wide[:, :, number * own : (number + 1) * own] = part
        return wide

    def split(number: int, of: Array) -> list[np.ndarray]:
        return np.split(np.asarray(of)[:, number], cut, axis=-1)

    # What is carried to every flexure, over all unknowns: to the first only base tensions.
    carried = [np.zeros((states, form.carried, size))]
    if by_stroke is not None:
        carried[0][:, form.carried - len(order) + np.arange(len(order)), tensions[order]] = 1.0
    for number in range(flexures - 1):
        by_own, by_carried, _ = split(number, rows.onward)
        carried.append(put(by_own, number) + by_carried @ carried[-1])
    matrix = np.zeros((states, size, size))
    back = np.zeros((states, form.beyond, size))
    for number in reversed(range(flexures)):
        by_own, by_carried, by_back = split(number, rows.residual)
        here = put(by_own, number) + by_carried @ carried[number] + by_back @ back
        here[:, : form.modes] *= np.asarray(chain.stiffness)[number][None, :, None]
        matrix[:, number * own : (number + 1) * own] = here
        by_own, by_carried, by_back = split(number, rows.behind)
        back = put(by_own, number) + by_carried @ carried[number] + by_back @ back
    on_diagonal = np.zeros((flexures, own))
    natural_gap = np.asarray(chain.rods.length).sum(-1)
    give = 1.0 / (_HOLDING_STIFFNESS * np.asarray(chain.contact_stiffness) * natural_gap)
    on_diagonal[:, form.modes : form.modes + sum(form.contact_pairs)] = give[:, None]
    every = np.arange(flexures * own)
    matrix[:, every, every] += on_diagonal.ravel()
    if by_stroke is not None:
        lengths = np.zeros((2, states, len(order), size))
        lengths[:, :, order] = np.moveaxis(
            back[:, form.beyond - 2 * len(order) :].reshape(states, 2, len(order), size), 1, 0
        )
        matrix[:, tensions] = slopes[:, 1] @ lengths[0] + slopes[:, 2] @ lengths[1]
        matrix[:, tensions[:, None], tensions] += slopes[:, 0]
        soft = by_stroke / (_HOLDING_STIFFNESS * np.asarray(chain.stroke_stiffness))
        matrix[:, tensions, tensions] += soft
    return matrix


def _condensed(chain: Chain, form: RowLayout, matrix: Float[np.ndarray, "s m m"]) -> HeldStiffness:
    """What is left of the system after all but the robot's own modes is eliminated."""
    # Modes that only fill up the arrays are none of the robot's.
    idle = np.asarray(chain.rods.padding_mask) > 0.0
    of_flexures = np.zeros((chain.flexures, form.unknowns), bool)
    of_flexures[:, : form.modes] = True
    keep = np.zeros(matrix.shape[-1], bool)
    keep[: of_flexures.size] = of_flexures.ravel()
    modes, others = np.flatnonzero(keep), np.flatnonzero(~keep)
    own = modes[~idle.ravel()]
    whole = np.isfinite(matrix).all(axis=(1, 2))
    stiffness = np.full((len(matrix), len(own), len(own)), np.nan)
    sign = np.full(len(matrix), np.nan)
    some = matrix[whole]
    answer = np.linalg.solve(some[:, others[:, None], others], some[:, others[:, None], own])
    stiffness[whole] = some[:, own[:, None], own] - some[:, own[:, None], others] @ answer
    sign[whole] = np.linalg.slogdet(some)[0]
    return HeldStiffness(stiffness, sign)
