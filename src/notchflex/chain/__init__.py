"""The chain: rigid bodies joined by flexures, as arrays, and how it moves."""

from notchflex.chain.chain import Chain, assemble, flexure_states, prepared

__all__ = ["Chain", "assemble", "flexure_states", "prepared"]
