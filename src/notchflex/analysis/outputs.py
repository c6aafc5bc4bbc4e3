"""Outputs of batches and differentiable functions: their names, and programs that compute them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Any, NoReturn

import numpy as np
from jaxtyping import Array, Float, Int

from notchflex._jax import choose, jax, jnp
from notchflex.errors import ErrorCode, InputError
from notchflex.loads.command import Command
from notchflex.loads.load import short_repr
from notchflex.loads.load_path import TENDONS, TIP
from notchflex.mechanics.chain import Chain
from notchflex.results.quantities import QUANTITIES
from notchflex.solver.continuation import solve_load_step
from notchflex.solver.newton import Settings
from notchflex.solver.programs.compiled import Native
from notchflex.solver.programs.prepare import PreparedChain
from notchflex.solver.programs.static_structure import PytreeLayout, StaticStructure
from notchflex.solver.quantities import believable, unpad_quantity
from notchflex.solver.residual import SolverState, at_rest
from notchflex.solver.solved_state import SolvedState

Arrays = dict[str, np.ndarray]
"""Arrays by name."""

OF_STATE = [name for name, quantity in QUANTITIES.items() if quantity.source != "path"]
"""What is reported of a state alone, without its path."""
DEFAULT_OUTPUTS = ("total_angle", "notch_angle", "tip_position", "tip_rotation", "converged")
OUTPUTS = (*dict.fromkeys([*DEFAULT_OUTPUTS, "residual", "iterations", *OF_STATE]),)
"""What can be asked of a batch or of a function that can be differentiated."""
LOADS = (*TENDONS, *TIP)
"""Names of the loads that batches vary and that slopes are taken by."""
WORKS = {name: quantity.work_of for name, quantity in QUANTITIES.items() if quantity.work_of}
"""What can be asked of a batch besides: works, with what they are integrated of."""


STEPS = ("states", "between", "how")
"""What derivatives take of every step of a row; see `PathTangents.steps`."""


class UnknownOutputError(InputError, KeyError):
    """No output of this name was asked for."""

    def __init__(self, name: object, names: Iterable[str]) -> None:
        """Name what there is."""
        available = ", ".join(names) or "none"
        message = f"there is no output {short_repr(name)}; there are {available}"
        super().__init__(message, ErrorCode.UNKNOWN_NAME)

    def __str__(self) -> str:
        """Return the message; a `KeyError` would put it in quotes."""
        return str(self.args[0])


@jax.tree_util.register_pytree_with_keys_class
class OutputTable(dict[str, Array]):
    """Outputs by name; an unknown name raises an `InputError` that lists those there are."""

    def __missing__(self, name: str) -> NoReturn:
        """Refuse a name that was not asked for."""
        raise UnknownOutputError(name, self)

    def tree_flatten_with_keys(self) -> tuple[list[Any], tuple[str, ...]]:
        """Return keys and values, and the names, for JAX."""
        return [(jax.tree_util.DictKey(name), value) for name, value in self.items()], tuple(self)

    @classmethod
    def tree_unflatten(cls, names: tuple[str, ...], values: Iterable[Any]) -> OutputTable:
        """Return the table of names and values, for JAX."""
        return cls(zip(names, values, strict=True))


def check_outputs(outputs: Sequence[str], allowed: Sequence[str] = OUTPUTS) -> tuple[str, ...]:
    """Return the names of outputs, at least one, all of them allowed."""
    names = (outputs,) if isinstance(outputs, str) else tuple(outputs)
    wrong = [name for name in names if name not in allowed]
    if wrong or not names:
        problem = f"there is no output {short_repr(wrong[0])}" if wrong else "no output is asked"
        raise InputError.UNKNOWN_NAME(f"{problem}; there are {', '.join(allowed)}")
    return names


def report_quantities(
    chain: Chain, solved: SolverState, outputs: tuple[str, ...]
) -> dict[str, Array]:
    """Return quantities of a solved state by name, in the frame of the base."""
    state = SolvedState(chain, solved)
    return {name: state.quantity(name) for name in outputs if name in OF_STATE}


@lru_cache(maxsize=64)
def reported_shapes(
    chain: StaticStructure, state: PytreeLayout, outputs: tuple[str, ...]
) -> dict[str, tuple[int, ...]]:
    """Return the shapes of quantities of a state, as a program reports them."""

    def report(numbers: Array, packed: Array) -> dict[str, Array]:
        return report_quantities(chain.unpack(numbers), state.unpack(packed), outputs)

    vectors = (jax.ShapeDtypeStruct((layout.size,), float) for layout in (chain, state))
    reported = jax.eval_shape(report, *vectors)
    return {name: reported[name].shape for name in outputs}


def slices_of(arrays: Mapping[str, np.ndarray]) -> dict[str, slice]:
    """Return where arrays are in a row of all their numbers."""
    ends = np.cumsum([0, *(array.size for array in arrays.values())]).tolist()
    return dict(zip(arrays, map(slice, ends, ends[1:]), strict=True))


def unpadded_entries(
    ready: PreparedChain, outputs: Sequence[str]
) -> dict[str, Int[np.ndarray, ...]]:
    """Return where programs of the padded chain report the numbers of a robot's own quantities."""
    # -1 stands for numbers beyond the end of a tendon.
    long, begin, indices = ready.long, 1, {}
    shapes = reported_shapes(long.static_structure, long.state, tuple(outputs))
    for name, shape in shapes.items():
        end = begin + int(np.prod(shape))
        numbers = unpad_quantity(ready.chain, name, np.arange(float(begin), end).reshape(shape))
        begin, indices[name] = end, np.nan_to_num(numbers).astype(int) - 1
    return indices


@Native
def follow_row(
    robot: Chain, loads: Command, numbers: Float[Array, " settings"], outputs: tuple[str, ...]
) -> dict[str, Array]:
    """Follow the path of a batch row from rest; the last good state stays after a failure."""
    # Beside `run` this is a second loop over a path, and stays one: `run` continues or starts
    # anew, skips what comes after a failure (a branch that rows side by side would both take),
    # and packs all that a path may be asked for later; here only what is asked for is kept.
    settings = Settings.of(numbers)

    def step(state: tuple[SolverState, Array], command: Any) -> tuple[Any, dict[str, Array]]:
        last, alive = state
        result = solve_load_step(robot, command, last, settings)
        solved = choose(alive, result.solved, last)
        reached = alive & result.converged
        quantity = SolvedState(robot, solved).quantity
        converged = reached & believable(quantity)
        values = {
            "residual": result.residual,
            "iterations": result.iterations,
            "converged": converged,
        }
        if STEPS[0] in outputs:
            how = [result.fraction_before, result.substeps, converged, True]
            packed = [PytreeLayout.of(pytree).pack(pytree) for pytree in (solved, result.between)]
            values |= dict(zip(STEPS, [*packed, jnp.array(how, float)], strict=True))
        return (solved, reached), {
            name: values[name] if name in values else quantity(name) for name in outputs
        }

    return jax.lax.scan(step, (at_rest(robot), jnp.array(True)), loads)[1]
