"""Quantities that the programs report of a solved state, and their layout."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Array

from notchflex._quantity import REGISTERED
from notchflex.mechanics.chain import Chain
from notchflex.solver.derived.quantities import MAX_MOMENT_ERROR  # and registers all formulas
from notchflex.solver.derived.solved_state import SolvedState
from notchflex.solver.programs.pytree_layout import PytreeLayout
from notchflex.solver.solver_state import SolverState


def _reported(source: str) -> tuple[str, ...]:
    return tuple(name for name, one in REGISTERED.items() if one.source == source)


STATE = _reported("state")
"""Names of the quantities that a second program computes for a solved state."""


class Shape(namedtuple("Shape", _reported("solve"))):  # pyright: ignore[reportUntypedNamedTuple]
    """Quantities that the program of a solve reports, of one state or many (leading axis)."""

    __slots__ = ()

    @staticmethod
    def form(flexures: int, tendons: int) -> PytreeLayout:
        """Return its layout for a number of flexures and tendons."""
        sizes = {"tendon": tendons, "notch": flexures, "body": flexures + 1, "row": 3, "axis": 3}
        own = (REGISTERED[name] for name in Shape._fields)
        return PytreeLayout.of(
            Shape(*(np.zeros([sizes[axis] for axis in q.per], q.kind) for q in own))
        )


def shape(chain: Chain, solved: SolverState) -> Shape:
    """Compute the quantities that the program of a solve reports."""
    state = SolvedState(chain, solved)
    return Shape(*(state.quantity(name) for name in Shape._fields))


def quantities(chain: Chain, solved: SolverState) -> dict[str, Array]:
    """Compute all other reported quantities of a solved state, in the frame of the base."""
    state = SolvedState(chain, solved)
    return {name: state.quantity(name) for name in STATE}


def believable(value: Callable[[str], Any]) -> Any:
    """Return whether states lie within the range of friction law, modes and geometry.

    Args:
        value: Gives the values of a quantity by its name.
    """
    return (
        value("friction_holds")
        & (value("moment_error") < MAX_MOMENT_ERROR)
        & value("bend_possible")
    )


def unpad_quantity(chain: Chain, name: str, values: np.ndarray) -> np.ndarray:
    """Select the values of a chain from those of its padded chain with contacts at all edges.

    Args:
        chain: The chain.
        name: Name of the quantity.
        values: Values of the padded chain, with any leading axes.
    """
    per = REGISTERED[name].per
    if per[:1] in (("notch",), ("body",)):
        own = slice(chain.flexures + (per[0] == "body"))
        return values[(..., own, *(slice(None),) * (len(per) - 1))]
    if per[1:] not in (("span",), ("contact",)):
        return values
    contacts = np.asarray(chain.contacts)
    first = int(per[1] == "span")  # the proximal span comes before the first edge
    tendons = np.arange(len(contacts))[:, None]
    beyond = 0 if REGISTERED[name].kind is int else np.nan
    own_values = np.where(
        contacts[:, 1:] >= 0, values[..., tendons, contacts[:, :-1] + first], beyond
    )
    return np.concatenate([values[..., :first], own_values], axis=-1)
