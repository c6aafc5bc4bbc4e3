"""Standard deviations of measured numbers: given, from repeats, or from residuals of the fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from notchflex.fit.measurements.measurements import OBSERVED
from notchflex.fit.measurements.repeats import repeats
from notchflex.fit.model.residuals import Residuals
from notchflex.fit.model.samples import Samples

# Standard deviations to begin with if nothing is known: 1 deg, 0.1 mm, 0.01 N.
_FIRST: dict[str, float] = {"tip_tension": 0.01, "tip_position": 0.1, "axis_points": 0.1}
_FIRST_ANGLE = float(np.radians(1.0))
# Nothing is measured better than this part of that; else an exact fit would have no noise at all.
_MIN_NOISE = 1e-9


@dataclass(frozen=True)
class Noise:
    """Standard deviations of all measured numbers.

    Attributes:
        deviation: Standard deviation of every number (rad, mm, N), (R,).
        estimated: Whether it is estimated from the residuals of the fit, (R,).
        source: By number of the measurements and quantity: "given", "repeats", "fit", or "sum of
            the notches" of a total angle that adds nothing to the notches; its deviation is
            infinite.
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
        """Whether none of them is estimated from the residuals."""
        return not bool(self.estimated.any())


def first_noise(samples: Samples, residuals: Residuals) -> Noise:
    """Return standard deviations as given, or of repeats; a first guess if there are neither."""
    deviation = residuals.given.copy()
    estimated = np.zeros(len(deviation), bool)
    source: dict[tuple[int, str], str] = {}
    for number, sample in enumerate(samples.every):
        of_repeats = repeats(sample.measured)
        for name in sample.measured.observed:
            mine = residuals.of(number, name)
            missing = mine & ~(deviation > 0.0)
            key = (number, name)
            if sample.measured.is_sum(name):
                deviation[mine] = np.inf
                source[key] = "sum of the notches"
            elif not missing.any():
                source[key] = "given"
            elif 0.0 < of_repeats[name] < np.inf:
                deviation[missing] = of_repeats[name]
                source[key] = "repeats"
            else:
                deviation[missing] = _FIRST.get(name, _FIRST_ANGLE)
                estimated |= missing
                source[key] = "fit"
    return Noise(deviation, estimated, source)


def noise_left(noise: Noise, residuals: Residuals, constants: int) -> Noise:
    """Return the noise with the unknown standard deviations estimated from the residuals.

    By quantity: root mean squares over the degrees of freedom that the constants leave.
    """
    deviation = noise.deviation.copy()
    counted = max(noise.counted, 1)
    share = max(1.0 - constants / counted, 1.0 / counted)
    for quantity in np.unique(residuals.quantity[noise.estimated]):
        mine = noise.estimated & (residuals.quantity == quantity)
        least = _MIN_NOISE * _FIRST.get(OBSERVED[quantity], _FIRST_ANGLE)
        deviation[mine] = max(np.sqrt(np.mean(residuals.values[mine] ** 2) / share), least)
    return Noise(deviation, noise.estimated, noise.source)
