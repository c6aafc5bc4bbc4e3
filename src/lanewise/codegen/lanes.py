"""Loops over lanes, and what puts lanes together: sums, extremes, running sums."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from lanewise.codegen.addresses import Place
from lanewise.codegen.text import literal, type_of
from lanewise.codegen.values import Values
from lanewise.ir.control_flow import WIDTH
from lanewise.lowering.tables import NEUTRAL


class Lanes(Values):
    """Rows of a program that is being written."""

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


__all__ = ["Lanes"]
