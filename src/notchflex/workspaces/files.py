"""Workspaces in files: a JSON document of what was found, and a data set of all states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from notchflex._extras import need
from notchflex._quantity import DEGREES
from notchflex._replacing import replacing
from notchflex.results.files.json import document_head
from notchflex.results.quantities.registry import AXES
from notchflex.workspaces.cloud import Workspace
from notchflex.workspaces.comparing import Overlap

_PARTS = (0.05, 0.5, 0.95)


def workspace_document(explored: Workspace) -> dict[str, Any]:
    """Return what was found as a document of plain values, at the units of files."""
    document: dict[str, Any] = {
        **document_head(explored.robot),
        "limits": [one.text for one in explored.limits],
        "largest_tension_N": explored.largest,
        "states": {
            "solved": explored.tried,
            "kept": len(explored),
            "not_converged": explored.failed,
            "beyond_limits": explored.beyond,
        },
    }
    if not len(explored):
        return document
    hull, voxels = explored.hull, explored.voxels()
    low, high = explored.extent
    return document | {
        "extent_mm": {axis: [low[i], high[i]] for i, axis in enumerate(AXES)},
        "convex_hull": {"dimension": hull.dimension, "size": hull.size, "unit": hull.unit},
        "alpha_shape": {"size": explored.alpha_size(), "unit": hull.unit},
        "total_angle_deg": _spread(explored.angle * DEGREES),
        "peak_strain": _spread(explored.strain),
        "tension_N": _spread(explored.tension.max(axis=1)),
        "hysteresis_mm": _spread(explored.hysteresis),
        "softest_stiffness_N_mm": _spread(explored.stiffness),
        "voxels": {
            "edge_mm": voxels.size,
            "count": len(voxels),
            "dexterity_mean": float(voxels.dexterity.mean()),
            "dexterity_largest": float(voxels.dexterity.max()),
        },
    }


def _spread(values: np.ndarray) -> dict[str, float | None]:
    finite = values[np.isfinite(values)]
    if not len(finite):
        return {"p5": None, "p50": None, "p95": None, "largest": None}
    parts = np.quantile(finite, _PARTS)
    named: dict[str, float | None] = {
        f"p{100 * part:g}": float(one) for part, one in zip(_PARTS, parts, strict=True)
    }
    return named | {"largest": float(finite.max())}


def overlap_documents(overlaps: Sequence[Overlap]) -> list[dict[str, Any]]:
    """Return comparisons as plain values."""
    return [vars(one) for one in overlaps]


def save_netcdf(workspaces: Mapping[str, Workspace], target: str) -> None:
    """Write the states as NetCDF, each robot a group where there are several; whole or not at all.

    Raises:
        InputError: A package is missing, or the file cannot be written.
    """
    for module in ("xarray", "h5netcdf", "h5py"):
        need(module, "data", "--nc")
    with replacing(target) as temporary:
        for number, (label, one) in enumerate(workspaces.items()):
            group = label.replace("/", "-") if len(workspaces) > 1 else None
            mode = "a" if number else "w"
            one.to_xarray().to_netcdf(temporary, engine="h5netcdf", group=group, mode=mode)
