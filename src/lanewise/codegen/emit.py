"""Emit the LLVM IR of a lowered function: its blocks, loops and branches."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from lanewise.codegen.addresses import Address
from lanewise.codegen.builder import type_name
from lanewise.codegen.lanes import LaneLoops
from lanewise.codegen.storage import Storage
from lanewise.codegen.stores import StoreWriter
from lanewise.codegen.values import Values
from lanewise.ir.control_flow import (
    WIDTH,
    BatchLoop,
    Conditional,
    LoweredFunction,
    ScanLoop,
    WhileLoop,
)
from lanewise.ir.graph import LANE_BITS, Block

# Without `alignstack` LLVM keeps vectors at any address of the stack, many across two cache lines.
_HEAD = (
    "define void @program(ptr %arguments, ptr %results, ptr noalias %arena, i64 %count) "
    f"alignstack({8 * WIDTH})"
)


class Emitter:
    """Write a function.

    Args:
        function: The function.

    Attributes:
        source: Its LLVM IR.
        storage: Its memory.
    """

    def __init__(self, function: LoweredFunction) -> None:
        """Write the whole function."""
        self.graph = function.graph
        self.storage = Storage(function)
        self.schedule, self.builder = self.storage.schedule, self.storage.builder
        self.values = Values(self.storage)
        self.lanes = LaneLoops(self.values)
        self.stores = StoreWriter(self.values)
        self._block(self.graph.top)
        self.stores.write(function.stores)
        self.source = self._module()

    def _module(self) -> str:
        """Return the text of the module; pointers to arguments and results are loaded first."""
        storage, builder = self.storage, self.builder
        pointers = ["%never = icmp slt i64 %count, 0"]
        for array, names in (("arguments", storage.arguments), ("results", storage.results)):
            for number, name in names.items():
                pointers.append(f"{name}.at = getelementptr ptr, ptr %{array}, i64 {number}")
                pointers.append(f"{name} = load ptr, ptr {name}.at, align 8")
        declarations = [*storage.constants, *sorted(builder.declarations)]
        body = [*pointers, *builder.lines, "ret void", "stop:", "ret void"]
        return "\n".join([*declarations, f"{_HEAD} {{\nentry:", *body, "}"])

    def _block(self, block: Block) -> None:
        for number, stage in enumerate(self.schedule.stages(block)):
            for node in stage.straight:
                self._node(node)
                self.builder.limit_block()
            for (length, batched), members in stage.loops.items():
                self.lanes.elementwise(length, batched, members)
            for node in self.schedule.last_used(block, number):
                room = self.storage.rooms.pop(node, None)
                if room is not None:
                    self.storage.arena.free(*room)

    def _node(self, node: int) -> None:
        """Write a node or region of straight code."""
        op, args = self.graph.op[node], self.graph.args[node]
        match op:
            case "region":
                _REGIONS[type(args[0])](self, args[0])
            case "load":
                self.values.load(node)
            case "shuffle":
                self.values.shuffle(node)
            case "reduce":
                self.lanes.reduce(node)
            case "prefix":
                self.lanes.prefix(node)
            case _:
                vector = self.values.is_vector(node)
                operand = self.values.as_vector if vector else self.values.value
                kinds = [self.graph.kind[one] for one in args]
                operands = [operand(one) for one in args]
                self.values.name[node] = self.builder.operation(op, operands, kinds, vector)

    # Regions

    def _any_row(self, mask: str, by_row: bool) -> str:
        return self.builder.reduce("or", mask, "b") if by_row else mask

    def _while_loop(self, loop: WhileLoop) -> None:
        builder = self.builder
        self.stores.write(loop.initial)
        head, inside, after = builder.label(), builder.label(), builder.label()
        builder.join(head)
        self._block(loop.condition)
        by_row = loop.batched and self.schedule.varies(loop.predicate >> LANE_BITS)
        mask = self.values.entry(loop.predicate)
        going = self._any_row(mask, by_row)
        builder.line(f"br i1 {going}, label %{inside}, label %{after}")
        builder.line(f"{inside}:")
        self._block(loop.body)
        self.stores.write(loop.updates, mask if by_row else None)
        builder.line(f"br label %{head}")
        builder.line(f"{after}:")

    def _scan_loop(self, loop: ScanLoop) -> None:
        builder, storage = self.builder, self.storage
        self.stores.write(loop.initial)
        length = "%count" if loop.length is None else str(loop.length)
        last = 0 if loop.length is None else loop.length - 1

        def step(index: str) -> None:
            at = builder.assign(f"sub i64 {last}, {index}") if loop.reverse else index
            for own in loop.slices:
                unit = storage.unit(own.source.batched)
                offset = builder.assign(f"mul i64 {at}, {own.stride * unit}")
                whole = storage.offset(own.source) + own.offset * unit
                start = builder.pointer(storage.base(own.source), whole)
                storage.slice_pointer[id(own)] = builder.pointer(start, offset)
            self._block(loop.body)
            self.stores.write(loop.updates)

        storage.loop(length, step)

    def _conditional(self, region: Conditional) -> None:
        builder = self.builder
        node = region.index >> LANE_BITS
        by_row = region.batched and self.schedule.varies(node)
        kind = self.graph.kind[node]
        index = self.values.entry(region.index)
        last = len(region.branches) - 1
        for number, (block, stores) in enumerate(region.branches):
            # An index out of range selects the first or the last branch.
            compare = "eq" if kind == "b" or 0 < number < last else "sge" if number else "sle"
            value = number if kind == "i" else bool(number)
            own = builder.splat("", kind, value) if by_row else str(value).lower()
            mask = builder.assign(f"icmp {compare} {type_name(kind, by_row)} {index}, {own}")
            after = builder.branch(self._any_row(mask, by_row))
            self._block(block)
            self.stores.write(stores, mask if by_row else None)
            builder.join(after)

    def _batch_loop(self, loop: BatchLoop) -> None:
        builder, storage = self.builder, self.storage

        def rows(first: str) -> None:
            for number, buffer in loop.inputs.items():
                base = storage.arguments.setdefault(number, f"%argument{number}")
                offset = storage.offset(buffer)
                for lane in range(WIDTH):  # lanes beyond the last row repeat it
                    row = builder.assign(f"add i64 {first}, {lane}")
                    last = builder.assign("sub i64 %count, 1")
                    row = builder.call("llvm.umin.i64", "i64", [("i64", row), ("i64", last)])
                    start = builder.assign(f"mul i64 {row}, {buffer.size}")
                    source = Address(builder.pointer(base, start), 0, 1, False)
                    target = Address("%arena", offset + lane, WIDTH, False)
                    storage.copy(source, target, buffer.size, "f")
            self._block(loop.body)
            self.stores.write(loop.stores)
            for number, buffer in enumerate(loop.outputs):
                base = storage.results.setdefault(number, f"%result{number}")
                offset = storage.offset(buffer)
                for lane in range(WIDTH):
                    row = builder.assign(f"add i64 {first}, {lane}")
                    after = builder.branch(builder.assign(f"icmp ult i64 {row}, %count"))
                    start = builder.assign(f"mul i64 {row}, {buffer.size}")
                    target = Address(builder.pointer(base, start), 0, 1, False)
                    source = Address("%arena", offset + lane, WIDTH, False)
                    storage.copy(source, target, buffer.size, "f")
                    builder.join(after)

        storage.loop("%count", rows, WIDTH)


_REGIONS: dict[type, Callable[[Emitter, Any], None]] = {
    WhileLoop: Emitter._while_loop,  # pyright: ignore[reportPrivateUsage]
    ScanLoop: Emitter._scan_loop,  # pyright: ignore[reportPrivateUsage]
    Conditional: Emitter._conditional,  # pyright: ignore[reportPrivateUsage]
    BatchLoop: Emitter._batch_loop,  # pyright: ignore[reportPrivateUsage]
}
