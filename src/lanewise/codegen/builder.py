"""Write LLVM IR: single operations on numbers and on vectors of them."""

from __future__ import annotations

import struct
from typing import Any

from lanewise.ir.control_flow import WIDTH

# Lines of a basic block that LLVM optimises together.
_LONGEST_BLOCK = 200

_SCALAR = {"f": "double", "i": "i64", "b": "i1"}
_SUFFIX = {"f": "f64", "i": "i64", "b": "i1"}
_COMPARISONS = ("eq", "ne", "lt", "le", "gt", "ge")
_FLOAT = {"add": "fadd contract", "sub": "fsub contract", "mul": "fmul contract", "div": "fdiv"}
_INTEGER = ("add", "sub", "mul", "and", "or", "xor", "shl", "lshr", "ashr", "div")
_FLOAT_INTRINSICS = {"abs": "fabs", "round_even": "roundeven", "round_away": "round"} | {
    name: f"{name}imum" for name in ("max", "min")
}
_REDUCE = {
    "f": {"add": "fadd", "mul": "fmul", "max": "fmaximum", "min": "fminimum"},
    "i": {"add": "add", "mul": "mul", "max": "smax", "min": "smin", "and": "and", "or": "or"},
    "b": {"max": "or", "min": "and", "and": "and", "or": "or"},
}


def type_name(kind: str, vector: bool) -> str:
    """Return LLVM's name of a type."""
    return f"<{WIDTH} x {_SCALAR[kind]}>" if vector else _SCALAR[kind]


def literal(value: Any, kind: str) -> str:
    """Return a number as LLVM reads it."""
    if kind == "f":
        return f"0x{struct.unpack('<Q', struct.pack('<d', float(value)))[0]:016X}"
    if kind == "b":
        return "true" if value else "false"
    return str(int(value))


