"""Functions compiled to machine code for this processor, kept on disk.

`lanewise` compiles them. XLA compiles the same functions where lanewise does not support them
(with a warning), for batches on a GPU, and if `NOTCHFLEX_BACKEND=xla` asks for it.
"""

from __future__ import annotations

import json
import os
import threading
import warnings
from collections import OrderedDict, deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from functools import lru_cache, partial, update_wrapper
from typing import Any, ClassVar, NamedTuple, TypeVar

import numpy as np

from lanewise import Program, UnsupportedPrimitiveError, lower, machine_code, target
from notchflex._jax import jax, jit, jnp
from notchflex.errors import InputError
from notchflex.solver.programs import store

BACKEND = "NOTCHFLEX_BACKEND"
"""Environment variable: `native` (lanewise, the default) or `xla` compiles the programs."""

_COMPILERS = ("native", "xla")
_warned: set[str] = set()


def backend() -> str:
    """Return the compiler of programs, "native" or "xla"."""
    value = os.environ.get(BACKEND) or _COMPILERS[0]
    if value not in _COMPILERS:
        raise InputError.UNKNOWN_NAME(
            f"the environment variable {BACKEND} is {value!r}; allowed are "
            f"{', '.join(_COMPILERS)}. Set it to one of them, or unset it for {_COMPILERS[0]!r}."
        )
    return value


def warn_of_xla(function: str, error: UnsupportedPrimitiveError) -> None:
    """Warn once for each unsupported primitive that XLA compiles a function."""
    reason = error.primitive or str(error)
    if reason in _warned:
        return
    _warned.add(reason)
    warnings.warn(
        f"XLA compiles {function}, which makes it some ten times slower: lanewise does not support "
        f"{error}",
        RuntimeWarning,
        stacklevel=3,
    )


def runs_uncompiled() -> bool:
    """Return whether JAX is asked to run functions without compiling them."""
    return getattr(jax.config, "jax_disable_jit")  # noqa: B009


# Batch sizes of XLA's programs; larger batches are split, smaller ones padded.
_BATCH_SIZES = (64, 256, 1024)
# Largest number of programs in memory; the least recently used is dropped.
_MAX_PROGRAMS = 96
# Lines of a program for rows beyond which it is not optimised. A notch of nitinol with elastic ends
# has 100,000 and is three times as fast for ten seconds; a link, 92,000, by a tenth for five.
_OPTIMISED = 120_000
# JAX's tracing caches are cleared after this number of programs.
_TRACES_KEPT = 4
_lock = threading.RLock()


class CompiledFunction:
    """A program with machine code, and the structure of what it returns."""

    def __init__(self, content: bytes) -> None:
        """Read the program."""
        head, code = _parts(content)
        *sizes, self._structure = head
        self._program = Program(code, *sizes)

    def __call__(self, vectors: Sequence[np.ndarray]) -> Any:
        """Call the program; return NumPy arrays."""
        return _rebuild(self._structure, iter(self._program(vectors)))


def _content(head: Sequence[Any], body: bytes) -> bytes:
    """Serialise a program: signature, and its text or machine code."""
    return json.dumps(head).encode() + b"\n" + body


def _parts(content: bytes) -> tuple[list[Any], bytes]:
    """Return head and body of a serialised program."""
    head, _, body = content.partition(b"\n")
    return json.loads(head), body


def _structure(tree: Any) -> Any:
    """Return the structure of a tree of arrays (tuples and dictionaries) as plain data."""
    if isinstance(tree, dict):
        return {name: _structure(tree[name]) for name in sorted(tree)}
    if isinstance(tree, tuple):
        if hasattr(tree, "_fields"):
            raise TypeError("compiled functions return arrays, plain tuples or dictionaries")
        return ["tuple", *(_structure(branch) for branch in tree)]
    return ["array", list(tree.shape), np.dtype(tree.dtype).str]


def _rebuild(structure: Any, flat: Iterator[np.ndarray]) -> Any:
    """Rebuild the tree of a structure from its flat arrays in order; they may have rows."""
    if isinstance(structure, dict):
        return {name: _rebuild(part, flat) for name, part in structure.items()}
    if structure[0] == "tuple":
        return tuple(_rebuild(part, flat) for part in structure[1:])
    _, shape, kind = structure
    values = next(flat)
    if len(shape) != 1:
        values = values.reshape((*values.shape[:-1], *shape))
    return values if kind == "<f8" else values.astype(kind)


class Packed(NamedTuple):
    """An argument of a program: numbers, and what unpacks them inside it.

    Attributes:
        numbers: A vector of floats, or vectors as the rows of a table.
        layout: Its method `unpack` makes of a vector what the function takes, a tree of arrays; the
            function takes the vector itself where it is None.
        by_row: Whether there are rows.
    """

    numbers: Any
    layout: Any = None
    by_row: bool = False

    def unpack(self, vector: Any) -> Any:
        """Return a vector as the function takes it."""
        return vector if self.layout is None else self.layout.unpack(vector)


