"""Padding of a chain with inert flexures, so that different robots share one program."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from jaxtyping import Array

from notchflex._jax import constant, jax
from notchflex.mechanics.chain.arrays import Chain
from notchflex.mechanics.flexure import Rod

_ROTATIONS = ("start_rotation", "curve_rotation", "end_rotation", "node_rotation")
_NOTHING = (
    "start_offset",
    "curve_offset",
    "end_offset",
    "node_offset",
    "reference_strain",
    "basis",
    "turn",
    "turn_pair",
    "step",
    "node_turn",
    "has_closure",
    "chord",
)


def padded(chain: Chain, flexures: int, edges: int) -> Chain:
    """Pad a chain with flexures beyond its tip, and with entries for contact edges.

    The added flexures are stiff, straight, of zero length and without tendons: the last body's
    frame is then the tip, and no other number of the robot changes.

    Args:
        chain: The chain, as plain arrays.
        flexures: Number of flexures of the result, at least that of the chain.
        edges: Number of entries for the contact edges of a tendon.
    """
    more = flexures - chain.flexures
    contacts = np.pad(
        chain.contacts, ((0, 0), (0, edges - chain.contacts.shape[1])), constant_values=-1
    )
    if more == 0:
        return dataclasses.replace(chain, contacts=contacts)

    def longer(leaf: Any) -> Array:
        return np.concatenate([leaf, np.repeat(leaf[-1:], more, axis=0)])  # pyright: ignore

    def changed(part: Any, **values: Any) -> Any:
        """Return a part whose added entries have other values."""
        wider = jax.tree.map(longer, part)
        own = {name: getattr(wider, name).copy() for name in values}
        for name, value in values.items():
            own[name][-more:] = value
        return dataclasses.replace(wider, **own)

    def with_nothing(values: Any) -> Array:
        return constant(np.pad(values, [(0, more)] + [(0, 0)] * (np.ndim(values) - 1)))

    return dataclasses.replace(
        chain,
        rods=_rods(chain, changed),
        groups=tuple(
            changed(group, present=0.0, visits=0.0, ends=0.0, back=1, body_length=0.0)
            for group in chain.groups
        ),
        contact_pairs=tuple(
            changed(group, has_contact=0.0, back=1) for group in chain.contact_pairs
        ),
        body_length=with_nothing(chain.body_length),
        body_mass=with_nothing(chain.body_mass),
        body_centre=with_nothing(chain.body_centre),
        stiffness=np.concatenate([chain.stiffness, np.ones((more, chain.stiffness.shape[1]))]),
        elastic=None if chain.elastic is None else _elastic(chain.elastic, more),
        contact_stiffness=longer(chain.contact_stiffness),
        contact_flexibility=jax.tree.map(longer, chain.contact_flexibility),
        notch_frame=longer(chain.notch_frame),
        contacts=contacts,
    )


def _rods(chain: Chain, changed: Any) -> Rod:
    rods = chain.rods
    values = {name: 0.0 for name in _NOTHING if getattr(rods, name) is not None}
    values |= {name: np.eye(getattr(rods, name).shape[-1]) for name in _ROTATIONS}
    wider: Rod = changed(rods, padding_mask=1.0, **values)
    # The first added flexure begins at the tip, at the end of the last body.
    wider.start_offset[chain.flexures, -1] = chain.body_length[-1]  # pyright: ignore
    return wider


def _elastic(elastic: Any, more: int) -> Array:
    idle = np.broadcast_to(np.eye(elastic.shape[-1]), (more, *elastic.shape[1:]))
    return np.concatenate([elastic, idle])  # pyright: ignore


__all__ = ["padded"]
