"""Draws the pictures of docs/cut_file.md from exported files: patterns, a kerf, solids.

`python docs/make/cut_file.py`.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import trimesh
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from pictures import picture

import notchflex as nf
from notchflex.plotting.style import BLUE, GREY, SKY, VERMILLION, rgb

LOADS: dict[str, Any] = {
    "pacheco2021-a": 1.0,
    "two-axis-wrist": [1.0, 0.3, 0.0, 0.0],
    "liu2022": [6.0, 0.0],
    "gao2017": 8.0,
}
LAYERS = {"CUT": (VERMILLION, 1.0), "CUT_OFF": (BLUE, 1.4), "REFERENCE": (GREY, 0.6)}
BEAM = 0.06  # mm


def exported(subject: Any, options: Any, layers: tuple[str, ...]) -> dict[str, list[np.ndarray]]:
    """Return the polylines of a pattern by layer, closed ones with their first point again."""
    with tempfile.TemporaryDirectory() as folder:
        nf.export_robot(subject, Path(folder, "pattern.dxf"), options)
        drawing = ezdxf.readfile(Path(folder, "pattern.dxf"))
    lines: dict[str, list[np.ndarray]] = {}
    for layer in layers:
        for polyline in drawing.query(f'LWPOLYLINE[layer=="{layer}"]'):
            points = np.array(polyline.get_points("xy"))
            closing = points[: polyline.closed]
            lines.setdefault(layer, []).append(np.concatenate([points, closing]))
    return lines


def in_mm(axes: Axes, **look: Any) -> None:
    """Show a plane in mm."""
    axes.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]", **look)


@picture("patterns.png", 9.0, 6.0, columns=2, rows=2)
def patterns(*places: Axes) -> None:
    """Four robots, as their DXF files have them."""
    for axes, name in zip(places, LOADS, strict=True):
        robot = nf.load_robot(name)
        lines = exported(robot, nf.PatternOptions(shank=2.0), tuple(LAYERS))
        for layer, (colour, width) in LAYERS.items():
            for points in lines.get(layer, ()):
                axes.plot(*points.T, color=colour, lw=width)
        in_mm(axes, title=robot.name)


@picture("kerf.png", 4.2, 3.2)
def kerf(axes: Axes) -> None:
    """The corner of a window, nominal and compensated."""
    wrist = nf.load_robot("pacheco2021-a")
    for beam, colour, dashes, label in (
        (0.0, GREY, "-", "nominal edge"),
        (BEAM, VERMILLION, "--", "path of the beam"),
    ):
        options = nf.PatternOptions(kerf=beam, corner_radius=0.08, chord=1e-5)
        points = exported(wrist, options, ("CUT",))["CUT"][-1]
        axes.plot(*points.T, color=colour, ls=dashes, label=label)
    # The beam itself, at one place of its path.
    place = points[np.argmin(np.linalg.norm(points - points.max(axis=0), axis=1))]
    turn = np.linspace(0.0, 2.0 * np.pi, 60)
    circle = place + 0.5 * BEAM * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    axes.fill(*circle.T, color=SKY, alpha=0.6, label=f"beam, {BEAM} mm wide")
    in_mm(axes, xlim=(0.45, 0.87), ylim=(1.65, 1.98))
    axes.legend(loc="lower left")


def unit(vector: Any) -> np.ndarray:
    """Return a direction."""
    return np.array(vector) / np.linalg.norm(vector)


def solid(axes: Axes, mesh: trimesh.Trimesh) -> None:
    """Draw a solid as seen from the side, lit from above."""
    view, light = unit([0.25, -1.0, 0.3]), unit([0.5, -0.7, 0.5])
    right = unit(np.cross([0.0, 0.0, 1.0], view))
    seen = mesh.face_normals @ view > 0.0
    corners, normals = mesh.triangles[seen], mesh.face_normals[seen]
    order = np.argsort(corners.mean(axis=1) @ view)
    shade = 0.45 + 0.55 * np.clip(normals[order] @ light, 0.0, 1.0)
    colours = shade[:, None] * np.array(rgb(SKY))
    flat = corners[order] @ np.stack([right, np.cross(view, right)], axis=1)
    made = PolyCollection(flat, facecolors=colours, edgecolors=colours, linewidths=0.15)
    made.set_rasterized(True)
    axes.add_collection(made)
    axes.autoscale()
    axes.set_aspect("equal")
    axes.set_axis_off()


@picture("solids.png", 9.0, 3.4, columns=4)
def solids(*places: Axes) -> None:
    """Four robots under load, as their STL files have them."""
    for axes, (name, tension) in zip(places, LOADS.items(), strict=True):
        robot = nf.load_robot(name)
        state = nf.solve(robot, nf.Load(tension=tension)).raise_if_failed()
        options = nf.SolidOptions(shank=1.5 * robot.tube.outer_diameter)
        with tempfile.TemporaryDirectory() as folder:
            nf.export_robot(state, Path(folder, "solid.stl"), options)
            solid(axes, trimesh.load(Path(folder, "solid.stl")))
        axes.set_title(robot.name, fontsize=8.0)


if __name__ == "__main__":
    for draw in (patterns, kerf, solids):
        draw()
