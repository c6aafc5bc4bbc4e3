"""Random programs against XLA, which runs the same function primitive by primitive.

Sums are not contracted to fused multiply-adds here, so that results are equal bit for bit; those
of elementary functions are nearly equal. XLA flushes denormal numbers to zero, so the program does,
too, where there are some.
"""

import ctypes
import platform
from contextlib import contextmanager

import llvmlite.binding as llvm
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lanewise import Program, UnsupportedPrimitiveError, lower, machine_code
from lanewise._jax import jax, jnp
from random_programs import DENORMAL, SPECIAL, Drawing, Value, numbers, run

TINY = 2.0**-1022
X86 = platform.machine().lower() in ("x86_64", "amd64")
FLUSH = 0x8040  # MXCSR: flush results to zero, take denormals as zero
REFUSED = ("repeated indices", "along several axes", "out of bounds")
SIZES = (3, 13, 3, 13, 8, 1)


def _set_mxcsr():
    code = """
    declare void @llvm.x86.sse.ldmxcsr(ptr)
    define void @program(i32 %value) {
      %at = alloca i32
      store i32 %value, ptr %at
      call void @llvm.x86.sse.ldmxcsr(ptr %at)
      ret void
    }"""
    target = llvm.Target.from_default_triple().create_target_machine(jit=True)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(code), target)
    engine.finalize_object()
    function = ctypes.CFUNCTYPE(None, ctypes.c_int32)(engine.get_function_address("program"))
    function.engine = engine
    return function


@contextmanager
def flushed(on):
    """Flush denormal numbers to zero."""
    if not on:
        yield
        return
    if not hasattr(flushed, "set"):
        machine_code("define void @program() { ret void }")  # makes LLVM ready
        flushed.set = _set_mxcsr()
    flushed.set(0x1F80 | FLUSH)
    try:
        yield
    finally:
        flushed.set(0x1F80)


def by_xla(steps, out, arrays, size):
    """Results of the function, every primitive compiled by XLA for itself."""
    with jax.disable_jit():
        # JAX's own arrays: NumPy would convert numbers of its own in another way.
        values = run(steps, map(jnp.asarray, parted(arrays, size)))
        return [np.asarray(values[at], float).ravel() for at in out]


def parted(arrays, size):
    """Arrays of some shapes out of three vectors."""
    first, second, third = arrays
    return [first, second.reshape(size, 2), second[::2] * 1.0, third, third[0], third[1]]


def compare(got, want, kind, *, signs, flush):
    if flush:
        got, want = (np.where(abs(one) < TINY, 0.0, one) for one in (got, want))
        signs = False
    if kind == "e":
        np.testing.assert_allclose(got, want, rtol=1e-13, atol=1e-290)
        return
    np.testing.assert_array_equal(got, want)
    if signs:
        known = got == got
        np.testing.assert_array_equal(np.signbit(got[known]), np.signbit(want[known]))


def check(data):
    """Draw a program, compile it and compare."""
    padded = data.draw(st.booleans())
    drawing = Drawing(data.draw, padded)
    size = drawing.pick(SIZES)
    flush = X86 and not padded
    special = () if padded else SPECIAL + DENORMAL * (flush and drawing.below(4) == 0)
    how = drawing.pick(("once", "once", "rows", "path"))
    rows = 1 if how == "once" else drawing.pick((1, 1, 3, 3, 9))
    tables = [
        np.stack([numbers(drawing, count, special) for _ in range(rows)])
        for count in (size, 2 * size, 2)
    ]
    if how == "path":  # the last vector is carried
        tables[2] = np.broadcast_to(tables[2][:1], tables[2].shape)
    with np.errstate(all="ignore"):
        with jax.disable_jit():
            first = parted([one[0] for one in tables], size)
            values = [Value(jnp.asarray(one), "f") for one in first]
            steps = drawing.steps(values, 2 + drawing.below(7), 2)
        inputs = 6
        out = list(dict.fromkeys(range(inputs, len(values))))[-4:] or [0]
        kinds = [values[at].kind for at in out]
        carry = next(
            at for at in reversed(range(len(values)))
            if values[at].kind == "f" and np.shape(values[at].array) == (2,)
        )  # fmt: skip
        # The first row is that with which the function was drawn.
        wanted = [[np.asarray(values[at].array, float).ravel() for at in out]]
        third = np.asarray(values[carry].array, float).ravel()
        for row in range(1, rows):
            own = [tables[0][row], tables[1][row], third if how == "path" else tables[2][row]]
            *results, third = by_xla(steps, [*out, carry], own, size)
            wanted.append(results)

    def function(*arrays):
        if how != "path":
            values = run(steps, parted(arrays, size))
            return [values[at] for at in out]
        carried, first, second = arrays
        values = run(steps, parted((first, second, carried), size))
        return values[carry], [values[at] for at in out]

    arrays = [one[0] for one in tables] if how == "once" else tables
    by_row = None if how == "once" else (True, True, True)
    if how == "path":
        arrays, by_row = [tables[2][0], tables[0], tables[1]], (False, True, True)
    example = [one[0] if by_row and by_row[at] else one for at, one in enumerate(arrays)]
    try:
        lowered, _ = lower(
            function, example, (size, size + 1), by_row, how="scan" if how == "path" else how
        )
    except UnsupportedPrimitiveError as error:
        if any(words in str(error) for words in REFUSED):
            return
        raise
    code = machine_code(lowered.text.replace(" contract", ""), 0)
    program = Program(code, lowered.sizes, lowered.memory, by_row)
    with flushed(flush):
        got = program(arrays)
    for number, kind in enumerate(kinds):
        want = np.stack([row[number] for row in wanted])
        one = got[number].reshape(want.shape)
        compare(one, want, kind, signs=not padded, flush=flush)


few = settings(
    max_examples=50, deadline=None, suppress_health_check=list(HealthCheck), print_blob=True
)


@few
@given(st.data())
def test_random_programs(data):
    check(data)


@pytest.mark.nightly
@settings(few, max_examples=700)
@given(st.data())
def test_very_many_random_programs(data):
    check(data)
