"""Limits on drives and robot that a search for a target keeps to."""

from __future__ import annotations

from typing import Annotated, Any, Literal, get_args

import numpy as np
from jaxtyping import Float
from pydantic import Field, model_validator

from notchflex import InputError, Robot
from notchflex.specification import coded, record
from notchflex.support import Float as Number
from notchflex.support import check_number, short_repr

Drive = Literal["tension", "stroke"]


@record(refuse=coded)
class Limits:
    """Limits on drives and robot.

    Args:
        tension: Lowest and highest tension at the base of a tendon, N; each a number or one entry
            per tendon, None for no limit. The lowest is the pretension of antagonists; a tendon
            never pushes, so that it is 0 or more.
        stroke: Lowest and highest length drawn out of a tendon, mm; in the same form.
        rate: Largest change of a drive from target to target, N or mm.
        strain: Largest peak strain of a notch.
        gap: Smallest gap that is left of the opening of a notch, mm; 0 lets none be pressed
            together.

    Raises:
        InputError: A limit that is not a number, or a lowest above the highest.

    Example:
        >>> Limits(tension=(0.05, 2.0), strain=0.06).tension
        (0.05, 2.0)
    """

    tension: tuple[Any, Any] = (0.0, None)
    stroke: tuple[Any, Any] = (None, None)
    rate: Annotated[Number | None, Field(gt=0.0)] = None
    strain: Annotated[Number | None, Field(gt=0.0)] = None
    gap: Annotated[Number | None, Field(ge=0.0)] = None

    @model_validator(mode="after")
    def _in_order(self) -> Limits:
        for name in get_args(Drive):
            given = getattr(self, name)
            low, high = self.bounds(name, max(map(np.size, given)))
            if not (low <= high).all():
                raise InputError.OUT_OF_RANGE(
                    f"the lowest {name} is above the highest, or one is NaN: {short_repr(given)}; "
                    "give the lowest first, None for no limit"
                )
            if name == "tension" and (low < 0.0).any():
                raise InputError.OUT_OF_RANGE(
                    f"the lowest tension is {low.min():g} N; a tendon only pulls, so give 0 N or "
                    "more"
                )
        return self

    def bounds(
        self, drive: Drive, tendons: int
    ) -> tuple[Float[np.ndarray, " t"], Float[np.ndarray, " t"]]:
        """Return the lowest and highest value of every tendon, N or mm.

        Args:
            drive: "tension" or "stroke".
            tendons: Number of tendons of the robot.
        """
        least, ends = 0.0 if drive == "tension" else -np.inf, list[np.ndarray]()
        for side, none in zip(getattr(self, drive), (least, np.inf), strict=True):
            entries = list(side) if np.ndim(side) else [side]
            if len(entries) not in (1, tendons):
                raise InputError.WRONG_SHAPE(
                    f"the limits of {drive} have {len(entries)} entries for {tendons} tendons; "
                    "give one number, or one per tendon"
                )
            what = f"a limit of {drive}"
            numbers = [none if entry is None else check_number(entry, what) for entry in entries]
            ends.append(np.broadcast_to(numbers, (tendons,)).astype(float))
        return ends[0], ends[1]


def limits_of_robot(
    limits: Limits, drive: Drive, robot: Robot
) -> list[tuple[str, float, Float[np.ndarray, " m"]]]:
    """Return limits beside those of the drives: quantity, 1 if the highest or -1, and values.

    Raises:
        InputError: A strain is limited that is not known.
    """
    other: Drive = "stroke" if drive == "tension" else "tension"
    low, high = limits.bounds(other, robot.number_of_tendons)
    unknown = [number for number, notch in enumerate(robot.notches, 1) if not notch.is_cut]
    if limits.strain is not None and unknown:
        raise InputError.UNSUPPORTED(
            f"the strain of notch {unknown[0]} is not known, so that no limit on it can be kept; "
            "leave the limit of strain out"
        )
    strain = np.inf if limits.strain is None else limits.strain
    gap = -np.inf if limits.gap is None else limits.gap
    if other == "tension":
        low = np.where(low > 0.0, low, -np.inf)  # a tendon pulls with 0 N or more by itself
    rows = [
        (other, 1.0, high),
        (other, -1.0, low),
        ("peak_strain", 1.0, np.full(robot.number_of_notches, strain)),
        ("gap", -1.0, np.array([gap if notch.has_lips else -np.inf for notch in robot.notches])),
    ]
    return [row for row in rows if np.isfinite(row[2]).any()]
