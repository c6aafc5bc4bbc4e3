"""The chain: rigid bodies joined by flexures, as arrays, and how it moves."""

from notchflex.chain.chain import Chain, Shaped, assemble, flexure_states, laws, shape_of
from notchflex.chain.pad import padded
from notchflex.chain.plane import bending_normal, tendons_in_plane
from notchflex.chain.structure import structural

__all__ = [
    "Chain",
    "Shaped",
    "assemble",
    "bending_normal",
    "flexure_states",
    "laws",
    "padded",
    "shape_of",
    "structural",
    "tendons_in_plane",
]
