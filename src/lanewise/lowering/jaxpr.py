"""Lower a jaxpr, JAX's trace of a function: equation by equation, loops and branches included."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from functools import cache
from typing import Any

import numpy as np

from lanewise._jax import jax
from lanewise.elementary import ELEMENTARY
from lanewise.ir.control_flow import Conditional, ScanLoop, Store, WhileLoop
from lanewise.ir.graph import (
    LANE_BITS,
    Block,
    Buffer,
    Graph,
    References,
    UnsupportedPrimitiveError,
    reference,
)
from lanewise.lowering.arrays import ArrayLowering
from lanewise.lowering.buffers import BufferLayout, Layout
from lanewise.lowering.data_movement import DATA_MOVEMENT
from lanewise.lowering.primitives import ELEMENTWISE, PRIMITIVES, kind_of
from lanewise.lowering.scan_inputs import ScanInputs, slice_of

# Primitives that call another function.
_CALLS = {"jit", "pjit", "closed_call", "core_call", "remat", "remat2", "checkpoint"}.union(
    ("custom_jvp_call", "custom_vjp_call", "custom_vmap_call")
)


class JaxprLowering:
    """Lower functions that JAX has traced to one graph.

    Args:
        lane_sizes: Sizes of axes along which rows are laid out.
    """

    def __init__(self, lane_sizes: Sequence[int]) -> None:
        """Begin with an empty graph."""
        self.graph = Graph()
        self.arrays = ArrayLowering(self.graph, lane_sizes)
        self.buffers = BufferLayout(self.arrays)

    @contextmanager
    def inside(self, block: Block) -> Generator[None]:
        """Lower what follows into a block."""
        outer, self.graph.block = self.graph.block, block
        try:
            yield
        finally:
            self.graph.block = outer

    def add_region(self, region: Any, block: Block) -> None:
        """Add a loop or branch to a block, behind all nodes added so far."""
        self.graph.add("region", (region,), 0, "f", block)

    def function(
        self, closed: Any, args: Sequence[References], *, scalar: bool = False
    ) -> list[References]:
        """Return the results of a traced function.

        Args:
            closed: The function, a closed jaxpr.
            args: Its arguments.
            scalar: Whether it was traced for single numbers and is applied entry by entry.
        """
        consts = [self.arrays.constant(np.asarray(value)) for value in closed.consts]
        return self._jaxpr(closed.jaxpr, consts, args, scalar)

    def _jaxpr(
        self, jaxpr: Any, consts: Sequence[References], args: Sequence[References], scalar: bool
    ) -> list[References]:
        values: dict[Any, References] = {}
        values.update(zip(jaxpr.constvars, consts, strict=True))
        values.update(zip(jaxpr.invars, args, strict=True))

        def value(variable: Any) -> References:
            if hasattr(variable, "val"):
                return self.arrays.constant(np.asarray(variable.val))
            return values[variable]

        for equation in jaxpr.eqns:
            operands = [value(variable) for variable in equation.invars]
            name = equation.primitive.name
            if scalar and name == "broadcast_in_dim":
                results = [operands[0]]
            else:
                try:
                    results = self._equation(name, equation, operands, scalar)
                except (KeyError, AttributeError) as error:  # another JAX writes it in another way
                    reason = f"JAX's primitive `{name}` as JAX {jax.__version__} writes it: {error}"
                    raise UnsupportedPrimitiveError(reason, name) from error
            values.update(zip(equation.outvars, results, strict=True))
        return [value(variable) for variable in jaxpr.outvars]

    def _equation(
        self, name: str, equation: Any, operands: list[References], scalar: bool
    ) -> list[References]:
        params = equation.params
        for variable in equation.outvars:
            kind_of(variable.aval.dtype)
        if name in DATA_MOVEMENT:
            moved = DATA_MOVEMENT[name](*operands, **params)
            results = moved if isinstance(moved, list) else [moved]
            return list(map(self.buffers.as_rows, results)) if name == "reshape" else results
        if name in ELEMENTWISE:
            return [self.arrays.elementwise(ELEMENTWISE[name], *operands)]
        if name in ELEMENTARY:
            for at, variable in enumerate(equation.invars):
                if kind_of(variable.aval.dtype) != "f":
                    operands[at] = self.arrays.elementwise("to_float", operands[at])
            return self.function(_elementary(name, len(operands)), operands, scalar=True)
        if name in _CALLS:
            inner = next(params[key] for key in ("jaxpr", "call_jaxpr", "call") if key in params)
            if hasattr(inner, "consts"):
                return self.function(inner, operands, scalar=scalar)
            return self._jaxpr(inner, [], operands, scalar)
        if name in _CONTROL_FLOW:
            block = self.graph.block if name == "cond" else self._before_loops(operands)
            with self.inside(block):
                return _CONTROL_FLOW[name](self, operands, params)
        if name in PRIMITIVES:
            return [PRIMITIVES[name](self.arrays, operands, params, equation)]
        raise UnsupportedPrimitiveError(f"JAX's primitive `{name}`", name)

    # Loops and branches

    def _before_loops(self, operands: Sequence[References]) -> Block:
        """Return the block for a loop: as a node, it stands before loops that do not change it."""
        nodes = {int(ref) >> LANE_BITS for refs in operands for ref in refs.ravel()}
        block = self.graph.placement(nodes)
        if self.buffers.batched and block is self.graph.top:  # buffers there are not of rows
            block = self.graph.block
            while block.depth > 1:
                assert block.parent is not None
                block = block.parent
        return block

    def _allocate(self, avals: Sequence[Any]) -> list[Layout]:
        return [self.buffers.allocate(one.shape, kind_of(one.dtype)) for one in avals]

    def _store(self, arrays: Sequence[References], layouts: Sequence[Layout]) -> list[Store]:
        return [self.buffers.store(*pair) for pair in zip(arrays, layouts, strict=True)]

    def _read(self, layouts: Sequence[Layout], block: Block) -> list[References]:
        return [self.buffers.read(layout, block) for layout in layouts]

    def while_loop(self, operands: list[References], params: dict[str, Any]) -> list[References]:
        """Lower `while`: carried values lie in buffers, which both blocks read."""
        first, second = params["cond_nconsts"], params["body_nconsts"]
        condition_consts, body_consts = operands[:first], operands[first : first + second]
        layouts = self._allocate(params["body_jaxpr"].out_avals)
        condition, body = (self.graph.block.nested(repeats=True) for _ in range(2))
        with self.inside(condition):
            args = [*condition_consts, *self._read(layouts, condition)]
            (going,) = self.function(params["cond_jaxpr"], args)
            predicate = int(self.arrays.loaded(going).reshape(()))
        with self.inside(body):
            args = [*body_consts, *self._read(layouts, body)]
            updates = self._store(self.function(params["body_jaxpr"], args), layouts)
        initial = self._store(operands[first + second :], layouts)
        batched = self.buffers.batched
        loop = WhileLoop(initial, condition, predicate, body, updates, batched)
        self.add_region(loop, self.graph.block)
        return self._read(layouts, self.graph.block)

    def scan(self, operands: list[References], params: dict[str, Any]) -> list[References]:
        """Lower `scan`: carried values lie in buffers, a step sees slices of inputs and results."""
        consts, carried = _scan_sizes(params)
        closed, length = params["jaxpr"], params["length"]
        start, arrays = operands[consts : consts + carried], operands[consts + carried :]
        avals = closed.out_avals
        if length == 0:
            empty = [np.zeros((0, *one.shape), one.dtype) for one in avals[carried:]]
            return [*start, *map(self.arrays.constant, empty)]
        layouts = self._allocate(avals[:carried])
        initial = self._store(start, layouts)
        body = self.graph.block.nested(repeats=True)
        inputs = ScanInputs(self.buffers, body, length)
        present = [inputs.present(refs) for refs in arrays]
        initial += inputs.initial
        with self.inside(body):
            present = list(map(self.buffers.as_rows, present))
            carry = self._read(layouts, body)
            results = self.function(closed, [*operands[:consts], *carry, *present])
            updates = self._store(results[:carried], layouts)
            steps = self._scan_results(avals[carried:], length)
            present = [(slice_of(whole, at), at[0]) for whole, at in steps]
            updates += self._store(results[carried:], present)
        inputs.slices += [buffer for buffer, _ in present]
        loop = ScanLoop(
            initial, length, params["reverse"], inputs.slices, inputs.inputs, body, updates
        )
        self.add_region(loop, self.graph.block)
        return [*self._read(layouts, self.graph.block), *self._in_buffers(steps)]

    def _in_buffers(self, layouts: Sequence[Layout]) -> list[References]:
        """Return the entries of buffers; what uses them loads them."""
        block = self.graph.block
        return [reference(self.graph.add_buffer(one, block)) + at for one, at in layouts]

    def _scan_results(self, avals: Sequence[Any], length: int) -> list[Layout]:
        """Return buffers for the results of all steps of a scan, steps as leading axis."""
        layouts: list[Layout] = []
        for aval in avals:
            size, positions = self.buffers.stacked(aval.shape, length)
            kind = kind_of(aval.dtype)
            whole = Buffer("arena", size, batched=self.buffers.batched, kind=kind)
            layouts.append((whole, positions))
        return layouts

    def cond(self, operands: list[References], params: dict[str, Any]) -> list[References]:
        """Lower `cond` and `switch`: results that all branches share need no buffer."""
        branches = params["branches"]
        index = self.arrays.loaded(operands[0])
        known = self.arrays.known(index)
        if known is not None:
            number = int(np.clip(int(known), 0, len(branches) - 1))
            return self.function(branches[number], operands[1:])
        blocks = [self.graph.block.nested(repeats=False) for _ in branches]
        results: list[list[References]] = []
        for branch, block in zip(branches, blocks, strict=True):
            with self.inside(block):
                results.append(self.function(branch, operands[1:]))
        layouts = self._allocate(branches[0].out_avals)
        same = [
            all(np.array_equal(one, own[0]) for one in own) for own in zip(*results, strict=True)
        ]
        lowered: list[tuple[Block, list[Store]]] = []
        for block, arrays in zip(blocks, results, strict=True):
            with self.inside(block):
                stores = [
                    self.buffers.store(refs, layout)
                    for refs, layout, shared in zip(arrays, layouts, same, strict=True)
                    if not shared
                ]
            lowered.append((block, stores))
        region = Conditional(int(index.reshape(())), lowered, self.buffers.batched)
        self.add_region(region, self.graph.block)
        return [
            refs if shared else self.buffers.read(layout, self.graph.block)
            for refs, layout, shared in zip(results[0], layouts, same, strict=True)
        ]


def _scan_sizes(params: dict[str, Any]) -> tuple[int, int]:
    """Return how many constants and how many carried values a scan has."""
    if "num_consts" in params:
        return params["num_consts"], params["num_carry"]
    consts, carry, _ = params["ft_in"].unpack()  # from JAX 0.12 on
    return len(list(consts.vals)), len(list(carry.vals))


@cache
def _elementary(name: str, count: int) -> Any:
    return jax.make_jaxpr(ELEMENTARY[name])(*[1.0] * count)


_CONTROL_FLOW: dict[str, Callable[..., list[References]]] = {
    "while": JaxprLowering.while_loop,
    "scan": JaxprLowering.scan,
    "cond": JaxprLowering.cond,
}
