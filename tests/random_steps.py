"""Steps of random programs without loops and branches, drawn by hypothesis."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from hypothesis import strategies as st
from jax import lax

from lanewise._jax import jnp
from random_operations import (
    BINARY,
    CONSTANTS,
    ELEMENTARY,
    INTEGERS,
    NOT_PADDED,
    UNARY,
    Step,
    Value,
    digits,
    filled_like,
    float_bits,
    index_within,
    mirrored_by_bits,
    signs,
    with_slice_of,
    without_denormals,
)

_CHOICES = [st.integers(0, count) for count in range(200)]


class StepDrawing:
    """Draw steps of a function.

    Args:
        draw: Hypothesis' function that draws.
        padded: Whether zeros may be known when it is compiled.
    """

    def __init__(self, draw: Callable[[Any], Any], padded: bool) -> None:
        self.draw, self.padded = draw, padded

    def below(self, count: int) -> int:
        return self.draw(_CHOICES[count - 1])

    def pick(self, options: Sequence[Any]) -> Any:
        return options[self.below(len(options))]

    def one(self, values: list[Value], kinds: str = "fibe") -> int | None:
        """Draw a value of some kinds, later ones more often."""
        known = [at for at, value in enumerate(values) if value.kind in kinds]
        return known[max(self.below(len(known)), self.below(len(known)))] if known else None

    def like(self, values: list[Value], at: int, kinds: str | None = None) -> int:
        """Draw a value of the same shape and kind."""
        shape, kind = np.shape(values[at].array), kinds or values[at].kind
        return self.pick([
            other
            for other, value in enumerate(values)
            if np.shape(value.array) == shape and value.kind in kind
        ] or [at])  # fmt: skip

    def unary(self, values: list[Value]) -> Step:
        at = self.one(values)
        function, kind = self.pick(UNARY[values[at].kind])
        return Step(lambda x: [function(x)], (at,), kind)

    def bits(self, values: list[Value]) -> Step | None:
        at = self.one(values, "f")
        function, kind = self.pick([(float_bits, "i"), (mirrored_by_bits, "f")])
        return Step(lambda x: [function(x)], (at,), kind)

    def binary(self, values: list[Value]) -> Step | None:
        at = self.one(values, "fib")
        kind = values[at].kind
        allowed = [one for one in BINARY[kind] if not self.padded or one[0] not in NOT_PADDED]
        function, result = self.pick(allowed)
        if kind != "b" and self.below(3) == 0:
            number = self.pick(CONSTANTS if kind == "f" else INTEGERS)
            if self.padded and self.below(2):
                number = 0
            number = float(number) if kind == "f" else np.int64(number)
            first = bool(self.below(2))

            def with_number(x: Any) -> list[Any]:
                other = filled_like(x, number)
                return [function(other, x) if first else function(x, other)]

            return Step(with_number, (at,), result)
        return Step(lambda x, y: [function(x, y)], (at, self.like(values, at)), result)

    def elementary(self, values: list[Value]) -> Step:
        at = self.one(values, "f")
        allowed = [one for one in ELEMENTARY if not self.padded or one[0] not in NOT_PADDED]
        function, domains = self.pick(allowed)
        others = (at, self.like(values, at))[: len(domains)]

        def apply(*arrays: Any) -> list[Any]:
            within = (domain(x) for domain, x in zip(domains, arrays, strict=True))
            return [function(*map(without_denormals, within))]

        return Step(apply, others, "e")

    def selected(self, values: list[Value]) -> Step | None:
        which = self.one(values, "b")
        if which is None:
            return None
        one = self.like(values, which, self.pick("fibe"))
        if np.shape(values[one].array) != np.shape(values[which].array):
            return None
        other = self.like(values, one)
        return Step(lambda p, x, y: [lax.select(p, x, y)], (which, one, other), values[one].kind)

    def constant(self, values: list[Value]) -> Step | None:
        like = self.one(values)
        shape = np.shape(values[like].array)
        if not self.padded and self.below(2):
            return self.bits(values)
        if self.below(2) and shape:
            axis = self.below(len(shape))
            return Step(
                lambda x: [lax.add(lax.broadcasted_iota(np.int64, shape, axis), np.int64(1))],
                (like,),
                "i",
            )
        numbers = [self.pick((*CONSTANTS, *([0.0] * 9 * self.padded))) for _ in range(4)]
        table = np.resize(np.array(numbers), shape)
        return Step(lambda x: [jnp.asarray(table)], (like,), "f")

    def moved(self, values: list[Value]) -> Step | None:
        """Draw a primitive that only moves entries."""
        at = self.one(values)
        array, kind = values[at].array, values[at].kind
        shape = np.shape(array)
        if not shape:
            return Step(lambda x: [lax.broadcast(x, (2,))], (at,), kind)
        axis = self.below(len(shape))
        size = shape[axis]
        other = self.like(values, at)
        # Few shapes, as XLA compiles every primitive for every shape.
        start = self.pick((0, size - 1)) if size else 0
        which = self.below(9)
        if which == 0:
            return Step(lambda x: [lax.rev(x, (axis,))], (at,), kind)
        if which == 1:
            order = list(range(len(shape)))[::-1]
            return Step(lambda x: [lax.transpose(x, order)], (at,), kind)
        if which == 2 and size:
            start, stop, stride = self.pick([(0, size, 1), (1, size, 1), (0, size, 2), (0, 2, 1)])
            if not start < stop <= size:
                return None
            return Step(lambda x: [lax.slice_in_dim(x, start, stop, stride, axis)], (at,), kind)
        if which == 3 and np.size(array) <= 26:
            return Step(lambda x, y: [lax.concatenate([x, y], axis)], (at, other), kind)
        if which == 4:
            return Step(lambda x: [lax.reshape(x, (np.size(array),))], (at,), kind)
        if which == 5 and np.size(array) <= 26 and kind != "b":
            low, high, inside = self.pick([(1, 0, 0), (-1, 1, 0), (0, -1, 1), (2, -1, 0)])
            if size + low + high < 1:
                return None
            number = 0 if self.padded else self.pick((1, 3))
            config = [(low, high, inside) if a == axis else (0, 0, 0) for a in range(len(shape))]
            return Step(lambda x: [lax.pad(x, np.array(number, x.dtype), config)], (at,), kind)
        if which == 6 and size:
            return Step(lambda x: [lax.index_in_dim(x, start, axis, keepdims=False)], (at,), kind)
        if which == 7 and size:
            order = self.pick((np.arange(size)[::-1], np.zeros(2, int), np.arange(0, size, 3)))
            return Step(lambda x: [jnp.take(x, order, axis, mode="clip")], (at,), kind)
        if size:
            return Step(lambda x, y: [with_slice_of(x, y, start, axis)], (at, other), kind)
        return None

    def picked(self, values: list[Value]) -> Step | None:
        """Draw an index that is computed, or the place of an extreme."""
        at = self.one(values, "f")
        shape = np.shape(values[at].array)
        if not shape or 0 in shape:
            return None
        axis = self.below(len(shape))
        if self.below(2):
            function = self.pick((lax.argmax, lax.argmin))
            return Step(lambda x: [function(x, axis, np.int64)], (at,), "i")
        index = self.one(values, "i")
        if index is None or np.ndim(values[index].array) > 1:
            return None
        mode = self.pick(("clip", "fill"))
        return Step(lambda x, i: [jnp.take(x, index_within(i), axis, mode=mode)], (at, index), "f")

    def combined(self, values: list[Value]) -> Step | None:
        """Draw a reduction, a running sum or a sum of products."""
        at = self.one(values, "fib")
        kind, shape = values[at].kind, np.shape(values[at].array)
        if not shape or 0 in shape:
            return None
        axis = self.below(len(shape))
        axes = tuple(range(len(shape))) if self.below(2) else (axis,)
        reverse = bool(self.below(2))
        if kind == "b":
            function = self.pick((jnp.all, jnp.any))
            return Step(lambda x: [function(x, axis=axes)], (at,), "b")
        ready = {"sum": digits, "prod": signs} if kind == "f" else {}
        name = self.pick(("sum", "prod", "max", "min"))
        first = ready.get(name, lambda x: x)
        if self.below(2):
            function = getattr(jnp, name)
            return Step(lambda x: [function(first(x), axis=axes)], (at,), kind)
        if kind == "f" and self.below(2):
            other = self.like(values, at)
            numbers = (((axis,), (axis,)), ((), ()))
            return Step(lambda x, y: [lax.dot_general(digits(x), digits(y), numbers)],
                        (at, other), "f")  # fmt: skip
        function = getattr(lax, f"cum{name}")
        return Step(lambda x: [function(first(x), axis, reverse)], (at,), kind)
