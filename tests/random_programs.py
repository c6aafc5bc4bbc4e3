"""Random functions of JAX's primitives, drawn by hypothesis, for comparing compilers.

A function is drawn while it is run on given arrays, primitive by primitive by XLA, so that shapes
are known. Its operations are exact (or correctly rounded) whatever their order: sums and products
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
_SEEDS = st.integers(0, 2**32 - 1)
_CHOICES = [st.integers(0, count) for count in range(200)]


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
    if x.dtype != np.float64:
        return x
    few = lax.mul(lax.floor(lax.mul(lax.clamp(-8.0, x, 8.0), 8.0)), 0.125)
    return lax.select(lax.is_finite(x), few, x)


def signs(x: Any) -> Any:
    """Return -2, 1/2 or 1, so that products of them are exact."""
    if x.dtype != np.float64:
        return x
    return jnp.where(x < 0.0, -2.0, jnp.where(x > 1.0, 1.0, 0.5))


def float_bits(x: Any) -> Any:
    """Return the bits of floats; those of NaN differ."""
    return lax.bitcast_convert_type(jnp.where(x != x, 1.0, x), np.int64)


def mirrored_by_bits(x: Any) -> Any:
    """Return -x, by way of its bits."""
    return lax.bitcast_convert_type(lax.bitwise_xor(float_bits(x), np.int64(-(2**63))), np.float64)


def _elementary(function: Any, *domains: tuple[float, float]) -> Callable[..., Any]:
    """Return a function of values within its domain; those of fewer digits are replaced."""

    def apply(*arrays: Any) -> Any:
        within = [lax.clamp(low, x, high) for (low, high), x in zip(domains, arrays, strict=False)]
        return function(*(jnp.where(abs(x) < 1e-300, 0.5, x) for x in within))

    return lambda x, y, axis: apply(x, y)


def _plain(*functions: Any) -> list[Callable[..., Any]]:
    """Make functions of one array functions of two arrays of a shape, and an axis."""
    return [lambda x, y, axis, function=one: function(x) for one in functions]


def _pairs(*functions: Any) -> list[Callable[..., Any]]:
    return [lambda x, y, axis, function=one: function(x, y) for one in functions]


def _taken(mode: str) -> Callable[..., Any]:
    """Pick by an index that is computed, within bounds or beyond."""
    return lambda x, y, axis: jnp.take(
        x, lax.convert_element_type(digits(y).ravel()[:3], np.int64), axis, mode=mode
    )


def _running(name: str, first: Callable[[Any], Any], reverse: bool) -> Callable[..., Any]:
    return lambda x, y, axis: getattr(lax, f"cum{name}")(first(x), axis, reverse)


def _reduced(name: str, first: Callable[[Any], Any]) -> list[Callable[..., Any]]:
    function = getattr(jnp, name)
    return [
        lambda x, y, axis: function(first(x)),
        lambda x, y, axis: function(first(x), axis=axis),
        *(_running(name, first, reverse) for reverse in (False, True)),
    ]


def _same(x: Any) -> Any:
    return x


def _to(dtype: Any) -> Callable[[Any], Any]:
    return lambda x: lax.convert_element_type(x, dtype)


REAL, LARGE = (-1e300, 1e300), (-600.0, 600.0)
MOVES = [
    lambda x, y, axis: lax.rev(x, (axis,)),
    lambda x, y, axis: x.T,
    lambda x, y, axis: x[1:],
    lambda x, y, axis: x[::2],
    lambda x, y, axis: x.ravel(),
    lambda x, y, axis: lax.concatenate([x, y], axis),
    lambda x, y, axis: lax.index_in_dim(x, x.shape[axis] - 1, axis, keepdims=False),
    lambda x, y, axis: jnp.take(x, np.arange(x.shape[axis])[::-2], axis, mode="clip"),
    lambda x, y, axis: x.at[0].set(y[-1], mode="promise_in_bounds"),
    lambda x, y, axis: jnp.pad(x, [(1, 0), *[(0, 0)] * (x.ndim - 1)]),
    lambda x, y, axis: lax.broadcast(x, (2,)),
]
SELECTED = [lambda x, y, axis: lax.select(lax.gt(x, y), y, x)]
COMPARED = _pairs(lax.eq, lax.ne, lax.lt, lax.le, lax.gt, lax.ge)
LOGIC = _pairs(lax.bitwise_and, lax.bitwise_or, lax.bitwise_xor)
ARITHMETIC = _pairs(lax.add, lax.sub, lax.mul, lax.max, lax.min)
REDUCED = [
    function
    for name, first in {"sum": digits, "prod": signs, "max": _same, "min": _same}.items()
    for function in _reduced(name, first)
]
# Functions of two arrays of a shape and an axis, by the kinds of the arrays and of the result.
OPERATIONS: dict[tuple[str, str], list[Callable[..., Any]]] = {
    ("f", "f"): [
        *_plain(lax.neg, lax.abs, lax.floor, lax.ceil, lax.sign, lax.square, mirrored_by_bits),
        *_plain(
            lambda x: lax.sqrt(lax.abs(x)),
            lambda x: lax.round(x, lax.RoundingMethod.TO_NEAREST_EVEN),
            lambda x: lax.round(x, lax.RoundingMethod.AWAY_FROM_ZERO),
            lambda x: lax.integer_pow(digits(x), 3),
            lambda x: lax.integer_pow(signs(x), -2),
            lambda x: lax.clamp(-1.5, x, 2.0),
            # Not every JAX has it.
            lambda x: getattr(lax, "one_minus_square", lax.neg)(digits(x)),
        ),
        *(ARITHMETIC + SELECTED + REDUCED),
        lambda x, y, axis: lax.dot_general(digits(x), digits(y), (((axis,), (axis,)), ((), ()))),
        *map(_taken, ("clip", "fill")),
    ],
    ("f", "b"): [*_plain(lax.is_finite, _to(bool)), *COMPARED],
    ("f", "i"): [
        *_plain(float_bits, _to(np.int64)),
        lambda x, y, axis: lax.argmax(x, axis, np.int64),
        lambda x, y, axis: lax.argmin(x, axis, np.int64),
    ],
    ("f", "e"): [
        _elementary(lax.exp, LARGE),
        _elementary(lax.exp2, (-900.0, 900.0)),
        _elementary(lax.expm1, LARGE),
        _elementary(lax.log, (1e-300, 1e300)),
        _elementary(lax.log1p, (-0.875, 1e300)),
        _elementary(lax.logistic, LARGE),
        _elementary(lax.cbrt, (-1e280, 1e280)),
        _elementary(lax.rsqrt, (1e-300, 1e300)),
        _elementary(lax.sin, (-1e5, 1e5)),
        _elementary(lax.cos, (-1e5, 1e5)),
        _elementary(lax.tan, (-8.0, 8.0)),
        _elementary(lax.asin, (-1.0, 1.0)),
        _elementary(lax.acos, (-1.0, 1.0)),
        _elementary(lax.atan, REAL),
        _elementary(lax.sinh, LARGE),
        _elementary(lax.cosh, LARGE),
        _elementary(lax.tanh, REAL),
        _elementary(lax.asinh, (-1e100, 1e100)),
        _elementary(lax.acosh, (1.0, 1e100)),
        _elementary(lax.atanh, (-0.875, 0.875)),
        _elementary(lax.pow, (0.125, 8.0), (-8.0, 8.0)),
    ],
    ("i", "i"): [
        *_plain(lax.neg, lax.abs, lax.sign, lax.bitwise_not, lambda x: lax.integer_pow(x, 2)),
        *_pairs(lax.shift_left, lax.shift_right_logical, lax.shift_right_arithmetic),
        *(ARITHMETIC + LOGIC + SELECTED + REDUCED),
    ],
    ("i", "f"): _plain(_to(np.float64)),
    ("i", "b"): [*_plain(_to(bool)), *COMPARED],
    ("b", "b"): [
        *_plain(lax.bitwise_not, jnp.all, jnp.any),
        *(LOGIC + COMPARED[:2]),
        lambda x, y, axis: jnp.all(x, axis=axis),
    ],
    ("b", "f"): _plain(_to(np.float64)),
    ("b", "i"): _plain(_to(np.int64)),
    ("e", "e"): _plain(lax.neg, lax.abs),
}
# What changes where zeros are known when a program is compiled: signs of zeros, what is not finite.
NOT_PADDED: dict[tuple[str, str], list[Callable[..., Any]]] = {
    ("f", "f"): _pairs(lax.div),
    ("i", "i"): _pairs(lax.div),
    ("f", "e"): [_elementary(lax.atan2, (-1e100, 1e100), (-1e100, 1e100))],
}


class Drawing:
    """Draw a function, loops and branches included.

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

    def value(self, values: list[Value]) -> int:
        """Draw a value, later ones more often."""
        return max(self.below(len(values)), self.below(len(values)))

    def like(self, values: list[Value], of: Value) -> int:
        """Draw a value of the same shape and kind."""
        return self.pick([
            at for at, value in enumerate(values)
            if value.kind == of.kind and np.shape(value.array) == np.shape(of.array)
        ])  # fmt: skip

    def steps(self, values: list[Value], count: int, depth: int) -> list[Step]:
        """Draw steps; what they return is added to the values."""
        steps: list[Step] = []
        makers = [self.operation] * 6 + [self.constant]
        makers += [self.scan, self.while_loop, self.cond, self.call] if depth else []
        for _ in range(count):
            step = self.pick(makers)(values, depth)
            if step is None:
                continue
            try:
                arrays = step.function(*[values[at].array for at in step.operands])
            except (TypeError, ValueError, IndexError):  # not for this shape
                continue
            if all(np.size(one) <= 60 and np.ndim(one) <= 3 for one in arrays):
                values += map(Value, arrays, step.kinds)
                steps.append(step)
        return steps

    def operation(self, values: list[Value], _: int) -> Step:
        at = self.value(values)
        own = values[at]
        kind = self.pick(
            [
                "move",
                own.kind,
                own.kind,
                *(after for before, after in OPERATIONS if before == own.kind),
            ]
        )
        if kind == "move":
            kind, functions = own.kind, MOVES
        else:
            functions = OPERATIONS[own.kind, kind]
            if not self.padded:
                functions = functions + NOT_PADDED.get((own.kind, kind), [])
        function, axis = self.pick(functions), self.below(max(np.ndim(own.array), 1))
        other = self.like(values, own)
        return Step(lambda x, y: [function(x, y, axis)], (at, other), kind)

    def constant(self, values: list[Value], _: int) -> Step:
        """Draw numbers that are known beforehand, of the shape of a value."""
        at = self.value(values)
        kind, known = self.pick([("f", CONSTANTS), ("i", INTEGERS)])
        numbers = [self.pick((*known, *[0] * 36 * self.padded)) for _ in range(4)]
        dtype = np.float64 if kind == "f" else np.int64
        table = np.resize(np.array(numbers, dtype), np.shape(values[at].array))
        return Step(lambda x: [jnp.asarray(table)], (at,), kind)

    def some(self, values: list[Value]) -> list[int]:
        return [self.value(values) for _ in range(1 + self.below(2))]

    def body(self, inner: list[Value], depth: int) -> list[Step]:
        return self.steps(inner, 1 + self.below(4), depth - 1)

    def scan(self, values: list[Value], depth: int) -> Step | None:
        carry, along, reverse = self.some(values), self.value(values), bool(self.below(2))
        own = values[along]
        if not np.shape(own.array) or not 0 < np.shape(own.array)[0] <= 4:
            return None
        inner = [*values, Value(own.array[0], own.kind)]
        steps = self.body(inner, depth)
        after, out = [self.like(inner, values[at]) for at in carry], self.value(inner)

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

        kinds = [values[at].kind for at in carry] + [inner[out].kind]
        return Step(function, tuple(range(len(values))), "".join(kinds))

    def while_loop(self, values: list[Value], depth: int) -> Step:
        carry, limit, test = self.some(values), self.below(4), self.like(values, values[0])
        inner = [*values, Value(jnp.int64(0), "i")]
        steps = self.body(inner, depth)
        after = [self.like(inner, values[at]) for at in carry]

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
        index, out = self.pick(which), [values[at] for at in self.some(values)]
        branches = []
        for _ in range(2):
            inner = list(values)
            steps = self.body(inner, depth)
            branches.append((steps, [self.like(inner, one) for one in out]))

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
        steps, wrap = self.body(inner, depth), self.pick((jax.jit, jax.checkpoint))
        out = self.value(inner)
        function = wrap(lambda *arrays: [run(steps, arrays)[out]])
        return Step(function, tuple(range(len(values))), inner[out].kind)


def numbers(drawing: Drawing, count: int, special: Sequence[float]) -> np.ndarray:
    """Draw floats, some of them special.

    One draw seeds them all: Hypothesis takes longer over each choice than the program runs.
    """
    generator = np.random.default_rng(drawing.draw(_SEEDS))
    values = generator.integers(-64, 65, count) / 8
    if not special:
        return values
    return np.where(generator.integers(0, 4, count) == 0, generator.choice(special, count), values)
