"""Where a program's numbers lie in memory, and how they are copied."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from lanewise.codegen.addresses import Arena, Place
from lanewise.codegen.schedule import Order
from lanewise.codegen.text import Text, literal, type_of
from lanewise.ir.control_flow import WIDTH, Program
from lanewise.ir.graph import LANE, LANE_BITS, Memory

# Runs of numbers longer than this are copied in a loop.
_UNROLLED = 16


class Storage:
    """Memory of a program that is being written.

    Args:
        program: The program.
    """

    def __init__(self, program: Program) -> None:
        """Begin with an empty text."""
        self.program, self.graph = program, program.graph
        self.order = Order(program)
        self.text = Text()
        self.arena = Arena()
        self.value: dict[int, str] = {}
        self.slot: dict[int, Place] = {}
        self.rooms: dict[int, tuple[int, int]] = {}
        self.pointer: dict[int, str] = {}
        self.constants: list[str] = []
        self.given: dict[int, str] = {}
        self.results: dict[int, str] = {}

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
            return self.given.setdefault(memory.number, f"%given{memory.number}")
        if memory.place == "result":
            return self.results.setdefault(memory.number, f"%result{memory.number}")
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
            room = length * unit
            first = self.arena.room(room)
            self.rooms[number] = (first, room)
            place = Place("%arena", first, unit, rows)
        self.slot[number] = place
        return place

    def _seen_in(self, number: int) -> Place | None:
        """Where a row is seen without being copied: in memory, or in another row."""
        op, args = self.graph.op[number], self.graph.args[number]
        if op == "load":
            memory: Memory = self.graph.args[args[0]][0]
            unit = self.unit(memory.rows)
            if not self.program.rows and (args[2] != 1 or not self._has_room(memory, args)):
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

    def _has_room(self, memory: Memory, args: tuple[int, ...]) -> bool:
        """Whether the last vector of a row may be read whole."""
        _, first, _, length = args
        last = first + -(-length // WIDTH) * WIDTH
        while memory.place == "step":
            if not memory.steps:
                return False
            last += memory.offset + (memory.steps - 1) * memory.stride
            memory = memory.number
        return memory.place == "arena" or (memory.place == "given" and last <= memory.size)

    def _lies(self, number: int) -> bool:
        """Whether lanes are in memory, and no value."""
        return self.graph.op[number] == "memory" or self.order.looped(number)

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


__all__ = ["Storage"]
