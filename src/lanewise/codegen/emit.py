"""From statements in order to the text of a program for LLVM.

A program is written in layers: where numbers lie (storage), what they are (values), loops over
lanes, writing to memory (puts), and here its blocks, loops and conditions.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from lanewise.codegen.addresses import Place
from lanewise.codegen.stores import Puts
from lanewise.codegen.text import type_of
from lanewise.ir.control_flow import WIDTH, Choice, Loop, Program, Rows, Steps
from lanewise.ir.graph import LANE_BITS, Block, Memory


class Emitter(Puts):
    """Writes a program.

    Args:
        program: The program.
    """

    def __init__(self, program: Program) -> None:
        """Write it whole."""
        super().__init__(program)
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
        for kind, table in (("given", self.given), ("results", self.results)):
            for number, name in table.items():
                looked.append(f"{name}.at = getelementptr ptr, ptr %{kind}, i64 {number}")
                looked.append(f"{name} = load ptr, ptr {name}.at, align 8")
        self.text.lines[:0] = looked

    def block(self, block: Block) -> None:
        """All statements of a block."""
        for count, stage in enumerate(self.order.stages(block)):
            for number in stage.straight:
                self.straight(number)
                self.text.pause()
            for (length, rows), members in stage.loops.items():
                self.over_lanes(length, rows, members)
            for number in self.order.over(block, count):
                room = self.rooms.pop(number, None)
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
        steps = "%count" if item.count is None else str(item.count)
        count = 0 if item.count is None else item.count - 1

        def step(index: str) -> None:
            at = text.give(f"sub i64 {count}, {index}") if item.reverse else index
            for own in item.along:
                whole: Memory = own.number
                unit = self.unit(whole.rows)
                size = text.give(f"mul i64 {at}, {own.stride * unit}")
                start = text.place(self.base(whole), self.offset(whole) + own.offset * unit)
                self.pointer[id(own)] = text.place(start, size)
            self.block(item.body)
            self.puts(item.after)

        self.counted(steps, step)

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
                base = self.given.setdefault(number, f"%given{number}")
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
                base = self.results.setdefault(number, f"%result{number}")
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


__all__ = ["Emitter"]
