"""Random functions of JAX's primitives, drawn by hypothesis, for comparing compilers.

A function is drawn while it is run on given arrays, primitive by primitive by XLA, so that shapes
are known. All operations are exact (or correctly rounded) whatever their order: sums and products
run over few digits. Elementary functions differ in the last digits; their results, of the kind "e",
are only moved and returned.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from hypothesis import strategies as st
from jax import lax

from lanewise._jax import jax, jnp

CONSTANTS = (0.5, -1.5, 2.0, 3.0, -1.0, 1.0, 0.25, -8.0)
INTEGERS = (1, 2, 3, 5, -1, -7, 63, 64, 1 << 40, -(1 << 63))
SPECIAL = (0.0, -0.0, np.inf, -np.inf, np.nan, 1.7e308, -1.7e308, 3e-308, 4503599627370497.5, 1e19)
DENORMAL = (5e-324, -5e-324, 2.2e-308, -1.1e-308)
_CHOICES = [st.integers(0, count) for count in range(200)]
_SEEDS = st.integers(0, 2**32 - 1)


class Value(NamedTuple):
    """An array and the kind of its numbers: f, i, b, or e for floats that are not exact."""

    array: Any
    kind: str


class Step(NamedTuple):
    """A function of earlier values, and the kinds of what it returns."""

    function: Callable[..., Sequence[Any]]
    operands: tuple[int, ...]
    kinds: str


def run(steps: Sequence[Step], arrays: Sequence[Any]) -> list[Any]:
    """Return all values: the given ones and those of the steps."""
    values = list(arrays)
    for step in steps:
        values += step.function(*[values[at] for at in step.operands])
    return values


def digits(x: Any) -> Any:
    """Return multiples of 1/8 up to 8 in size, so that sums of them are exact; inf and NaN stay."""
    few = lax.mul(lax.floor(lax.mul(lax.clamp(-8.0, x, 8.0), 8.0)), 0.125)
    return lax.select(lax.is_finite(x), few, x)


def signs(x: Any) -> Any:
    """Return -2, 1/2 or 1, so that products of them are exact."""
    return lax.select(lax.lt(x, _like(x, 0.0)), _like(x, -2.0), _low(x))


def _low(x: Any) -> Any:
    return lax.select(lax.gt(x, _like(x, 1.0)), _like(x, 1.0), _like(x, 0.5))


def _like(x: Any, value: Any) -> Any:
    return lax.full_like(x, value)


def _later(name: str) -> list[tuple[Callable[[Any], Any], str]]:
    """Return a function of few digits that not every JAX has, if this one has it."""
    function = getattr(lax, name, None)
    return [(lambda x: function(digits(x)), "f")] if function else []


def _within(low: float, high: float) -> Callable[[Any], Any]:
    return lambda x: lax.clamp(low, x, high)


def _bits(x: Any) -> Any:
    """Return the bits of floats; those of NaN differ."""
    return lax.bitcast_convert_type(lax.select(lax.ne(x, x), _like(x, 1.0), x), np.int64)


def _mirrored(x: Any) -> Any:
    """Return -x, by way of its bits."""
    return lax.bitcast_convert_type(lax.bitwise_xor(_bits(x), np.int64(-(2**63))), np.float64)


ELEMENTARY = [
    (lax.exp, (_within(-600.0, 600.0),)),
    (lax.exp2, (_within(-900.0, 900.0),)),
    (lax.expm1, (_within(-600.0, 600.0),)),
    (lambda x: lax.log(lax.abs(x)), (_within(1e-300, 1e300),)),
    (lax.log1p, (_within(-0.875, 1e300),)),
    (lax.logistic, (_within(-600.0, 600.0),)),
    (lax.cbrt, (_within(-1e280, 1e280),)),
    (lax.rsqrt, (_within(1e-300, 1e300),)),
    (lax.sin, (_within(-1e5, 1e5),)),
    (lax.cos, (_within(-1e5, 1e5),)),
    (lax.tan, (_within(-8.0, 8.0),)),
    (lax.asin, (_within(-1.0, 1.0),)),
    (lax.acos, (_within(-1.0, 1.0),)),
    (lax.atan, (_within(-1e300, 1e300),)),
    (lax.atan2, (_within(-1e100, 1e100), _within(-1e100, 1e100))),
    (lax.sinh, (_within(-600.0, 600.0),)),
    (lax.cosh, (_within(-600.0, 600.0),)),
    (lax.tanh, (_within(-1e300, 1e300),)),
    (lax.asinh, (_within(-1e100, 1e100),)),
    (lax.acosh, (_within(1.0, 1e100),)),
    (lax.atanh, (_within(-0.875, 0.875),)),
    (lax.pow, (_within(0.125, 8.0), _within(-8.0, 8.0))),
]

UNARY: dict[str, list[tuple[Callable[[Any], Any], str]]] = {
    "f": [
        (lax.neg, "f"),
        (lax.abs, "f"),
        (lambda x: lax.sqrt(lax.abs(x)), "f"),
        (lax.floor, "f"),
        (lax.ceil, "f"),
        (lambda x: lax.round(x, lax.RoundingMethod.TO_NEAREST_EVEN), "f"),
        (lambda x: lax.round(x, lax.RoundingMethod.AWAY_FROM_ZERO), "f"),
        (lax.sign, "f"),
        (lax.square, "f"),
        *_later("one_minus_square"),
        (lambda x: lax.integer_pow(digits(x), 3), "f"),
        (lambda x: lax.integer_pow(signs(x), -2), "f"),
        (lambda x: lax.clamp(-1.5, x, 2.0), "f"),
        (lax.is_finite, "b"),
        (lambda x: lax.convert_element_type(x, np.int64), "i"),
        (lambda x: lax.convert_element_type(x, bool), "b"),
    ],
    "i": [
        (lax.neg, "i"),
        (lax.abs, "i"),
        (lax.sign, "i"),
        (lax.bitwise_not, "i"),
        (lambda x: lax.integer_pow(x, 2), "i"),
        (lambda x: lax.convert_element_type(x, np.float64), "f"),
        (lambda x: lax.convert_element_type(x, bool), "b"),
    ],
    "b": [
        (lax.bitwise_not, "b"),
        (lambda x: lax.convert_element_type(x, np.float64), "f"),
        (lambda x: lax.convert_element_type(x, np.int64), "i"),
    ],
    "e": [(lax.neg, "e"), (lax.abs, "e")],
}
COMPARISONS = [(one, "b") for one in (lax.eq, lax.ne, lax.lt, lax.le, lax.gt, lax.ge)]
LOGIC = (lax.bitwise_and, lax.bitwise_or, lax.bitwise_xor)
SHIFTS = (lax.shift_left, lax.shift_right_logical, lax.shift_right_arithmetic)
BINARY: dict[str, list[tuple[Callable[[Any, Any], Any], str]]] = {
    "f": [(one, "f") for one in (lax.add, lax.sub, lax.mul, lax.div, lax.max, lax.min)]
    + COMPARISONS,
    "i": [(one, "i") for one in (lax.add, lax.sub, lax.mul, lax.div, lax.max, lax.min)]
    + [(one, "i") for one in (*LOGIC, *SHIFTS)]
    + COMPARISONS,
    "b": [(one, "b") for one in LOGIC] + COMPARISONS[:2],
    "e": [],
}
# What changes where zeros are known when a program is compiled: signs of zeros, what is not finite.
_NOT_PADDED = (lax.div, lax.atan2)


class Drawing:
    """Draw a function.

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

    def steps(self, values: list[Value], count: int, depth: int) -> list[Step]:
        """Draw steps; what they return is added to the values."""
        steps: list[Step] = []
        makers = [self.unary, self.binary, self.binary, self.moved, self.moved, self.combined]
        makers += [self.elementary, self.selected, self.constant, self.picked]
        if depth:
            makers += [self.scan, self.while_loop, self.cond, self.call]
        for _ in range(count):
            maker = self.pick(makers)
            step = maker(values, depth) if maker in makers[10:] else maker(values)
            if step is not None:
                arrays = step.function(*[values[at].array for at in step.operands])
                values += map(Value, arrays, step.kinds)
                steps.append(step)
        return steps

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
        function, kind = self.pick([(_bits, "i"), (_mirrored, "f")])
        return Step(lambda x: [function(x)], (at,), kind)

    def binary(self, values: list[Value]) -> Step | None:
        at = self.one(values, "fib")
        kind = values[at].kind
        allowed = [one for one in BINARY[kind] if not self.padded or one[0] not in _NOT_PADDED]
        function, result = self.pick(allowed)
        if kind != "b" and self.below(3) == 0:
            number = self.pick(CONSTANTS if kind == "f" else INTEGERS)
            if self.padded and self.below(2):
                number = 0
            number = float(number) if kind == "f" else np.int64(number)
            first = bool(self.below(2))

            def with_number(x: Any) -> list[Any]:
                other = _like(x, number)
                return [function(other, x) if first else function(x, other)]

            return Step(with_number, (at,), result)
        return Step(lambda x, y: [function(x, y)], (at, self.like(values, at)), result)

    def elementary(self, values: list[Value]) -> Step:
        at = self.one(values, "f")
        allowed = [one for one in ELEMENTARY if not self.padded or one[0] not in _NOT_PADDED]
        function, domains = self.pick(allowed)
        others = (at, self.like(values, at))[: len(domains)]

        def apply(*arrays: Any) -> list[Any]:
            within = (domain(x) for domain, x in zip(domains, arrays, strict=True))
            return [function(*map(_normal, within))]

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
            return Step(lambda x, y: [_written(x, y, start, axis)], (at, other), kind)
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
        return Step(lambda x, i: [jnp.take(x, _inside(i), axis, mode=mode)], (at, index), "f")

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

    # Loops and branches

    def results(self, values: list[Value], like: Sequence[Value]) -> list[int]:
        """Draw values of the same shapes and kinds as others."""
        found = []
        for one in like:
            shape, kind = np.shape(one.array), one.kind
            found.append(
                self.pick([
                    at
                    for at, value in enumerate(values)
                    if np.shape(value.array) == shape and value.kind == kind
                ])
            )  # fmt: skip
        return found

    def body(self, values: list[Value], inner: list[Value], depth: int) -> list[Step]:
        return self.steps(inner, 1 + self.below(4), depth - 1)

    def scan(self, values: list[Value], depth: int) -> Step | None:
        carry = [self.one(values) for _ in range(1 + self.below(2))]
        along = self.one(values)
        shape = np.shape(values[along].array)
        if not shape or not 0 < shape[0] <= 4:
            return None
        reverse, own = bool(self.below(2)), values[along]
        inner = [*values, Value(own.array[0], own.kind)]
        steps = self.body(values, inner, depth)
        count = len(values)
        after = self.results(inner, [values[at] for at in carry])
        out = self.one(inner)
        kinds = [values[at].kind for at in carry] + [inner[out].kind]

        def function(*arrays: Any) -> list[Any]:
            def step(state: Any, item: Any) -> Any:
                here = list(arrays)
                for at, one in zip(carry, state, strict=True):
                    here[at] = one
                done = run(steps, [*here, item])
                return tuple(done[at] for at in after), done[out]

            start = tuple(arrays[at] for at in carry)
            last, rows = lax.scan(step, start, arrays[along], reverse=reverse)
            return [*last, rows]

        return Step(function, tuple(range(count)), "".join(kinds))

    def while_loop(self, values: list[Value], depth: int) -> Step:
        carry = [self.one(values) for _ in range(1 + self.below(2))]
        limit, test = self.below(4), self.one(values, "f")
        inner = [*values, Value(jnp.int64(0), "i")]
        steps = self.body(values, inner, depth)
        after = self.results(inner, [values[at] for at in carry])

        def function(*arrays: Any) -> list[Any]:
            def here(state: Any) -> list[Any]:
                known = list(arrays)
                for at, one in zip(carry, state[1:], strict=True):
                    known[at] = one
                return [*known, state[0]]

            def going(state: Any) -> Any:
                few = jnp.sum(lax.convert_element_type(lax.lt(here(state)[test], 1e3), np.int64))
                return lax.bitwise_and(lax.lt(state[0], np.int64(limit)), lax.gt(few, np.int64(0)))

            def again(state: Any) -> Any:
                done = run(steps, here(state))
                return (lax.add(state[0], np.int64(1)), *(done[at] for at in after))

            start = (jnp.int64(0), *(arrays[at] for at in carry))
            return list(lax.while_loop(going, again, start)[1:])

        return Step(function, tuple(range(len(values))), "".join(values[at].kind for at in carry))

    def cond(self, values: list[Value], depth: int) -> Step | None:
        which = [
            at
            for at, value in enumerate(values)
            if value.kind in "ib" and np.shape(value.array) == ()
        ]
        if not which:
            return None
        index = self.pick(which)
        out = [values[self.one(values)] for _ in range(1 + self.below(2))]
        count = 2 if values[index].kind == "b" else 2 + self.below(2)
        branches = []
        for _ in range(count):
            inner = list(values)
            steps = self.body(values, inner, depth)
            branches.append((steps, self.results(inner, out)))

        def branch(steps: list[Step], after: list[int]) -> Callable[..., Any]:
            return lambda *arrays: [run(steps, arrays)[at] for at in after]

        functions = [branch(*one) for one in branches]

        def function(*arrays: Any) -> list[Any]:
            if values[index].kind == "b":
                return lax.cond(arrays[index], *functions, *arrays)
            return lax.switch(arrays[index], functions, *arrays)

        return Step(function, tuple(range(len(values))), "".join(one.kind for one in out))

    def call(self, values: list[Value], depth: int) -> Step:
        inner = list(values)
        steps = self.body(values, inner, depth)
        out = self.one(inner)
        wrap = self.pick((jax.jit, jax.checkpoint))
        function = wrap(lambda *arrays: [run(steps, arrays)[out]])
        return Step(function, tuple(range(len(values))), inner[out].kind)


def _normal(x: Any) -> Any:
    """Return floats with those that have fewer digits replaced."""
    return lax.select(lax.lt(lax.abs(x), _like(x, 1e-300)), _like(x, 0.5), x)


def _inside(index: Any) -> Any:
    return lax.clamp(np.int64(-100), index, np.int64(100))


def _written(x: Any, y: Any, start: int, axis: int) -> Any:
    """Return an array with one slice replaced by another's."""
    own = (slice(None),) * axis + (start,)
    return jnp.asarray(x).at[own].set(jnp.asarray(y)[own], mode="promise_in_bounds")


def numbers(drawing: Drawing, count: int, special: Sequence[float]) -> np.ndarray:
    """Draw floats, some of them special.

    One draw seeds them all: Hypothesis takes longer over each choice than the program runs.
    """
    generator = np.random.default_rng(drawing.draw(_SEEDS))
    values = generator.integers(-64, 65, count) / 8
    if not special:
        return values
    return np.where(generator.integers(0, 4, count) == 0, generator.choice(special, count), values)
