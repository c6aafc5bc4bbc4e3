"""Wrists and notches from the drawing against solid finite elements; what 10 µm of depth do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from page import percent, table
from pictures import TENSION, TOTAL, label_all, picture

import notchflex as nf
from fem_notches import chain_bending, moments, other_directions, single_notch
from fem_wrists import Solid, rigid, sideways, solid, wrist
from notchflex.plotting.style import BLUE, GREEN, GREY, VERMILLION, sequence_colours

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
SHELL, RIGID = (f'`ends = "{ends}"`' for ends in ("shell", "rigid"))


def _error(found: np.ndarray, solid: np.ndarray) -> str:
    """Return the largest error, with its sign."""
    error = 100.0 * (found / solid - 1.0).ravel()
    return f"{error[np.argmax(np.abs(error))]:+.1f} %".replace("-", "−")


def _compared(fem: Solid, robot: nf.Robot) -> nf.EquilibriumPath:
    """Load a wrist as the solid was loaded."""
    return nf.simulate(robot, fem.loads).raise_if_failed()


def _totals(fem: Solid) -> list[np.ndarray]:
    """Return the total angles, deg, with elastic and with rigid ends."""
    both = (fem.robot, rigid(fem.robot))
    return [np.degrees(_compared(fem, robot).total_angle) for robot in both]


def _wrists() -> str:
    rows = []
    for name, case in LINEAR.items():
        fem, total = solid(case), solid(case).angles.sum(axis=1)
        path, (shell, stiff) = _compared(fem, fem.robot), _totals(fem)
        rows.append(
            (
                f"{name}, to {fem.loads[-1].tension:g} N",
                f"{total[-1]:.0f}",
                _error(np.degrees(path.notch_angle), fem.angles),
                _error(shell, total),
                percent(fem.tip_errors(path).max()),
                _error(stiff, total),
            )
        )
    return table(("wrist", "bent to, deg", "any notch", "total", "tip", f"total, {RIGID}"), rows)


def _levels() -> str:
    """Every level of wrist A with friction."""
    fem = solid(LINEAR["A, μ = 0.13"])
    columns = zip(fem.loads, fem.angles.sum(axis=1), *_totals(fem), strict=True)
    rows = [(f"{load.tension:g}", *(f"{angle:.1f}" for angle in row)) for load, *row in columns]
    return table(("tension, N", "finite elements, deg", f"{SHELL}, deg", f"{RIGID}, deg"), rows)


def _yielding() -> str:
    rows = []
    for name, case in YIELDING.items():
        fem, total = solid(case), solid(case).angles.sum(axis=1)
        angles = np.degrees(_compared(fem, fem.robot).notch_angle)
        parts = [_error(angles[:, part], fem.angles[:, part]) for part in (slice(4), 4)]
        totals = [_error(found, total) for found in _totals(fem)]
        rows.append((name, f"{total[-1]:.0f}", *parts, *totals))
    head = ("wrist", "bent to, deg", "notches 1 to 4", "notch 5", "total")
    return table((*head, f"total, {RIGID}"), rows)


def _sideways() -> str:
    both = {SHELL: sideways(wrist()), RIGID: sideways(rigid(wrist()))}
    rows = [
        (ends, f"{1e3 * twist[-1]:.2f}", _error(twist, fem[0]), f"{1e3 * bend[-1]:.2f}",
         _error(bend, fem[1]))
        for ends, (twist, bend, *fem) in both.items()
    ]  # fmt: skip
    _, _, twist, bend = both[SHELL]
    fem = ("finite elements", f"{1e3 * twist[-1]:.2f}", "–", f"{1e3 * bend[-1]:.2f}", "–")
    twisted = ("by", "twist of the tip, mrad", "any ring")
    return table((*twisted, "sideways bend of the tip, mrad", "any ring"), [fem, *rows])


def _notches() -> str:
    single, single_outside = single_notch()
    errors = {
        "bending, one notch between plates": single,
        "the same, outside the checked ranges": single_outside,
    }
    for depth in (0.972, 1.4, 1.458):
        errors[f"moment to closing, {depth:.2f} mm deep"] = moments(depth)
    names = {
        "strong": "bending sideways",
        "axial": "stretch",
        "coupling": "stretch by bending (neutral axis)",
        "torsion": "torsion",
        "shear centre": "shear centre",
        "shear": "shift by a force across, in the plane",
        "sway": "shift by a force across, sideways",
    }
    for use, kind in (("fit", "fitted"), ("judge", "kept back")):
        inside, outside = chain_bending(use)
        errors[f"bending, in a chain of notches, {kind}"] = inside
        errors[f"the same, outside the checked ranges, {kind}"] = outside
        errors |= {f"{names[name]}, {kind}": all_ for name, all_ in other_directions(use).items()}
    rows = []
    for name, values in errors.items():
        both = np.sqrt(np.mean(np.square(values))), np.abs(values).max()
        rows.append((name, len(values), *map(percent, both)))
    return table(("compared", "numbers", "root mean square", "largest"), rows)


def drawn(name: str, depth: float = 1.40, depth_at: str = "outer") -> nf.Robot:
    """Return wrist A or B of Pacheco 2021 as a drawing has it, of Nitinol never measured."""
    robot = nf.load_robot(f"pacheco2021-{name.lower()}")
    notch = replace(robot.notch[0], ends="shell", depth=depth, depth_at=depth_at)
    tendon = replace(robot.tendon[0], path="straight")
    return replace(
        robot, notch=(notch,), tendon=(tendon,), material=nf.Nitinol(), friction=nf.Capstan(0.18)
    )


def _angle(robot: nf.Robot, tension: float) -> float:
    return float(np.degrees(nf.solve(robot, nf.Load(tension=tension)).total_angle))


def _depth() -> str:
    rows = []
    for name in "AB":
        for tension in TENSIONS:
            less, angle, more = (
                _angle(drawn(name, 1.40 + by), tension) for by in (-STEP, 0.0, STEP)
            )
            change = 0.5 * (more - less)
            numbers = f"{tension:g}", f"{angle:.1f}", f"{change:.1f}", percent(change / angle, 0)
            rows.append((name, *numbers))
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
    makers = (_wrists, _levels, _yielding, _sideways, _notches, _depth, _readings)
    return {make.__name__[1:]: make() for make in makers}


def _both_ends(fem: Solid):
    """Paths of a wrist with elastic ends and with rigid ones, and how their lines look."""
    loads = nf.pull(0.0, fem.loads[-1].tension, steps=41)
    for robot, dashes in ((fem.robot, "-"), (rigid(fem.robot), "--")):
        path = nf.simulate(robot, loads).raise_if_failed()
        yield path, path.tension[:, 0], dashes


@picture("drawing_wrists.svg", 8.6, 3.4, 2)
def _draw_wrists(left: Axes, right: Axes) -> None:
    """Draw the total angle of both wrists, and of the notches of one."""
    dots = {"color": "k", "marker": "o", "ls": "", "ms": 4, "mfc": "none"}
    for name, colour in (("A, μ = 0.13", BLUE), ("B, no friction", VERMILLION)):
        fem = solid(LINEAR[name])
        for path, tension, dashes in _both_ends(fem):
            label = name if dashes == "-" else None
            angle = np.degrees(path.total_angle)
            left.plot(tension, angle, color=colour, ls=dashes, label=label)
        left.plot([load.tension for load in fem.loads], fem.angles.sum(axis=1), **dots)
    left.plot([], [], label="finite elements", **dots)
    left.plot([], [], color=GREY, label='ends = "shell"')
    left.plot([], [], color=GREY, ls="--", label='ends = "rigid"')
    left.legend(title="linear, 60 GPa")
    fem = solid(YIELDING["A, μ = 0.13"])
    for path, tension, dashes in _both_ends(fem):
        for notch, colour in zip((0, 2, 4), sequence_colours(3), strict=True):
            label = f"notch {notch + 1}" if dashes == "-" else None
            angle = np.degrees(path.notch_angle[:, notch])
            right.plot(tension, angle, color=colour, ls=dashes, label=label)
    for notch in (0, 2, 4):
        right.plot([load.tension for load in fem.loads], fem.angles[:, notch], **dots)
    right.legend(title="A, μ = 0.13, yielding")
    label_all((left, right), TENSION, TOTAL, "notch angle [deg]")


@picture("drawing_depth.svg", 8.6, 3.4, 2, sharey=True)
def _draw_depth(left: Axes, right: Axes) -> None:
    """Draw the total angle over the depth at one tension, and over the tension for five depths."""
    away, highest = np.linspace(-0.03, 0.03, 61), TENSIONS[-1]
    for name, colour in (("A", BLUE), ("B", VERMILLION)):
        angles = [_angle(drawn(name, 1.40 + by), highest) for by in away]
        left.plot(1e3 * away, angles, color=colour, label=f"wrist {name}")
    left.axvspan(-10.0, 10.0, color=GREEN, alpha=0.15, lw=0, label="±10 µm")
    label_all((left,), f"depth beyond 1.40 mm [µm], at {highest:g} N", TOTAL)
    loads = nf.pull(0.0, 3.5, steps=71)
    for by, colour in zip((-0.03, -0.01, 0.0, 0.01, 0.03), sequence_colours(5), strict=True):
        path = nf.simulate(drawn("A", 1.40 + by), loads).raise_if_failed()
        label = f"{1.40 + by:.2f} mm deep"
        right.plot(path.tension[:, 0], np.degrees(path.total_angle), color=colour, label=label)
    label_all((right,), f"{TENSION}, wrist A")
    right.set_ylim(bottom=0.0)
    for axes in (left, right):
        axes.legend()


def pictures(folder: Path) -> None:
    """Draw both pictures."""
    _draw_wrists(folder)
    _draw_depth(folder)
