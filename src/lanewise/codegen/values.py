"""Produce the values of nodes: single numbers, vectors, rows put together from other rows."""

from __future__ import annotations

from collections.abc import Sequence

from lanewise.codegen.addresses import Address
from lanewise.codegen.builder import literal, type_name
from lanewise.codegen.runs import Run, find_runs
from lanewise.codegen.storage import Storage
from lanewise.ir.control_flow import WIDTH
from lanewise.ir.graph import LANE_BITS, LANE_MASK, Buffer


class Values:
    """Write the code that loads, shuffles and extracts.

    Args:
        storage: The memory of the function.

    Attributes:
        name: LLVM's names of values by node.
    """

    def __init__(self, storage: Storage) -> None:
        """Begin without values."""
        self.storage, self.builder = storage, storage.builder
        self.graph, self.schedule = storage.graph, storage.schedule
        self.name: dict[int, str] = {}

    def is_vector(self, node: int) -> bool:
        """Return whether the value of a node is a vector."""
        if self.storage.batched:
            return self.schedule.varies(node)
        return self.graph.lanes[node] > 1

    def has_rows(self, node: int) -> bool:
        """Return whether an entry of a node is a vector over rows of a batch."""
        if self.storage.in_memory(node):
            return self.storage.address_of(node).batched
        return self.schedule.varies(node)

    # Operands

    def value(self, node: int) -> str:
        """Return the value of a node that is not computed in a loop over lanes."""
        kind = self.graph.kind[node]
        if self.graph.op[node] == "const":
            return literal(self.graph.args[node][0], kind)
        if self.graph.op[node] == "constants" and node not in self.name:
            lanes = list(self.graph.args[node][0])
            lanes += [lanes[-1]] * (WIDTH - len(lanes))
            row = ", ".join(f"{type_name(kind, False)} {literal(one, kind)}" for one in lanes)
            self.name[node] = f"<{row}>"
        return self.name[node]

    def as_vector(self, node: int) -> str:
        """Return a value as a vector."""
        known = self.graph.number[node]
        if known is not None:
            return self.builder.splat("", self.graph.kind[node], known)
        if self.is_vector(node):
            return self.value(node)
        return self.builder.splat(self.name[node], self.graph.kind[node])

    def entry(self, ref: int) -> str:
        """Return an entry; a vector over rows if rows of a batch differ in it."""
        node, lane = ref >> LANE_BITS, ref & LANE_MASK
        if self.graph.lanes[node] == 1:
            return self.value(node)
        if self.storage.in_memory(node):
            return self.storage.load(self.storage.address_of(node), lane, self.graph.kind[node])
        return self.builder.extract(self.value(node), self.graph.kind[node], lane)

    def entry_for(self, ref: int, batched: bool) -> str:
        """Return an entry in the form that memory has it: a vector over rows if batched."""
        value, node = self.entry(ref), ref >> LANE_BITS
        if batched and not self.has_rows(node):
            return self.builder.splat(value, self.graph.kind[node], self.graph.number[node])
        return value

    # Nodes

    def load(self, node: int) -> None:
        """Write a load of entries of a buffer."""
        buffer_node, first, stride, length = self.graph.args[node]
        buffer: Buffer = self.graph.args[buffer_node][0]
        kind, storage = self.graph.kind[node], self.storage
        source = storage.buffer_address(buffer, first, stride)
        if length == 1:
            value = storage.load(source, 0, kind)
            shared = self.is_vector(node) and not source.batched  # by all rows of a batch
            self.name[node] = self.builder.splat(value, kind) if shared else value
            return
        alias = storage.alias(node)
        if self.schedule.is_looped(node):
            if alias is None:
                storage.copy(source, storage.address_of(node), length, kind)
            else:
                storage.address[node] = alias
            return
        if alias is not None:
            at = self.builder.pointer(source.pointer, source.first)
            self.name[node] = self.builder.load(at, kind, True)
            return
        value = "poison"
        for lane in range(length):
            value = self.builder.insert(value, storage.load(source, lane, kind), kind, lane)
        self.name[node] = value

    def shuffle(self, node: int) -> None:
        """Write a row put together from lanes of others."""
        refs, kind = self.graph.args[node], self.graph.kind[node]
        if len(refs) == 1:
            self.name[node] = self.entry(refs[0])
        elif not self.schedule.is_looped(node):
            self.name[node] = self._shuffled(refs, kind)
        else:
            alias = self.storage.alias(node)
            if alias is None:
                self._fill(refs, kind, self.storage.address_of(node))
            else:
                self.storage.address[node] = alias

    def _shuffled(self, refs: Sequence[int], kind: str) -> str:
        """Return a vector of some entries."""
        first = refs[0] >> LANE_BITS
        contiguous = all(one - refs[0] == lane for lane, one in enumerate(refs))
        if contiguous and self._is_contiguous(first):
            return self._vector_from(first, refs[0] & LANE_MASK)
        pieces: dict[tuple[int, int], dict[int, int]] = {}
        single: list[tuple[int, int]] = []
        for lane, one in enumerate(refs):
            node, source_lane = one >> LANE_BITS, one & LANE_MASK
            if self._is_contiguous(node):
                piece = source_lane // WIDTH
                pieces.setdefault((node, piece), {})[lane] = source_lane % WIDTH
            elif self.graph.lanes[node] > 1 and not self.schedule.is_looped(node):
                pieces.setdefault((node, 0), {})[lane] = source_lane
            else:
                single.append((lane, one))
        value = "poison"
        filled: set[int] = set()
        for (node, piece), lanes in pieces.items():
            mask = ", ".join(
                f"i32 {WIDTH + lanes[lane]}"
                if lane in lanes
                else f"i32 {lane}"
                if lane in filled
                else "i32 poison"
                for lane in range(WIDTH)
            )
            own = type_name(kind, True)
            both = f"{own} {value}, {own} {self._vector_from(node, piece * WIDTH)}"
            value = self.builder.assign(f"shufflevector {both}, <{WIDTH} x i32> <{mask}>")
            filled |= set(lanes)
        for lane, one in single:
            value = self.builder.insert(value, self.entry(one), kind, lane)
        return value

    def _is_contiguous(self, node: int) -> bool:
        """Return whether a vector may be loaded from any lane of a row on."""
        if self.storage.batched or self.graph.op[node] == "buffer":
            return False
        if not self.schedule.is_looped(node):
            return False
        address = self.storage.address_of(node)
        return address.pointer == "%arena" and address.stride == 1

    def _vector_from(self, node: int, lane: int) -> str:
        """Return the lanes of a row from one on."""
        if not self.schedule.is_looped(node):
            return self.value(node)
        address = self.storage.address_of(node)
        at = self.builder.pointer(address.pointer, address.of_lane(lane))
        return self.builder.load(at, self.graph.kind[node], True)

    def _fill(self, refs: Sequence[int], kind: str, target: Address) -> None:
        """Store entries in memory one after the other."""
        builder, storage = self.builder, self.storage
        if not storage.batched:
            for lane in range(0, len(refs), WIDTH):
                value = self._shuffled(refs[lane : lane + WIDTH], kind)
                at = builder.pointer(target.pointer, target.of_lane(lane))
                builder.store(at, value, kind, True)
            return
        for run in find_runs(refs, range(len(refs))):
            part = target.part(run.offset, run.offset_stride)
            if run.count > 1 and self.schedule.is_looped(run.node):
                storage.copy(self.run_address(run), part, run.count, kind)
                continue
            for number in range(run.count):
                value = self.entry_for(run.ref(number), target.batched)
                storage.store(part, number, value, kind)

    def run_address(self, run: Run) -> Address:
        """Return where the lanes of a run are."""
        return self.storage.address_of(run.node).part(run.lane, run.lane_stride)
