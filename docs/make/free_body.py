"""Draws the free bodies of docs/theory.md: the part beyond a notch, and the tendon at a contact."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

import notchflex as nf
from notchflex.plotting.style import BLUE, GREEN, SKY, VERMILLION, new_figure, save

NOTCH = 3
"""The notch through which the wrist is cut, from 1."""
HALF_TURN = np.radians(28.0)
"""Half the turning angle of the tendon in the right-hand picture."""


def free_body(folder: Path) -> None:
    """Draw both free bodies into `free_body.svg`."""
    figure = new_figure(8.6, 4.9)
    left, right = figure.subplots(1, 2, width_ratios=[1.15, 1.0])
    beyond_the_cut(left)
    contact(right)
    for axes in (left, right):
        axes.set_aspect("equal")
        axes.set_axis_off()
    save(figure, folder / "free_body.svg")


def arrow(axes: Axes, start: Any, end: Any, colour: str, **look: Any) -> None:
    """Draw a force: its arrow points at the end."""
    properties = {"arrowstyle": "-|>", "color": colour, "lw": 1.8, "mutation_scale": 13}
    axes.annotate("", end, start, arrowprops=properties | {"shrinkA": 0, "shrinkB": 0} | look)


def beyond_the_cut(axes: Axes) -> None:
    """Draw a bent wrist that is cut through one notch and its tendon."""
    wrist = nf.load_robot("pacheco2021-a").with_value("tube.base_length", 1.0)
    state = nf.solve(wrist, nf.Load(tension=1.0)).raise_if_failed()
    outer, lever = wrist.tube.outer_radius, wrist.tendon[0].radius
    lengths = [wrist.tube.base_length, *(notch.uncut_length for notch in wrist.notches)]
    centroid = float(nf.annular_sector(0.81, 0.70, 1.40).centroid)

    def on(body: int, across: float, along: float) -> np.ndarray:
        turn = state.body_rotation[body][np.ix_([0, 2], [0, 2])]
        return state.body_position[body][[0, 2]] + turn @ np.array([across, along])

    for body, length in enumerate(lengths):
        corners = [(-outer, 0.0), (outer, 0.0), (outer, length), (-outer, length)]
        polygon = np.array([on(body, *corner) for corner in corners])
        free = body >= NOTCH
        axes.fill(
            *polygon.T,
            facecolor=SKY if free else "none",
            alpha=0.7 if free else 0.6,
            edgecolor="black" if free else "#888888",
            lw=0.8,
            ls="-" if free else (0, (3, 2)),
        )
        if body:
            before, after = on(body - 1, -centroid, lengths[body - 1]), on(body, -centroid, 0.0)
            if body == NOTCH:
                before = 0.5 * (before + after)  # the half beyond the cut
            ghost = body < NOTCH
            axes.plot(
                *np.array([before, after]).T,
                color="#888888" if ghost else VERMILLION,
                lw=1.2 if ghost else 3.5,
            )
        ends = np.array([on(body, lever, 0.0), on(body, lever, length)])
        axes.plot(*ends.T, color="black" if free else "#888888", lw=1.1)
        if free and body > NOTCH:
            gap = np.array([on(body - 1, lever, lengths[body - 1]), on(body, lever, 0.0)])
            axes.plot(*gap.T, color="black", lw=1.1)
    # The forces on the part beyond the cut.
    entry, exit_ = on(NOTCH, lever, 0.0), on(NOTCH - 1, lever, lengths[NOTCH - 1])
    span = (exit_ - entry) / np.linalg.norm(exit_ - entry)
    arrow(axes, entry, entry + 1.7 * span, "black")
    axes.text(*(entry + 1.75 * span + [0.25, 0.0]), "$T_j$", va="center", fontsize=12)
    cut = 0.5 * (on(NOTCH - 1, -centroid, lengths[NOTCH - 1]) + on(NOTCH, -centroid, 0.0))
    arrow(axes, cut + 1.5 * span, cut + 0.08 * span, VERMILLION)
    axes.text(*(cut + 1.5 * span + [-0.15, -0.15]), "$\\mathbf{n}$", ha="right", fontsize=12)
    angles = np.radians(np.linspace(105.0, 235.0, 40))  # it bends the part back
    arc = cut + 0.75 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    axes.plot(*arc[:-2].T, color=VERMILLION, lw=1.6)
    arrow(axes, arc[-4], arc[-1], VERMILLION)
    axes.text(*(arc[20] + [-0.12, 0.05]), "$\\mathbf{m}$", ha="right", fontsize=12)
    tip = on(-1, 0.0, lengths[-1])
    arrow(axes, tip, tip - np.array([0.0, 1.5]), GREEN)
    axes.text(*(tip - np.array([-0.12, 1.45])), "$\\mathbf{F}$", fontsize=12)
    axes.plot(*tip, "o", color=GREEN, ms=4)
    middle = on(NOTCH, -0.3, 0.5 * lengths[NOTCH])
    axes.text(*middle, "body $j$", ha="center", va="center", fontsize=8.5, rotation=-35)
    axes.text(*on(0, 0.0, -0.35), "base, held", ha="center", color="#666666")
    axes.set_title("The part beyond a cut through notch $j$", loc="left")
    axes.set_xlim(-2.0, 7.4)
    axes.set_ylim(-0.8, 9.9)


def contact(axes: Axes) -> None:
    """Draw a tendon that turns over an edge, and the four forces on it."""
    base = np.array([-np.sin(HALF_TURN), -np.cos(HALF_TURN)])  # toward the base
    tip = base * [1.0, -1.0]  # toward the tip
    edge = np.array([[0.0, 0.0], 2.0 * base, [-2.6, -1.9], [-2.6, 1.9], 2.0 * tip])
    axes.fill(*(edge - [0.06, 0.0]).T, facecolor=SKY, alpha=0.6, edgecolor="black", lw=0.8)
    axes.plot(*np.array([2.2 * base, [0.0, 0.0], 2.2 * tip]).T, color="black", lw=2.2)
    arrow(axes, 2.1 * base, 3.3 * base, "black")
    arrow(axes, 2.1 * tip, 3.0 * tip, "black")
    axes.text(*(3.3 * base + [0.15, 0.0]), "$T_-$, base side", va="center", fontsize=11)
    axes.text(*(3.0 * tip + [0.15, 0.0]), "$T_+$, tip side", va="center", fontsize=11)
    arrow(axes, [0.0, 0.0], [1.7, 0.0], BLUE)
    axes.text(1.75, 0.0, "$N$", va="center", fontsize=12)
    arrow(axes, [0.0, 0.0], [0.0, 1.25], VERMILLION)
    axes.text(0.1, 1.25, "$\\mu N$", va="center", fontsize=12)
    straight = -base
    axes.plot(*np.array([[0.0, 0.0], 2.4 * straight]).T, color="black", lw=0.7, ls=(0, (4, 3)))
    angles = np.linspace(np.pi / 2.0 - HALF_TURN, np.pi / 2.0 + HALF_TURN, 40)
    axes.plot(2.0 * np.cos(angles), 2.0 * np.sin(angles), color="black", lw=0.7)
    axes.text(0.25, 2.15, "$\\beta$", ha="center", va="center", fontsize=12)
    axes.text(-1.75, 0.0, "body", ha="center", va="center")
    axes.set_title("The tendon at a contact, during loading", loc="left")
    axes.set_xlim(-2.7, 2.9)
    axes.set_ylim(-3.3, 3.2)
