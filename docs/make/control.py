"""Draws the pictures of the page on control: inverses on a circle, feedback, and a reversal.

`python docs/make/control.py`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from pictures import IMAGES, picture

import notchflex as nf
from notchflex.plotting.style import BLUE, GREEN, GREY, ORANGE, VERMILLION

FRICTION = "friction.coefficient"
ROBOT = nf.load_robot("two-axis-wrist").with_value(FRICTION, 0.2)
SLICK = ROBOT.with_value(FRICTION, 0.0)
Lines = dict[str, tuple[np.ndarray, str]]


def circle() -> np.ndarray:
    """Positions x and y on a circle of 2 mm, 120 points forward and back."""
    t = np.linspace(0.0, 2.0 * np.pi, 120)
    points = 2.0 * np.stack([np.cos(t), np.sin(t)], axis=1)
    return np.concatenate([points, points[::-1]])


GOALS = circle()


def constant_curvature() -> np.ndarray:
    """Tensions for an arc whose angle is proportional to the tension, without friction."""
    bent = nf.solve(SLICK, nf.Load(tension=[1e-3, 0.0, 0.0, 0.0]))
    length = float(nf.solve(SLICK, nf.Load(tension=[0.0] * 4)).tip_position[2])
    angle = np.linspace(1e-6, 2.0, 2000)
    far = np.interp(np.linalg.norm(GOALS, axis=1), length * (1 - np.cos(angle)) / angle, angle)
    toward = np.arctan2(GOALS[:, 1], GOALS[:, 0])[:, None]
    tendons = np.radians([tendon.direction_deg for tendon in ROBOT.tendon])
    tension = far * 1e-3 / float(bent.total_angle)
    return np.maximum(tension[:, None] * np.cos(toward - tendons), 0.0)


def exact(robot: nf.Robot) -> np.ndarray:
    """Tensions of the exact inverse of a robot, each after the one before."""
    aim = {"tip_position": [[x, y, None] for x, y in GOALS.tolist()]}
    followed = nf.follow(robot, aim)
    return followed.path.load.tension[followed.step]


def pulled(robot: nf.Robot, tension: np.ndarray) -> nf.EquilibriumPath:
    """Pull a robot by tensions one after the other."""
    return nf.simulate(robot, nf.LoadPath(tension, np.full_like(tension, np.nan)))


def fed_back(real: nf.Robot) -> np.ndarray:
    """Positions of the tip of another robot, measured with noise of 0.01 mm and fed back."""
    controller = nf.Controller(ROBOT, search=nf.TargetSearch(tolerance=1e-4, solves=12))
    state, seen, tips, random = None, None, [], np.random.default_rng(24)
    for x, y in GOALS:
        tension = controller.step([x, y, np.nan], measured=seen)
        solved = nf.solve(real, nf.Load(tension=tension), from_state=state)
        state, seen = solved.state, solved.tip_position + random.normal(0.0, 0.01, 3)
        tips.append(solved.tip_position)
    return np.array(tips)


def draw_tips(left: Axes, right: Axes, tips: Lines) -> None:
    """The tip in the plane, and how far it is off."""
    left.plot(*GOALS.T, color=GREY, lw=4.0, alpha=0.4, label="target")
    for label, (tip, colour) in tips.items():
        error = np.linalg.norm(tip[:, :2] - GOALS, axis=1)
        left.plot(*tip[:, :2].T, color=colour, lw=1.2)
        right.semilogy(np.maximum(error, 1e-12), color=colour, label=label)
        print(f"{label}: root mean square {np.sqrt(np.mean(error**2)):.2g} mm")
    left.set(xlabel="tip position x [mm]", ylabel="tip position y [mm]", aspect="equal")
    right.set(xlabel="target [number]", ylabel="error of the tip [mm]")
    right.axvline(119.5, color=GREY, lw=0.8, ls="--")
    low, high = right.get_ylim()
    right.text(123, low * (high / low) ** 0.03, "back", color=GREY)
    left.figure.legend(loc="outside lower center", ncols=5)


def tips_of(real: nf.Robot, colour: str) -> Lines:
    """The tip of a robot under the tensions of three inverses."""
    return {
        "constant curvature": (pulled(real, constant_curvature()).tip_position, ORANGE),
        "without friction": (pulled(real, exact(SLICK)).tip_position, VERMILLION),
        "with friction history": (pulled(real, exact(ROBOT)).tip_position, colour),
    }


@picture("control.svg", 8.6, 3.8, 2)
def three_inverses(left: Axes, right: Axes) -> None:
    """The tip under the tensions of three inverses."""
    draw_tips(left, right, tips_of(ROBOT, BLUE))


@picture("control_feedback.svg", 8.6, 3.8, 2)
def feedback(left: Axes, right: Axes) -> None:
    """A robot that is 10 % softer and has 10 % more friction than its model."""
    softer = 0.9 * ROBOT.material.elastic_modulus
    real = ROBOT.with_values({FRICTION: 0.22, "material.elastic_modulus": softer})
    draw_tips(left, right, tips_of(real, GREEN) | {"and feedback": (fed_back(real), BLUE)})


@picture("control_reversal.svg", 8.6, 3.4, 2)
def reversal(left: Axes, right: Axes) -> None:
    """The angle of a wrist after a change of direction."""
    angle = np.concatenate([np.linspace(0.2, 1.2, 41), np.linspace(1.2, 0.4, 33)[1:]])
    wrist, rising = nf.load_robot("pacheco2021-a"), np.unique(angle)
    followed = nf.follow(wrist, {"total_angle": angle})
    loading = nf.follow(wrist, {"total_angle": rising}).tension[:, 0]
    tension = np.interp(angle, rising, loading)
    plain = pulled(wrist, tension[:, None]).total_angle
    right.plot(np.degrees(angle), color=GREY, lw=4.0, alpha=0.4, label="target")
    for label, force, turned, colour in (
        ("tensions of loading", tension, plain, VERMILLION),
        ("with friction history", followed.tension[:, 0], followed.path.total_angle, BLUE),
    ):
        left.plot(force, color=colour, lw=1.2)
        right.plot(np.degrees(turned), color=colour, lw=1.2, label=label)
        error = np.degrees(np.abs(turned - angle)[41:].max())
        print(f"{label}: at most {error:.2g} deg after the reversal")
    left.set(xlabel="target [number]", ylabel="tension [N]")
    right.set(xlabel="target [number]", ylabel="angle of the tip [deg]")
    left.figure.legend(loc="outside lower center", ncols=3)


def main(folder: Path = IMAGES) -> None:
    """Draw all of them."""
    for draw in (three_inverses, feedback, reversal):
        draw(folder)


if __name__ == "__main__":
    main()
