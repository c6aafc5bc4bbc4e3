"""Draws the pictures of the pages on sensing and workspaces into docs/images.

`python docs/make/sensing_figures.py`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import notchflex as nf
from notchflex.plotting import sensed_picture

IMAGES = Path(__file__).resolve().parents[1] / "images"


def history() -> None:
    """A force that comes, stays and goes while a wrist is pulled, let go and pulled again."""
    wrist = nf.load_robot("pacheco2021-a")
    tension = [*np.linspace(0.1, 0.8, 8), 0.784, 0.784, 0.76, 0.7, 0.6, 0.5, 0.51, 0.53, 0.6, 0.7]
    force = np.array([0.0] * 4 + [0.01] + [0.02] * 9 + [0.005] * 4)
    tensions = np.array(tension)[:, None]
    external = tuple(nf.Load(tip_force=(one, 0.0, 0.0)).external for one in force)
    load = nf.LoadPath(tensions, np.full_like(tensions, np.nan), external=external)
    path = nf.simulate(wrist, load).raise_if_failed()
    noise = 0.003 * np.random.default_rng(2).normal(size=(2, len(force), 1))
    sensors = nf.SensorNoise(tension=0.003, stroke=0.003)
    sensed = nf.sense(wrist, path.tension + noise[0], path.stroke + noise[1], noise=sensors)
    sensed_picture(sensed, truth=force[:, None]).save(IMAGES / "sensing_history.png")


def workspace() -> None:
    """The workspace of the two-axis wrist."""
    found = nf.workspace(nf.load_robot("two-axis-wrist"), states=20_000, stiffness=300)
    nf.plot(found).save(IMAGES / "workspace.png")


if __name__ == "__main__":
    history()
    workspace()
