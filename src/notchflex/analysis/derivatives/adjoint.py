"""Gradients of one number that depends on a solved path: the adjoint of its derivatives.

One compiled program runs backwards over the path, through the memory of the contacts. Its time does
not depend on the number of parameters.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex._quantity import REGISTERED
from notchflex.analysis.derivatives.tangent import (
    Change,
    PathTangents,
    StepLayouts,
    lanes_of,
    step_function,
)
from notchflex.analysis.outputs import report_quantities
from notchflex.results.path import EquilibriumPath
from notchflex.solver.derived.reported import unpad_quantity
from notchflex.solver.programs.compiled import native
from notchflex.solver.programs.static_structure import StaticStructure


@dataclass(frozen=True, eq=False)
class Gradient:
    """Derivatives of a number by all that a path is computed from.

    Attributes:
        loads: By the loads, packed for the long chain, steps as leading axis.
        chain: By the long chain, packed for programs.
        structure: How it is packed.
    """

    loads: Float[np.ndarray, "s command"]
    chain: Float[np.ndarray, " unknown"]
    structure: StaticStructure

    def along(self, change: Change) -> float:
        """Return the derivative of the number along a change."""
        indices, sizes = change.entries(self.structure)
        by_chain = float(self.chain[indices] @ sizes)
        if change.loads is None:
            return by_chain
        return by_chain + float(self.loads.ravel() @ change.loads.ravel())


def gradient(path: EquilibriumPath, weights: Mapping[str, np.ndarray]) -> Gradient:
    """Differentiate a weighted sum of quantities by all loads and by all numbers of the chain.

    Args:
        path: The path, as solved.
        weights: By name of quantities that the solver reports as floats, in the world, the weight
            of each number of a quantity, steps as leading axis.

    Returns:
        Its derivatives. NaN if a step of any weight, or one before it, did not converge, or was so
        hard that its derivatives are not known.
    """
    long = path.prepared.long
    tangents = PathTangents(path, tuple(weights))
    layouts = tangents.layouts
    seeds = _packed(path, weights, _shapes(layouts))
    # No step beyond the last that counts: one that failed there must not matter.
    backwards = slice(int(np.flatnonzero(seeds.any(axis=1)).max(initial=0)), None, -1)
    steps = [one[backwards] for one in (*tangents.steps, tangents.loads, seeds)]
    by_row = (False, False, *(True,) * len(steps))
    start = (np.zeros(long.state.size), long.dynamic_vector)
    result = _adjoint.along(by_row, *start, *steps, layouts)
    loads = np.zeros_like(tangents.loads)
    loads[backwards] = result["load"]
    return Gradient(loads, result["chain"].sum(axis=0), layouts.chain)


def _packed(
    path: EquilibriumPath, weights: Mapping[str, np.ndarray], shapes: dict[str, tuple[int, ...]]
) -> Float[np.ndarray, "s outputs"]:
    """Pack weights in the frame of the base, for the outputs of the long chain."""
    seeds: list[np.ndarray] = []
    turn = path.base_to_world
    for name, weight in weights.items():
        if turn is not None:
            weight = REGISTERED[name].turned(weight, turn.T)
        size = int(np.prod(shapes[name]))
        padded = np.arange(float(size)).reshape(1, *shapes[name])
        indices = unpad_quantity(path.chain, name, padded)[0]
        is_there = np.isfinite(indices)  # tendons may meet fewer edges than there are
        whole = np.zeros((len(weight), size))
        whole[:, indices[is_there].astype(int)] = weight[:, is_there]
        seeds.append(whole)
    return np.concatenate(seeds, axis=1)


@lru_cache(maxsize=64)
def _shapes(layouts: StepLayouts) -> dict[str, tuple[int, ...]]:
    """Return the shapes of the outputs of the long chain."""

    def report(chain: Array, state: Array) -> dict[str, Array]:
        unpacked = layouts.chain.unpack(chain), layouts.state.unpack(state)
        return report_quantities(*unpacked, layouts.outputs)

    vectors = (jax.ShapeDtypeStruct((one.size,), float) for one in (layouts.chain, layouts.state))
    return {name: one.shape for name, one in jax.eval_shape(report, *vectors).items()}


@native(8, lanes_of)
def _adjoint(
    seed: Float[Array, " state"],
    chain: Float[Array, " chain"],
    before: Float[Array, " state"],
    state: Float[Array, " state"],
    between: Float[Array, " state"],
    how: Float[Array, " 4"],
    load: Float[Array, " command"],
    weights: Float[Array, " outputs"],
    layouts: StepLayouts,
) -> tuple[Float[Array, " state"], dict[str, Array]]:
    """Compute the adjoint of a state, carried to the previous one, and of its load and chain."""
    step = step_function(state, between, how, layouts)
    leaves, structure = jax.tree.flatten(layouts.chain.unpack(chain))
    varies = [jnp.issubdtype(leaf.dtype, jnp.floating) for leaf in leaves]

    def packed(load: Array, before: Array, numbers: list[Array]) -> tuple[Array, Array]:
        rest = iter(numbers)
        every = [next(rest) if one else leaf for one, leaf in zip(varies, leaves, strict=True)]
        solved, values = step(jax.tree.unflatten(structure, every), load, before)
        return solved, jnp.concatenate([values[one].ravel() for one in layouts.outputs])

    numbers = [jnp.asarray(leaf) for one, leaf in zip(varies, leaves, strict=True) if one]
    pull_back = jax.vjp(packed, load, before, numbers)[1]
    by_load, by_before, by_numbers = pull_back((seed, weights))
    rest = iter(by_numbers)
    every = [
        next(rest).ravel() if one else jnp.zeros(leaf.size)
        for one, leaf in zip(varies, leaves, strict=True)
    ]
    by_chain = layouts.chain.pack(jnp.concatenate(every))
    return jnp.where(how[3] > 0.0, by_before, 0.0), {"load": by_load, "chain": by_chain}
