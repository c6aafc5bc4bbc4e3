"""Draws the pictures of the pages on sweeps, tolerances, sensing, sheaths, workspaces and nitinol.

`python docs/make/analyses.py [FOLDER]` writes to docs/images; FOLDER has the measured angles of
Pacheco 2021, which one picture needs.
"""

from __future__ import annotations

import csv
import sys
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from pictures import HOLLOW, IMAGES, TENSION, TOTAL, beside, label_all, picture, shown_file

import notchflex as nf
from notchflex.plotting import sensed_picture, sweep_picture
from notchflex.plotting.style import BLUE, GREEN, VERMILLION
from notchflex.support import law_errors

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
from fem_wrists import drawn, drawn_wrists, solid


def sweep(images: Path = IMAGES) -> None:
    """The plan that the page on sweeps shows."""
    with tempfile.TemporaryDirectory() as folder:
        file = shown_file("sweep.md", "plan.toml", Path(folder))
        swept = nf.sweep(file, Path(folder) / "swept")
        picture = sweep_picture(swept, "notch.depth", "total_angle_deg_step_3")
        picture.save(images / "sweep.svg")


def tolerances(images: Path = IMAGES) -> None:
    """The limits that the page on tolerances shows."""
    with tempfile.TemporaryDirectory() as folder:
        file = shown_file("tolerances.md", "limits.toml", Path(folder))
        made = nf.tolerance_analysis(nf.load_robot("pacheco2021-a"), file, draws=6400)
    nf.plot(made).save(images / "tolerances.svg")


def sensing(images: Path = IMAGES) -> None:
    """A force that comes, stays and goes while a wrist is pulled, let go and pulled again."""
    wrist = nf.load_robot("pacheco2021-a")
    tension = [*np.linspace(0.1, 0.8, 8), 0.784, 0.784, 0.76, 0.7, 0.6, 0.5, 0.51, 0.53, 0.6, 0.7]
    force = np.array([0.0] * 4 + [0.01] + [0.02] * 9 + [0.005] * 4)
    tensions = np.array(tension)[:, None]
    external = tuple(nf.Load(tip_force=(x, 0.0, 0.0)).external for x in force)
    load = nf.LoadPath(tensions, np.full_like(tensions, np.nan), external=external)
    path = nf.simulate(wrist, load).raise_if_failed()
    noise = 0.003 * np.random.default_rng(2).normal(size=(2, len(force), 1))
    sensors = nf.SensorNoise(tension=0.003, stroke=0.003)
    sensed = nf.sense(wrist, path.tension + noise[0], path.stroke + noise[1], noise=sensors)
    sensed_picture(sensed, truth=force[:, None]).save(images / "sensing_history.png")


def workspace(images: Path = IMAGES) -> None:
    """The workspace of the two-axis wrist."""
    robot = nf.load_robot("two-axis-wrist")
    nf.plot(nf.workspace(robot, states=20_000, stiffness=300)).save(images / "workspace.png")


@picture("transmission.svg", 7.2, 2.9, columns=3)
def transmission(by_tension: Axes, by_stroke: Axes, along: Axes) -> None:
    """Loops of wrist A behind the sheath of the page, at three bends, and ln T along the sheath."""
    sheath = {
        "length": 1000.0, "friction": 0.15, "bend_deg": 180.0, "wire_stiffness": 14137.0
    }  # fmt: skip
    named = {f"tendon.sheath_{key}": value for key, value in sheath.items()}
    wrist = nf.load_robot("pacheco2021-a").with_values(named)
    up, down = np.linspace(0.0, 2.0, 81), np.linspace(2.0, 0.0, 81)
    part = np.concatenate([up, down[:50], np.linspace(down[49], 1.6, 40), np.linspace(1.6, 0, 60)])
    for bend, colour in ((0.0, BLUE), (90.0, GREEN), (180.0, VERMILLION)):
        loads = [nf.Load(tension=tension, sheath_bend_deg=bend) for tension in part]
        path = nf.simulate(wrist, loads).raise_if_failed()
        angle = np.degrees(path.total_angle)
        by_tension.plot(path.tension, angle, color=colour, lw=1.0, label=f"{bend:.0f} deg")
        by_stroke.plot(path.stroke, angle, color=colour, lw=1.0)
    by_tension.legend()
    for step, label in ((81, "pulled"), (110, "let go"), (150, "pulled again")):
        memory = path.run.solved.memory.sheath
        along.plot(memory.place[step, 0], np.exp(memory.level[step, 0]), lw=1.0, label=label)
    along.legend()
    by_tension.set(xlabel="tension of the drive [N]", ylabel=TOTAL)
    by_stroke.set(xlabel="way of the drive [mm]", ylabel=TOTAL)
    along.set(xlabel="place: drive to base", ylabel="tension of the wire [N]")


