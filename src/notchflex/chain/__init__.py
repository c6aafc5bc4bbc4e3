"""The chain: rigid bodies joined by flexures, as arrays, and how it moves."""

from notchflex.chain.chain import Chain, assemble, flexure_states
from notchflex.chain.pad import padded
from notchflex.chain.plane import bending_normal, tendons_in_plane
from notchflex.chain.structure import structural

__all__ = [
    "Chain",
    "assemble",
    "bending_normal",
    "flexure_states",
    "padded",
    "structural",
    "tendons_in_plane",
]
