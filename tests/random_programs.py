"""Random functions of JAX's primitives, drawn by hypothesis, for comparing compilers.

A function is drawn while it is run on given arrays, primitive by primitive by XLA, so that shapes
are known. `random_operations.py` holds what it is drawn from, `random_steps.py` draws single steps.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from hypothesis import strategies as st
from jax import lax

from lanewise._jax import jax, jnp
from random_operations import Step, Value, run
from random_steps import StepDrawing

_SEEDS = st.integers(0, 2**32 - 1)


class Drawing(StepDrawing):
    """Draw a function, loops and branches included."""

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


def numbers(drawing: Drawing, count: int, special: Sequence[float]) -> np.ndarray:
    """Draw floats, some of them special.

    One draw seeds them all: Hypothesis takes longer over each choice than the program runs.
    """
    generator = np.random.default_rng(drawing.draw(_SEEDS))
    values = generator.integers(-64, 65, count) / 8
    if not special:
        return values
    return np.where(generator.integers(0, 4, count) == 0, generator.choice(special, count), values)
