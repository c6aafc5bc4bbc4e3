"""Write the effect of tolerances on a prediction as a few lines of text."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Collection, Iterable
from typing import TYPE_CHECKING

from notchflex.cli import terminal
from notchflex.results.quantities.registry import DEGREES
from notchflex.robot.value_names import described_at

if TYPE_CHECKING:
    from notchflex.analysis.uncertainty.bands import Band, Bands
    from notchflex.analysis.uncertainty.closing_bands import ClosingBands
    from notchflex.robot import Robot
    from notchflex.robot.tolerance import Tolerance


def closing_lines(robot: Robot, bands: ClosingBands) -> list[str]:
    """Return what `show` says: closing, a typical load, 10 µm of depth, and what was assumed."""
    first, last = int(bands.tension.median.argmin()), int(bands.tension.median.argmax())
    words = [_closing(bands, one) for one in dict.fromkeys((first, last))]
    pulled = f" of tendon {bands.tendon}" if robot.number_of_tendons > 1 else ""
    text = (
        f"Accuracy: of {bands.bands.draws} draws within the tolerances, 5 to 95 % give: "
        f"{'; '.join(words)}; total angle at {bands.load:.3g} N{pulled}: "
        f"{_range(bands.total_angle, '.1f', DEGREES)} deg."
    )
    if math.isfinite(bands.by_depth):
        change = abs(bands.by_depth) * DEGREES
        text += f" 10 µm of depth in all notches change that angle by {change:.2g} deg."
    return [*_wrapped(text), *tolerance_lines(bands.bands)]


def tolerance_lines(bands: Bands) -> list[str]:
    """Return the tolerances that bands were made with, and which of them were assumed."""
    return tolerance_words(bands.path.robot, bands.tolerances, bands.assumed)


def tolerance_words(
    robot: Robot, tolerances: Iterable[Tolerance], names: Collection[str]
) -> list[str]:
    """Return tolerances in lines of text.

    Args:
        robot: The robot.
        tolerances: Its tolerances.
        names: Of the values whose tolerance is assumed.
    """
    tolerances = list(tolerances)
    given = [_words(robot, one) for one in tolerances if one.value not in names]
    assumed = [_words(robot, one) for one in tolerances if one.value in names]
    lines = _wrapped(f"Tolerances: {', '.join(given)}.") if given else []
    if assumed:
        text = f"Tolerances assumed: {', '.join(assumed)}. A [tolerance] table in the robot file"
        lines += _wrapped(f"{text} replaces them.")
    return lines


def _closing(bands: ClosingBands, step: int) -> str:
    tensions = _range(bands.tension, ".3g", step=step)
    angles = _range(bands.angle, ".1f", DEGREES, step)
    return f"notch {bands.notches[step]} closes at {tensions} N and {angles} deg"


def _range(band: Band, form: str, scale: float = 1.0, step: int | None = None) -> str:
    ends = [band.low, band.high] if step is None else [band.low[step], band.high[step]]
    low, high = (float(end) * scale for end in ends)
    if math.isinf(high):
        return f"{low:{form}} or more" if math.isfinite(low) else "no"
    return f"{low:{form}} to {high:{form}}"


def _words(robot: Robot, one: Tolerance) -> str:
    """Return a tolerance in words, such as "notch.depth 0.01 mm"."""
    unit = described_at(robot, one.value).unit

    def size(value: object) -> str:
        return value if isinstance(value, str) else f"{value:g} {unit}".strip()

    if one.sd is not None:
        words = f"{one.value} {size(one.sd)} (SD)"
    elif one.plus == one.minus:
        words = f"{one.value} ±{size(one.plus)}"
    else:
        words = f"{one.value} +{size(one.plus)} −{size(one.minus)}"
    return f"{words} each" if one.per_notch else words


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(text, width=terminal.NARROW - 1)
