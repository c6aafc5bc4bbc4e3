"""Compiled functions of the package: made for this processor once, found again on disk.

`lanewise` makes the programs. Where it cannot (something that it does not know, or a
program too long to be written out), and on a GPU, XLA makes them, of the same function.
"""

from __future__ import annotations

import json
import threading
import warnings
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from functools import partial, update_wrapper
from typing import Any, ClassVar

import numpy as np

from lanewise import Program, UnknownHereError, machine_code, processor, source
from notchflex._jax import jax, jit, jnp
from notchflex.solver.programs import shipped, store

# Rows that XLA's programs are made for; more are cut up, fewer filled up.
_PIECES = (64, 256, 1024)
# Programs that a process holds at once; those not used for longest are made or read again.
_MOST = 96
# JAX remembers what it traced; it forgets that after so many programs.
_TRACES = 24
_making = threading.RLock()


class CompiledFunction:
    """A program, and the form of what it returns.

    Args:
        content: What `_content` returned, with machine code; plain data, nothing that is run when
            it is read.
    """

    def __init__(self, content: bytes) -> None:
        """Read it."""
        head, code = _parts(content)
        *own, self.form = head
        self.program = Program(code, *own)

    def __call__(self, given: Sequence[np.ndarray]) -> Any:
        """Return what the function returns, in NumPy's arrays."""
        flat = self.program(given)
        rows = () if self.program.by_row is None else flat[0].shape[:1]
        return _filled(self.form, iter(flat), rows)


def _content(head: Sequence[Any], body: bytes) -> bytes:
    """A program as bytes: what it takes and returns, and its text or machine code."""
    return json.dumps(head).encode() + b"\n" + body


def _parts(content: bytes) -> tuple[list[Any], bytes]:
    """The head and the body of what `_content` returned."""
    head, _, body = content.partition(b"\n")
    return json.loads(head), body


def _form(tree: Any) -> Any:
    """Return a tree of arrays (tuples and dictionaries) as plain data."""
    if isinstance(tree, dict):
        return {name: _form(tree[name]) for name in sorted(tree)}
    if isinstance(tree, tuple):
        if hasattr(tree, "_fields"):
            raise TypeError("compiled functions return arrays, plain tuples or dictionaries")
        return ["tuple", *(_form(one) for one in tree)]
    return ["array", list(tree.shape), np.dtype(tree.dtype).str]


def _filled(form: Any, flat: Iterator[np.ndarray], rows: tuple[int, ...]) -> Any:
    if isinstance(form, dict):
        return {name: _filled(one, flat, rows) for name, one in form.items()}
    if form[0] == "tuple":
        return tuple(_filled(one, flat, rows) for one in form[1:])
    _, shape, kind = form
    one = next(flat)
    return (one if kind == "<f8" else one.astype(kind)).reshape(*rows, *shape)


