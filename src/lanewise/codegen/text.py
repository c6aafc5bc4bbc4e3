"""Text of a program for LLVM: single operations on numbers and on vectors of them."""

from __future__ import annotations

import struct
from typing import Any

from lanewise.ir.control_flow import WIDTH

# Lines of a part that LLVM works on at once.
_LONGEST = 200

_SCALAR = {"f": "double", "i": "i64", "b": "i1"}
_SUFFIX = {"f": "f64", "i": "i64", "b": "i1"}
_COMPARE = {
    "eq": ("oeq", "eq"),
    "ne": ("une", "ne"),
    "lt": ("olt", "slt"),
    "le": ("ole", "sle"),
    "gt": ("ogt", "sgt"),
    "ge": ("oge", "sge"),
}
_FLOAT = {"add": "fadd contract", "sub": "fsub contract", "mul": "fmul contract", "div": "fdiv"}
_SAME = ("add", "sub", "mul", "and", "or", "xor", "shl", "lshr", "ashr")
_WHOLE = {name: name for name in _SAME} | {"div": "sdiv"}
_CALLS = {
    "sqrt": "sqrt",
    "abs": "fabs",
    "floor": "floor",
    "ceil": "ceil",
    "round_even": "roundeven",
    "round_away": "round",
    "max": "maximum",
    "min": "minimum",
}
_REDUCE = {"add": "fadd", "mul": "fmul", "max": "fmaximum", "min": "fminimum"}
_REDUCE_WHOLE = {"add": "add", "mul": "mul", "max": "smax", "min": "smin", "and": "and", "or": "or"}


def type_of(kind: str, vector: bool) -> str:
    """LLVM's name of a type."""
    return f"<{WIDTH} x {_SCALAR[kind]}>" if vector else _SCALAR[kind]


def literal(value: Any, kind: str) -> str:
    """A number as LLVM reads it."""
    if kind == "f":
        return f"0x{struct.unpack('<Q', struct.pack('<d', float(value)))[0]:016X}"
    if kind == "b":
        return "true" if value else "false"
    return str(int(value))


