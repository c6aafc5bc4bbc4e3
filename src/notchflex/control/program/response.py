"""Values and slopes of a solved load by the drives, and the input of a search for a target."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float


class Response(NamedTuple):
    """A solved load, and how what was asked of it changes with the drives.

    Attributes:
        state: The state, packed for the padded chain.
        values: Quantities that were asked, one after the other, flattened, (m,).
        jacobian: Their change per unit of every drive (N or mm), (m, t). NaN where the load was
            so hard that its derivatives are not known.
        converged: Whether the load has an equilibrium within what the model is for.
        whole: Whether it was solved in one substep.
        sliding: The Jacobian, of tendons that stick as they last slid, (m, t).
    """

    state: Float[np.ndarray, " state"]
    values: Float[np.ndarray, " m"]
    jacobian: Float[np.ndarray, "m t"]
    converged: bool
    whole: bool
    sliding: Float[np.ndarray, "m t"]


class DriveAim(NamedTuple):
    """A target of drives, and their limits; m target values, t tendons.

    Attributes:
        entries: Entries of a response that have a target, (m,).
        goal: What they are to become, (m,).
        weights: What an error of each counts, (m,).
        low: Lowest drives, (t,).
        high: Highest drives, (t,).
        driven: Which tendons are driven, (t,).
        tolerance: Weighted error at which the target is met.
        unit: Drive that about closes a notch, N or mm.
        solves: How many loads may be solved.
    """

    entries: np.ndarray
    goal: np.ndarray
    weights: np.ndarray
    low: np.ndarray
    high: np.ndarray
    driven: np.ndarray
    tolerance: float
    unit: float
    solves: int
