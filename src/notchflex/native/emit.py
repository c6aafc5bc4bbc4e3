"""From statements in order to the text of a program for LLVM."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from notchflex.native.graph import LANE, LANE_BITS, Block, Memory
from notchflex.native.order import Order
from notchflex.native.places import Arena, Place
from notchflex.native.read import WIDTH, Choice, Loop, Program, Put, Rows, Steps
from notchflex.native.tables import NEUTRAL
from notchflex.native.text import Text, literal, type_of

# Runs of numbers longer than this are copied in a loop.
_UNROLLED = 16


class Emitter:
    """Writes a program.

    Args:
        program: The program.
    """

    def __init__(self, program: Program) -> None:
        """Write it whole."""
        self.program, self.graph = program, program.graph
        self.order = Order(program)
        self.text = Text()
        self.arena = Arena()
        self.value: dict[int, str] = {}
        self.vectors: dict[int, str] = {}
        self.slot: dict[int, Place] = {}
        self._rooms: dict[int, tuple[int, int]] = {}
        self.pointer: dict[int, str] = {}
        self.constants: list[str] = []
        self._given: dict[int, str] = {}
        self._results: dict[int, str] = {}
        self._write()

    @property
    def source(self) -> str:
        """The whole text."""
        body = "\n".join(self.text.lines)
        head = "define void @program(ptr %given, ptr %results, ptr noalias %arena, i64 %count)"
        parts = [*self.constants, *sorted(self.text.declared), f"{head} {{\nentry:", body, "}"]
        return "\n".join(parts)

    def _write(self) -> None:
        self.block(self.graph.top)
        self.puts(self.program.put)
        for line in ("ret void", "stop:", "ret void"):
            self.text.say(line)
        # Pointers that are given are looked up first of all.
        looked: list[str] = ["%never = icmp slt i64 %count, 0"]
        for kind, table in (("given", self._given), ("results", self._results)):
            for number, name in table.items():
                looked.append(f"{name}.at = getelementptr ptr, ptr %{kind}, i64 {number}")
                looked.append(f"{name} = load ptr, ptr {name}.at, align 8")
        self.text.lines[:0] = looked

    # Shapes of values

    def vector(self, number: int) -> bool:
        """Whether a statement's value is a vector."""
        if self.program.rows:
            return self.order.varies(number)
        return int(self.graph.length[number]) > 1

    def unit(self, rows: bool) -> int:
        """Numbers per entry of memory."""
        return WIDTH if rows else 1

    # Memory

    def base(self, memory: Memory) -> str:
        """Where memory begins."""
        if memory.place == "given":
            return self._given.setdefault(memory.number, f"%given{memory.number}")
        if memory.place == "result":
            return self._results.setdefault(memory.number, f"%result{memory.number}")
        if memory.place == "step":
            return self.pointer[id(memory)]
        return "%arena"

    def offset(self, memory: Memory) -> int:
        """Place of its first number, from there."""
        if memory.place != "arena":
            return 0
        if memory.offset < 0:
            memory.offset = self.arena.room((memory.size + WIDTH) * self.unit(memory.rows))
        return memory.offset

    def place_of(self, number: int) -> Place:
        """Where the lanes of a row lie that is computed in a loop."""
        found = self.slot.get(number)
        if found is not None:
            return found
        op, args = self.graph.op[number], self.graph.args[number]
        length = int(self.graph.length[number])
        if op == "memory":
            memory: Memory = args[0]
            return Place(
                self.base(memory),
                self.offset(memory),
                self.unit(memory.rows),
                memory.rows,
                memory,
            )
        if op == "lanes":
            name = f"@lanes{number}"
            room = -(-length // WIDTH) * WIDTH
            values = [float(one) if self.graph.kind[number] != "i" else int(one) for one in args[0]]
            kind = "i" if self.graph.kind[number] == "i" else "f"
            values += [values[-1]] * (room - length)
            row = ", ".join(f"{type_of(kind, False)} {literal(one, kind)}" for one in values)
            form = f"[{room} x {type_of(kind, False)}]"
            self.constants.append(f"{name} = internal constant {form} [{row}], align 64")
            place = Place(name, 0, 1, False)
        else:
            rows = self.order.varies(number)
            unit = self.unit(rows)
            room = (length + WIDTH) * unit
            first = self.arena.room(room)
            self._rooms[number] = (first, room)
            place = Place("%arena", first, unit, rows)
        self.slot[number] = place
        return place

    def _seen_in(self, number: int) -> Place | None:
        """Where a row is seen without being copied: in memory, or in another row."""
        op, args = self.graph.op[number], self.graph.args[number]
        if op == "load":
            memory: Memory = self.graph.args[args[0]][0]
            unit = self.unit(memory.rows)
            outside = memory.place != "arena"
            if not self.program.rows and (args[2] != 1 or outside):
                return None
            first = self.offset(memory) + args[1] * unit
            return Place(self.base(memory), first, args[2] * unit, memory.rows, memory)
        if op == "take" and self.program.rows:
            source = args[0] >> LANE_BITS
            apart = np.diff(args)
            if self.order.looped(source) and (apart == apart[0]).all() and abs(apart[0]) < LANE:
                own = self.place_of(source)
                first = own.of_lane(args[0] & LANE)
                return Place(own.pointer, first, int(apart[0]) * own.step, own.rows, own.memory)
        return None

    # Values

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

    def _lies(self, number: int) -> bool:
        """Whether lanes are in memory, and no value."""
        return self.graph.op[number] == "memory" or self.order.looped(number)

    def _wide(self, number: int) -> bool:
        """Whether an entry is a vector, with a number for every row."""
        if self._lies(number):
            return self.place_of(number).rows
        return self.order.varies(number)

    # Blocks

    def block(self, block: Block) -> None:
        """All statements of a block."""
        for count, stage in enumerate(self.order.stages(block)):
            for number in stage.straight:
                self.straight(number)
                self.text.pause()
            for (length, rows), members in stage.loops.items():
                self.over_lanes(length, rows, members)
            for number in self.order.over(block, count):
                room = self._rooms.pop(number, None)
                if room is not None:
                    self.arena.leave(*room)

    def straight(self, number: int) -> None:
        """A statement, loop or condition on its own."""
        op, args = self.graph.op[number], self.graph.args[number]
        if op == "item":
            _ITEMS[type(args[0])](self, args[0])
        elif op == "load":
            self._load(number)
        elif op == "take":
            self._take(number)
        elif op == "reduce":
            self._reduce(number)
        elif op == "along":
            self._along(number)
        else:
            vector = self.vector(number)
            values = [self.as_vector(one) if vector else self.single(one) for one in args]
            kinds = [self.graph.kind[one] for one in args]
            self.value[number] = self.text.each(op, values, kinds, vector)

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
        own = type_of(kind, True)
        by_source: dict[int, list[tuple[int, int]]] = {}
        single: list[tuple[int, int]] = []
        for lane, one in enumerate(entries):
            number = one >> LANE_BITS
            if int(self.graph.length[number]) > 1 and not self.order.looped(number):
                by_source.setdefault(number, []).append((lane, one & LANE))
            else:
                single.append((lane, one))
        value = "poison"
        filled: set[int] = set()
        for number, pairs in by_source.items():
            at = dict(pairs)
            lanes = [
                WIDTH + at[lane] if lane in at else lane if lane in filled else -1
                for lane in range(WIDTH)
            ]
            mask = ", ".join("i32 poison" if lane < 0 else f"i32 {lane}" for lane in lanes)
            both = f"{own} {value}, {own} {self.value_of_row(number)}"
            value = self.text.give(f"shufflevector {both}, <{WIDTH} x i32> <{mask}>")
            filled |= set(at)
        for lane, one in single:
            value = self._insert(value, self.lane(one), kind, lane)
        return value

    def _fill(self, entries: Sequence[int], kind: str, place: Place) -> None:
        """Put entries in memory one after the other."""
        for run in _runs(entries, range(len(entries))):
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

    def _along_run(self, run: _Run) -> Place:
        """Where the lanes of a run lie."""
        own = self.place_of(run.statement)
        return Place(own.pointer, own.of_lane(run.lane), run.step * own.step, own.rows, own.memory)

    def _store_lane(self, one: int, kind: str, pointer: str, at: int, rows: bool) -> None:
        value = self.lane(one)
        number = one >> LANE_BITS
        if rows and not self._wide(number):
            value = self.text.same(value, kind, self.graph.value(number))
        self.text.store(self.text.place(pointer, at), value, kind, rows)

    def copy(self, source: Place, target: Place, count: int, kind: str) -> None:
        """Copy numbers from one place to another."""
        unit = self.unit(source.rows)
        if source.rows == target.rows and source.step == unit and target.step == unit:
            goes = self.text.place(target.pointer, target.first)
            comes = self.text.place(source.pointer, source.first)
            self.text.declared.add("declare void @llvm.memmove.p0.p0.i64(ptr, ptr, i64, i1)")
            size = 8 * unit * count
            given = f"ptr align 8 {goes}, ptr align 8 {comes}, i64 {size}, i1 false"
            self.text.say(f"call void @llvm.memmove.p0.p0.i64({given})")
            return

        def one(index: str | int) -> None:
            value = self._at(source, index, kind)
            if target.rows and not source.rows:
                value = self.text.same(value, kind, None)
            self._to(target, index, value, kind)

        self.repeat(count, one)

    def _where(self, place: Place, index: str | int) -> str:
        if isinstance(index, int):
            return self.text.place(place.pointer, place.of_lane(index))
        start = self.text.place(place.pointer, place.first)
        along = index if place.step == 1 else self.text.give(f"mul i64 {index}, {place.step}")
        return self.text.place(start, along)

    def _at(self, place: Place, index: str | int, kind: str) -> str:
        return self.text.load(self._where(place, index), kind, place.rows)

    def _to(self, place: Place, index: str | int, value: str, kind: str) -> None:
        self.text.store(self._where(place, index), value, kind, place.rows)

    def repeat(self, count: int, body: Callable[[Any], None]) -> None:
        """Something for every number below another."""
        if count <= _UNROLLED:
            for index in range(count):
                body(index)
            return
        self.counted(str(count), body)

    def counted(self, count: str, body: Callable[[str], None], by: int = 1) -> None:
        """A loop."""
        text = self.text
        before, head, after = text.label(), text.label(), text.label()
        index = text.name()
        text.say(f"br label %{before}")
        text.say(f"{before}:")
        text.say(f"br label %{head}")
        text.say(f"{head}:")
        latch = text.label()
        text.say(f"{index} = phi i64 [ 0, %{before} ], [ {index}.next, %{latch} ]")
        body(index)
        text.say(f"br label %{latch}")
        text.say(f"{latch}:")
        text.say(f"{index}.next = add i64 {index}, {by}")
        text.say(f"{index}.more = icmp ult i64 {index}.next, {count}")
        text.say(f"br i1 {index}.more, label %{head}, label %{after}")
        text.say(f"{after}:")

    # Loops over lanes

    def over_lanes(self, length: int, rows: bool, members: Sequence[int]) -> None:
        """Statements whose lanes are computed in a loop."""
        inside = set(members)
        vector = rows or not self.program.rows
        spread: dict[int, str] = {}
        for number in members:
            for one in self.graph.args[number]:
                if one in inside or one in spread or int(self.graph.length[one]) > 1:
                    continue
                if vector and not (self.program.rows and self.order.varies(one)):
                    spread[one] = self.as_vector(one)
                else:
                    spread[one] = self.single(one)
        for number in members:
            if number in self.order.kept:
                self.place_of(number)

        def trip(index: str | int) -> None:
            local: dict[int, str] = {}

            def operand(one: int) -> str:
                if one in local:
                    return local[one]
                if one in spread:
                    return spread[one]
                local[one] = self._lanes_at(self.place_of(one), index, one, vector)
                return local[one]

            for number in members:
                args = self.graph.args[number]
                kinds = [self.graph.kind[one] for one in args]
                values = [operand(one) for one in args]
                local[number] = self.text.each(self.graph.op[number], values, kinds, vector)
                if number in self.order.kept:
                    own, kind = self.place_of(number), self.graph.kind[number]
                    at = self._where(own, index)
                    self.text.store(at, local[number], kind, vector)
                self.text.pause()

        by = 1 if self.program.rows else WIDTH
        self.counted(str(length), trip, by)

    def _lanes_at(self, place: Place, index: str | int, number: int, vector: bool) -> str:
        kind = self.graph.kind[number]
        wide = place.rows or not self.program.rows
        value = self.text.load(self._where(place, index), kind, wide)
        return self.text.same(value, kind, None) if vector and not wide else value

    def _reduce(self, number: int) -> None:
        op, row, first, count = self.graph.args[number]
        kind = self.graph.kind[number]
        neutral = self._neutral(op, kind)
        if not self.order.looped(row):
            value = self._within(self.as_vector(row), kind, neutral, None, first, first + count)
            self.value[number] = self.text.together(op, value, kind)
            return
        place, text = self.place_of(row), self.text
        rows = self.program.rows
        wide = place.rows or not rows
        room = self.arena.room(WIDTH)
        total = text.place("%arena", room)
        start = text.same("", kind, neutral) if wide else literal(neutral, kind)
        text.store(total, start, kind, wide)
        length = int(self.graph.length[row])

        def trip(index: str | int) -> None:
            at = text.give(f"add i64 {index}, {first}") if rows else str(index)
            own = text.load(self._where(place, at), kind, wide)
            if not rows and (first > 0 or (first + count) % WIDTH or count < length):
                own = self._within(own, kind, neutral, at, first, first + count)
            so_far = text.load(total, kind, wide)
            text.store(total, text.each(op, [so_far, own], [kind, kind], wide), kind, wide)

        if rows:
            self.counted(str(count), trip)
        else:
            self.counted(str(first + count), trip, WIDTH)
        found = text.load(total, kind, wide)
        self.value[number] = found if rows else text.together(op, found, kind)

    def _neutral(self, op: str, kind: str) -> Any:
        neutral = NEUTRAL[op]
        if kind == "i":
            return {"add": 0, "mul": 1, "max": -(1 << 63), "min": (1 << 63) - 1}[op]
        return neutral

    def _within(
        self, value: str, kind: str, neutral: Any, at: str | None, first: int, last: int
    ) -> str:
        """A vector with other lanes than some made such that they make no difference."""
        if at is None and first == 0 and last == WIDTH:
            return value
        text = self.text
        if at is None:
            inside = ", ".join(
                f"i1 {'true' if first <= lane < last else 'false'}" for lane in range(WIDTH)
            )
            mask = f"<{inside}>"
        else:
            whole = type_of("i", True)
            counting = ", ".join(f"i64 {lane}" for lane in range(WIDTH))
            lanes = text.give(f"add {whole} {text.same(at, 'i', None)}, <{counting}>")
            low = text.give(f"icmp sge {whole} {lanes}, {text.same('', 'i', first)}")
            high = text.give(f"icmp slt {whole} {lanes}, {text.same('', 'i', last)}")
            mask = text.give(f"and {type_of('b', True)} {low}, {high}")
        values = [mask, value, text.same("", kind, neutral)]
        return text.each("select", values, ["b", kind, kind], True)

    def _along(self, number: int) -> None:
        op, row, reverse = self.graph.args[number]
        kind, length = self.graph.kind[number], int(self.graph.length[number])
        text = self.text
        if not self.order.looped(number):
            source, value, total = self.as_vector(row), "poison", None
            own = type_of(kind, True)
            for lane in reversed(range(length)) if reverse else range(length):
                one = text.give(f"extractelement {own} {source}, i64 {lane}")
                total = one if total is None else text.each(op, [total, one], [kind, kind], False)
                value = self._insert(value, total, kind, lane)
            self.value[number] = value
            return
        source, target = self.place_of(row), self.place_of(number)
        wide = target.rows
        room = text.place("%arena", self.arena.room(WIDTH))
        neutral = self._neutral(op, kind)
        text.store(
            room, text.same("", kind, neutral) if wide else literal(neutral, kind), kind, wide
        )

        def trip(index: str) -> None:
            at = text.give(f"sub i64 {length - 1}, {index}") if reverse else index
            own = text.load(self._where(source, at), kind, source.rows)
            if wide and not source.rows:
                own = text.same(own, kind, None)
            total = text.each(op, [text.load(room, kind, wide), own], [kind, kind], wide)
            text.store(room, total, kind, wide)
            text.store(self._where(target, at), total, kind, wide)

        self.counted(str(length), trip)

    # Writing to memory

    def puts(self, puts: Sequence[Put], mask: str | None = None) -> None:
        """Write tables to memory, all as they were before; of rows those of a mask."""
        targets = {id(put.memory) for put in puts}
        for put in puts:
            self._unhooked(put, targets)
        for put in puts:
            entries, places = put.table.tolist(), put.places.tolist()
            kind, rows = put.memory.inside, put.memory.rows
            base, start, unit = self.base(put.memory), self.offset(put.memory), self.unit(rows)
            for run in _runs(entries, places):
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

    def _put_run(self, run: _Run, kind: str, target: Place, mask: str | None) -> None:
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

    def value_of_row(self, number: int) -> str:
        """The vector of a short row."""
        if self.graph.op[number] == "lanes" and number not in self.value:
            self.value[number] = self._lanes(number)
        return self.value[number]

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

    # Loops and conditions of the program

    def _loop(self, item: Loop) -> None:
        text = self.text
        self.puts(item.before)
        head, inside, after = text.label(), text.label(), text.label()
        text.say(f"br label %{head}")
        text.say(f"{head}:")
        self.block(item.test)
        going = item.going >> LANE_BITS
        by_row = item.rows and self.order.varies(going)
        mask = self.lane(item.going)
        more = text.together("or", mask, "b") if by_row else mask
        text.say(f"br i1 {more}, label %{inside}, label %{after}")
        text.say(f"{inside}:")
        self.block(item.body)
        self.puts(item.after, mask if by_row else None)
        text.say(f"br label %{head}")
        text.say(f"{after}:")

    def _steps(self, item: Steps) -> None:
        text = self.text
        self.puts(item.before)
        if item.count == 0:
            return

        def step(index: str) -> None:
            at = text.give(f"sub i64 {item.count - 1}, {index}") if item.reverse else index
            for own in item.along:
                whole: Memory = own.number
                unit = self.unit(whole.rows)
                size = text.give(f"mul i64 {at}, {own.size * unit}")
                start = text.place(self.base(whole), self.offset(whole) + own.offset * unit)
                self.pointer[id(own)] = text.place(start, size)
            self.block(item.body)
            self.puts(item.after)

        self.counted(str(item.count), step)

    def _choice(self, item: Choice) -> None:
        text = self.text
        which = item.which >> LANE_BITS
        by_row = item.rows and self.order.varies(which)
        index = self.lane(item.which)
        whole = self.graph.kind[which] == "i"
        last = len(item.branches) - 1
        for number, (block, puts) in enumerate(item.branches):
            how = "sle" if number == 0 else "sge" if number == last else "eq"
            values = "true" if number else "false"
            own = type_of("i" if whole else "b", by_row)
            if whole:
                value = text.same("", "i", number) if by_row else str(number)
                mine = text.give(f"icmp {how} {own} {index}, {value}")
            else:
                value = text.same("", "b", bool(number)) if by_row else values
                mine = text.give(f"icmp eq {own} {index}, {value}")
            more = text.together("or", mine, "b") if by_row else mine
            inside, after = text.label(), text.label()
            text.say(f"br i1 {more}, label %{inside}, label %{after}")
            text.say(f"{inside}:")
            self.block(block)
            self.puts(puts, mine if by_row else None)
            text.say(f"br label %{after}")
            text.say(f"{after}:")

    def _rows(self, item: Rows) -> None:
        text = self.text

        def some(first: str) -> None:
            for number, memory in item.given.items():
                base = self._given.setdefault(number, f"%given{number}")
                offset = self.offset(memory)
                for lane in range(WIDTH):
                    row = text.give(f"add i64 {first}, {lane}")
                    last = text.give("sub i64 %count, 1")
                    row = text.call("llvm.umin.i64", "i64", [("i64", row), ("i64", last)])
                    start = text.give(f"mul i64 {row}, {memory.size}")
                    source = Place(text.place(base, start), 0, 1, False)
                    target = Place("%arena", offset + lane, WIDTH, False)
                    self.copy(source, target, memory.size, "f")
            self.block(item.body)
            self.puts(item.put)
            for number, memory in enumerate(item.out):
                base = self._results.setdefault(number, f"%result{number}")
                offset = self.offset(memory)
                for lane in range(WIDTH):
                    row = text.give(f"add i64 {first}, {lane}")
                    mine = text.give(f"icmp ult i64 {row}, %count")
                    inside, after = text.label(), text.label()
                    text.say(f"br i1 {mine}, label %{inside}, label %{after}")
                    text.say(f"{inside}:")
                    start = text.give(f"mul i64 {row}, {memory.size}")
                    target = Place(text.place(base, start), 0, 1, False)
                    source = Place("%arena", offset + lane, WIDTH, False)
                    self.copy(source, target, memory.size, "f")
                    text.say(f"br label %{after}")
                    text.say(f"{after}:")

        self.counted("%count", some, WIDTH)


_ITEMS: dict[type, Callable[[Emitter, Any], None]] = {
    Loop: Emitter._loop,  # pyright: ignore[reportPrivateUsage]
    Steps: Emitter._steps,  # pyright: ignore[reportPrivateUsage]
    Choice: Emitter._choice,  # pyright: ignore[reportPrivateUsage]
    Rows: Emitter._rows,  # pyright: ignore[reportPrivateUsage]
}


@dataclass(frozen=True)
class _Run:
    """Lanes of one row at even distances that go to places at even distances."""

    statement: int
    lane: int
    step: int
    place: int
    apart: int
    count: int

    def entry(self, number: int) -> int:
        """One of its entries."""
        return (self.statement << LANE_BITS) + self.lane + number * self.step


def _runs(entries: Sequence[int], places: Sequence[int]) -> list[_Run]:
    """Entries and the places that they go to, as few runs."""
    by_row: dict[int, list[tuple[int, int]]] = {}
    for one, place in zip(entries, places, strict=True):
        by_row.setdefault(one >> LANE_BITS, []).append((one & LANE, place))
    found: list[_Run] = []
    for statement, pairs in by_row.items():
        first = 0
        while first < len(pairs):
            lane, place = pairs[first]
            last, step, apart = first + 1, 1, 1
            if last < len(pairs):
                step, apart = pairs[last][0] - lane, pairs[last][1] - place
                while step and last < len(pairs):
                    near, here = pairs[last - 1], pairs[last]
                    if (here[0] - near[0], here[1] - near[1]) != (step, apart):
                        break
                    last += 1
            found.append(_Run(statement, lane, step, place, apart, last - first))
            first = last
    return found
