"""The picture of the friction rig: readings over wrap angle and load, with the estimate."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.output import Picture
from notchflex.plotting.sheet import BESIDE, Curve, Mark, Panel, Span, dots, grid
from notchflex.plotting.style import BLUE, GREY, ORANGE, VERMILLION
from notchflex.support import DEGREES

if TYPE_CHECKING:
    from notchflex.fit import FrictionRig

_READING = "#333333"


def friction_picture(rig: FrictionRig) -> Picture:
    """Describe the coefficients of all readings of the friction rig.

    Left over the wrap angle, right over the load: readings with their standard deviations where
    known, marked outliers, the estimate with its 95 % interval and the spread of the readings as
    bands, and the line of the alternative model if a constant does not fit.

    Args:
        rig: The estimate.

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
    left = Panel(over_turn, "turn over both edges [deg]", label, shared="y")
    right = Panel(over_load, "weight 1 [g]", label, legend=BESIDE, shared="y")
    title = f"Coefficient of friction, {readings.source}"
    return Picture(title, 9.6, 3.6, grid([left, right], 2))


def _items(rig: FrictionRig, x: NDArray[np.float64]) -> list[Mark]:
    """Return the estimate and the readings, over what changed from reading to reading."""
    readings, at = rig.readings, rig.coefficient
    low, high = rig.interval
    items: list[Mark] = []
    if np.isfinite(rig.spread):
        ends = at - rig.spread, at + rig.spread
        items.append(Span("y", *ends, GREY, opacity=0.15, name="spread of readings"))
    if np.isfinite(low):
        items.append(Span("y", low, high, BLUE, opacity=0.3, name="95 % interval"))
    name = rf"$\mu$ = {at:.4g}"
    items.append(Span("y", at, at, BLUE, width=1.4, name=name, group="estimate"))
    points = np.stack([x, readings.coefficient], axis=1)
    deviation = readings.coefficient_deviation
    error = deviation if np.isfinite(deviation).any() else None
    style: dict[str, Any] = {"hover": True, "error": error}
    items.append(dots(points, _READING, name="reading", group="reading", **style))
    if rig.outliers:
        style = {"hollow": True, "layer": 3, "name": "outlier", "group": "outlier"}
        items.append(dots(points[list(rig.outliers)], VERMILLION, 8.0, **style))
    return items


def _other_model(
    rig: FrictionRig, x: NDArray[np.float64], slope: float, *, logarithmic: bool = False
) -> list[Mark]:
    """Return the alternative model over one variable, with the other one at its mean."""
    if not np.isfinite(slope):
        return []
    positions = np.linspace(x.min(), x.max(), 100)
    along = np.log(positions) - np.mean(np.log(x)) if logarithmic else positions - x.mean()
    mean = float(np.mean(rig.readings.coefficient))
    line = np.stack([positions, mean + slope * along], axis=1)
    return [Curve(line, ORANGE, name="not constant", group="not constant", layer=3)]
