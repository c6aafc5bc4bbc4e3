"""A constant that a fit may change, with its limits and what is known of it before."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from notchflex.errors import InputError


@dataclass(frozen=True)
class Constant:
    """A constant to be fitted.

    Args:
        name: A value of the robot file (`material.elastic_modulus`, `notch[2].depth`), shared by
            all robots of the fit; with a label before it (`A:friction.coefficient`) of one robot;
            with `each:` one for every robot; with `notch[each].` one for every notch. One constant
            for unlike values: `offset:notch.depth` is added to each of them, `factor:notch.height`
            multiplies each of them, and `notch.precurvature_deg/height` is their ratio to another
            value of the same part. Of the measurement: `sensor.force_offset` (what the gauge shows
            at no force, N), `sensor.force_factor` (the tension that acts is this times the reading
            less the offset) and `sensor.stroke_slack` (stroke that only takes up slack, mm).
        lower: Least value allowed, in the unit of the robot file; by default that of the robot.
        upper: Greatest value allowed, likewise.
        prior: Mean and standard deviation of prior knowledge.

    Raises:
        InputError: The limits are in the wrong order, or the prior has no width.

    Example:
        >>> Constant("friction.coefficient", lower=0.0, upper=0.5).upper
        0.5
    """

    name: str
    lower: float | None = None
    upper: float | None = None
    prior: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        """Check the numbers."""
        if not isinstance(self.name, str) or not self.name.strip():  # pyright: ignore
            raise InputError.WRONG_TYPE(f"a constant needs the name of a value; got {self.name!r}")
        for limit in (self.lower, self.upper):
            if limit is not None and not _is_finite(limit):
                raise InputError.NOT_FINITE(f"`{self.name}`: limits must be finite; got {limit}")
        if None not in (self.lower, self.upper) and not self.lower < self.upper:  # pyright: ignore
            raise InputError.OUT_OF_RANGE(
                f"`{self.name}`: the lower limit must be below the upper one; got {self.lower:g} "
                f"and {self.upper:g}"
            )
        if self.prior is not None:
            pair = np.atleast_1d(np.asarray(self.prior, object))
            if len(pair) != 2 or not all(map(_is_finite, pair)) or not pair[1] > 0.0:
                raise InputError.OUT_OF_RANGE(
                    f"`{self.name}`: a prior is a mean and a standard deviation above 0; "
                    f"got {' and '.join(map(str, pair))}"
                )


def _is_finite(value: object) -> bool:
    return isinstance(value, int | float | np.number) and math.isfinite(value)