class Text:
    """Lines of a function, one operation after the other.

    Attributes:
        lines: The lines.
        declared: Functions of LLVM that are called.
    """

    def __init__(self) -> None:
        """Begin an empty function."""
        self.lines: list[str] = []
        self.declared: set[str] = set()
        self._count = 0
        self._since = 0

    def name(self) -> str:
        """A new name."""
        self._count += 1
        return f"%v{self._count}"

    def say(self, line: str) -> None:
        """A line that has no result."""
        self._since = 0 if line.endswith(":") else self._since + 1
        self.lines.append(line)

    def pause(self) -> None:
        """Begin a new part: LLVM's time grows faster than the length of a part.

        A plain jump would be taken out again, so it depends on what LLVM cannot know: that there
        are never fewer than no rows.
        """
        if self._since > _LONGEST:
            label = self.label()
            self.say(f"br i1 %never, label %stop, label %{label}")
            self.say(f"{label}:")

    def give(self, line: str) -> str:
        """A line with a result; its name."""
        name = self.name()
        self._since += 1
        self.lines.append(f"{name} = {line}")
        return name

    def call(self, function: str, result: str, args: list[tuple[str, str]], flags: str = "") -> str:
        """A call of one of LLVM's own functions."""
        types = ", ".join(kind for kind, _ in args)
        self.declared.add(f"declare {result} @{function}({types})")
        given = ", ".join(f"{kind} {value}" for kind, value in args)
        return self.give(f"call {flags}{result} @{function}({given})")

    def same(self, value: str, kind: str, known: Any) -> str:
        """A vector of one number."""
        if known is not None:
            return f"splat ({_SCALAR[kind]} {literal(known, kind)})"
        vector = type_of(kind, True)
        first = self.give(f"insertelement {vector} poison, {_SCALAR[kind]} {value}, i64 0")
        mask = f"<{WIDTH} x i32> zeroinitializer"
        return self.give(f"shufflevector {vector} {first}, {vector} poison, {mask}")

    def each(self, op: str, values: list[str], kinds: list[str], vector: bool) -> str:
        """An operation lane by lane on values of one shape."""
        kind = kinds[-1]
        own = type_of(kind, vector)
        if op == "select":
            chosen = type_of("b", vector)
            given = f"{chosen} {values[0]}, {own} {values[1]}, {own} {values[2]}"
            return self.give(f"select {given}")
        if op in _COMPARE:
            floats, whole = _COMPARE[op]
            if kind == "b" and op not in ("eq", "ne"):
                whole = "u" + whole[1:]
            how = f"fcmp {floats}" if kind == "f" else f"icmp {whole}"
            return self.give(f"{how} {own} {values[0]}, {values[1]}")
        if op == "neg":
            if kind == "f":
                return self.give(f"fneg {own} {values[0]}")
            return self.give(f"sub {own} {self._all(0, kind, vector)}, {values[0]}")
        if op == "not":
            ones = True if kind == "b" else -1
            return self.give(f"xor {own} {values[0]}, {self._all(ones, kind, vector)}")
        if op == "is_finite":
            size = self.each("abs", values, kinds, vector)
            return self.give(f"fcmp one {own} {size}, {self._all(float('inf'), 'f', vector)}")
        if op in ("to_float", "to_int", "to_bool", "as_bits", "of_bits"):
            return self._converted(op, values[0], kind, vector)
        if kind == "f" and op in _FLOAT:
            return self.give(f"{_FLOAT[op]} {own} {values[0]}, {values[1]}")
        if kind == "f":
            name = f"llvm.{_CALLS[op]}.{self._suffix(kind, vector)}"
            return self.call(name, own, [(own, value) for value in values])
        if op in _WHOLE:
            return self.give(f"{_WHOLE[op]} {own} {values[0]}, {values[1]}")
        if op == "abs":
            args = [(own, values[0]), ("i1", "false")]
            return self.call(f"llvm.abs.{self._suffix(kind, vector)}", own, args)
        name = f"llvm.{'s' if kind == 'i' else 'u'}{op}.{self._suffix(kind, vector)}"
        return self.call(name, own, [(own, value) for value in values])

    def _converted(self, op: str, value: str, kind: str, vector: bool) -> str:
        own = type_of(kind, vector)
        if op == "to_bool":
            how = "fcmp une" if kind == "f" else "icmp ne"
            return self.give(f"{how} {own} {value}, {self._all(0, kind, vector)}")
        if op in ("as_bits", "of_bits"):
            other = type_of("i" if op == "as_bits" else "f", vector)
            return self.give(f"bitcast {own} {value} to {other}")
        if op == "to_int":
            how = "zext" if kind == "b" else "fptosi"
            return self.give(f"{how} {own} {value} to {type_of('i', vector)}")
        if kind == "b":
            args = [value, self._all(1.0, "f", vector), self._all(0.0, "f", vector)]
            return self.each("select", args, ["b", "f", "f"], vector)
        return self.give(f"sitofp {own} {value} to {type_of('f', vector)}")

    def _all(self, value: Any, kind: str, vector: bool) -> str:
        return self.same("", kind, value) if vector else literal(value, kind)

    def _suffix(self, kind: str, vector: bool) -> str:
        return f"v{WIDTH}{_SUFFIX[kind]}" if vector else _SUFFIX[kind]

    def together(self, op: str, value: str, kind: str) -> str:
        """All lanes of a vector put together by an operation."""
        own, result = type_of(kind, True), type_of(kind, False)
        if kind != "f":
            name = f"llvm.vector.reduce.{_REDUCE_WHOLE[op]}.{self._suffix(kind, True)}"
            return self.call(name, result, [(own, value)])
        name = f"llvm.vector.reduce.{_REDUCE[op]}.{self._suffix(kind, True)}"
        if op in ("add", "mul"):
            start = literal(-0.0 if op == "add" else 1.0, "f")
            return self.call(name, result, [("double", start), (own, value)], "reassoc ")
        return self.call(name, result, [(own, value)])

    def load(self, pointer: str, kind: str, vector: bool) -> str:
        """A number, or a vector of numbers that lie together."""
        stored = type_of("f" if kind == "b" else kind, vector)
        value = self.give(f"load {stored}, ptr {pointer}, align 8")
        return self._converted("to_bool", value, "f", vector) if kind == "b" else value

    def store(self, pointer: str, value: str, kind: str, vector: bool, lanes: int = WIDTH) -> None:
        """Put a number, or the first lanes of a vector, in memory."""
        if kind == "b":
            value, kind = self._converted("to_float", value, kind, vector), "f"
        own = type_of(kind, vector)
        if not vector or lanes == WIDTH:
            self.say(f"store {own} {value}, ptr {pointer}, align 8")
            return
        mask = ", ".join(f"i1 {'true' if lane < lanes else 'false'}" for lane in range(WIDTH))
        name = f"llvm.masked.store.{self._suffix(kind, True)}.p0"
        self.declared.add(f"declare void @{name}({own}, ptr, <{WIDTH} x i1>)")
        self.say(
            f"call void @{name}({own} {value}, ptr align 8 {pointer}, <{WIDTH} x i1> <{mask}>)"
        )

    def place(self, pointer: str, index: str | int) -> str:
        """Where a number is, so many after another."""
        if index == 0:
            return pointer
        return self.give(f"getelementptr double, ptr {pointer}, i64 {index}")

    def label(self) -> str:
        """A new label."""
        self._count += 1
        return f"b{self._count}"
