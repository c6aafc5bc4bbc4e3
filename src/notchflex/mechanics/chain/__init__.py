"""The chain: rigid bodies joined by flexures, as arrays, and how it moves."""

from notchflex.mechanics.chain.arrays import Chain, flexure_states
from notchflex.mechanics.chain.assembly import Shaped, assemble, averages, laws, shape_of
from notchflex.mechanics.chain.flexures import FlexureOf, flexure
from notchflex.mechanics.chain.pad import padded
from notchflex.mechanics.chain.plane import bending_normal, tendons_in_plane
from notchflex.mechanics.chain.sites import sites_of, unchecked_dimensions
from notchflex.mechanics.chain.structure import structural

__all__ = [
    "Chain",
    "FlexureOf",
    "Shaped",
    "assemble",
    "averages",
    "bending_normal",
    "flexure",
    "flexure_states",
    "laws",
    "padded",
    "shape_of",
    "sites_of",
    "structural",
    "tendons_in_plane",
    "unchecked_dimensions",
]