class Native:
    """A function of vectors of floats, compiled.

    Args:
        function: What to compile; vectors come first, then what is no array. It returns an array,
            or plain tuples and dictionaries of arrays.
        vectors: How many vectors it takes.
        long: From the other arguments, sizes of axes that rows are laid out along.
    """

    made: ClassVar[OrderedDict[Any, CompiledFunction | None]] = OrderedDict()
    compiled: ClassVar[int] = 0
    """How many programs this process has compiled, not read from disk."""
    traced: ClassVar[int] = 0
    """How many of them it has traced, not found in the package."""

    def __init__(
        self, function: Callable[..., Any], vectors: int, long: Callable[..., Sequence[int]]
    ) -> None:
        """Compile nothing yet."""
        self._function, self._vectors, self._long = function, vectors, long
        self._name = f"{function.__module__}.{function.__qualname__}"
        self._by_xla: dict[Any, Callable[..., Any]] = {}
        update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        """Return the function of some vectors."""
        made = self._made("once", None, arguments)
        if made is None:
            vectors = map(jnp.asarray, arguments[: self._vectors])
            by_xla = self._xla("once", (), self._function, len(arguments))
            return jax.tree.map(np.asarray, by_xla(*vectors, *arguments[self._vectors :]))
        return made(arguments[: self._vectors])

    def rows(self, by_row: tuple[bool, ...], *arguments: Any) -> Any:
        """Return the function of every row of a batch.

        Args:
            by_row: Which of the vectors are tables, a row for each row of the batch.
            arguments: As the function takes them.

        Returns:
            What the function returns, rows as leading axis of all.
        """
        made = None
        if jax.default_backend() == "cpu":
            made = self._made("rows", by_row, arguments)
        if made is None:
            return self._side_by_side(by_row, arguments)
        return made(arguments[: self._vectors])

    def along(self, by_row: tuple[bool, ...], *arguments: Any) -> Any:
        """Return the function of rows one after the other, with a vector carried from row to row.

        Args:
            by_row: Which of the vectors are tables, a row for each step.
            arguments: As the function takes them; the first vector is the one carried into the
                first step. The function returns the vector carried on, and what the step gives.

        Returns:
            What the steps give, steps as leading axis of all.
        """
        made = self._made("along", by_row, arguments)
        if made is None:
            return self._one_by_one(by_row, arguments)
        return made(arguments[: self._vectors])

    def count(self) -> int:
        """Return how many programs there are of it."""
        return sum(key[0] is self for key in Native.made)

    def _made(
        self, how: str, by_row: tuple[bool, ...] | None, arguments: tuple[Any, ...]
    ) -> CompiledFunction | None:
        if getattr(jax.config, "jax_disable_jit"):  # noqa: B009
            return None
        vectors, others = arguments[: self._vectors], arguments[self._vectors :]
        shapes = tuple(
            np.shape(one)[1:] if by_row is not None and by_row[place] else np.shape(one)
            for place, one in enumerate(vectors)
        )
        key = (self, how, by_row, shapes, others)
        try:
            found = Native.made[key]
            Native.made.move_to_end(key)
            return found
        except KeyError:
            pass
        with _making:  # threads that ask for the same program wait for the one at work
            if key not in Native.made:
                Native.made[key] = self._found(how, by_row, shapes, others)
                while len(Native.made) > _MOST:
                    Native.made.popitem(last=False)
            return Native.made[key]

    def _found(
        self,
        how: str,
        by_row: tuple[bool, ...] | None,
        shapes: Sequence[Any],
        others: tuple[Any, ...],
    ) -> CompiledFunction | None:
        """The program, from disk or made and put there; None where XLA must make it."""
        key = repr((self._name, how, by_row, shapes, others))
        own = f"{key} {processor()}"
        content = store.read(own)
        if content is None:
            written = self._source(key, how, by_row, shapes, others)
            if written is None:
                return None
            Native.compiled += 1
            head, text = _parts(written)
            content = _content(head, machine_code(text.decode()))
            store.write(own, content)
        return CompiledFunction(content)

    def _source(
        self,
        key: str,
        how: str,
        by_row: tuple[bool, ...] | None,
        shapes: Sequence[Any],
        others: tuple[Any, ...],
    ) -> bytes | None:
        """The program as text: shipped, or written now; None where XLA must make it."""
        content = shipped.read(key)
        if content is not None:
            return content
        given = [np.zeros(shape) for shape in shapes]
        function = partial(self._with, others)
        try:
            made, tree = source(
                function, given, self._long(*others), by_row, carries=how == "along"
            )
        except UnknownHereError as error:
            warnings.warn(
                f"{self._name} is compiled by XLA, which makes it some ten times slower: {error}",
                RuntimeWarning,
                stacklevel=2,
            )
            return None
        Native.traced += 1
        if Native.traced % _TRACES == 0:
            jax.clear_caches()
        content = _content([made.sizes, made.room, by_row, _form(tree)], made.text.encode())
        shipped.record(key, content)
        return content

    def _with(self, others: tuple[Any, ...], *vectors: Any) -> Any:
        return self._function(*vectors, *others)

    def _one_by_one(self, by_row: tuple[bool, ...], arguments: tuple[Any, ...]) -> Any:
        """Steps by a program of XLA."""

        def every(*given: Any) -> Any:
            vectors, others = given[: self._vectors], given[self._vectors :]
            along = tuple(one for one, rows in zip(vectors, by_row, strict=True) if rows)

            def step(carry: Any, items: tuple[Any, ...]) -> Any:
                item = iter(items)
                fixed = zip(vectors, by_row, strict=True)
                own = [next(item) if rows else one for one, rows in fixed]
                return self._function(carry, *own[1:], *others)

            return jax.lax.scan(step, vectors[0], along)[1]

        vectors = map(jnp.asarray, arguments[: self._vectors])
        by_xla = self._xla("along", by_row, every, len(arguments))
        return jax.tree.map(np.asarray, by_xla(*vectors, *arguments[self._vectors :]))

    def _side_by_side(self, by_row: tuple[bool, ...], arguments: tuple[Any, ...]) -> Any:
        """Rows by a program of XLA, in pieces."""

        def each(*given: Any) -> Any:
            own = partial(self._with, given[self._vectors :])
            axes = [0 if rows else None for rows in by_row]
            return jax.vmap(own, in_axes=axes)(*given[: self._vectors])

        many = self._xla("rows", by_row, each, len(arguments))
        tables, others = arguments[: self._vectors], arguments[self._vectors :]
        count = max(len(one) for one, rows in zip(tables, by_row, strict=True) if rows)
        piece = next((size for size in _PIECES if size >= count), _PIECES[-1])
        found: list[Any] = []
        for start in range(0, count, piece):
            index = np.minimum(np.arange(start, start + piece), count - 1)
            some = [one[index] if rows else one for one, rows in zip(tables, by_row, strict=True)]
            found.append(jax.tree.map(np.asarray, many(*some, *others)))
        return jax.tree.map(lambda *leaves: np.concatenate(leaves)[:count], *found)

    def _xla(
        self, how: str, by_row: tuple[bool, ...], function: Callable[..., Any], count: int
    ) -> Callable[..., Any]:
        key = (how, by_row)
        if key not in self._by_xla:
            static = tuple(range(self._vectors, count))
            self._by_xla[key] = jit(function, static_argnums=static)
        return self._by_xla[key]


def native(
    vectors: int, long: Callable[..., Sequence[int]]
) -> Callable[[Callable[..., Any]], Native]:
    """Make a function a compiled one; see `Native`."""
    return lambda function: Native(function, vectors, long)


__all__ = ["CompiledFunction", "Native", "native"]
