"""Draws the picture of the page on control: three inverses on one circle.

`python docs/make/control.py`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import notchflex as nf
from notchflex.plotting.style import BLUE, GREY, ORANGE, VERMILLION, house_style, new_figure, save

IMAGES = Path(__file__).resolve().parents[1] / "images"
ROBOT = nf.load_robot("two-axis-wrist").with_value("friction.coefficient", 0.2)
RADIUS = 2.0


def circle() -> np.ndarray:
    """Positions x and y, 120 points forward and back, mm."""
    t = np.linspace(0.0, 2.0 * np.pi, 120)
    points = RADIUS * np.stack([np.cos(t), np.sin(t)], axis=1)
    return np.concatenate([points, points[::-1]])


def constant_curvature(goals: np.ndarray) -> np.ndarray:
    """Tensions for an arc whose angle is proportional to the tension, without friction."""
    slick = ROBOT.with_value("friction.coefficient", 0.0)
    bent = nf.solve(slick, nf.Load(tension=[1e-3, 0.0, 0.0, 0.0]))
    length = float(nf.solve(slick, nf.Load(tension=[0.0] * 4)).tip_position[2])
    angle = np.linspace(1e-6, 2.0, 2000)
    far = np.interp(np.linalg.norm(goals, axis=1), length * (1 - np.cos(angle)) / angle, angle)
    toward = np.arctan2(goals[:, 1], goals[:, 0])[:, None]
    at = np.radians([tendon.direction_deg for tendon in ROBOT.tendon])
    tension = far * 1e-3 / float(bent.total_angle)
    return np.maximum(tension[:, None] * np.cos(toward - at), 0.0)


def three_inverses() -> None:
    """The tip under the tensions of three inverses, and how far it is off."""
    goals = circle()
    aim = {"tip_position": [[x, y, None] for x, y in goals.tolist()]}
    slick = nf.follow(ROBOT.with_value("friction.coefficient", 0.0), aim)
    drives = {
        "constant curvature": (constant_curvature(goals), ORANGE),
        "without friction": (slick.path.load.tension[slick.step], VERMILLION),
    }
    tips = {
        name: (nf.simulate(ROBOT, nf.LoadPath(one, np.full_like(one, np.nan))).tip_position, colour)
        for name, (one, colour) in drives.items()
    }
    tips["with friction history"] = nf.follow(ROBOT, aim).tip_position, BLUE
    with house_style():
        figure = new_figure(8.6, 3.8)
        left, right = figure.subplots(1, 2)
        left.plot(*goals.T, color=GREY, lw=4.0, alpha=0.4, label="target")
        for name, (tip, colour) in tips.items():
            error = np.linalg.norm(tip[:, :2] - goals, axis=1)
            left.plot(*tip[:, :2].T, color=colour, lw=1.2)
            right.semilogy(np.maximum(error, 1e-12), color=colour, label=name)
            print(f"{name}: root mean square {np.sqrt(np.mean(error**2)):.2g} mm")
        left.set(xlabel="tip position x [mm]", ylabel="tip position y [mm]", aspect="equal")
        right.set(xlabel="target [number]", ylabel="error of the tip [mm]")
        right.axvline(119.5, color=GREY, lw=0.8, ls="--")
        right.text(123, 1e-5, "back", color=GREY)
        figure.legend(loc="outside lower center", ncols=4)
        save(figure, IMAGES / "control.svg")


if __name__ == "__main__":
    three_inverses()
