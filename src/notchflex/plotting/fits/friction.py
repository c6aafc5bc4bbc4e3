"""The picture of the friction rig: the readings over turn and load, with the estimate."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from notchflex._quantity import DEGREES
from notchflex.plotting.output import Picture
from notchflex.plotting.sheet import BESIDE, Cell, Item, Level, Line, Panel, Stripe
from notchflex.plotting.style import BLUE, GREY, ORANGE, VERMILLION

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from notchflex.fit import FrictionRig

_READING = "#333333"


def friction_figure(rig: FrictionRig) -> Figure:
    """Draw the friction rig with matplotlib; for what it shows see `friction_picture`.

    Args:
        rig: The estimate.

    Returns:
        The figure; `notchflex.plotting.save` writes it.
    """
    return friction_picture(rig).figure()


def friction_picture(rig: FrictionRig) -> Picture:
    """Describe the coefficients of all readings of the friction rig.

    Left over the turn, right over the load: readings with their standard deviations where known,
    outliers marked, the estimate with its 95 % interval and the spread of the readings as bands,
    and the line of the other model where a constant is not enough.

    Args:
        rig: The estimate.

    Returns:
        The picture; its `save` writes it as PNG, SVG, PDF or HTML.

    Example:
        >>> import notchflex as nf
        >>> readings = nf.FrictionReadings([200.0, 300.0], [150.0, 221.0], [1.6, 1.6], [1.6, 1.6])
        >>> left, right = friction_picture(nf.friction_rig(readings)).cells
        >>> right.panel.x_label
        'weight 1 [g]'
    """
    readings, test = rig.readings, rig.constancy
    turn, load = readings.turn * DEGREES, readings.weight_1
    over_turn, over_load = _items(rig, turn), _items(rig, load)
    if test.enough is False:
        over_turn += _other_model(rig, turn, test.by_turn / DEGREES)
        over_load += _other_model(rig, load, test.by_load, logarithmic=True)
    label = r"coefficient of friction $\mu$ [-]"
    left = Panel(over_turn, "turn over both edges [deg]", label, shared_y=True)
    right = Panel(over_load, "weight 1 [g]", label, legend=BESIDE, shared_y=True)
    cells = [Cell(left, (0, 1), (0, 1)), Cell(right, (0, 1), (1, 2))]
    return Picture(f"Coefficient of friction, {readings.source}", 9.6, 3.6, cells)


def _items(rig: FrictionRig, x: NDArray[np.float64]) -> list[Item]:
    """The estimate and the readings, over what changed from reading to reading."""
    readings = rig.readings
    low, high = rig.interval
    items: list[Item] = []
    if np.isfinite(rig.spread):
        ends = rig.coefficient - rig.spread, rig.coefficient + rig.spread
        items.append(Stripe(*ends, GREY, 0.15, name="spread of readings"))
    if np.isfinite(low):
        items.append(Stripe(low, high, BLUE, 0.3, name="95 % interval"))
    name = rf"$\mu$ = {rig.coefficient:.4g}"
    items.append(Level(rig.coefficient, BLUE, width=1.4, name=name, group="estimate"))
    points = np.stack([x, readings.coefficient], axis=1)
    deviation = readings.coefficient_deviation
    half = deviation if np.isfinite(deviation).any() else None
    dots: dict[str, Any] = {"dash": None, "marker": "o", "told": True, "half": half}
    items.append(Line(points, _READING, name="reading", group="reading", **dots))
    if rig.outliers:
        off = points[list(rig.outliers)]
        mark: dict[str, Any] = {"dash": None, "marker": "o", "size": 8.0, "hollow": True}
        items.append(Line(off, VERMILLION, name="outlier", group="outlier", layer=3, **mark))
    return items


def _other_model(
    rig: FrictionRig, x: NDArray[np.float64], slope: float, *, logarithmic: bool = False
) -> list[Item]:
    """How the other model depends on one of the two, the other one at its mean."""
    if not np.isfinite(slope):
        return []
    places = np.linspace(x.min(), x.max(), 100)
    along = np.log(places) - np.mean(np.log(x)) if logarithmic else places - x.mean()
    mean = float(np.mean(rig.readings.coefficient))
    line = np.stack([places, mean + slope * along], axis=1)
    return [Line(line, ORANGE, name="not constant", group="not constant", layer=3)]
