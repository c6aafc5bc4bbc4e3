"""Compile functions that JAX has traced to vector code for this processor, by LLVM.

The README of this package describes how it works.
"""

from lanewise.ir.control_flow import WIDTH
from lanewise.ir.graph import UnsupportedPrimitiveError
from lanewise.machine import machine_code, target
from lanewise.program import FixedVector, LoweredProgram, Program, lower

__all__ = [
    "WIDTH",
    "FixedVector",
    "LoweredProgram",
    "Program",
    "UnsupportedPrimitiveError",
    "lower",
    "machine_code",
    "target",
]
