"""Writing tables to memory: what a loop carries on, what a branch or a program hands on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lanewise.codegen.addresses import Place
from lanewise.codegen.lanes import Lanes
from lanewise.codegen.runs import Run, runs
from lanewise.ir.control_flow import WIDTH, Put
from lanewise.ir.graph import LANE, LANE_BITS


class Puts(Lanes):
    """What a program that is being written puts in memory."""

    def puts(self, puts: Sequence[Put], mask: str | None = None) -> None:
        """Write tables to memory, all as they were before; of rows those of a mask."""
        targets = {id(put.memory) for put in puts}
        for put in puts:
            self._unhooked(put, targets)
        for put in puts:
            entries, places = put.table.tolist(), put.places.tolist()
            kind, rows = put.memory.inside, put.memory.rows
            base, start, unit = self.base(put.memory), self.offset(put.memory), self.unit(rows)
            for run in runs(entries, places):
                first = start + run.place * unit
                target = Place(base, first, (run.apart if run.count > 1 else 1) * unit, rows)
                if run.count > 1:
                    self._put_run(run, kind, target, mask)
                else:
                    self._put_one(run.entry(0), kind, target, mask)
                self.text.pause()

    def _unhooked(self, put: Put, targets: set[int]) -> None:
        """Copy rows aside that are seen in memory which is about to be written to elsewhere."""
        unit = self.unit(put.memory.rows)
        for number in {int(one) for one in np.unique(put.table >> LANE_BITS)}:
            place = self.place_of(number) if self._lies(number) else None
            if place is None or place.memory is None or id(place.memory) not in targets:
                continue
            if place.memory is put.memory and place.step == unit:
                own = put.table >> LANE_BITS == number
                goes = self.offset(put.memory) + put.places[own] * unit
                comes = place.first + (put.table[own] & LANE) * place.step
                if (goes == comes).all():
                    continue
            length = int(self.graph.length[number]) or place.memory.size
            room = self.arena.room((length + WIDTH) * self.unit(place.rows))
            aside = Place("%arena", room, self.unit(place.rows), place.rows)
            self.copy(place, aside, length, self.graph.kind[number])
            self.slot[number] = aside

    def _put_run(self, run: Run, kind: str, target: Place, mask: str | None) -> None:
        number = run.statement
        if self._lies(number):
            source = self._along_run(run)
            if (source.pointer, source.first, source.step) == (
                target.pointer,
                target.first,
                target.step,
            ):
                return
            if mask is None:
                self.copy(source, target, run.count, kind)
                return

            def trip(index: str | int) -> None:
                value = self._at(source, index, kind)
                if not source.rows:
                    value = self.text.same(value, kind, None)
                self._to(target, index, self._chosen(mask, value, target, index, kind), kind)

            self.repeat(run.count, trip)
            return
        if run.lane == 0 and run.step == 1 and target.step == 1:
            at = self.text.place(target.pointer, target.first)
            self.text.store(at, self.value_of_row(number), kind, True, run.count)
            return
        for place in range(run.count):
            own = Place(target.pointer, target.of_lane(place), 1, target.rows)
            self._put_one(run.entry(place), kind, own, mask)

    def _put_one(self, one: int, kind: str, place: Place, mask: str | None) -> None:
        number = one >> LANE_BITS
        value = self.lane(one)
        if place.rows and not self._wide(number):
            value = self.text.same(value, kind, self.graph.value(number))
        if mask is not None and place.rows:
            value = self._chosen(mask, value, place, 0, kind)
        self.text.store(self.text.place(place.pointer, place.first), value, kind, place.rows)

    def _chosen(self, mask: str, value: str, place: Place, index: str | int, kind: str) -> str:
        old = self._at(place, index, kind)
        return self.text.each("select", [mask, value, old], ["b", kind, kind], True)


__all__ = ["Puts"]
