"""Draws the pictures of the page on control: inverses on a circle, feedback, and a reversal.

`python docs/make/control.py`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import notchflex as nf
from notchflex.plotting.style import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    VERMILLION,
    house_style,
    new_figure,
    save,
)

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


def frictionless(goals: np.ndarray) -> np.ndarray:
    """Tensions of the exact inverse of the robot without friction."""
    aim = {"tip_position": [[x, y, None] for x, y in goals.tolist()]}
    slick = nf.follow(ROBOT.with_value("friction.coefficient", 0.0), aim)
    return slick.path.load.tension[slick.step]


def pulled(robot: nf.Robot, tension: np.ndarray) -> np.ndarray:
    """Positions of the tip under tensions one after the other, mm."""
    return nf.simulate(robot, nf.LoadPath(tension, np.full_like(tension, np.nan))).tip_position


def fed_back(real: nf.Robot, goals: np.ndarray) -> np.ndarray:
    """Positions of the tip of another robot, measured with noise of 0.01 mm and fed back."""
    controller = nf.Controller(ROBOT, search=nf.TargetSearch(tolerance=1e-4, solves=12))
    state, seen, tips, random = None, None, [], np.random.default_rng(24)
    for x, y in goals:
        tension = controller.step([x, y, np.nan], measured=seen)
        found = nf.solve(real, nf.Load(tension=tension), from_state=state)
        state, seen = found.state, found.tip_position + random.normal(0.0, 0.01, 3)
        tips.append(found.tip_position)
    return np.array(tips)


def draw_tips(goals: np.ndarray, tips: dict[str, tuple[np.ndarray, str]], name: str) -> None:
    """The tip in the plane, and how far it is off."""
    with house_style():
        figure = new_figure(8.6, 3.8)
        left, right = figure.subplots(1, 2)
        left.plot(*goals.T, color=GREY, lw=4.0, alpha=0.4, label="target")
        for label, (tip, colour) in tips.items():
            error = np.linalg.norm(tip[:, :2] - goals, axis=1)
            left.plot(*tip[:, :2].T, color=colour, lw=1.2)
            right.semilogy(np.maximum(error, 1e-12), color=colour, label=label)
            print(f"{label}: root mean square {np.sqrt(np.mean(error**2)):.2g} mm")
        left.set(xlabel="tip position x [mm]", ylabel="tip position y [mm]", aspect="equal")
        right.set(xlabel="target [number]", ylabel="error of the tip [mm]")
        right.axvline(119.5, color=GREY, lw=0.8, ls="--")
        low, high = right.get_ylim()
        right.text(123, low * (high / low) ** 0.03, "back", color=GREY)
        figure.legend(loc="outside lower center", ncols=5)
        save(figure, IMAGES / f"{name}.svg")


def three_inverses() -> None:
    """The tip under the tensions of three inverses."""
    goals = circle()
    aim = {"tip_position": [[x, y, None] for x, y in goals.tolist()]}
    tips = {
        "constant curvature": (pulled(ROBOT, constant_curvature(goals)), ORANGE),
        "without friction": (pulled(ROBOT, frictionless(goals)), VERMILLION),
        "with friction history": (nf.follow(ROBOT, aim).tip_position, BLUE),
    }
    draw_tips(goals, tips, "control")


def feedback() -> None:
    """A robot that is 10 % softer and has 10 % more friction than its model."""
    goals = circle()
    softer = 0.9 * ROBOT.material.elastic_modulus
    real = ROBOT.with_value("friction.coefficient", 0.22)
    real = real.with_value("material.elastic_modulus", softer)
    aim = {"tip_position": [[x, y, None] for x, y in goals.tolist()]}
    found = nf.follow(ROBOT, aim)
    tips = {
        "constant curvature": (pulled(real, constant_curvature(goals)), ORANGE),
        "without friction": (pulled(real, frictionless(goals)), VERMILLION),
        "with friction history": (pulled(real, found.path.load.tension[found.step]), GREEN),
        "and feedback": (fed_back(real, goals), BLUE),
    }
    draw_tips(goals, tips, "control_feedback")


def reversal() -> None:
    """The angle of a wrist after a change of direction."""
    angle = np.concatenate([np.linspace(0.2, 1.2, 41), np.linspace(1.2, 0.4, 33)[1:]])
    wrist = nf.load_robot("pacheco2021-a")
    found = nf.follow(wrist, {"total_angle": angle})
    rising = np.unique(angle)
    loading = nf.follow(wrist, {"total_angle": rising}).tension[:, 0]
    tension = np.interp(angle, rising, loading)
    plain = nf.simulate(wrist, nf.LoadPath(tension[:, None], np.full((len(angle), 1), np.nan)))
    lines = {
        "tensions of loading": (tension, plain.total_angle, VERMILLION),
        "with friction history": (found.tension[:, 0], found.path.total_angle, BLUE),
    }
    with house_style():
        figure = new_figure(8.6, 3.4)
        left, right = figure.subplots(1, 2)
        right.plot(np.degrees(angle), color=GREY, lw=4.0, alpha=0.4, label="target")
        for label, (force, turned, colour) in lines.items():
            left.plot(force, color=colour, lw=1.2)
            right.plot(np.degrees(turned), color=colour, lw=1.2, label=label)
            error = np.degrees(np.abs(turned - angle)[41:].max())
            print(f"{label}: at most {error:.2g} deg after the reversal")
        left.set(xlabel="target [number]", ylabel="tension [N]")
        right.set(xlabel="target [number]", ylabel="angle of the tip [deg]")
        figure.legend(loc="outside lower center", ncols=3)
        save(figure, IMAGES / "control_reversal.svg")


if __name__ == "__main__":
    three_inverses()
    feedback()
    reversal()
