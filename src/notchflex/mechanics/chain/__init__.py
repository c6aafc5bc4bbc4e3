"""The chain: rigid bodies joined by flexures, as arrays, and how it moves."""

from notchflex.mechanics.chain.arrays import Chain, flexure_states, padded, structural
from notchflex.mechanics.chain.assembly import (
    ChainTemplate,
    assemble,
    chain_template,
    laws,
)
from notchflex.mechanics.chain.flexures import flexure
from notchflex.mechanics.chain.mass import body_lengths
from notchflex.mechanics.chain.plane import bending_normal, tendons_in_plane
from notchflex.mechanics.chain.sites import sites_of, unchecked_dimensions

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
