"""Bands in files: columns of a table, and a document for JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from notchflex.analysis.uncertainty.bands import LEVELS, Bands
from notchflex.results.files.csv import entries_of, is_listed
from notchflex.results.quantities.registry import QUANTITIES

ENDS = ("low", "median", "high")


def band_columns(bands: Bands) -> dict[str, Sequence[Any]]:
    """Return columns beside those of a path, such as `total_deg_low`, `total_deg_median`."""
    columns: dict[str, Sequence[Any]] = {"draws_converged": bands.converged.tolist()}
    for name in bands:
        quantity = QUANTITIES[name]
        if quantity.column and is_listed(quantity):
            ends = [list(entries_of(bands.end(end), quantity)) for end in ENDS]
            for entries in zip(*ends, strict=True):
                columns |= {
                    f"{one.header}_{end}": one.values
                    for one, end in zip(entries, ENDS, strict=True)
                }
    return columns


def band_document(bands: Bands) -> dict[str, Any]:
    """Return bands as a document of plain values and arrays, at the edge units."""
    quantities = [QUANTITIES[name] for name in bands]
    return {
        "draws": bands.draws,
        "seed": bands.seed,
        "percentiles": [100.0 * level for level in LEVELS],
        "tolerances": {one.value: one.written for one in bands.tolerances},
        "assumed": list(bands.assumed),
        "redrawn": bands.redrawn,
        "steps": [
            {
                "step": step + 1,
                "converged": converged,
                **{
                    one.key: {
                        end: np.asarray(getattr(bands[one.name], end)[step]) * one.scale
                        for end in ENDS
                    }
                    for one in quantities
                    if one.key
                },
            }
            for step, converged in enumerate(bands.converged)
        ],
    }
