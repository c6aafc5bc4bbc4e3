"""A small compiler: programs that JAX has traced, as vector code for this processor."""

from lanewise.ir.control_flow import WIDTH
from lanewise.ir.graph import UnknownHereError
from lanewise.machine import machine_code, processor
from lanewise.program import Program, Source, source

__all__ = [
    "WIDTH",
    "Program",
    "Source",
    "UnknownHereError",
    "machine_code",
    "processor",
    "source",
]