class Native:
    """A function of arrays and trees of arrays, compiled."""

    # Its arguments are `Packed`, or vectors; all others are hashable and compiled in. It returns an
    # array, or plain tuples and dictionaries of arrays. Axes as long as `lanes` of an argument's
    # layout, such as that of the flexures of a chain, are laid out side by side.

    programs: ClassVar[OrderedDict[Any, CompiledFunction | None]] = OrderedDict()
    compiled: ClassVar[int] = 0
    """Number of programs that this process has compiled, not read from disk."""
    traced: ClassVar[int] = 0
    """Number of them that it has traced, not found in the package."""

    def __init__(self, function: Callable[..., Any]) -> None:
        """Store the function; programs are compiled when called."""
        self.function = function
        self._name = f"{function.__module__}.{function.__qualname__}"
        self._jitted: dict[Any, Callable[..., Any]] = {}
        update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        """Evaluate the function once."""
        return self.bound("once", *arguments)(vectors_of(arguments))

    def map(self, *arguments: Any) -> Any:
        """Evaluate the function of every row, one after the other."""
        return self.bound("map", *arguments)(vectors_of(arguments))

    def scan(self, *arguments: Any) -> Any:
        """Evaluate the function row after row, with a vector carried from row to row."""
        # The first argument is the vector carried into the first row. The function returns the
        # vector for the next row, and the results.
        return self.bound("scan", *arguments)(vectors_of(arguments))

    def rows(self, *arguments: Any) -> Any:
        """Evaluate the function of every row, side by side; results with rows as leading axis."""
        if jax.default_backend() == "cpu":
            return self.bound("rows", *arguments)(vectors_of(arguments))
        vectors, forms = vectors_of(arguments), _forms_of(arguments)
        by_row = _by_row(forms)
        count = max(len(vector) for vector, rows in zip(vectors, by_row, strict=True) if rows)
        piece = next((size for size in _BATCH_SIZES if size >= count), _BATCH_SIZES[-1])
        results: list[Any] = []
        for start in range(0, count, piece):
            index = np.minimum(np.arange(start, start + piece), count - 1)
            some = [
                vector[index] if rows else vector
                for vector, rows in zip(vectors, by_row, strict=True)
            ]
            results.append(self._by_xla("rows", forms, some))
        return jax.tree.map(lambda *leaves: np.concatenate(leaves)[:count], *results)

    def bound(self, how: str, *arguments: Any) -> Callable[[Sequence[Any]], Any]:
        """Return the program, a function of vectors, for "once", "map", "scan" or "rows"."""
        forms = _forms_of(arguments)
        program = self._program(how, forms, vectors_of(arguments))
        return program or partial(self._by_xla, how, forms)

    def _program(
        self, how: str, forms: tuple[Any, ...], vectors: Sequence[Any]
    ) -> CompiledFunction | None:
        """Return the program for arguments of these forms; None where XLA must compile it."""
        if runs_uncompiled():
            return None
        by_row = _by_row(forms)
        shapes = tuple([vector.shape[rows:] for vector, rows in zip(vectors, by_row, strict=True)])
        key = (self, how, shapes, forms)
        try:
            program = Native.programs[key]
            Native.programs.move_to_end(key)
            return program
        except KeyError:
            pass
        with _lock:  # other threads wait while one compiles the same program
            if key not in Native.programs:
                Native.programs[key] = self._load(how, shapes, forms)
                while len(Native.programs) > _MAX_PROGRAMS:
                    Native.programs.popitem(last=False)
            return Native.programs[key]

    def _load(
        self, how: str, shapes: Sequence[Any], forms: tuple[Any, ...]
    ) -> CompiledFunction | None:
        """Read the program from disk, or compile and store it; None where XLA must compile it."""
        if backend() == "xla":
            return None
        key = repr((self._name, how, shapes, forms))
        on_processor = f"{key} {target()}"
        content = store.read(on_processor)
        if content is None:
            text = store.read_shipped(key) or self._trace(key, how, shapes, forms)
            if text is None:
                return None
            Native.compiled += 1
            head, body = _parts(text)
            # A program that is recorded for a wheel runs once.
            long = how == "rows" and body.count(b"\n") > _OPTIMISED
            level = 0 if long or store.recording() else 2
            content = _content(head, machine_code(body.decode(), level))
            store.write(on_processor, content)
        return CompiledFunction(content)

    def _trace(
        self, key: str, how: str, shapes: Sequence[Any], forms: tuple[Any, ...]
    ) -> bytes | None:
        """Trace the program to text; None where XLA must compile it."""
        function, by_row = self._of_vectors(forms), None if how == "once" else _by_row(forms)
        lanes = (getattr(getattr(form, "layout", form), "lanes", ()) for form in forms)
        try:
            program, tree = lower(
                function,
                list(map(np.zeros, shapes)),
                max(lanes, default=()),
                by_row,
                how=how,
            )
        except UnsupportedPrimitiveError as error:
            warn_of_xla(self._name, error)
            return None
        Native.traced += 1
        if Native.traced % _TRACES_KEPT == 0:
            jax.clear_caches()
        content = _content(
            [program.sizes, program.memory, by_row, _structure(tree)], program.text.encode()
        )
        store.record(key, content)
        return content

    def _of_vectors(self, forms: tuple[Any, ...]) -> Callable[..., Any]:
        """Return the function of vectors alone."""

        def of_vectors(*vectors: Any) -> Any:
            following = iter(vectors)
            return self.function(
                *(form.unpack(next(following)) if _is_packed(form) else form for form in forms)
            )

        return of_vectors

    def _by_xla(self, how: str, forms: tuple[Any, ...], vectors: Sequence[Any]) -> Any:
        """Evaluate the function by a program of XLA."""
        key = (how, forms)
        if key not in self._jitted:
            function, by_row = self._of_vectors(forms), _by_row(forms)
            if how == "rows":
                function = jax.vmap(function, in_axes=[0 if rows else None for rows in by_row])
            elif how != "once":
                function = partial(_one_by_one, function, by_row, how == "scan")
            self._jitted[key] = jit(function)
        return jax.tree.map(np.asarray, self._jitted[key](*map(jnp.asarray, vectors)))


