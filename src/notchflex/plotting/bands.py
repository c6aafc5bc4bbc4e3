"""Shades the bands of tolerances behind the curves of a path."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.curves import (
    COLOUR,
    abscissa,
    branches,
    converged_only,
    load_parameter,
)
from notchflex.plotting.sheet import INSIDE, Area, Colour, Panel
from notchflex.plotting.style import sequence_colours
from notchflex.results.quantities.registry import QUANTITIES

if TYPE_CHECKING:
    from notchflex.analysis.uncertainty.bands import Band
    from notchflex.results import EquilibriumPath

NAME = "5 to 95 % of draws"


def shaded(
    panel: Panel, path: EquilibriumPath, bands: Mapping[str, Band] | None, name: str
) -> Panel:
    """Return a panel with the band of a quantity behind its curves, entry by entry.

    Args:
        panel: Curves of one quantity over the load.
        path: The path that the panel shows.
        bands: Bands by name; None leaves the panel as it is.
        name: The quantity.
    """
    if bands is None or name not in bands:
        return panel
    # A strain is drawn without its sign, in percent.
    scale = 100.0 if name == "peak_strain" else QUANTITIES[name].scale
    ends = np.stack([bands[name].low, bands[name].high]) * scale
    ends = np.sort(np.abs(ends), axis=0) if name == "peak_strain" else ends
    ends = ends.reshape(2, len(path), -1)
    several = ends.shape[2] > 1
    shades: list[Colour | None] = [None]
    if several:
        shades = [*sequence_colours(ends.shape[2])]
    x = abscissa(path)[0]
    areas = [
        replace(area, group=f"notch {entry + 1}") if several else area
        for entry, shade in enumerate(shades)
        for area in _areas(path, x, ends[:, :, entry], shade)
    ]
    if areas and not several:
        areas[0] = replace(areas[0], name=NAME)
    return replace(panel, items=[*areas, *panel.items], legend=panel.legend or INSIDE)


def _areas(
    path: EquilibriumPath,
    x: NDArray[np.float64],
    ends: NDArray[np.float64],
    shade: Colour | None,
) -> Iterator[Area]:
    """Yield the area between two ends, (2, S), of every branch."""
    low, high = (converged_only(path, end) for end in ends)
    for part, way in branches(load_parameter(path)):
        is_finite = np.isfinite(low[part]) & np.isfinite(high[part])
        along = x[part][is_finite]
        outline = np.stack(
            [
                np.append(along, along[::-1]),
                np.append(low[part][is_finite], high[part][is_finite][::-1]),
            ],
            axis=1,
        )
        if len(along) > 1:
            colour = COLOUR[way] if shade is None else shade
            yield Area([outline], colour, colour, opacity=0.18, width=0.0, layer=1)
