"""A small compiler: programs that JAX has traced, as vector code for this processor."""

from notchflex.native.graph import UnknownHereError
from notchflex.native.items import WIDTH
from notchflex.native.machine import machine_code, processor
from notchflex.native.program import Program, Source, source

__all__ = [
    "WIDTH",
    "Program",
    "Source",
    "UnknownHereError",
    "machine_code",
    "processor",
    "source",
]
