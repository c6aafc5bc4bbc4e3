"""Input and result of a search for a target."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from notchflex import Failure, InputError
from notchflex.control.limits import Bound
from notchflex.control.program.drive_model import DriveModel, Response
from notchflex.support import check_integer, check_number


def size_of(vector: Float[np.ndarray, " k"]) -> float:
    """Return the Euclidean norm of a vector; of a short one faster than NumPy does."""
    return math.sqrt(float(vector @ vector))


@dataclass(frozen=True, kw_only=True)
class TargetSearch:
    """Tolerance and budget of a search for a target.

    Attributes:
        tolerance: Weighted error (mm, N, rad) at which the search ends.
        near: Distance from lengths of a target at which it counts as met, mm.
        near_angle: Angle from angles of a target at which it counts as met, rad.
        solves: Largest number of solves for one target.

    Raises:
        InputError: A number that is not positive.
    """

    tolerance: float = 1e-7
    near: float = 0.05
    near_angle: float = math.radians(0.2)
    solves: int = 80

    def __post_init__(self) -> None:
        """Check the numbers."""
        check_integer(self.solves, "the number of solves of a search")
        for name, value in vars(self).items():
            if not check_number(value, f"{name} of a search") > 0.0:
                raise InputError.OUT_OF_RANGE(
                    f"{name} of a search must be greater than 0; got {value!r}"
                )


class Problem(NamedTuple):
    """Problem of a search: one target, and its limits.

    Attributes:
        model: The robot.
        entries: Entries of a response that have a target.
        weights: What an error of one unit counts.
        driven: Which tendons are driven; the others keep what the load commands.
        low: Lowest drive of every tendon, N or mm.
        high: Highest drive.
        chosen: Whether each drive has a highest value, or one above which nothing is sought.
        bounds: Limits on other quantities.
        unit: Drive that about closes a notch, N or mm.
        by_tension: Whether drives are tensions; otherwise they are strokes.
        search: Tolerance and budget.
    """

    model: DriveModel
    entries: np.ndarray
    weights: np.ndarray
    driven: np.ndarray
    low: np.ndarray
    high: np.ndarray
    chosen: np.ndarray
    bounds: tuple[Bound, ...]
    unit: float
    by_tension: bool
    search: TargetSearch


class Attempt(NamedTuple):
    """Result of one search.

    Attributes:
        drive: Drives of all tendons, N or mm.
        response: The solved state there.
        error: Weighted distance from the target.
        excess: Largest violation of a limit, as a part of it; 0 where all are kept.
        solves: How many loads were solved.
        failure: Why the target is not met; None where it is.
    """

    drive: Float[np.ndarray, " t"]
    response: Response
    error: float
    excess: float
    solves: int
    failure: Failure | None

    @property
    def effort(self) -> float:
        """Size of the drives."""
        return size_of(self.drive)
