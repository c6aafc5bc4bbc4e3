"""Draws the pictures of the explanations into docs/images, from solved states and real robots.

`python docs/make/figures.py`.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
from free_body import chain, free_body
from matplotlib.axes import Axes
from pictures import IMAGES, TENSION, TOTAL, label_all, picture

import notchflex as nf
from notchflex.export.joints import joint_model
from notchflex.export.simulators import mjcf, run_mujoco
from notchflex.plotting import dimensioned_figure
from notchflex.plotting.style import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    VERMILLION,
    save,
    sequence_colours,
)


@picture("memory.svg", 8.4, 3.4, 2)
def memory(left: Axes, right: Axes) -> None:
    """Ratio of tensions at every contact, over its bound, during loading and unloading."""
    wrist = nf.load_robot("pacheco2021-a").with_value("friction.wrap", "geometric")
    path = nf.simulate(wrist, nf.pull(0.0, 1.4, steps=57).release()).raise_if_failed()
    ratio, bound = path.contact_log_ratio[:, 0, ::2], path.contact_bound[:, 0, ::2]
    # Where the tendon hardly turns there is no friction to have a part of.
    part = np.divide(ratio, bound, out=np.full_like(ratio, np.nan), where=bound > 1e-9)
    for number, (values, colour) in enumerate(
        zip(part.T, sequence_colours(part.shape[1]), strict=True)
    ):
        left.plot(values, color=colour, label=f"contact {2 * number + 1}")
    left.axvline(len(path) / 2 - 0.5, color=GREY, lw=0.8)
    left.set_xlabel("step: loading to 1.4 N, then unloading")
    left.set_ylabel("ln of tension ratio over its bound")
    left.legend(loc="lower left")
    half = len(path) // 2
    for steps, colour, label in (
        (slice(half), BLUE, "loading"),
        (slice(half, None), ORANGE, "unloading"),
    ):
        angle = np.degrees(path.total_angle[steps])
        right.plot(path.tension[steps, 0], angle, color=colour, label=label)
    label_all((right,), TENSION, TOTAL)
    right.legend()


@picture("closing.svg", 8.4, 3.2, 2)
def closing(left: Axes, right: Axes) -> None:
    """Angles and contact forces of graded notches that close one after the other."""
    wrist = nf.load_robot("pacheco2021-c")
    path = nf.simulate(wrist, nf.pull(0.0, 3.0, steps=61)).raise_if_failed()
    pull = path.tension[:, 0]
    for notch, colour in enumerate(sequence_colours(wrist.number_of_notches)):
        label = f"notch {notch + 1}, {wrist.notches[notch].depth:g} mm deep"
        left.plot(pull, np.degrees(path.notch_angle[:, notch]), color=colour, label=label)
        right.plot(pull, path.contact_force[:, notch], color=colour)
    label_all((left, right), TENSION, "notch angle [deg]", "contact force [N]")
    left.legend()


@picture("cuts.svg", 6.4, 3.2, 2)
def cuts(on_axis: Axes, off_axis: Axes) -> None:
    """What an on-axis and an off-axis cut of one depth leave of the tube."""
    outer, inner, depth = 0.81, 0.70, 1.40
    plane = depth - outer  # the spine is on the left, at -x
    around, half = np.linspace(0.0, 2.0 * np.pi, 721), np.arccos(plane / outer)
    inside = np.arccos(min(plane / inner, 1.0))
    for axes, cut, section, ends in (
        (on_axis, "on-axis", nf.annular_sector(outer, inner, depth), (half, half)),
        (off_axis, "off-axis", nf.annular_segment(outer, inner, depth), (half, inside)),
    ):
        for radius in (outer, inner):
            axes.plot(radius * np.cos(around), radius * np.sin(around), color=GREY, lw=0.6)
        line = [
            radius * np.stack([-np.cos(angle), np.sin(angle)], axis=1)
            for radius, end, way in ((outer, ends[0], 1), (inner, ends[1], -1))
            for angle in [np.linspace(-end, end, 121)[::way]]
        ]
        axes.fill(*np.concatenate(line).T, color=BLUE)
        axes.axvline(-float(section.centroid), color=VERMILLION, lw=1.0, ls="--")
        moment = float(section.second_moment_weak)
        axes.set_title(f'"{cut}": I = {1e4 * moment:.2f} · 10⁻⁴ mm⁴', loc="left")
        axes.set_aspect("equal")
        axes.set_xlabel("mm; dashed: neutral axis")
        axes.plot(inner, 0.0, "ko", ms=4)
        axes.annotate("tendon", (inner, 0.0), (inner - 0.1, 0.0), ha="right", va="center")


def dimensions(folder: Path) -> None:
    """The dimensioned drawings of one robot for each kind of notch."""
    robots = {
        "arc_on_axis": nf.load_robot("pacheco2021-a").with_value("tube.base_length", 1.0),
        "arc_off_axis": nf.load_robot("york2015").with_value("tube.base_length", 0.5),
        "rod": nf.load_robot("disks-two-segments").with_values(
            {"notch.length": 18.0, "notch.uncut_length": 2.0, "tube.base_length": 3.0}
        ),
        "strip": nf.load_robot("liu2022"),
        "u_link": nf.load_robot("gao2017"),
    }
    for name, robot in robots.items():
        save(dimensioned_figure(robot), folder / f"dimensions_{name}.svg")


@picture("backbones.png", 9.0, 4.4, 3, subplot_kw={"projection": "3d"})
def backbones(*axes: Axes) -> None:
    """Robots of disks with parallel, converging and winding tendons."""
    part = np.arange(1, 21) / 20
    gap = nf.RodGap(18.5, 1.4, uncut_length=1.5, repeat=20)
    tendons = {
        "parallel": nf.Tendon(10.0, 30.0, path="straight"),
        "converging": nf.Tendon(10.0, 30.0, path="straight", disk_radius=tuple(10.0 - 6.0 * part)),
        "winding": nf.Tendon(10.0, path="straight", disk_direction_deg=tuple(360.0 * part)),
    }
    for one, (name, tendon) in zip(axes, tendons.items(), strict=True):
        robot = nf.load_robot("disks-two-segments").replace(
            tube=nf.Tube(24.0, 1.4, base_length=5.0), notch=(gap,), tendon=(tendon,)
        )
        nf.plot(nf.solve(robot, nf.Load(tension=3.0)), ax=one)
        one.set_title(name, loc="left")
        if (legend := one.get_legend()) is not None:
            legend.remove()


@picture("bands.svg", 8.6, 3.4, 2, sharey=True)
def bands(left: Axes, right: Axes) -> None:
    """What tolerances do to wrist A, and how the band narrows with the tolerance of the depth."""
    wrist, loads = nf.load_robot("pacheco2021-a"), nf.pull(0.0, 2.5, steps=51)
    found = nf.uncertain(wrist, loads.release())
    angle, tension = found["total_angle"], found.path.tension[:, 0]
    for part, colour, name in (
        (slice(51), BLUE, "loading"),
        (slice(51, 102), VERMILLION, "unloading"),
    ):
        low, high = np.degrees(angle.low[part]), np.degrees(angle.high[part])
        left.fill_between(tension[part], low, high, color=colour, alpha=0.25, lw=0)
        left.plot(tension[part], np.degrees(found.path.total_angle[part]), color=colour, label=name)
    for depth, colour in ((0.010, BLUE), (0.005, GREEN), (0.002, ORANGE)):
        angle = nf.uncertain(wrist, loads, {"notch.depth": depth})["total_angle"]
        low, high = np.degrees(angle.low), np.degrees(angle.high)
        look = {"color": colour, "alpha": 0.6, "lw": 0, "label": f"{1e3 * depth:g} µm (SD)"}
        right.fill_between(loads.tension[:, 0], low, high, **look)
    label_all((left, right), "tendon tension $T$ [N]", TOTAL)
    left.legend(title="all tolerances, 5 to 95 %")
    right.legend(title="depth alone")


@picture("simulators.svg", 8.6, 3.4, 2)
def simulators(left: Axes, right: Axes) -> None:
    """Wrist A in MuJoCo, as `notchflex export` writes it, and in the chain."""
    wrist = nf.load_robot("pacheco2021-a")
    text = mjcf(joint_model(wrist, 2.35))
    every = np.ones((5, 1))
    ends = np.eye(5)[:, [0, 4]]
    for axes, levels, shown, names, place in (
        (left, (0.0, 2.35, 0.0), every, ("",), "lower right"),
        (right, (0.0, 1.5, 0.7, 1.9, 0.0), ends, (", first notch", ", last notch"), "upper left"),
    ):
        way = np.concatenate([np.linspace(a, b, 25) for a, b in pairwise(levels)])
        path = nf.simulate(wrist, [nf.Load(tension=float(level)) for level in way])
        ran = np.degrees(run_mujoco(text, 0, way, 5)[0]) @ shown
        angles = np.degrees(path.notch_angle) @ shown
        for angle, name, colour in zip(angles.T, names, (BLUE, VERMILLION), strict=False):
            axes.plot(way, angle, color=colour, label=f"chain{name}")
        axes.plot(way, ran, ".", color="black", ms=3, label=["MuJoCo", "_"][: len(names)])
        axes.legend(loc=place)
    label_all((left, right), "tendon tension $T$ [N]", TOTAL, "notch angle [deg]")
    left.set_title("the range that was fitted")
    right.set_title("reversals within it")


def main(folder: Path = IMAGES) -> None:
    """Draw all of them."""
    for draw in (dimensions, chain, memory, closing, cuts, bands, simulators, free_body):
        draw(folder)


if __name__ == "__main__":
    main()
