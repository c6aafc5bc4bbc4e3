"""A picture of the friction rig: the readings over turn and load, with the estimate."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from notchflex.plot.style import BLUE, GREY, ORANGE, VERMILLION, house_style, new_figure
from notchflex.results.quantities import DEGREES

if TYPE_CHECKING:
    from notchflex.calibrate import FrictionRig


def friction_figure(rig: FrictionRig) -> Figure:
    """Draw the coefficients of all readings of the friction rig.

    Left over the turn, right over the load: readings with their standard deviations where known,
    outliers marked, the estimate with its 95 % interval and the spread of the readings as bands,
    and the line of the other model where a constant is not enough.

    Args:
        rig: The estimate.

    Returns:
        The figure; `save` writes it.
    """
    readings, test = rig.readings, rig.constancy
    with house_style():
        figure = new_figure(8.0, 3.6, f"Coefficient of friction, {readings.source}")
        left, right = figure.subplots(1, 2, sharey=True)
        turn, load = readings.turn * DEGREES, readings.weight_1
        _draw(left, rig, turn)
        _draw(right, rig, load)
        if test.enough is False:
            _line(left, rig, turn, test.by_turn / DEGREES)
            _line(right, rig, load, test.by_load, logarithmic=True)
        left.set_xlabel("turn over both edges [deg]")
        right.set_xlabel("weight 1 [g]")
        left.set_ylabel(r"coefficient of friction $\mu$")
        right.legend(loc="best")
    return figure


def _draw(axes: Axes, rig: FrictionRig, x: NDArray[np.float64]) -> None:
    readings = rig.readings
    low, high = rig.interval
    if np.isfinite(rig.spread):
        ends = rig.coefficient - rig.spread, rig.coefficient + rig.spread
        axes.axhspan(*ends, color=GREY, alpha=0.15, linewidth=0.0, label="spread of readings")
    if np.isfinite(low):
        axes.axhspan(low, high, color=BLUE, alpha=0.3, linewidth=0.0, label="95 % interval")
    axes.axhline(rig.coefficient, color=BLUE, label=rf"$\mu$ = {rig.coefficient:.4g}")
    known = np.isfinite(readings.coefficient_deviation)
    style: dict[str, Any] = {"color": "0.2", "linestyle": "none", "marker": "o", "markersize": 3.0}
    axes.errorbar(
        x,
        readings.coefficient,
        yerr=np.where(known, readings.coefficient_deviation, 0.0) if known.any() else None,
        elinewidth=0.7,
        label="reading",
        **style,
    )
    if rig.outliers:
        off = list(rig.outliers)
        axes.plot(
            x[off],
            readings.coefficient[off],
            linestyle="none",
            marker="o",
            markersize=8.0,
            markerfacecolor="none",
            markeredgecolor=VERMILLION,
            label="outlier",
        )


def _line(
    axes: Axes,
    rig: FrictionRig,
    x: NDArray[np.float64],
    slope: float,
    *,
    logarithmic: bool = False,
) -> None:
    """Draw how the other model depends on one of the two, the other one at its mean."""
    if not np.isfinite(slope):
        return
    places = np.linspace(x.min(), x.max(), 100)
    along = np.log(places) - np.mean(np.log(x)) if logarithmic else places - x.mean()
    mean = float(np.mean(rig.readings.coefficient))
    axes.plot(places, mean + slope * along, color=ORANGE, label="not constant")
