"""Compile LLVM IR to machine code, and load machine code."""

from __future__ import annotations

import ctypes
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from functools import cache
from typing import Any

import llvmlite.binding as llvm

# A program is a few long functions without loops, in a good order already. LLVM's passes for code
# as people write it would take several times as long as all others. LLVM has no other switch for
# these than options of the whole process (see the README); they are set during a compilation only.
_OPTIONS = {
    "-disable-lsr": ("true", "false"),
    "-disable-machine-cse": ("true", "false"),
    "-disable-machine-licm": ("true", "false"),
    "-disable-machine-sink": ("true", "false"),
    "-enable-misched": ("false", "true"),
    "-pre-RA-sched": ("source", "default"),
    "-combiner-global-alias-analysis": ("false", "true"),
    "-combiner-store-merging": ("false", "true"),
}
# LLVM ends the process at an option that it does not know.
_KNOWN_VERSIONS = range(18, 23)
_Function = ctypes.CFUNCTYPE(
    None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64
)
_lock = threading.Lock()


@cache
def _initialize() -> None:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()


def _target_machine(level: int) -> Any:
    """Return a new target machine; an engine ends its own with itself."""
    _initialize()
    features = llvm.get_host_cpu_features().flatten()
    return llvm.Target.from_default_triple().create_target_machine(
        cpu=llvm.get_host_cpu_name(), features=features, opt=level, jit=True
    )


def target() -> str:
    """Return what machine code is compiled for: version of LLVM, processor and its features."""
    version = ".".join(map(str, llvm.llvm_version_info))
    return f"{version} {llvm.get_host_cpu_name()} {llvm.get_host_cpu_features().flatten()}"


@contextmanager
def _without_slow_passes(level: int) -> Generator[None]:
    known = level > 0 and llvm.llvm_version_info[0] in _KNOWN_VERSIONS
    options = _OPTIONS if known else {}
    for option, (ours, _) in options.items():
        llvm.set_option("lanewise", f"{option}={ours}")
    try:
        yield
    finally:
        for option, (_, default) in options.items():
            llvm.set_option("lanewise", f"{option}={default}")


def machine_code(text: str, level: int = 2) -> bytes:
    """Return the machine code of a program.

    Args:
        text: The program, in LLVM IR.
        level: How hard LLVM optimises, 0 to 3.
    """
    with _lock, _without_slow_passes(level):
        machine = _target_machine(level)
        head = f'target triple = "{machine.triple}"\n'
        head += f'target datalayout = "{machine.target_data}"\n'
        code = machine.emit_object(llvm.parse_assembly(head + text))
    # LLVM leaves some 40 MB free, of which glibc returns nothing by itself.
    if sys.platform == "linux":
        with suppress(AttributeError):  # other C libraries have no such function
            ctypes.CDLL(None).malloc_trim(0)
    return code


def load(code: bytes) -> Callable[[bytes, bytes, int, int], None]:
    """Load machine code.

    Args:
        code: What `machine_code` returned, on the same kind of processor.

    Returns:
        A function of arrays of pointers to arguments and to results, the address of working memory
        and the number of rows.
    """
    with _lock:
        engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _target_machine(0))
        engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        engine.finalize_object()
        function = _Function(engine.get_function_address("program"))
    # The code lives as long as its engine.
    function.engine = engine  # pyright: ignore[reportAttributeAccessIssue]
    return function
