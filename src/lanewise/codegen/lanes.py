"""Write loops over lanes and what combines lanes: reductions and running sums."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from lanewise.codegen.builder import literal, type_name
from lanewise.codegen.values import Values
from lanewise.ir.control_flow import WIDTH
from lanewise.lowering.reductions import neutral


class LaneLoops:
    """Write the code of long rows.

    Args:
        values: Values of nodes.
    """

    def __init__(self, values: Values) -> None:
        """Hold the function that is being written."""
        self.values, self.storage, self.builder = values, values.storage, values.builder
        self.graph, self.schedule = values.graph, values.schedule

    def elementwise(self, length: int, batched: bool, members: Sequence[int]) -> None:
        """Write a loop that computes nodes lane by lane."""
        graph, storage, builder, kept = self.graph, self.storage, self.builder, self.schedule.kept
        vector = batched or not storage.batched
        outside, inside = self._loop_invariants(members, vector), set(members)
        for node in members:
            if node in kept:
                storage.address_of(node)

        def iteration(index: str | int) -> None:
            local: dict[int, str] = {}

            def operand(node: int) -> str:
                if node in local:
                    return local[node]
                if node in outside:
                    return outside[node]
                local[node] = self._load_lanes(node, index, vector)
                return local[node]

            for node in members:
                args = graph.args[node]
                kinds = [graph.kind[one] for one in args]
                operands = [operand(one) for one in args]
                local[node] = builder.operation(graph.op[node], operands, kinds, vector)
                if node in kept:
                    at = storage.pointer(storage.address_of(node), index)
                    builder.store(at, local[node], graph.kind[node], vector)
                if builder.limit_block():
                    # Values in memory are read again there: LLVM would copy them to the stack.
                    for one in [one for one in local if one in kept or one not in inside]:
                        del local[one]

        storage.loop(str(length), iteration, 1 if storage.batched else WIDTH)

    def _loop_invariants(self, members: Sequence[int], vector: bool) -> dict[int, str]:
        """Return the operands that are the same for all lanes."""
        inside = set(members)
        outside: dict[int, str] = {}
        for node in members:
            for one in self.graph.args[node]:
                if one in inside or one in outside or self.graph.lanes[one] > 1:
                    continue
                has_rows = self.storage.batched and self.schedule.varies(one)
                of_vector = vector and not has_rows
                outside[one] = self.values.as_vector(one) if of_vector else self.values.value(one)
        return outside

    def _load_lanes(self, node: int, index: str | int, vector: bool) -> str:
        kind, address = self.graph.kind[node], self.storage.address_of(node)
        wide = address.batched or not self.storage.batched
        value = self.builder.load(self.storage.pointer(address, index), kind, wide)
        return self.builder.splat(value, kind) if vector and not wide else value

    def reduce(self, node: int) -> None:
        """Write the reduction of lanes of a row to one number."""
        op, row, first, count = self.graph.args[node]
        kind, builder, storage = self.graph.kind[node], self.builder, self.storage
        start = neutral(op, kind)
        if not self.schedule.is_looped(row):
            value = self._masked(self.values.as_vector(row), kind, start, None, first, count)
            self.values.name[node] = builder.reduce(op, value, kind)
            return
        address, batched = storage.address_of(row), storage.batched
        wide = address.batched or not batched
        total = self._accumulator(start, kind, wide)
        length = self.graph.lanes[row]

        def iteration(index: str | int) -> None:
            at = builder.assign(f"add i64 {index}, {first}") if batched else str(index)
            value = builder.load(storage.pointer(address, at), kind, wide)
            if not batched and (first > 0 or (first + count) % WIDTH or count < length):
                value = self._masked(value, kind, start, at, first, count)
            so_far = builder.load(total, kind, wide)
            result = builder.operation(op, [so_far, value], [kind, kind], wide)
            builder.store(total, result, kind, wide)

        storage.loop(str(count if batched else first + count), iteration, 1 if batched else WIDTH)
        result = builder.load(total, kind, wide)
        self.values.name[node] = result if batched else builder.reduce(op, result, kind)

    def _accumulator(self, start: Any, kind: str, wide: bool) -> str:
        """Return the pointer to memory that holds a start value."""
        pointer = self.builder.pointer("%arena", self.storage.arena.allocate(WIDTH))
        value = self.builder.splat("", kind, start) if wide else literal(start, kind)
        self.builder.store(pointer, value, kind, wide)
        return pointer

    def _masked(
        self, value: str, kind: str, start: Any, at: str | None, first: int, count: int
    ) -> str:
        """Return a vector with the neutral number in the lanes outside a range.

        Args:
            value: The vector.
            kind: Kind of its numbers.
            start: The neutral number.
            at: Index of its first lane; None for 0.
            first: First lane of the range.
            count: Number of lanes in it.
        """
        builder, end = self.builder, first + count
        if at is None and first == 0 and end == WIDTH:
            return value
        if at is None:
            lanes = (f"i1 {'true' if first <= lane < end else 'false'}" for lane in range(WIDTH))
            mask = f"<{', '.join(lanes)}>"
        else:
            integers = type_name("i", True)
            counting = ", ".join(f"i64 {lane}" for lane in range(WIDTH))
            index = builder.assign(f"add {integers} {builder.splat(at, 'i')}, <{counting}>")
            low = builder.assign(f"icmp sge {integers} {index}, {builder.splat('', 'i', first)}")
            high = builder.assign(f"icmp slt {integers} {index}, {builder.splat('', 'i', end)}")
            mask = builder.assign(f"and {type_name('b', True)} {low}, {high}")
        values = [mask, value, builder.splat("", kind, start)]
        return builder.operation("select", values, ["b", kind, kind], True)

    def prefix(self, node: int) -> None:
        """Write the running combination of the lanes of a row."""
        op, row, reverse = self.graph.args[node]
        kind, length = self.graph.kind[node], self.graph.lanes[node]
        builder, storage = self.builder, self.storage
        if not self.schedule.is_looped(node):
            source, value, total = self.values.as_vector(row), "poison", None
            for lane in reversed(range(length)) if reverse else range(length):
                one = builder.extract(source, kind, lane)
                if total is not None:
                    one = builder.operation(op, [total, one], [kind, kind], False)
                total = one
                value = builder.insert(value, total, kind, lane)
            self.values.name[node] = value
            return
        source, target = storage.address_of(row), storage.address_of(node)
        wide = target.batched
        pointer = self._accumulator(neutral(op, kind), kind, wide)

        def iteration(index: str) -> None:
            at = builder.assign(f"sub i64 {length - 1}, {index}") if reverse else index
            value = storage.load(source, at, kind)
            if wide and not source.batched:
                value = builder.splat(value, kind)
            so_far = builder.load(pointer, kind, wide)
            total = builder.operation(op, [so_far, value], [kind, kind], wide)
            builder.store(pointer, total, kind, wide)
            storage.store(target, at, total, kind)

        storage.loop(str(length), iteration)
