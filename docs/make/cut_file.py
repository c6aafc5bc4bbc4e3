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

import notchflex as nf
from notchflex.plotting.style import BLUE, GREY, SKY, VERMILLION, house_style, new_figure, rgb, save

IMAGES = Path(__file__).resolve().parents[1] / "images"
NAMES = ("pacheco2021-a", "two-axis-wrist", "liu2022", "gao2017")
LOADS: dict[str, Any] = {
    "pacheco2021-a": 1.0,
    "two-axis-wrist": [1.0, 0.3, 0.0, 0.0],
    "liu2022": [6.0, 0.0],
    "gao2017": 8.0,
}
LAYERS = {"CUT": (VERMILLION, 1.0), "CUT_OFF": (BLUE, 1.4), "REFERENCE": (GREY, 0.6)}
LIGHT = np.array([0.5, -0.7, 0.5]) / np.linalg.norm([0.5, -0.7, 0.5])


def lines_of(file: Path, layer: str) -> list[np.ndarray]:
    """Return the polylines of a layer, closed ones with their first point again."""
    found = []
    for one in ezdxf.readfile(file).query(f'LWPOLYLINE[layer=="{layer}"]'):
        points = np.array(one.get_points("xy"))
        found.append(np.concatenate([points, points[:1]]) if one.closed else points)
    return found


def patterns(folder: Path) -> None:
    """Four robots, as their DXF files have them."""
    figure = new_figure(9.0, 6.0)
    for axes, name in zip(figure.subplots(2, 2).flat, NAMES, strict=True):
        robot, file = nf.load_robot(name), folder / f"{name}.dxf"
        nf.export_robot(robot, file, nf.PatternOptions(shank=2.0))
        for layer, (colour, width) in LAYERS.items():
            for points in lines_of(file, layer):
                axes.plot(*points.T, color=colour, lw=width)
        axes.set_aspect("equal")
        axes.set_title(robot.name)
        axes.set_xlabel("x [mm]")
        axes.set_ylabel("y [mm]")
    save(figure, IMAGES / "patterns.png")


def kerf(folder: Path) -> None:
    """The corner of a window, nominal and compensated."""
    wrist, file = nf.load_robot("pacheco2021-a"), folder / "kerf.dxf"
    figure = new_figure(4.2, 3.2)
    axes = figure.subplots()
    width = 0.06
    looks = (
        (0.0, GREY, "-", "nominal edge"),
        (width, VERMILLION, "--", "path of the beam"),
    )
    for beam, colour, dash, label in looks:
        options = nf.PatternOptions(kerf=beam, corner_radius=0.08, chord=1e-5)
        nf.export_robot(wrist, file, options)
        points = lines_of(file, "CUT")[-1]
        axes.plot(*points.T, color=colour, ls=dash, label=label)
    # The beam itself, at one place of its path.
    place = points[np.argmin(np.linalg.norm(points - points.max(axis=0), axis=1))]
    turn = np.linspace(0.0, 2.0 * np.pi, 60)
    circle = place + 0.5 * width * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    axes.fill(*circle.T, color=SKY, alpha=0.6, label=f"beam, {width} mm wide")
    axes.set_aspect("equal")
    axes.set_xlim(0.45, 0.87)
    axes.set_ylim(1.65, 1.98)
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("y [mm]")
    axes.legend(loc="lower left")
    save(figure, IMAGES / "kerf.png")


def solid(axes: Axes, file: Path) -> None:
    """Draw a solid as seen from the side, lit from above."""
    mesh = trimesh.load(file)
    view = np.array([0.25, -1.0, 0.3]) / np.linalg.norm([0.25, -1.0, 0.3])
    right = np.cross([0.0, 0.0, 1.0], view)
    right /= np.linalg.norm(right)
    up = np.cross(view, right)
    seen = mesh.face_normals @ view > 0.0
    corners, normals = mesh.triangles[seen], mesh.face_normals[seen]
    order = np.argsort(corners.mean(axis=1) @ view)
    shade = 0.45 + 0.55 * np.clip(normals[order] @ LIGHT, 0.0, 1.0)
    flat = np.stack([corners[order] @ right, corners[order] @ up], axis=-1)
    colours = shade[:, None] * np.array(rgb(SKY))
    made = PolyCollection(flat, facecolors=colours, edgecolors=colours, linewidths=0.15)
    made.set_rasterized(True)
    axes.add_collection(made)
    axes.autoscale()
    axes.set_aspect("equal")
    axes.set_axis_off()


def solids(folder: Path) -> None:
    """Four robots under load, as their STL files have them."""
    figure = new_figure(9.0, 3.4)
    for axes, name in zip(figure.subplots(1, 4), NAMES, strict=True):
        robot, file = nf.load_robot(name), folder / f"{name}.stl"
        state = nf.solve(robot, nf.Load(tension=LOADS[name])).raise_if_failed()
        shank = 1.5 * robot.tube.outer_diameter
        nf.export_robot(state, file, nf.SolidOptions(shank=shank))
        solid(axes, file)
        axes.set_title(robot.name, fontsize=8.0)
    save(figure, IMAGES / "solids.png")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as work, house_style():
        for draw in (patterns, kerf, solids):
            draw(Path(work))
