"""Output of `workspace`: sizes, extents and spreads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from notchflex.cli import terminal

if TYPE_CHECKING:
    from notchflex.workspaces import Overlap

_SPREADS = {
    "total_angle_deg": "total angle [deg]",
    "peak_strain": "peak strain",
    "tension_N": "largest tension [N]",
    "hysteresis_mm": "error by hysteresis [mm]",
    "softest_stiffness_N_mm": "softest stiffness [N/mm]",
}


def print_workspace(label: str, document: dict[str, Any]) -> None:
    """Print one workspace, from its document."""
    console = terminal.output()
    counts = document["states"]
    name = f"{label}: {document['name']}" if label else document["name"]
    each = [f"{one:.4g}" for one in document["largest_tension_N"]]
    pulled = each[0] if len(set(each)) == 1 else ", ".join(each)
    console.print(f"Workspace of {name}, tendons up to {pulled} N", soft_wrap=True)
    for text in document["limits"]:
        console.print(f"limit: {text}", soft_wrap=True)
    console.print(
        f"{counts['kept']} of {counts['solved']} states kept, {counts['not_converged']} not "
        f"converged, {counts['beyond_limits']} beyond limits",
        soft_wrap=True,
    )
    if "extent_mm" not in document:
        return
    for axis, (low, high) in document["extent_mm"].items():
        console.print(f"{axis}  {low:.3f} to {high:.3f} mm")
    hull, alpha, voxels = document["convex_hull"], document["alpha_shape"], document["voxels"]
    console.print(
        f"convex hull {hull['size']:.5g} {hull['unit']}, alpha shape {alpha['size']:.4g} "
        f"{alpha['unit']}",
        soft_wrap=True,
    )
    console.print(
        f"dexterity {100 * voxels['dexterity_mean']:.2g} % of directions in a voxel of "
        f"{voxels['edge_mm']:.3g} mm, up to {100 * voxels['dexterity_largest']:.2g} %",
        soft_wrap=True,
    )
    heads = ["", ">5 %", ">50 %", ">95 %", ">largest"]
    rows = [
        [title, *("" if one is None else f"{one:.4g}" for one in document[key].values())]
        for key, title in _SPREADS.items()
        if document[key]["largest"] is not None
    ]
    console.print(terminal.table(heads, rows, gap=2))


def print_overlaps(overlaps: Sequence[Overlap]) -> None:
    """Print what workspaces have in common."""
    console = terminal.output()
    for one in overlaps:
        console.print(
            f"{one.first} and {one.second}: of voxels of {one.voxel:.3g} mm {one.both} hold tips "
            f"of both, {one.first_alone} of {one.first} alone, {one.second_alone} of {one.second} "
            f"alone; {100 * one.first_in_second:.0f} % of {one.first} lie in the hull of "
            f"{one.second}, {100 * one.second_in_first:.0f} % of {one.second} in that of "
            f"{one.first}",
            soft_wrap=True,
        )
