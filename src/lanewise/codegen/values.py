"""Values of statements: single numbers, vectors, and rows that are put together of others."""

from __future__ import annotations

from collections.abc import Sequence

from lanewise.codegen.addresses import Place
from lanewise.codegen.runs import Run, runs
from lanewise.codegen.storage import Storage
from lanewise.codegen.text import literal, type_of
from lanewise.ir.control_flow import WIDTH
from lanewise.ir.graph import LANE, LANE_BITS, Memory


class Values(Storage):
    """Values of a program that is being written."""

    def single(self, number: int) -> str:
        """The value of a statement that is computed at once."""
        if self.graph.op[number] == "const":
            return literal(self.graph.args[number][0], self.graph.kind[number])
        return self.value[number]

    def as_vector(self, number: int) -> str:
        """A value that is computed at once as a vector."""
        known = self.graph.value(number)
        if known is not None:
            return self.text.same("", self.graph.kind[number], known)
        if self.vector(number):
            return self.value_of_row(number)
        return self.text.same(self.value[number], self.graph.kind[number], None)

    def lane(self, one: int) -> str:
        """An entry; a vector where rows of a batch differ in it."""
        number, lane = one >> LANE_BITS, one & LANE
        if int(self.graph.length[number]) == 1:
            return self.single(number)
        if self._lies(number):
            place = self.place_of(number)
            at = self.text.place(place.pointer, place.of_lane(lane))
            return self.text.load(at, self.graph.kind[number], place.rows)
        kind = self.graph.kind[number]
        return self.text.give(
            f"extractelement {type_of(kind, True)} {self.value_of_row(number)}, i64 {lane}"
        )

    def _wide(self, number: int) -> bool:
        """Whether an entry is a vector, with a number for every row."""
        if self._lies(number):
            return self.place_of(number).rows
        return self.order.varies(number)

    def _lanes(self, number: int) -> str:
        kind = self.graph.kind[number]
        values = list(self.graph.args[number][0])
        values += [values[-1]] * (WIDTH - len(values))
        return "<" + ", ".join(f"{type_of(kind, False)} {literal(v, kind)}" for v in values) + ">"

    def _load(self, number: int) -> None:
        statement, first, step, length = self.graph.args[number]
        memory: Memory = self.graph.args[statement][0]
        kind, unit = self.graph.kind[number], self.unit(memory.rows)
        start = self.offset(memory)
        base = self.base(memory)
        if length == 1:
            at = self.text.place(base, start + first * unit)
            self.value[number] = self.text.load(at, kind, memory.rows)
            return
        seen = self._seen_in(number)
        if self.order.looped(number):
            if seen is None:
                place = self.place_of(number)
                self.copy(Place(base, start + first, step, False), place, length, kind)
            else:
                self.slot[number] = seen
            return
        if seen is not None:
            at = self.text.place(base, start + first)
            self.value[number] = self.text.load(at, kind, True)
            return
        value = "poison"
        for lane in range(length):
            at = self.text.place(base, start + first + lane * step)
            own = self.text.load(at, kind, False)
            value = self._insert(value, own, kind, lane)
        self.value[number] = value

    def _insert(self, vector: str, value: str, kind: str, lane: int) -> str:
        own = type_of(kind, False)
        return self.text.give(
            f"insertelement {type_of(kind, True)} {vector}, {own} {value}, i64 {lane}"
        )

    def _take(self, number: int) -> None:
        args, kind = self.graph.args[number], self.graph.kind[number]
        if len(args) == 1:
            self.value[number] = self.lane(args[0])
        elif not self.order.looped(number):
            self.value[number] = self._taken(args, kind)
        else:
            seen = self._seen_in(number)
            if seen is None:
                self._fill(args, kind, self.place_of(number))
            else:
                self.slot[number] = seen

    def _taken(self, entries: Sequence[int], kind: str) -> str:
        """A vector of some entries."""
        first = entries[0] >> LANE_BITS
        ordered = all(one - entries[0] == lane for lane, one in enumerate(entries))
        if ordered and self._in_vectors(first):
            return self._vector_from(first, entries[0] & LANE)
        own = type_of(kind, True)
        pieces: dict[tuple[int, int], dict[int, int]] = {}
        single: list[tuple[int, int]] = []
        for lane, one in enumerate(entries):
            number, at = one >> LANE_BITS, one & LANE
            if self._in_vectors(number):
                pieces.setdefault((number, at // WIDTH), {})[lane] = at % WIDTH
            elif int(self.graph.length[number]) > 1 and not self.order.looped(number):
                pieces.setdefault((number, 0), {})[lane] = at
            else:
                single.append((lane, one))
        value = "poison"
        filled: set[int] = set()
        for (number, piece), at in pieces.items():
            lanes = [
                WIDTH + at[lane] if lane in at else lane if lane in filled else -1
                for lane in range(WIDTH)
            ]
            mask = ", ".join("i32 poison" if lane < 0 else f"i32 {lane}" for lane in lanes)
            both = f"{own} {value}, {own} {self._vector_from(number, piece * WIDTH)}"
            value = self.text.give(f"shufflevector {both}, <{WIDTH} x i32> <{mask}>")
            filled |= set(at)
        for lane, one in single:
            value = self._insert(value, self.lane(one), kind, lane)
        return value

    def _in_vectors(self, number: int) -> bool:
        """Whether a row lies in memory such that vectors may be read from any of its lanes on."""
        if self.program.rows or self.graph.op[number] == "memory" or not self.order.looped(number):
            return False
        place = self.place_of(number)
        return place.pointer == "%arena" and place.step == 1

    def _vector_from(self, number: int, lane: int) -> str:
        """The lanes of a row from one on."""
        if not self.order.looped(number):
            return self.value_of_row(number)
        place = self.place_of(number)
        at = self.text.place(place.pointer, place.of_lane(lane))
        return self.text.load(at, self.graph.kind[number], True)

    def _fill(self, entries: Sequence[int], kind: str, place: Place) -> None:
        """Put entries in memory one after the other."""
        if not self.program.rows:
            for lane in range(0, len(entries), WIDTH):
                value = self._taken(entries[lane : lane + WIDTH], kind)
                at = self.text.place(place.pointer, place.of_lane(lane))
                self.text.store(at, value, kind, True)
            return
        for run in runs(entries, range(len(entries))):
            target = Place(
                place.pointer, place.of_lane(run.place), run.apart * place.step, place.rows
            )
            if run.count > 1 and self.order.looped(run.statement):
                source = self._along_run(run)
                self.copy(source, target, run.count, kind)
                continue
            for number in range(run.count):
                at = target.of_lane(number)
                self._store_lane(run.entry(number), kind, place.pointer, at, place.rows)

    def _along_run(self, run: Run) -> Place:
        """Where the lanes of a run lie."""
        own = self.place_of(run.statement)
        return Place(own.pointer, own.of_lane(run.lane), run.step * own.step, own.rows, own.memory)

    def _store_lane(self, one: int, kind: str, pointer: str, at: int, rows: bool) -> None:
        value = self.lane(one)
        number = one >> LANE_BITS
        if rows and not self._wide(number):
            value = self.text.same(value, kind, self.graph.value(number))
        self.text.store(self.text.place(pointer, at), value, kind, rows)

    def value_of_row(self, number: int) -> str:
        """The vector of a short row."""
        if self.graph.op[number] == "lanes" and number not in self.value:
            self.value[number] = self._lanes(number)
        return self.value[number]


__all__ = ["Values"]
