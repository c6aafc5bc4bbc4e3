"""Write stores of references to buffers: carried values, results of branches and functions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lanewise.codegen.addresses import Address
from lanewise.codegen.runs import Run, find_runs
from lanewise.codegen.values import Values
from lanewise.ir.control_flow import WIDTH, Store
from lanewise.ir.graph import LANE_BITS, LANE_MASK


class StoreWriter:
    """Write stores.

    Args:
        values: Values of nodes.
    """

    def __init__(self, values: Values) -> None:
        """Hold the function that is being written."""
        self.values, self.storage, self.builder = values, values.storage, values.builder

    def write(self, stores: Sequence[Store], mask: str | None = None) -> None:
        """Write stores as if at once: all read what was there before.

        Args:
            stores: The stores.
            mask: Which rows of a batch to write; None for all.
        """
        targets = {id(store.buffer) for store in stores}
        for store in stores:
            self._save_overwritten(store, targets)
        for store in stores:
            kind, target = store.buffer.kind, self.storage.buffer_address(store.buffer)
            for run in find_runs(store.refs.tolist(), store.offsets.tolist()):
                part = target.part(run.offset, run.offset_stride if run.count > 1 else 1)
                if run.count > 1:
                    self._write_run(run, kind, part, mask, store.row)
                else:
                    self._write_entry(run.ref(0), kind, part, 0, mask)
                self.builder.limit_block()

    def _save_overwritten(self, store: Store, targets: set[int]) -> None:
        """Copy rows that alias buffers which are about to be overwritten."""
        storage = self.storage
        for node in np.unique(store.refs >> LANE_BITS).tolist():
            address = storage.address_of(node) if storage.in_memory(node) else None
            if address is None or address.buffer is None or id(address.buffer) not in targets:
                continue
            if address.buffer is store.buffer:
                target, own = storage.buffer_address(store.buffer), store.refs >> LANE_BITS == node
                to = target.first + store.offsets[own] * target.stride
                of = address.first + (store.refs[own] & LANE_MASK) * address.stride
                if (to == of).all():
                    continue
            length = storage.graph.lanes[node] or address.buffer.size
            unit = storage.unit(address.batched)
            saved = Address(
                "%arena", storage.arena.allocate((length + WIDTH) * unit), unit, address.batched
            )
            storage.copy(address, saved, length, storage.graph.kind[node])
            storage.address[node] = saved

    def _write_run(self, run: Run, kind: str, target: Address, mask: str | None, row: int) -> None:
        storage, builder = self.storage, self.builder
        if storage.in_memory(run.node):
            self._copy_run(self.values.run_address(run), run.count, kind, target, mask)
        elif run.lane == 0 and run.lane_stride == 1 and target.stride == 1:
            at = builder.pointer(target.pointer, target.first)
            # A whole vector can be loaded again at once, one stored under a mask much later.
            lanes = WIDTH if run.count == row else run.count
            builder.store(at, self.values.value(run.node), kind, True, lanes)
        else:
            for number in range(run.count):
                self._write_entry(run.ref(number), kind, target, number, mask)

    def _copy_run(
        self, source: Address, count: int, kind: str, target: Address, mask: str | None
    ) -> None:
        storage = self.storage
        same = (source.pointer, source.first, source.stride)
        if same == (target.pointer, target.first, target.stride):
            return
        if mask is None:
            storage.copy(source, target, count, kind)
            return

        def one(index: str | int) -> None:
            value = storage.load(source, index, kind)
            if not source.batched:
                value = self.builder.splat(value, kind)
            storage.store(target, index, self._blend(mask, value, target, index, kind), kind)

        storage.repeat(count, one)

    def _write_entry(
        self, ref: int, kind: str, target: Address, lane: int, mask: str | None
    ) -> None:
        value = self.values.entry_for(ref, target.batched)
        if mask is not None and target.batched:
            value = self._blend(mask, value, target, lane, kind)
        self.storage.store(target, lane, value, kind)

    def _blend(self, mask: str, value: str, target: Address, index: str | int, kind: str) -> str:
        """Return the new value for the rows of a mask and the stored one for others."""
        old = self.storage.load(target, index, kind)
        return self.builder.operation("select", [mask, value, old], ["b", kind, kind], True)
