"""LLVM: from the text of a program to machine code, and from machine code to something to call."""

from __future__ import annotations

import ctypes
import os
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from functools import cache
from typing import Any

import llvmlite.binding as llvm

# A program is a few long parts without loops, of which LLVM's passes for code as people write it
# take several times as long as all else; it is in a good order already. What is turned off, and
# what says so; put back after, as others may use the same LLVM.
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
_KNOWN_TO = range(18, 23)
_Called = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64)
_lock = threading.Lock()

LEVEL = "NOTCHFLEX_OPTIMISATION"
"""Environment variable: how hard LLVM tries, 0 to 3. Programs that run a few times want 0."""


@cache
def _begun() -> None:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()


def _machine() -> Any:
    """What makes machine code; an engine takes its own with it when it ends."""
    _begun()
    target = llvm.Target.from_default_triple()
    features = llvm.get_host_cpu_features().flatten()
    return target.create_target_machine(
        cpu=llvm.get_host_cpu_name(), features=features, opt=_level(), jit=True
    )


def _level() -> int:
    told = os.environ.get(LEVEL, "")
    return int(told) if told in ("0", "1", "2", "3") else 2


def processor() -> str:
    """What machine code is made for, and by which LLVM."""
    features = llvm.get_host_cpu_features().flatten()
    return f"{llvm.llvm_version_info} {llvm.get_host_cpu_name()} {features} {_level()}"


@contextmanager
def _plain_passes() -> Generator[None]:
    known = llvm.llvm_version_info[0] in _KNOWN_TO
    for option, (ours, _) in _OPTIONS.items() if known else ():
        llvm.set_option("notchflex", f"{option}={ours}")
    try:
        yield
    finally:
        for option, (_, theirs) in _OPTIONS.items() if known else ():
            llvm.set_option("notchflex", f"{option}={theirs}")


def machine_code(text: str) -> bytes:
    """Machine code of a program.

    Args:
        text: The program, in LLVM's language.
    """
    with _lock, _plain_passes():
        machine = _machine()
        head = f'target triple = "{machine.triple}"\n'
        head += f'target datalayout = "{machine.target_data}"\n'
        code = machine.emit_object(llvm.parse_assembly(head + text))
    _return_memory()
    return code


def _return_memory() -> None:
    """Give back what LLVM has left free: of some 40 MB, glibc returns nothing by itself."""
    if sys.platform == "linux":
        with suppress(AttributeError):  # other libraries of C have no such function
            ctypes.CDLL(None).malloc_trim(0)


def loaded(code: bytes) -> Callable[[bytes, bytes, int, int], None]:
    """The program of some machine code.

    Args:
        code: What `machine_code` returned, on the same kind of processor.

    Returns:
        A function of addresses given, addresses of results, the address of memory, and the number
        of rows.
    """
    with _lock:
        machine = _machine()
        engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
        engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        engine.finalize_object()
        function = _Called(engine.get_function_address("program"))
    # The code lives as long as its engine.
    function.engine = engine  # pyright: ignore[reportAttributeAccessIssue]
    return function


__all__ = ["loaded", "machine_code", "processor"]
