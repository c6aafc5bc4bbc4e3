"""Gradients of one number that depends on a solved path: the adjoint of its derivatives.

One compiled program runs backwards over the path, through the memory of the contacts. Its time does
not depend on how many numbers the gradient is taken by.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex._quantity import REGISTERED
from notchflex.analysis.derivatives.tangent import Change, PathTangents, answer_of
from notchflex.analysis.outputs import report_quantities
from notchflex.results.path import EquilibriumPath
from notchflex.solver.derived.quantities import unpad_quantity
from notchflex.solver.programs.compiled import native
from notchflex.solver.programs.pytree_layout import PytreeLayout, lane_sizes
from notchflex.solver.programs.static_structure import StaticStructure


@dataclass(frozen=True, eq=False)
class Gradient:
    """Derivatives of a number by all that a path is computed from.

    Attributes:
        loads: By the loads, packed for the long chain, steps as leading axis.
        chain: By the long chain, packed for programs.
        form: How it is packed.
    """

    loads: Float[np.ndarray, "s command"]
    chain: Float[np.ndarray, " unknown"]
    form: StaticStructure

    def along(self, change: Change) -> float:
        """Return the derivative of the number along a change."""
        places, sizes = change.entries(self.form)
        by_chain = float(self.chain[places] @ sizes)
        return (
            by_chain
            if change.loads is None
            else by_chain + float(self.loads.ravel() @ change.loads.ravel())
        )


def gradient(path: EquilibriumPath, weights: Mapping[str, np.ndarray]) -> Gradient:
    """Differentiate a weighted sum of quantities by all loads and by all numbers of the chain.

    Args:
        path: The path, as solved.
        weights: By name of quantities that the solver reports as floats, in the world, what each
            number of a quantity counts, steps as leading axis.

    Returns:
        Its derivatives. NaN if a step of any weight, or one before it, did not converge, or was so
        hard that its derivatives are not known.
    """
    long = path.prepared.long
    outputs = tuple(weights)
    packed, command_layout, states = PathTangents(path, outputs).steps
    form = (long.static_structure, command_layout, long.state)
    seeds = _packed(path, weights, _shapes(*form, outputs))
    # No step beyond the last that counts: one that failed there must not matter.
    backwards = slice(int(np.flatnonzero(seeds.any(axis=1)).max(initial=0)), None, -1)
    given = [one[backwards] for one in (*states, packed, seeds)]
    rows = (False, False, *(True,) * len(given))
    start = (np.zeros(long.state.size), long.dynamic_vector)
    came = _adjoint.along(rows, *start, *given, *form, outputs)
    loads = np.zeros_like(packed)
    loads[backwards] = came["load"]
    return Gradient(loads, came["chain"].sum(axis=0), long.static_structure)


def _packed(
    path: EquilibriumPath, weights: Mapping[str, np.ndarray], shapes: dict[str, tuple[int, ...]]
) -> Float[np.ndarray, "s outputs"]:
    """Weights in the frame of the base and for the outputs of the long chain."""
    seeds: list[np.ndarray] = []
    turn = path.base_to_world
    for name, weight in weights.items():
        if turn is not None:
            weight = REGISTERED[name].turned(weight, turn.T)
        size = int(np.prod(shapes[name]))
        numbers = unpad_quantity(
            path.chain, name, np.arange(float(size)).reshape(1, *shapes[name])
        )[0]
        is_there = np.isfinite(numbers)  # tendons may meet fewer edges than there are
        whole = np.zeros((len(weight), size))
        whole[:, numbers[is_there].astype(int)] = weight[:, is_there]
        seeds.append(whole)
    return np.concatenate(seeds, axis=1)


@lru_cache(maxsize=64)
def _shapes(
    chain_layout: StaticStructure,
    command_layout: PytreeLayout,
    state_layout: PytreeLayout,
    outputs: tuple[str, ...],
) -> dict[str, tuple[int, ...]]:
    """Shapes of the outputs of the long chain."""
    del command_layout

    def report(chain: Array, state: Array) -> dict[str, Array]:
        return report_quantities(chain_layout.unpack(chain), state_layout.unpack(state), outputs)

    vectors = (jax.ShapeDtypeStruct((form.size,), float) for form in (chain_layout, state_layout))
    return {name: one.shape for name, one in jax.eval_shape(report, *vectors).items()}


@native(9, lane_sizes)
def _adjoint(
    seed: Float[Array, " state"],
    chain: Float[Array, " chain"],
    remembers: Float[Array, " 1"],
    before: Float[Array, " state"],
    state: Float[Array, " state"],
    between: Float[Array, " state"],
    how: Float[Array, " 3"],
    load: Float[Array, " command"],
    weights: Float[Array, " outputs"],
    chain_layout: StaticStructure,
    command_layout: PytreeLayout,
    state_layout: PytreeLayout,
    outputs: tuple[str, ...],
) -> tuple[Float[Array, " state"], dict[str, Array]]:
    """What a state counts, which is carried to the one before; what its load and chain count."""
    answer = answer_of(state, between, how, (command_layout, state_layout), outputs)
    leaves, structure = jax.tree.flatten(chain_layout.unpack(chain))
    varies = [jnp.issubdtype(leaf.dtype, jnp.floating) for leaf in leaves]

    def found(load: Array, before: Array, numbers: list[Array]) -> tuple[Array, Array]:
        rest = iter(numbers)
        every = [next(rest) if own else leaf for own, leaf in zip(varies, leaves, strict=True)]
        solved, values = answer(jax.tree.unflatten(structure, every), load, before)
        return solved, jnp.concatenate([values[one].ravel() for one in outputs])

    numbers = [jnp.asarray(leaf) for own, leaf in zip(varies, leaves, strict=True) if own]
    pull_back = jax.vjp(found, load, before, numbers)[1]
    by_load, by_before, by_numbers = pull_back((seed, weights))
    rest = iter(by_numbers)
    every = [
        next(rest).ravel() if own else jnp.zeros(leaf.size)
        for own, leaf in zip(varies, leaves, strict=True)
    ]
    by_chain = chain_layout.pack(jnp.concatenate(every))
    return jnp.where(remembers[0] > 0.0, by_before, 0.0), {"load": by_load, "chain": by_chain}
