"""Wrists and notches from the drawing against solid finite elements; what 10 µm of depth do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from page import table

import notchflex as nf
from fem_notches import chain_bending, moments, other_directions, single_notch
from fem_wrists import Solid, rigid, sideways, solid, wrist
from notchflex.plotting.style import (
    BLUE,
    GREEN,
    GREY,
    VERMILLION,
    house_style,
    new_figure,
    save,
    sequence_colours,
)

PAGE = "../from_the_drawing.md"
LINEAR = {
    "A, no friction": "A_lin_mu0_medium",
    "A, μ = 0.13": "A_lin_mu013_medium",
    "B, no friction": "B_lin_mu0_medium",
    "A, tip pushed toward the bend": "A_lin_mu0_tipFy+_medium",
    "A, tip pushed away": "A_lin_mu0_tipFy-_medium",
}
YIELDING = {"A, no friction": "A_se_mu0_medium", "A, μ = 0.13": "A_se_mu013_coarse"}
TENSIONS = (1.0, 1.5, 2.0)  # N
STEP = 0.01  # mm


def _error(found: np.ndarray, solid: np.ndarray) -> str:
    """Return the largest error, with its sign."""
    error = 100.0 * (found / solid - 1.0).ravel()
    return f"{error[np.argmax(np.abs(error))]:+.1f} %".replace("-", "−")


def _compared(fem: Solid, robot: nf.Robot) -> nf.EquilibriumPath:
    """Load a wrist as the solid was loaded."""
    return nf.simulate(robot, fem.loads).raise_if_failed()


def _total(fem: Solid, robot: nf.Robot) -> str:
    """Return the largest error of the total angle."""
    return _error(np.degrees(_compared(fem, robot).total_angle), fem.angles.sum(axis=1))


def _wrists() -> str:
    rows: list[tuple[str, ...]] = []
    for name, case in LINEAR.items():
        fem = solid(case)
        path = _compared(fem, fem.robot)
        rows.append(
            (
                f"{name}, to {fem.loads[-1].tension:g} N",
                f"{fem.angles[-1].sum():.0f}",
                _error(np.degrees(path.notch_angle), fem.angles),
                _total(fem, fem.robot),
                f"{100.0 * fem.tip_errors(path).max():.1f} %",
                _total(fem, rigid(fem.robot)),
            )
        )
    head = ("wrist", "bent to, deg", "any notch", "total", "tip")
    return table((*head, 'total, `ends = "rigid"`'), rows)


def _levels() -> str:
    """Every level of wrist A with friction."""
    fem = solid(LINEAR["A, μ = 0.13"])
    found = [np.degrees(_compared(fem, one).total_angle) for one in (fem.robot, rigid(fem.robot))]
    rows = [
        (f"{load.tension:g}", *(f"{angle:.1f}" for angle in angles))
        for load, *angles in zip(fem.loads, fem.angles.sum(axis=1), *found, strict=True)
    ]
    return table(
        ("tension, N", "finite elements, deg", '`ends = "shell"`, deg', '`ends = "rigid"`, deg'),
        rows,
    )


def _yielding() -> str:
    rows: list[tuple[str, ...]] = []
    for name, case in YIELDING.items():
        fem = solid(case)
        angles = np.degrees(_compared(fem, fem.robot).notch_angle)
        rows.append(
            (
                name,
                f"{fem.angles[-1].sum():.0f}",
                _error(angles[:, :4], fem.angles[:, :4]),
                _error(angles[:, 4], fem.angles[:, 4]),
                _total(fem, fem.robot),
                _total(fem, rigid(fem.robot)),
            )
        )
    head = ("wrist", "bent to, deg", "notches 1 to 4", "notch 5", "total")
    return table((*head, 'total, `ends = "rigid"`'), rows)


def _sideways() -> str:
    both = {"shell": sideways(wrist()), "rigid": sideways(rigid(wrist()))}
    rows = [
        (
            f'`ends = "{ends}"`',
            f"{1e3 * twist[-1]:.2f}",
            _error(twist, fem[0]),
            f"{1e3 * bend[-1]:.2f}",
            _error(bend, fem[1]),
        )
        for ends, (twist, bend, *fem) in both.items()
    ]
    _, _, *fem = both["shell"]
    solid_row = ("finite elements", f"{1e3 * fem[0][-1]:.2f}", "–", f"{1e3 * fem[1][-1]:.2f}", "–")
    head = (
        "by",
        "twist of the tip, mrad",
        "any ring",
        "sideways bend of the tip, mrad",
        "any ring",
    )
    return table(head, [solid_row, *rows])


def _notches() -> str:
    single, single_outside = single_notch()
    chain, shallow = chain_bending()
    found = {
        "bending, one notch between plates": single,
        "the same, outside the checked ranges": single_outside,
        "bending, in a chain of notches": chain,
        "the same, depth / outer diameter 0.60": shallow,
        "moment to closing, 0.97 mm deep": moments(0.972),
        "moment to closing, 1.40 mm deep": moments(1.4),
        "moment to closing, 1.46 mm deep": moments(1.458),
    }
    names = {
        "strong": "bending sideways",
        "axial": "stretch",
        "coupling": "stretch by bending (neutral axis)",
        "torsion": "torsion",
        "shear centre": "shear centre",
        "shear": "shift by a force across, in the plane",
        "sway": "shift by a force across, sideways",
    }
    found |= {names[name]: errors for name, errors in other_directions().items()}
    rows = [
        (
            name,
            str(len(errors)),
            f"{100.0 * np.sqrt(np.mean(np.square(errors))):.1f} %",
            f"{100.0 * np.max(np.abs(errors)):.1f} %",
        )
        for name, errors in found.items()
    ]
    return table(("compared", "numbers", "root mean square", "largest"), rows)


def drawn(name: str, depth: float = 1.40, depth_at: str = "outer") -> nf.Robot:
    """Return wrist A or B of Pacheco 2021 as a drawing has it, of Nitinol never measured."""
    robot = nf.load_robot(f"pacheco2021-{name.lower()}")
    (notch,) = robot.notch
    notch = replace(notch, ends="shell", depth=depth, depth_at=depth_at)
    tendon = replace(robot.tendon[0], path="straight")
    return replace(
        robot, notch=(notch,), tendon=(tendon,), material=nf.Nitinol(), friction=nf.Capstan(0.18)
    )


def _angle(robot: nf.Robot, tension: float) -> float:
    return float(np.degrees(nf.solve(robot, nf.Load(tension=tension)).total_angle))


def _depth() -> str:
    rows: list[tuple[str, ...]] = []
    for name in "AB":
        for tension in TENSIONS:
            angles = [_angle(drawn(name, 1.40 + by), tension) for by in (-STEP, 0.0, STEP)]
            change = 0.5 * (angles[2] - angles[0])
            rows.append(
                (
                    name,
                    f"{tension:g}",
                    f"{angles[1]:.1f}",
                    f"{change:.1f}",
                    f"{100.0 * change / angles[1]:.0f} %",
                )
            )
    return table(("wrist", "tension, N", "total, deg", "by 10 µm of depth, deg", "of it"), rows)


def _readings() -> str:
    """Wrist A with its depth read at each surface."""
    rows = [
        (f'`depth_at = "{at}"`', *(f"{_angle(drawn('A', 1.40, at), T):.1f}" for T in TENSIONS))
        for at in ("outer", "mid-wall", "inner")
    ]
    return table(("read at", *(f"{tension:g} N, deg" for tension in TENSIONS)), rows)


def tables() -> dict[str, str]:
    """Return what stands on the page."""
    return {
        "wrists": _wrists(),
        "levels": _levels(),
        "yielding": _yielding(),
        "sideways": _sideways(),
        "notches": _notches(),
        "depth": _depth(),
        "readings": _readings(),
    }


def _draw_wrists(folder: Path) -> None:
    """Draw the total angle of both wrists, and of the notches of one."""
    figure = new_figure(8.6, 3.4)
    left, right = figure.subplots(1, 2)
    for name, colour in (("A, μ = 0.13", BLUE), ("B, no friction", VERMILLION)):
        fem = solid(LINEAR[name])
        loads = nf.pull(0.0, fem.loads[-1].tension, steps=41)
        for robot, line in ((fem.robot, "-"), (rigid(fem.robot), "--")):
            path = nf.simulate(robot, loads).raise_if_failed()
            angle = np.degrees(path.total_angle)
            label = name if line == "-" else None
            left.plot(path.tension[:, 0], angle, color=colour, ls=line, label=label)
        at = [load.tension for load in fem.loads]
        left.plot(at, fem.angles.sum(axis=1), "ko", ms=4, mfc="none")
    left.plot([], [], "ko", ms=4, mfc="none", label="finite elements")
    left.plot([], [], color=GREY, label='ends = "shell"')
    left.plot([], [], color=GREY, ls="--", label='ends = "rigid"')
    left.set_ylabel("total bending angle [deg]")
    left.legend(title="linear, 60 GPa")
    fem = solid(YIELDING["A, μ = 0.13"])
    loads = nf.pull(0.0, fem.loads[-1].tension, steps=41)
    at = [load.tension for load in fem.loads]
    for robot, line in ((fem.robot, "-"), (rigid(fem.robot), "--")):
        path = nf.simulate(robot, loads).raise_if_failed()
        for notch, colour in zip((0, 2, 4), sequence_colours(3), strict=True):
            label = f"notch {notch + 1}" if line == "-" else None
            angle = np.degrees(path.notch_angle[:, notch])
            right.plot(path.tension[:, 0], angle, color=colour, ls=line, label=label)
    for notch in (0, 2, 4):
        right.plot(at, fem.angles[:, notch], "ko", ms=4, mfc="none")
    right.set_ylabel("notch angle [deg]")
    right.legend(title="A, μ = 0.13, yielding")
    for axes in (left, right):
        axes.set_xlabel("tendon tension [N]")
    save(figure, folder / "drawing_wrists.svg")


def _draw_depth(folder: Path) -> None:
    """Draw the total angle over the depth at one tension, and over the tension for five depths."""
    figure = new_figure(8.6, 3.4)
    left, right = figure.subplots(1, 2, sharey=True)
    away = np.linspace(-0.03, 0.03, 61)
    tension = TENSIONS[-1]
    for name, colour in (("A", BLUE), ("B", VERMILLION)):
        angles = [_angle(drawn(name, 1.40 + by), tension) for by in away]
        left.plot(1e3 * away, angles, color=colour, label=f"wrist {name}")
    left.axvspan(-10.0, 10.0, color=GREEN, alpha=0.15, lw=0, label="±10 µm")
    left.set_xlabel(f"depth beyond 1.40 mm [µm], at {tension:g} N")
    left.set_ylabel("total bending angle [deg]")
    left.legend()
    shades = sequence_colours(5)
    for by, colour in zip((-0.03, -0.01, 0.0, 0.01, 0.03), shades, strict=True):
        loads = nf.pull(0.0, 3.5, steps=71)
        path = nf.simulate(drawn("A", 1.40 + by), loads).raise_if_failed()
        angle = np.degrees(path.total_angle)
        label = f"{1.40 + by:.2f} mm deep"
        right.plot(path.tension[:, 0], angle, color=colour, label=label)
    right.set_xlabel("tendon tension [N], wrist A")
    right.set_ylim(bottom=0.0)
    right.legend()
    save(figure, folder / "drawing_depth.svg")


def pictures(folder: Path) -> None:
    """Draw both pictures."""
    with house_style():
        _draw_wrists(folder)
        _draw_depth(folder)
