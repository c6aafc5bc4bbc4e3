"""A small compiler: programs that JAX has traced, as vector code for this processor."""

from lanewise.ir.control_flow import WIDTH
from lanewise.ir.graph import UnknownHereError
from lanewise.machine import processor
from lanewise.program import Program, program

__all__ = ["WIDTH", "Program", "UnknownHereError", "processor", "program"]
