"""Draws the pictures of the pages on sweeps, tolerances, sensing and workspaces into docs/images.

`python docs/make/analyses.py`.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from pictures import IMAGES, shown_file

import notchflex as nf
from notchflex.plotting import sensed_picture, sweep_picture


def sweep(images: Path = IMAGES) -> None:
    """The plan that the page on sweeps shows."""
    with tempfile.TemporaryDirectory() as folder:
        file = shown_file("sweep.md", "plan.toml", Path(folder))
        swept = nf.sweep(file, Path(folder) / "swept")
        picture = sweep_picture(swept, "notch.depth", "total_angle_deg_step_3")
        picture.save(images / "sweep.svg")


def tolerances(images: Path = IMAGES) -> None:
    """The limits that the page on tolerances shows."""
    with tempfile.TemporaryDirectory() as folder:
        file = shown_file("tolerances.md", "limits.toml", Path(folder))
        made = nf.tolerance_analysis(nf.load_robot("pacheco2021-a"), file, draws=6400)
    nf.plot(made).save(images / "tolerances.svg")


def sensing(images: Path = IMAGES) -> None:
    """A force that comes, stays and goes while a wrist is pulled, let go and pulled again."""
    wrist = nf.load_robot("pacheco2021-a")
    tension = [*np.linspace(0.1, 0.8, 8), 0.784, 0.784, 0.76, 0.7, 0.6, 0.5, 0.51, 0.53, 0.6, 0.7]
    force = np.array([0.0] * 4 + [0.01] + [0.02] * 9 + [0.005] * 4)
    tensions = np.array(tension)[:, None]
    external = tuple(nf.Load(tip_force=(x, 0.0, 0.0)).external for x in force)
    load = nf.LoadPath(tensions, np.full_like(tensions, np.nan), external=external)
    path = nf.simulate(wrist, load).raise_if_failed()
    noise = 0.003 * np.random.default_rng(2).normal(size=(2, len(force), 1))
    sensors = nf.SensorNoise(tension=0.003, stroke=0.003)
    sensed = nf.sense(wrist, path.tension + noise[0], path.stroke + noise[1], noise=sensors)
    sensed_picture(sensed, truth=force[:, None]).save(images / "sensing_history.png")


def workspace(images: Path = IMAGES) -> None:
    """The workspace of the two-axis wrist."""
    robot = nf.load_robot("two-axis-wrist")
    nf.plot(nf.workspace(robot, states=20_000, stiffness=300)).save(images / "workspace.png")


if __name__ == "__main__":
    for draw in (sweep, tolerances, sensing, workspace):
        draw()
