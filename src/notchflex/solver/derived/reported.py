"""What the programs report of a solved state, and how it is packed."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Array

from notchflex._quantity import REGISTERED
from notchflex.mechanics.chain import Chain
from notchflex.solver.derived.quantities import MODES_FAIL  # and registers all formulas
from notchflex.solver.derived.solved_state import SolvedState
from notchflex.solver.programs.pytree_layout import PytreeLayout
from notchflex.solver.solver_state import SolverState


def _reported(source: str) -> tuple[str, ...]:
    return tuple(name for name, one in REGISTERED.items() if one.source == source)


STATE = _reported("state")
"""Names of what a second program finds of a solved state."""


class Shape(namedtuple("Shape", _reported("solve"))):  # pyright: ignore[reportUntypedNamedTuple]
    """What the program of a solve reports of a state, or of many along a leading axis."""

    __slots__ = ()

    @staticmethod
    def form(flexures: int, tendons: int) -> PytreeLayout:
        """Return how it is packed for a robot of so many flexures and tendons."""
        sizes = {"tendon": tendons, "notch": flexures, "body": flexures + 1, "row": 3, "axis": 3}
        own = (REGISTERED[name] for name in Shape._fields)
        return PytreeLayout.of(
            Shape(*(np.zeros([sizes[axis] for axis in q.per], q.kind) for q in own))
        )


def shape(chain: Chain, solved: SolverState) -> Shape:
    """Return what the program of a solve reports of a solved state."""
    state = SolvedState(chain, solved)
    return Shape(*(state.quantity(name) for name in Shape._fields))


def quantities(chain: Chain, solved: SolverState) -> dict[str, Array]:
    """Everything else that is reported of a solved state, in the frame of the base."""
    state = SolvedState(chain, solved)
    return {name: state.quantity(name) for name in STATE}


def believable(value: Callable[[str], Any]) -> Any:
    """Return whether states lie within what friction law, modes and geometry are for.

    Args:
        value: Gives the values of a quantity by its name.
    """
    return value("friction_holds") & (value("moment_error") < MODES_FAIL) & value("bend_possible")


def unpad_quantity(chain: Chain, name: str, values: np.ndarray) -> np.ndarray:
    """Return a quantity of a chain whose contacts are all edges of all gaps as that of its own.

    Args:
        chain: The own chain.
        name: Name of the quantity.
        values: Its values with any leading axes, of a chain that may have more flexures.
    """
    per = REGISTERED[name].per
    if per[:1] in (("notch",), ("body",)):
        own = slice(chain.flexures + (per[0] == "body"))
        return values[(..., own, *(slice(None),) * (len(per) - 1))]
    if per[1:] not in (("span",), ("contact",)):
        return values
    met = np.asarray(chain.contacts)
    first = int(per[1] == "span")  # the proximal span comes before the first edge
    tendons = np.arange(len(met))[:, None]
    beyond = 0 if REGISTERED[name].kind is int else np.nan
    found = np.where(met[:, 1:] >= 0, values[..., tendons, met[:, :-1] + first], beyond)
    return np.concatenate([values[..., :first], found], axis=-1)