def _is_packed(argument: Any) -> bool:
    return type(argument) is Packed


def vectors_of(arguments: Sequence[Any]) -> list[Any]:
    """Return the vectors and tables of a program's arguments."""
    return [
        argument.numbers if _is_packed(argument) else argument
        for argument in arguments
        if _is_packed(argument) or hasattr(argument, "shape")
    ]


def _forms_of(arguments: Sequence[Any]) -> tuple[Any, ...]:
    """Return what a program is compiled for: arguments without their numbers."""
    return tuple(
        [
            Packed(None) if hasattr(argument, "shape")
            else Packed(None, argument.layout, argument.by_row) if _is_packed(argument)
            else argument
            for argument in arguments
        ]
    )  # fmt: skip


def _by_row(forms: tuple[Any, ...]) -> tuple[bool, ...]:
    return tuple([form.by_row for form in forms if _is_packed(form)])


def _one_by_one(
    function: Callable[..., Any], by_row: tuple[bool, ...], carries: bool, *vectors: Any
) -> Any:
    """Evaluate a function row after row, perhaps with the first vector carried."""
    tables = [vector if rows else None for vector, rows in zip(vectors, by_row, strict=True)]

    def step(carry: Any, row: list[Any]) -> Any:
        arguments = [
            vector if entry is None else entry for vector, entry in zip(vectors, row, strict=True)
        ]
        return function(carry, *arguments[1:]) if carries else (None, function(*arguments))

    return jax.lax.scan(step, vectors[0] if carries else None, tables)[1]


# A pool of threads for the pieces of a table, started once: each reuses its memory.

Piece = TypeVar("Piece")
Result = TypeVar("Result")

# Number of pieces queued per thread, so that none is idle while results are collected.
_AHEAD = 4


def number_of_cores() -> int:
    """Return the default number of threads."""
    return os.cpu_count() or 1


@lru_cache(maxsize=4)
def _threads(cores: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(cores, thread_name_prefix="notchflex")


# The child of a fork has none of its parent's threads.
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_threads.cache_clear)


def on_cores(
    work: Callable[[Piece], Result], pieces: Iterable[Piece], cores: int | None = None
) -> Generator[Result]:
    """Process pieces in several threads; yield the results in the order of the pieces.

    Only a few pieces are queued, so that other callers can run. After an early close
    (`contextlib.closing`) no more pieces start, and the function waits for those that run.

    Args:
        work: Function of a piece.
        pieces: The pieces.
        cores: Number of threads, one per core where not given; 1 is the calling thread.
    """
    cores = cores or number_of_cores()
    if cores == 1:
        yield from map(work, pieces)
        return
    threads, begun = _threads(cores), deque[Future[Result]]()
    try:
        for piece in pieces:
            begun.append(threads.submit(work, piece))
            if len(begun) > _AHEAD * cores:
                yield begun.popleft().result()
        while begun:
            yield begun.popleft().result()
    finally:
        for future in begun:
            future.cancel()
        wait(begun)
