"""Draws a bent wrist: its chain, the part beyond a notch, and the tendon at a contact."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from pictures import picture

import notchflex as nf
from notchflex.plotting.style import BLUE, GREEN, GREY, SKY, VERMILLION

NOTCH = 3
"""The notch through which the wrist is cut, from 1."""
HALF_TURN = np.radians(28.0)
"""Half the turning angle of the tendon at the contact."""
GHOST = "#888888"
"""The colour of what lies before the cut."""


class BentWrist:
    """Wrist A with a base of 1 mm under a tension, in its plane of bending (x, z), mm."""

    def __init__(self, tension: float) -> None:
        """Solve it."""
        wrist = nf.load_robot("pacheco2021-a").with_value("tube.base_length", 1.0)
        self.state = nf.solve(wrist, nf.Load(tension=tension)).raise_if_failed()
        self.lengths = [wrist.tube.base_length, *(notch.uncut_length for notch in wrist.notches)]
        self.outer, self.lever = wrist.tube.outer_radius, wrist.tendon[0].radius
        self.neutral = -float(nf.annular_sector(0.81, 0.70, 1.40).centroid)

    def turn(self, body: int) -> np.ndarray:
        """Rotation of a body, (2, 2)."""
        return self.state.body_rotation[body][np.ix_([0, 2], [0, 2])]

    def on(self, body: int, across: float, along: float) -> np.ndarray:
        """Return a place of a body; -1 is the last."""
        return self.state.body_position[body][[0, 2]] + self.turn(body) @ [across, along]

    def end(self, body: int, across: float) -> np.ndarray:
        """Return a place at the distal end of a body."""
        return self.on(body, across, self.lengths[body])

    def corners(self, body: int) -> np.ndarray:
        """Return the corners of a body."""
        places = ((-self.outer, 0.0), (self.outer, 0.0))
        return np.array(
            [self.on(body, *place) for place in places]
            + [self.end(body, across) for across in (self.outer, -self.outer)]
        )


def line(axes: Axes, points: Sequence[Any], **look: Any) -> None:
    """Draw a line through points (x, z)."""
    axes.plot(*np.array(points).T, **look)


def arrow(axes: Axes, start: Any, end: Any, colour: str, **look: Any) -> None:
    """Draw a force: its arrow points at the end."""
    properties = {"arrowstyle": "-|>", "color": colour, "lw": 1.8, "mutation_scale": 13}
    axes.annotate("", end, start, arrowprops=properties | {"shrinkA": 0, "shrinkB": 0} | look)


@picture("chain.svg", 6.0, 4.6)
def chain(axes: Axes) -> None:
    """Bodies, flexures, tendon and frames of a bent wrist."""
    wrist = BentWrist(1.2)
    tendon = [[wrist.lever, -0.9]]
    for body, length in enumerate(wrist.lengths):
        axes.fill(*wrist.corners(body).T, color=SKY, alpha=0.6, lw=0)
        axes.text(*wrist.on(body, -0.35, length / 2), str(body), ha="center", va="center")
        tendon += [wrist.on(body, wrist.lever, 0.0), wrist.end(body, wrist.lever)]
        if body:  # the neutral line from the body before: an arc, here by its ends' directions
            start, end = wrist.end(body - 1, wrist.neutral), wrist.on(body, wrist.neutral, 0.0)
            size = np.linalg.norm(end - start)
            slopes = size * wrist.turn(body - 1)[:, 1], size * wrist.turn(body)[:, 1]
            label = "flexure" if body == 1 else None
            line(axes, hermite(start, end, *slopes), color=VERMILLION, lw=3, label=label)
    line(axes, tendon, color="black", lw=1.2, label="tendon")
    frame(axes, np.zeros(2), np.eye(2), "base")
    state = wrist.state
    frame(axes, state.tip_position[[0, 2]], state.tip_rotation[np.ix_([0, 2], [0, 2])], "tip")
    axes.annotate("tension T", (wrist.lever, -0.9), (wrist.lever + 0.4, -0.9), va="center")
    axes.fill([], [], color=SKY, alpha=0.6, label="rigid body")
    axes.set(aspect="equal", xlim=(-2.4, 8.6), ylim=(-1.3, 8.6), xlabel="x [mm]", ylabel="z [mm]")
    axes.legend(loc="lower right")


def hermite(a: np.ndarray, b: np.ndarray, da: np.ndarray, db: np.ndarray) -> np.ndarray:
    """Curve from a to b with slopes da and db, which for short arcs looks like the arc."""
    t = np.linspace(0.0, 1.0, 20)[:, None]
    return (
        (2 * t**3 - 3 * t**2 + 1) * a
        + (t**3 - 2 * t**2 + t) * da
        + (3 * t**2 - 2 * t**3) * b
        + (t**3 - t**2) * db
    )


def frame(axes: Axes, origin: np.ndarray, turn: np.ndarray, name: str) -> None:
    """Draw the axes x and z of a frame."""
    for column, (axis, colour) in enumerate((("x", GREEN), ("z", BLUE))):
        tip = origin + 1.4 * turn[:, column]
        axes.annotate("", tip, origin, arrowprops={"arrowstyle": "->", "color": colour, "lw": 1.6})
        axes.text(*(origin + 1.65 * turn[:, column]), axis, color=colour, ha="center", va="center")
    axes.text(*(origin + turn @ [-1.4, -0.1]), name, ha="center", color=GREY)


@picture("free_body.svg", 8.6, 4.9, 2, width_ratios=[1.15, 1.0])
def free_body(left: Axes, right: Axes) -> None:
    """Draw both free bodies."""
    wrist = BentWrist(1.0)
    beyond_the_cut(left, wrist)
    forces_beyond_the_cut(left, wrist)
    contact(right)
    for axes in (left, right):
        axes.set_aspect("equal")
        axes.set_axis_off()


def beyond_the_cut(axes: Axes, wrist: BentWrist) -> None:
    """Draw a bent wrist that is cut through one notch and its tendon."""
    solid = {"facecolor": SKY, "alpha": 0.7, "edgecolor": "black", "ls": "-"}
    ghost = {"facecolor": "none", "alpha": 0.6, "edgecolor": GHOST, "ls": (0, (3, 2))}
    lever = wrist.lever
    for body in range(len(wrist.lengths)):
        free = body >= NOTCH
        axes.fill(*wrist.corners(body).T, lw=0.8, **(solid if free else ghost))
        if body:
            before, after = wrist.end(body - 1, wrist.neutral), wrist.on(body, wrist.neutral, 0.0)
            if body == NOTCH:
                before = 0.5 * (before + after)  # the half beyond the cut
            look = {"color": VERMILLION, "lw": 3.5} if free else {"color": GHOST, "lw": 1.2}
            line(axes, [before, after], **look)
        ends = [wrist.on(body, lever, 0.0), wrist.end(body, lever)]
        line(axes, ends, color="black" if free else GHOST, lw=1.1)
        if body > NOTCH:
            line(axes, [wrist.end(body - 1, lever), ends[0]], color="black", lw=1.1)


def forces_beyond_the_cut(axes: Axes, wrist: BentWrist) -> None:
    """Draw the forces on the part beyond the cut."""

    def named(place: np.ndarray, name: str, **look: Any) -> None:
        axes.text(*place, name, fontsize=12, **look)

    entry, way_out = wrist.on(NOTCH, wrist.lever, 0.0), wrist.end(NOTCH - 1, wrist.lever)
    span = (way_out - entry) / np.linalg.norm(way_out - entry)
    arrow(axes, entry, entry + 1.7 * span, "black")
    named(entry + 1.75 * span + [0.25, 0.0], "$T_j$", va="center")
    cut = 0.5 * (wrist.end(NOTCH - 1, wrist.neutral) + wrist.on(NOTCH, wrist.neutral, 0.0))
    arrow(axes, cut + 1.5 * span, cut + 0.08 * span, VERMILLION)
    named(cut + 1.5 * span + [-0.15, -0.15], "$\\mathbf{n}$", ha="right")
    angles = np.radians(np.linspace(105.0, 235.0, 40))  # it bends the part back
    arc = cut + 0.75 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    line(axes, arc[:-2], color=VERMILLION, lw=1.6)
    arrow(axes, arc[-4], arc[-1], VERMILLION)
    named(arc[20] + [-0.12, 0.05], "$\\mathbf{m}$", ha="right")
    tip = wrist.end(-1, 0.0)
    arrow(axes, tip, tip - np.array([0.0, 1.5]), GREEN)
    named(tip - np.array([-0.12, 1.45]), "$\\mathbf{F}$")
    axes.plot(*tip, "o", color=GREEN, ms=4)
    middle = wrist.on(NOTCH, -0.3, 0.5 * wrist.lengths[NOTCH])
    axes.text(*middle, "body $j$", ha="center", va="center", fontsize=8.5, rotation=-35)
    axes.text(*wrist.on(0, 0.0, -0.35), "base, held", ha="center", color="#666666")
    axes.set_title("The part beyond a cut through notch $j$", loc="left")
    axes.set(xlim=(-2.0, 7.4), ylim=(-0.8, 9.9))


def contact(axes: Axes) -> None:
    """Draw a tendon that turns over an edge, and the four forces on it."""
    base = np.array([-np.sin(HALF_TURN), -np.cos(HALF_TURN)])  # toward the base
    tip, middle = base * [1.0, -1.0], np.zeros(2)  # toward the tip
    edge = np.array([middle, 2.0 * base, [-2.6, -1.9], [-2.6, 1.9], 2.0 * tip])
    axes.fill(*(edge - [0.06, 0.0]).T, facecolor=SKY, alpha=0.6, edgecolor="black", lw=0.8)
    line(axes, [2.2 * base, middle, 2.2 * tip], color="black", lw=2.2)
    arrow(axes, 2.1 * base, 3.3 * base, "black")
    arrow(axes, 2.1 * tip, 3.0 * tip, "black")
    axes.text(*(3.3 * base + [0.15, 0.0]), "$T_-$, base side", va="center", fontsize=11)
    axes.text(*(3.0 * tip + [0.15, 0.0]), "$T_+$, tip side", va="center", fontsize=11)
    arrow(axes, middle, [1.7, 0.0], BLUE)
    axes.text(1.75, 0.0, "$N$", va="center", fontsize=12)
    arrow(axes, middle, [0.0, 1.25], VERMILLION)
    axes.text(0.1, 1.25, "$\\mu N$", va="center", fontsize=12)
    line(axes, [middle, -2.4 * base], color="black", lw=0.7, ls=(0, (4, 3)))
    angles = np.linspace(np.pi / 2.0 - HALF_TURN, np.pi / 2.0 + HALF_TURN, 40)
    axes.plot(2.0 * np.cos(angles), 2.0 * np.sin(angles), color="black", lw=0.7)
    axes.text(0.25, 2.15, "$\\beta$", ha="center", va="center", fontsize=12)
    axes.text(-1.75, 0.0, "body", ha="center", va="center")
    axes.set_title("The tendon at a contact, during loading", loc="left")
    axes.set(xlim=(-2.7, 2.9), ylim=(-3.3, 3.2))
