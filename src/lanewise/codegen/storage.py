"""Assign memory to buffers and rows, and copy between them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from lanewise.codegen.addresses import Address, Arena
from lanewise.codegen.builder import IRBuilder, literal, type_name
from lanewise.codegen.schedule import Schedule
from lanewise.ir.control_flow import WIDTH, LoweredFunction
from lanewise.ir.graph import LANE_BITS, LANE_MASK, Buffer

# Longer runs of numbers are copied in a loop.
_UNROLLED = 16


class Storage:
    """Manage the memory of a function that is being written.

    Args:
        function: The function.

    Attributes:
        builder: Its lines of LLVM IR.
        address: Addresses of rows that are in memory, by node.
        rooms: Memory in the arena of rows, by node: offset and size.
        slice_pointer: Pointers to slices of the present step, by identity of the buffer.
        constants: Definitions of constant rows.
        arguments: Names of the pointers to arguments in use.
        results: Names of the pointers to results in use.
    """

    def __init__(self, function: LoweredFunction) -> None:
        """Begin with no memory assigned."""
        self.graph, self.batched = function.graph, function.batched
        self.schedule = Schedule(function)
        self.builder = IRBuilder()
        self.arena = Arena()
        self.address: dict[int, Address] = {}
        self.rooms: dict[int, tuple[int, int]] = {}
        self.slice_pointer: dict[int, str] = {}
        self.constants: list[str] = []
        self.arguments: dict[int, str] = {}
        self.results: dict[int, str] = {}

    # Addresses

    def unit(self, batched: bool) -> int:
        """Return the numbers in memory per entry."""
        return WIDTH if batched else 1

    def base(self, buffer: Buffer) -> str:
        """Return the pointer that a buffer's offset counts from."""
        if buffer.space == "argument":
            return self.arguments.setdefault(buffer.source, f"%argument{buffer.source}")
        if buffer.space == "result":
            return self.results.setdefault(buffer.source, f"%result{buffer.source}")
        return self.slice_pointer[id(buffer)] if buffer.space == "slice" else "%arena"

    def offset(self, buffer: Buffer) -> int:
        """Return the offset of a buffer's first entry from its base."""
        if buffer.space != "arena":
            return 0
        if buffer.offset < 0:
            size = (buffer.size + WIDTH) * self.unit(buffer.batched)
            buffer.offset = self.arena.allocate(size)
        return buffer.offset

    def buffer_address(self, buffer: Buffer, first: int = 0, stride: int = 1) -> Address:
        """Return the address of entries of a buffer."""
        unit = self.unit(buffer.batched)
        start = self.offset(buffer) + first * unit
        return Address(self.base(buffer), start, stride * unit, buffer.batched, buffer)

    def in_memory(self, node: int) -> bool:
        """Return whether the lanes of a node are in memory, not in a value."""
        return self.graph.op[node] == "buffer" or self.schedule.is_looped(node)

    def address_of(self, node: int) -> Address:
        """Return the address of a row that is in memory; assign it if need be."""
        known = self.address.get(node)
        if known is not None:
            return known
        op, args = self.graph.op[node], self.graph.args[node]
        if op == "buffer":
            return self.buffer_address(args[0])
        if op == "constants":
            address = self._constant_row(node)
        else:
            batched = self.schedule.varies(node)
            unit = self.unit(batched)
            size = self.graph.lanes[node] * unit
            first = self.arena.allocate(size)
            self.rooms[node] = (first, size)
            address = Address("%arena", first, unit, batched)
        self.address[node] = address
        return address

    def _constant_row(self, node: int) -> Address:
        values = self.graph.args[node][0]
        name = f"@lanes{node}"
        kind = "i" if self.graph.kind[node] == "i" else "f"
        size = -(-len(values) // WIDTH) * WIDTH
        padded = [*values, *[values[-1]] * (size - len(values))]
        row = ", ".join(f"{type_name(kind, False)} {literal(one, kind)}" for one in padded)
        array = f"[{size} x {type_name(kind, False)}]"
        self.constants.append(f"{name} = internal constant {array} [{row}], align 64")
        return Address(name, 0, 1, False)

    def alias(self, node: int) -> Address | None:
        """Return where a row can be read without a copy; None if nowhere."""
        op, args = self.graph.op[node], self.graph.args[node]
        if op == "load":
            _, first, stride, length = args
            buffer: Buffer = self.graph.args[args[0]][0]
            if not self.batched and (stride != 1 or not _is_padded(buffer, first, length)):
                return None
            return self.buffer_address(buffer, first, stride)
        if op == "shuffle" and self.batched:
            source = args[0] >> LANE_BITS
            steps = np.diff(args)
            constant = (steps == steps[0]).all() and abs(steps[0]) < LANE_MASK
            if constant and self.schedule.is_looped(source):
                return self.address_of(source).part(args[0] & LANE_MASK, int(steps[0]))
        return None

    # Copies

    def pointer(self, address: Address, index: str | int) -> str:
        """Return the pointer to a lane."""
        if isinstance(index, int):
            return self.builder.pointer(address.pointer, address.of_lane(index))
        start = self.builder.pointer(address.pointer, address.first)
        if address.stride != 1:
            index = self.builder.assign(f"mul i64 {index}, {address.stride}")
        return self.builder.pointer(start, index)

    def load(self, address: Address, index: str | int, kind: str) -> str:
        """Load a lane."""
        return self.builder.load(self.pointer(address, index), kind, address.batched)

    def store(self, address: Address, index: str | int, value: str, kind: str) -> None:
        """Store a lane."""
        self.builder.store(self.pointer(address, index), value, kind, address.batched)

    def copy(self, source: Address, target: Address, count: int, kind: str) -> None:
        """Copy lanes."""
        unit, builder = self.unit(source.batched), self.builder
        if source.batched == target.batched and source.stride == target.stride == unit:
            to = builder.pointer(target.pointer, target.first)
            of = builder.pointer(source.pointer, source.first)
            builder.declarations.add("declare void @llvm.memmove.p0.p0.i64(ptr, ptr, i64, i1)")
            args = f"ptr align 8 {to}, ptr align 8 {of}, i64 {8 * unit * count}, i1 false"
            builder.line(f"call void @llvm.memmove.p0.p0.i64({args})")
            return

        def one(index: str | int) -> None:
            value = self.load(source, index, kind)
            if target.batched and not source.batched:
                value = builder.splat(value, kind)
            self.store(target, index, value, kind)

        self.repeat(count, one)

    # Loops of the generated code

    def repeat(self, count: int, body: Callable[[Any], None]) -> None:
        """Write code for every index below a count; a loop if there are many."""
        if count > _UNROLLED:
            self.loop(str(count), body)
            return
        for index in range(count):
            body(index)

    def loop(self, count: str, body: Callable[[str], None], step: int = 1) -> None:
        """Write a loop; its body runs at least once."""
        builder = self.builder
        before, head, after = builder.label(), builder.label(), builder.label()
        index = builder.name()
        builder.join(before)
        builder.join(head)
        latch = builder.label()
        builder.line(f"{index} = phi i64 [ 0, %{before} ], [ {index}.next, %{latch} ]")
        body(index)
        builder.join(latch)
        builder.line(f"{index}.next = add i64 {index}, {step}")
        builder.line(f"{index}.more = icmp ult i64 {index}.next, {count}")
        builder.line(f"br i1 {index}.more, label %{head}, label %{after}")
        builder.line(f"{after}:")


def _is_padded(buffer: Buffer, first: int, length: int) -> bool:
    """Return whether memory reaches to the end of the last vector of a row."""
    end = first + -(-length // WIDTH) * WIDTH
    while buffer.space == "slice":
        if not buffer.steps:
            return False
        end += buffer.offset + (buffer.steps - 1) * buffer.stride
        buffer = buffer.source
    return buffer.space == "arena" or (buffer.space == "argument" and end <= buffer.size)
