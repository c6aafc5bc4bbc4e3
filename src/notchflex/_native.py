"""Compiled functions of the package: made for this processor once, found again on disk.

`notchflex.native` makes the programs. Where it cannot (something that it does not know, or a
program too long to be written out), and on a GPU, XLA makes them, of the same function.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial, update_wrapper
from typing import Any, ClassVar

import numpy as np

from notchflex import _kept
from notchflex._jax import jax, jnp
from notchflex._kept import Kept
from notchflex.native import Program, UnknownHereError, processor, program

# Rows that XLA's programs are made for; more are cut up, fewer filled up.
_PIECES = (64, 256, 1024)


class Made:
    """A program, and the form of what it returns."""

    def __init__(self, program: Program, tree: Any) -> None:
        """Take both."""
        self.program = program
        self.leaves, self.structure = jax.tree.flatten(tree)

    def __call__(self, given: Sequence[np.ndarray]) -> Any:
        """What the function returns, in NumPy's arrays."""
        flat = self.program(given)
        rows = () if self.program.by_row is None else flat[0].shape[:1]
        leaves = [
            (one if leaf.dtype == float else one.astype(leaf.dtype)).reshape(*rows, *leaf.shape)
            for one, leaf in zip(flat, self.leaves, strict=True)
        ]
        return jax.tree.unflatten(self.structure, leaves)


class Native:
    """A function of vectors of floats, compiled.

    Args:
        function: What to compile; vectors come first, then what is no array.
        vectors: How many vectors it takes.
        long: From the other arguments, sizes of axes that rows are laid out along.
    """

    made: ClassVar[dict[Any, Made | None]] = {}

    def __init__(
        self, function: Callable[..., Any], vectors: int, long: Callable[..., Sequence[int]]
    ) -> None:
        """Compile nothing yet."""
        self._function, self._vectors, self._long = function, vectors, long
        self._name = f"{function.__module__}.{function.__qualname__}"
        self._kept = Kept(function, tuple(range(vectors, function.__code__.co_argcount)))
        self._many: dict[tuple[bool, ...], Kept] = {}
        update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        """The function of some vectors."""
        made = self._made(None, arguments)
        if made is None:
            vectors = map(jnp.asarray, arguments[: self._vectors])
            return jax.tree.map(np.asarray, self._kept(*vectors, *arguments[self._vectors :]))
        return made(arguments[: self._vectors])

    def rows(self, by_row: tuple[bool, ...], *arguments: Any) -> Any:
        """The function of every row of a batch.

        Args:
            by_row: Which of the vectors are tables, a row for each row of the batch.
            arguments: As the function takes them.

        Returns:
            What the function returns, rows as leading axis of all.
        """
        made = None if jax.default_backend() != "cpu" else self._made(by_row, arguments)
        if made is None:
            return self._side_by_side(by_row, arguments)
        return made(arguments[: self._vectors])

    def count(self) -> int:
        """How many programs there are of it."""
        return sum(key[0] is self for key in Native.made)

    def _made(self, by_row: tuple[bool, ...] | None, arguments: tuple[Any, ...]) -> Made | None:
        if getattr(jax.config, "jax_disable_jit"):  # noqa: B009
            return None
        vectors, others = arguments[: self._vectors], arguments[self._vectors :]
        shapes = tuple(
            np.shape(one)[1:] if by_row is not None and by_row[place] else np.shape(one)
            for place, one in enumerate(vectors)
        )
        key = (self, by_row, shapes, others)
        if key not in Native.made:
            with _kept.making:  # threads that ask for the same program wait for the one at work
                if key not in Native.made:
                    Native.made[key] = self._found(by_row, shapes, others)
        return Native.made[key]

    def _found(
        self, by_row: tuple[bool, ...] | None, shapes: Sequence[Any], others: tuple[Any, ...]
    ) -> Made | None:
        """The program, from disk or made and put there; None where XLA must make it."""
        told = repr((self._name, by_row, shapes, others, processor()))
        try:
            return Made(*_kept.read(told))
        except TypeError:  # nothing is kept, or something else
            pass
        given = [np.zeros(shape) for shape in shapes]
        try:
            made = program(partial(self._with, others), given, self._long(*others), by_row)
        except UnknownHereError:
            return None
        _kept.write(told, made)
        return Made(*made)

    def _with(self, others: tuple[Any, ...], *vectors: Any) -> Any:
        return self._function(*vectors, *others)

    def _side_by_side(self, by_row: tuple[bool, ...], arguments: tuple[Any, ...]) -> Any:
        """Rows by a program of XLA, in pieces."""
        many = self._many.get(by_row)
        if many is None:
            others = range(self._vectors, len(arguments))

            def each(*given: Any) -> Any:
                own = partial(self._with, given[self._vectors :])
                axes = [0 if rows else None for rows in by_row]
                return jax.vmap(own, in_axes=axes)(*given[: self._vectors])

            each.__qualname__ = f"{self._name}.rows{by_row}"
            many = self._many[by_row] = Kept(each, tuple(others))
        tables, others = arguments[: self._vectors], arguments[self._vectors :]
        count = max(len(one) for one, rows in zip(tables, by_row, strict=True) if rows)
        piece = next((size for size in _PIECES if size >= count), _PIECES[-1])
        found: list[Any] = []
        for start in range(0, count, piece):
            index = np.minimum(np.arange(start, start + piece), count - 1)
            some = [one[index] if rows else one for one, rows in zip(tables, by_row, strict=True)]
            found.append(jax.tree.map(np.asarray, many(*some, *others)))
        return jax.tree.map(lambda *leaves: np.concatenate(leaves)[:count], *found)


def native(
    vectors: int, long: Callable[..., Sequence[int]]
) -> Callable[[Callable[..., Any]], Native]:
    """Make a function a compiled one; see `Native`."""
    return lambda function: Native(function, vectors, long)


__all__ = ["Native", "native"]
