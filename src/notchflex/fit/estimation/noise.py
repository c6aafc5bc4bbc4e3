"""How far each measured number may be off: given, told by repeats, or by what the fit leaves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from notchflex.fit.measurements.measurements import OBSERVED, Measurements
from notchflex.fit.measurements.repeats import repeats
from notchflex.fit.model.residuals import Residuals
from notchflex.fit.model.samples import Samples

# Standard deviations to begin with where nothing is known: 1 deg, 0.1 mm, 0.01 N.
_FIRST: dict[str, float] = {"tip_tension": 0.01, "tip_position": 0.1, "axis_points": 0.1}
_FIRST_ANGLE = float(np.radians(1.0))
# Nothing is measured better than this part of that; else an exact fit would have no noise at all.
_LEAST = 1e-9
# Rounding of a sum of angles (rad); angles are not measured to that.
_ADDED_UP = 1e-4


@dataclass(frozen=True)
class Noise:
    """Standard deviations of all measured numbers.

    Attributes:
        deviation: Of every number (rad, mm, N), (R,).
        estimated: Which of them the fit itself has told.
        source: By number of the measurement and quantity: "given", "repeats", "fit", or "sum of
            the notches" of a total angle that tells nothing that the notches do not; its deviation
            is infinite.
    """

    deviation: Float[np.ndarray, " r"]
    estimated: Bool[np.ndarray, " r"]
    source: dict[tuple[int, str], str]

    @property
    def counted(self) -> int:
        """How many of the numbers count."""
        return int(np.isfinite(self.deviation).sum())

    @property
    def is_known(self) -> bool:
        """Whether the fit had to tell none of them."""
        return not bool(self.estimated.any())


def first_noise(samples: Samples, residuals: Residuals) -> Noise:
    """Standard deviations as given, or else of repeats; a first guess where there are neither."""
    deviation = residuals.given.copy()
    estimated = np.zeros(len(deviation), bool)
    source: dict[tuple[int, str], str] = {}
    for number, sample in enumerate(samples.every):
        told = repeats(sample.measured)
        for name in sample.measured.observed:
            own = (residuals.sample == number) & (residuals.quantity == OBSERVED.index(name))
            missing = own & ~(deviation > 0.0)
            key = (number, name)
            if name == "total_angle" and _is_sum(sample.measured):
                deviation[own] = np.inf
                source[key] = "sum of the notches"
            elif not missing.any():
                source[key] = "given"
            elif np.isfinite(told.get(name, np.nan)) and told[name] > 0.0:
                deviation[missing] = told[name]
                source[key] = "repeats"
            else:
                deviation[missing] = _FIRST.get(name, _FIRST_ANGLE)
                estimated |= missing
                source[key] = "fit"
    return Noise(deviation, estimated, source)


def _is_sum(measured: Measurements) -> bool:
    """Whether the total angle was not measured, but added up from the notches."""
    notches = measured.observed.get("notch_angle")
    if notches is None:
        return False
    total = measured.observed["total_angle"]
    return bool(np.allclose(notches.sum(axis=1), total, rtol=0.0, atol=_ADDED_UP))


def noise_left(noise: Noise, residuals: Residuals, constants: int) -> Noise:
    """The same, with what the fit leaves for quantities whose noise is not known.

    Their mean squares, over the degrees of freedom that the fit has left them.
    """
    deviation = noise.deviation.copy()
    counted = max(noise.counted, 1)
    share = max(1.0 - constants / counted, 1.0 / counted)
    for quantity in np.unique(residuals.quantity[noise.estimated]):
        own = noise.estimated & (residuals.quantity == quantity)
        least = _LEAST * _FIRST.get(OBSERVED[quantity], _FIRST_ANGLE)
        deviation[own] = max(np.sqrt(np.mean(residuals.values[own] ** 2) / share), least)
    return Noise(deviation, noise.estimated, noise.source)


__all__ = ["Noise", "first_noise", "noise_left"]
