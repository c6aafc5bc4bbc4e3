"""Draws the pictures of the explanations into docs/images, from solved states and real robots.

`python docs/make/figures.py`.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
from free_body import free_body
from matplotlib.axes import Axes

import notchflex as nf
from notchflex.export.joints import joint_model
from notchflex.export.simulators import mjcf, run_mujoco
from notchflex.plotting import dimensioned_figure
from notchflex.plotting.style import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    SKY,
    VERMILLION,
    house_style,
    new_figure,
    save,
    sequence_colours,
)

IMAGES = Path(__file__).resolve().parents[1] / "images"


def chain() -> None:
    """Bodies, flexures, tendon and frames of a bent wrist."""
    wrist = nf.load_robot("pacheco2021-a").with_value("tube.base_length", 1.0)
    state = nf.solve(wrist, nf.Load(tension=1.2)).raise_if_failed()
    outer, lever = wrist.tube.outer_radius, wrist.tendon[0].radius
    lengths = [wrist.tube.base_length, *(notch.uncut_length for notch in wrist.notches)]
    centroid = float(nf.annular_sector(0.81, 0.70, 1.40).centroid)
    figure = new_figure(6.0, 4.6)
    axes = figure.subplots()
    tendon = []
    for body, length in enumerate(lengths):
        at, turn = state.body_position[body][[0, 2]], turn_of(state, body)
        corners = [(-outer, 0), (outer, 0), (outer, length), (-outer, length)]
        axes.fill(*(at + corners @ turn.T).T, color=SKY, alpha=0.6, lw=0)
        x, z = at + turn @ [-0.35, length / 2]
        axes.text(x, z, str(body), ha="center", va="center")
        tendon += [at + turn @ [lever, 0.0], at + turn @ [lever, length]]
        if body:  # the neutral line from the body before: an arc, here by its ends' directions
            before, way = state.body_position[body - 1][[0, 2]], turn_of(state, body - 1)
            start = before + way @ [-centroid, lengths[body - 1]]
            end = at + turn @ [-centroid, 0.0]
            t = np.linspace(0.0, 1.0, 20)[:, None]
            size = np.linalg.norm(end - start)
            line = hermite(t, start, end, size * way[:, 1], size * turn[:, 1])
            axes.plot(*line.T, color=VERMILLION, lw=3, label="flexure" if body == 1 else None)
    below = [[lever, -0.9], *tendon]
    axes.plot(*np.array(below).T, color="black", lw=1.2, label="tendon")
    frame(axes, np.zeros(2), np.eye(2), "base")
    end = state.tip_position[[0, 2]]
    frame(axes, end, state.tip_rotation[np.ix_([0, 2], [0, 2])], "tip")
    axes.annotate("tension T", (lever, -0.9), (lever + 0.4, -0.9), va="center")
    axes.fill([], [], color=SKY, alpha=0.6, label="rigid body")
    axes.set_aspect("equal")
    axes.set_xlim(-2.4, 8.6)
    axes.set_ylim(-1.3, 8.6)
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("z [mm]")
    axes.legend(loc="lower right")
    save(figure, IMAGES / "chain.svg")


def turn_of(state: nf.Equilibrium, body: int) -> np.ndarray:
    """Rotation of a body in the plane x-z, (2, 2)."""
    return state.body_rotation[body][np.ix_([0, 2], [0, 2])]


def hermite(t: np.ndarray, a: np.ndarray, b: np.ndarray, da: np.ndarray, db: np.ndarray):
    """Curve from a to b with slopes da and db, which for short arcs looks like the arc."""
    return (
        (2 * t**3 - 3 * t**2 + 1) * a
        + (t**3 - 2 * t**2 + t) * da
        + (3 * t**2 - 2 * t**3) * b
        + (t**3 - t**2) * db
    )


def frame(axes: Axes, at: np.ndarray, turn: np.ndarray, name: str) -> None:
    """Draw the axes x and z of a frame."""
    for column, (axis, colour) in enumerate((("x", GREEN), ("z", BLUE))):
        tip = at + 1.4 * turn[:, column]
        axes.annotate("", tip, at, arrowprops={"arrowstyle": "->", "color": colour, "lw": 1.6})
        axes.text(*(at + 1.65 * turn[:, column]), axis, color=colour, ha="center", va="center")
    axes.text(*(at + turn @ [-1.4, -0.1]), name, ha="center", color=GREY)


def memory() -> None:
    """Ratio of tensions at every contact, over its bound, during loading and unloading."""
    wrist = nf.load_robot("pacheco2021-a").with_value("friction.wrap", "geometric")
    path = nf.simulate(wrist, nf.pull(0.0, 1.4, steps=57).release()).raise_if_failed()
    figure = new_figure(8.4, 3.4)
    left, right = figure.subplots(1, 2)
    ratio, bound = path.contact_log_ratio[:, 0], path.contact_bound[:, 0]
    count = ratio.shape[1]
    # Where the tendon hardly turns there is no friction to have a part of.
    part = np.divide(ratio, bound, out=np.full_like(ratio, np.nan), where=bound > 1e-9)
    for contact, colour in zip(range(0, count, 2), sequence_colours((count + 1) // 2), strict=True):
        label = f"contact {contact + 1}"
        left.plot(np.arange(len(path)), part[:, contact], color=colour, label=label)
    left.axvline(len(path) / 2 - 0.5, color=GREY, lw=0.8)
    left.set_xlabel("step: loading to 1.4 N, then unloading")
    left.set_ylabel("ln of tension ratio over its bound")
    left.legend(loc="lower left")
    angle = np.degrees(path.total_angle)
    half = len(path) // 2
    right.plot(path.tension[:half, 0], angle[:half], color=BLUE, label="loading")
    right.plot(path.tension[half:, 0], angle[half:], color=ORANGE, label="unloading")
    right.set_xlabel("tendon tension [N]")
    right.set_ylabel("total bending angle [deg]")
    right.legend()
    save(figure, IMAGES / "memory.svg")


def closing() -> None:
    """Angles and contact forces of graded notches that close one after the other."""
    wrist = nf.load_robot("pacheco2021-c")
    path = nf.simulate(wrist, nf.pull(0.0, 3.0, steps=61)).raise_if_failed()
    figure = new_figure(8.4, 3.2)
    left, right = figure.subplots(1, 2)
    pull = path.tension[:, 0]
    for notch, colour in enumerate(sequence_colours(wrist.number_of_notches)):
        label = f"notch {notch + 1}, {wrist.notches[notch].depth:g} mm deep"
        left.plot(pull, np.degrees(path.notch_angle[:, notch]), color=colour, label=label)
        right.plot(pull, path.contact_force[:, notch], color=colour)
    left.set_ylabel("notch angle [deg]")
    right.set_ylabel("contact force [N]")
    for axes in (left, right):
        axes.set_xlabel("tendon tension [N]")
    left.legend()
    save(figure, IMAGES / "closing.svg")


def cuts() -> None:
    """What an on-axis and an off-axis cut of one depth leave of the tube."""
    outer, inner, depth = 0.81, 0.70, 1.40
    figure = new_figure(6.4, 3.2)
    plane = depth - outer  # the spine is on the left, at -x
    around = np.linspace(0.0, 2.0 * np.pi, 721)
    for axes, cut in zip(figure.subplots(1, 2), ("on-axis", "off-axis"), strict=True):
        for radius in (outer, inner):
            axes.plot(radius * np.cos(around), radius * np.sin(around), color=GREY, lw=0.6)
        half = np.arccos(plane / outer)
        if cut == "on-axis":
            section, ends = nf.annular_sector(outer, inner, depth), (half, half)
        else:
            section = nf.annular_segment(outer, inner, depth)
            ends = (half, np.arccos(min(plane / inner, 1.0)))
        line = [
            radius * np.stack([-np.cos(angle), np.sin(angle)], axis=1)
            for radius, end, way in ((outer, ends[0], 1), (inner, ends[1], -1))
            for angle in [np.linspace(-end, end, 121)[::way]]
        ]
        axes.fill(*np.concatenate(line).T, color=BLUE)
        centroid = float(section.centroid)
        axes.axvline(-centroid, color=VERMILLION, lw=1.0, ls="--")
        moment = float(section.second_moment_weak)
        axes.set_title(f'"{cut}": I = {1e4 * moment:.2f} · 10⁻⁴ mm⁴', loc="left")
        axes.set_aspect("equal")
        axes.set_xlabel("mm; dashed: neutral axis")
        axes.plot(inner, 0.0, "ko", ms=4)
        axes.annotate("tendon", (inner, 0.0), (inner - 0.1, 0.0), ha="right", va="center")
    save(figure, IMAGES / "cuts.svg")


def dimensions() -> None:
    """The dimensioned drawings of one robot for each kind of notch."""
    robots = {
        "arc_on_axis": nf.load_robot("pacheco2021-a").with_value("tube.base_length", 1.0),
        "arc_off_axis": nf.load_robot("york2015").with_value("tube.base_length", 0.5),
        "strip": nf.load_robot("liu2022"),
        "u_link": nf.load_robot("gao2017"),
    }
    for name, robot in robots.items():
        save(dimensioned_figure(robot), IMAGES / f"dimensions_{name}.svg")


def bands() -> None:
    """What tolerances do to wrist A, and how the band narrows with the tolerance of the depth."""
    wrist = nf.load_robot("pacheco2021-a")
    figure = new_figure(8.6, 3.4)
    left, right = figure.subplots(1, 2, sharey=True)
    loads = nf.pull(0.0, 2.5, steps=51)
    found = nf.uncertain(wrist, loads.release())
    angle = found["total_angle"]
    tension = found.path.tension[:, 0]
    for part, colour, name in (
        (slice(51), BLUE, "loading"),
        (slice(51, 102), VERMILLION, "unloading"),
    ):
        low, high = np.degrees(angle.low[part]), np.degrees(angle.high[part])
        left.fill_between(tension[part], low, high, color=colour, alpha=0.25, lw=0)
        left.plot(tension[part], np.degrees(found.path.total_angle[part]), color=colour, label=name)
    left.legend(title="all tolerances, 5 to 95 %")
    left.set_ylabel("total bending angle [deg]")
    for depth, colour in ((0.010, BLUE), (0.005, GREEN), (0.002, ORANGE)):
        angle = nf.uncertain(wrist, loads, {"notch.depth": depth})["total_angle"]
        low, high = np.degrees(angle.low), np.degrees(angle.high)
        label = f"{1e3 * depth:g} µm (SD)"
        right.fill_between(
            loads.tension[:, 0], low, high, color=colour, alpha=0.6, lw=0, label=label
        )
    for axes in (left, right):
        axes.set_xlabel("tendon tension $T$ [N]")
    right.legend(title="depth alone")
    save(figure, IMAGES / "bands.svg")


def simulators() -> None:
    """Wrist A in MuJoCo, as `notchflex export` writes it, and in the chain."""
    wrist = nf.load_robot("pacheco2021-a")
    model = joint_model(wrist, 2.35)
    text = mjcf(model)
    figure = new_figure(8.6, 3.4)
    left, right = figure.subplots(1, 2)
    turns = {left: (0.0, 2.35, 0.0), right: (0.0, 1.5, 0.7, 1.9, 0.0)}
    for axes, ends in turns.items():
        way = np.concatenate([np.linspace(a, b, 25) for a, b in pairwise(ends)])
        path = nf.simulate(wrist, [nf.Load(tension=float(one)) for one in way])
        found = run_mujoco(text, 0, way, 5)
        known, ran = np.degrees(path.notch_angle), np.degrees(found[0])
        if axes is left:
            known, ran = known.sum(axis=1)[:, None], ran.sum(axis=1)[:, None]
            axes.set_ylabel("total bending angle [deg]")
        else:
            known, ran = known[:, [0, 4]], ran[:, [0, 4]]
            axes.set_ylabel("notch angle [deg]")
        names = ("",) if axes is left else (", first notch", ", last notch")
        colours = (BLUE, VERMILLION)
        for column, name in enumerate(names):
            axes.plot(way, known[:, column], color=colours[column], label=f"chain{name}")
        axes.plot(way, ran, ".", color="black", ms=3, label=["MuJoCo", *["_"] * (len(names) - 1)])
        axes.set_xlabel("tendon tension $T$ [N]")
        axes.legend(loc="upper left" if axes is right else "lower right")
    left.set_title("the range that was fitted")
    right.set_title("reversals within it")
    save(figure, IMAGES / "simulators.svg")


def main() -> None:
    """Draw all of them."""
    dimensions()
    with house_style():
        for draw in (chain, memory, closing, cuts, bands, simulators):
            draw()
        free_body(IMAGES)


if __name__ == "__main__":
    main()
