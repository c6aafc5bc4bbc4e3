"""The chain: rigid bodies joined by flexures, as arrays, and how it moves."""

from notchflex.mechanics.chain.arrays import Chain, flexure_states, padded, structural
from notchflex.mechanics.chain.assembly import (
    ChainTemplate,
    assemble,
    bending_normal,
    body_lengths,
    chain_template,
    flexure,
    laws,
    sites_of,
    tendons_in_plane,
    unchecked_dimensions,
)

__all__ = [
    "Chain",
    "ChainTemplate",
    "assemble",
    "bending_normal",
    "body_lengths",
    "chain_template",
    "flexure",
    "flexure_states",
    "laws",
    "padded",
    "sites_of",
    "structural",
    "tendons_in_plane",
    "unchecked_dimensions",
]