@picture("temperature.svg", 4.2, 2.9)
def temperature(axes: Axes) -> None:
    """Loops of wrist A with elastic ends in the workshop and in the body."""
    known = {"reference_temperature": 22.0, "unloading_stress": 220.0}
    named = {f"material.{key}": value for key, value in known.items()}
    wrist = nf.load_robot("pacheco2021-a-true").with_values(named)
    for celsius, colour in ((22.0, BLUE), (37.0, VERMILLION)):
        loop = nf.pull(0.0, 1.4, steps=57).release().loaded(temperature=celsius)
        path = nf.simulate(wrist, loop).raise_if_failed()
        angle = np.degrees(path.total_angle)
        axes.plot(path.tension, angle, color=colour, label=f"{celsius:.0f} °C")
    axes.legend()
    axes.set(xlabel=TENSION, ylabel=TOTAL)


def fatigue(images: Path = IMAGES) -> None:
    """The cycle of the page on strain cycles."""
    wrist = nf.load_robot("pacheco2021-a-true").with_value("fatigue.line", "cao2020")
    path = nf.simulate(wrist, nf.pull(0.0, 0.5, steps=6).release())
    nf.plot(nf.strain_cycle(path)).save(images / "fatigue.svg")


@picture("accuracy.svg", 7.2, 2.9, columns=3)
def accuracy(*axes: Axes, measured: Path) -> None:
    """Every wrist of finite elements and every measured one, against the law from the drawing."""
    total, off, off_last = axes
    sizes: list[tuple[float, float]] = []

    def compare(bent: np.ndarray, found: np.ndarray, colour: str) -> None:
        """Add the levels of a wrist: angles of its notches, or the total where one angle stands."""
        sums, last = (bent.sum(axis=1), found.sum(axis=1)), (bent[:, -1], found[:, -1])
        beside(total, sums[::-1], colour)
        beside(off, (sums[1], 100.0 * (sums[0] / sums[1] - 1.0)), colour)
        if found.shape[1] > 1:
            beside(off_last, (last[1], 100.0 * (last[0] / last[1] - 1.0)), colour)

    for rows in drawn_wrists():
        robot = drawn(rows[0])
        found = np.array([str(row["angles_deg"]).split() for row in rows], float)
        path = nf.simulate(robot, [nf.Load(tension=row["tension_N"]) for row in rows])
        bent = np.where(path.converged[:, None], np.degrees(path.notch_angle), np.nan)
        sizes.append(tuple(law_errors(robot).values()))
        nitinol = isinstance(rows[0]["material"], str)
        colour = GREEN if nitinol else BLUE if rows[0]["use"] == "fit" else VERMILLION
        compare(bent, found, colour)
    for case in ("A_lin_mu0", "B_lin_mu0", "A_lin_mu013"):
        wrist = solid(f"{case}_medium")
        bent = np.degrees(nf.simulate(wrist.robot, wrist.loads).notch_angle)
        compare(bent, wrist.angles, BLUE)
    for letter in "abc":
        robot = nf.load_robot(f"pacheco2021-{letter}-true")
        file = measured / f"pacheco2021_wrist_{letter.upper()}_measured.csv"
        with file.open(encoding="utf-8") as lines:
            table = [
                (float(row["tendon_force_N"]), float(row["total_deg"]))
                for row in csv.DictReader(lines)
            ]
        force, seen = np.array(sorted(table)).T.clip(0.0)
        path = nf.simulate(robot, [nf.Load(tension=one) for one in force])
        total.plot(seen, np.degrees(path.edge_angle).sum(axis=1), "x", color="k", ms=3)
    total.plot([0, 160], [0, 160], color="0.6", lw=0.8, zorder=0)
    for one, size in zip((off, off_last), 100.0 * np.median(sizes, axis=0), strict=True):
        for part, shade in ((2.0, "0.92"), (1.0, "0.83")):
            one.axhspan(-part * size, part * size, color=shade, lw=0.0, zorder=0)
        one.set_ylim(-15.0, 15.0)
    for colour, label in ((BLUE, "fitted"), (VERMILLION, "kept back"), (GREEN, "nitinol")):
        total.plot([], [], "o", color=colour, label=label, **HOLLOW)
    total.plot([], [], "x", color="k", ms=3, label="measured")
    total.legend()
    label_all(axes, "total, found [deg]", "total, predicted [deg]", "error of the total [%]")
    off_last.set(xlabel="last notch, found [deg]", ylabel="error of the last notch [%]")


if __name__ == "__main__":
    for draw in (sweep, tolerances, sensing, workspace, transmission, temperature, fatigue):
        draw()
    if len(sys.argv) > 1:
        accuracy(measured=Path(sys.argv[1]))