class IRBuilder:
    """Write the lines of a function, one operation after the other.

    Attributes:
        lines: The lines.
        declarations: Declarations of LLVM's intrinsic functions in use.
    """

    def __init__(self) -> None:
        """Begin an empty function."""
        self.lines: list[str] = []
        self.declarations: set[str] = set()
        self._names = 0
        self._block_length = 0

    def name(self) -> str:
        """Return a new name."""
        self._names += 1
        return f"%v{self._names}"

    def label(self) -> str:
        """Return a new label."""
        self._names += 1
        return f"b{self._names}"

    def line(self, text: str) -> None:
        """Write a line without a result."""
        self._block_length = 0 if text.endswith(":") else self._block_length + 1
        self.lines.append(text)

    def assign(self, text: str) -> str:
        """Write a line with a result; return the result's name."""
        name = self.name()
        self._block_length += 1
        self.lines.append(f"{name} = {text}")
        return name

    def limit_block(self) -> bool:
        """Begin a new basic block if this one is long; return whether it did.

        LLVM's time grows faster than the length of a block. It would remove a plain jump, so the
        jump depends on what LLVM cannot know: that the number of rows is never negative.
        """
        if self._block_length > _LONGEST_BLOCK:
            label = self.label()
            self.line(f"br i1 %never, label %stop, label %{label}")
            self.line(f"{label}:")
            return True
        return False

    def call(self, function: str, result: str, args: list[tuple[str, str]], flags: str = "") -> str:
        """Call one of LLVM's intrinsic functions."""
        types = ", ".join(kind for kind, _ in args)
        self.declarations.add(f"declare {result} @{function}({types})")
        values = ", ".join(f"{kind} {value}" for kind, value in args)
        return self.assign(f"call {flags}{result} @{function}({values})")

    def splat(self, value: str, kind: str, known: Any = None) -> str:
        """Return a vector of equal lanes: a value, or a known number."""
        if known is not None:
            return f"splat ({_SCALAR[kind]} {literal(known, kind)})"
        vector = type_name(kind, True)
        first = self.assign(f"insertelement {vector} poison, {_SCALAR[kind]} {value}, i64 0")
        mask = f"<{WIDTH} x i32> zeroinitializer"
        return self.assign(f"shufflevector {vector} {first}, {vector} poison, {mask}")

    def insert(self, vector: str, value: str, kind: str, lane: int) -> str:
        """Return a vector with one lane replaced."""
        scalar = f"{_SCALAR[kind]} {value}"
        return self.assign(f"insertelement {type_name(kind, True)} {vector}, {scalar}, i64 {lane}")

    def extract(self, vector: str, kind: str, lane: int) -> str:
        """Return one lane of a vector."""
        return self.assign(f"extractelement {type_name(kind, True)} {vector}, i64 {lane}")

    def operation(self, op: str, values: list[str], kinds: list[str], vector: bool) -> str:
        """Compute an operation of the graph on scalars or vectors."""
        kind = kinds[-1]
        own = type_name(kind, vector)
        if op == "select":
            args = f"{own} {values[1]}, {own} {values[2]}"
            return self.assign(f"select {type_name('b', vector)} {values[0]}, {args}")
        if op in _COMPARISONS:
            return self._comparison(op, values, kind, own)
        if op == "neg":
            if kind == "f":
                return self.assign(f"fneg {own} {values[0]}")
            return self.assign(f"sub {own} {self._known(0, kind, vector)}, {values[0]}")
        if op == "not":
            ones = True if kind == "b" else -1
            return self.assign(f"xor {own} {values[0]}, {self._known(ones, kind, vector)}")
        if op == "is_finite":
            size = self.operation("abs", values, kinds, vector)
            return self.assign(f"fcmp one {own} {size}, {self._known(float('inf'), 'f', vector)}")
        if op in ("to_float", "to_int", "to_bool", "as_bits", "of_bits"):
            return self._conversion(op, values[0], kind, vector)
        if kind == "f" and op in _FLOAT:
            return self.assign(f"{_FLOAT[op]} {own} {values[0]}, {values[1]}")
        if kind == "f":
            name = f"llvm.{_FLOAT_INTRINSICS.get(op, op)}.{self._suffix(kind, vector)}"
            return self.call(name, own, [(own, value) for value in values])
        if op in _INTEGER:
            name = "sdiv" if op == "div" else op
            return self.assign(f"{name} {own} {values[0]}, {values[1]}")
        if op == "abs":
            args = [(own, values[0]), ("i1", "false")]
            return self.call(f"llvm.abs.{self._suffix(kind, vector)}", own, args)
        name = f"llvm.{'s' if kind == 'i' else 'u'}{op}.{self._suffix(kind, vector)}"
        return self.call(name, own, [(own, value) for value in values])

    def _comparison(self, op: str, values: list[str], kind: str, own: str) -> str:
        if kind == "f":
            compare = "fcmp une" if op == "ne" else f"fcmp o{op}"
        elif op in ("eq", "ne"):
            compare = f"icmp {op}"
        else:
            compare = f"icmp {'s' if kind == 'i' else 'u'}{op}"
        return self.assign(f"{compare} {own} {values[0]}, {values[1]}")

    def _conversion(self, op: str, value: str, kind: str, vector: bool) -> str:
        own = type_name(kind, vector)
        if op == "to_bool":
            compare = "fcmp une" if kind == "f" else "icmp ne"
            return self.assign(f"{compare} {own} {value}, {self._known(0, kind, vector)}")
        if op in ("as_bits", "of_bits"):
            other = type_name("i" if op == "as_bits" else "f", vector)
            return self.assign(f"bitcast {own} {value} to {other}")
        if op == "to_int" and kind == "b":
            return self.assign(f"zext {own} {value} to {type_name('i', vector)}")
        if op == "to_int":
            suffix = f"{self._suffix('i', vector)}.{self._suffix('f', vector)}"
            result = type_name("i", vector)
            return self.call(f"llvm.fptosi.sat.{suffix}", result, [(own, value)])
        if kind == "b":
            args = [value, self._known(1.0, "f", vector), self._known(0.0, "f", vector)]
            return self.operation("select", args, ["b", "f", "f"], vector)
        return self.assign(f"sitofp {own} {value} to {type_name('f', vector)}")

    def _known(self, value: Any, kind: str, vector: bool) -> str:
        return self.splat("", kind, value) if vector else literal(value, kind)

    def _suffix(self, kind: str, vector: bool) -> str:
        return f"v{WIDTH}{_SUFFIX[kind]}" if vector else _SUFFIX[kind]

    def reduce(self, op: str, value: str, kind: str) -> str:
        """Combine all lanes of a vector by an operation."""
        own, result = type_name(kind, True), type_name(kind, False)
        name = f"llvm.vector.reduce.{_REDUCE[kind][op]}.{self._suffix(kind, True)}"
        if kind == "f" and op in ("add", "mul"):
            start = literal(-0.0 if op == "add" else 1.0, "f")
            return self.call(name, result, [("double", start), (own, value)], "reassoc ")
        return self.call(name, result, [(own, value)])

    def load(self, pointer: str, kind: str, vector: bool) -> str:
        """Load a number, or a vector of contiguous numbers; booleans are stored as floats."""
        stored = type_name("f" if kind == "b" else kind, vector)
        value = self.assign(f"load {stored}, ptr {pointer}, align 8")
        return self._conversion("to_bool", value, "f", vector) if kind == "b" else value

    def store(self, pointer: str, value: str, kind: str, vector: bool, lanes: int = WIDTH) -> None:
        """Store a number, or the first lanes of a vector."""
        if kind == "b":
            value, kind = self._conversion("to_float", value, kind, vector), "f"
        own = type_name(kind, vector)
        if not vector or lanes == WIDTH:
            self.line(f"store {own} {value}, ptr {pointer}, align 8")
            return
        mask = ", ".join(f"i1 {'true' if lane < lanes else 'false'}" for lane in range(WIDTH))
        name = f"llvm.masked.store.{self._suffix(kind, True)}.p0"
        self.declarations.add(f"declare void @{name}({own}, ptr, <{WIDTH} x i1>)")
        self.line(
            f"call void @{name}({own} {value}, ptr align 8 {pointer}, <{WIDTH} x i1> <{mask}>)"
        )

    def pointer(self, start: str, index: str | int) -> str:
        """Return a pointer some numbers behind another."""
        if index == 0:
            return start
        return self.assign(f"getelementptr double, ptr {start}, i64 {index}")

    def branch(self, condition: str) -> str:
        """Begin a block that runs under a condition; return the label to end it with."""
        inside, after = self.label(), self.label()
        self.line(f"br i1 {condition}, label %{inside}, label %{after}")
        self.line(f"{inside}:")
        return after

    def join(self, label: str) -> None:
        """End a block: jump to a label and begin it."""
        self.line(f"br label %{label}")
        self.line(f"{label}:")
