"""Every example runs, and its number is that of an independent calculation.

The oracles (tests/oracles) are scalar equations of Pacheco 2021 and matrix exponentials; they
share no code with the package. All examples run in one process, for they share programs.
"""

from __future__ import annotations

import contextlib
import io
import re
import runpy
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

import notchflex as nf
from backbones import continuous
from balance import left_over
from oracles import frames
from oracles.wrist import A, Wrist
from reference_data import choose, reference

ROOT = Path(__file__).resolve().parents[2]
FILES = {int(file.name[:2]): file for file in sorted((ROOT / "examples").glob("*.py"))}
LONG = (19,)
ANGLE = 1e-8  # rad; what the tables and oracles are met to elsewhere


@cache
def ran(number: int) -> tuple[dict[str, Any], str]:
    """Names that an example leaves, and what it prints."""
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        names = runpy.run_path(str(FILES[number]))
    return names, printed.getvalue()


def test_each_has_its_number_and_asks_a_question():
    assert len(FILES) == len(list((ROOT / "examples").glob("*.py"))) >= 11
    for number, file in FILES.items():
        assert file.name.startswith(f"{number:02d}_")
        text = file.read_text(encoding="utf-8")
        assert re.match(r'"""[^"]*\?"""\n', text), f"{file.name} begins with no question"
        assert 13 <= len(text.splitlines()) <= 50, file.name


@pytest.mark.parametrize(
    "number",
    [pytest.param(one, marks=pytest.mark.nightly) if one in LONG else one for one in FILES],
)
def test_page_shows_the_example_and_what_it_prints(number):
    page = (ROOT / "docs" / "examples.md").read_text(encoding="utf-8")
    _, printed = ran(number)
    text = FILES[number].read_text(encoding="utf-8")
    question, code = re.match(r'"""(.*?)"""\n\n(.*)', text, re.DOTALL).groups()
    part = f"## {question}\n\n`examples/{FILES[number].name}`\n\n"
    part += f"```python\n{code}```\n\n```text\n{printed}```\n"
    assert part in page, "run docs/make/examples.py"


def test_first_bend(margin):
    path = ran(1)[0]["path"]
    rows = choose(reference("pacheco_force_curves.csv"), cut=(0, 0), wrist=(1, 0))[::2]
    margin.within("total angle", path.total_angle - np.radians(rows[:, 8]), ANGLE, "rad")
    margin.within("tip", path.tip_position[:, [0, 2]] - rows[:, 9:11], 1e-7, "mm")


def test_my_own_tube(margin):
    names = ran(2)[0]
    oracle = Wrist(
        height=(0.9,) * 5,
        uncut=(1.1,) * 5,
        depth=(1.53,) * 5,
        wrap="geometric",
        cut="off-axis",
        outer_diameter=1.80,
        inner_diameter=1.50,
    )
    expected = [state.angle for state in oracle.march(names["path"].tension[:, 0])]
    margin.within("notch angles", names["path"].notch_angle - expected, ANGLE, "rad")
    angle = names["closing"].angle
    margin.within("closing angle", angle - oracle.closing_angle, ANGLE, "rad")
    # The fibres farthest from the neutral line: the cut's edge, and the spine's outer surface.
    section = oracle.sections[0]
    edge = oracle.depth[0] - oracle.outer_diameter / 2  # of a straight cut, beyond the axis
    far = max(oracle.outer_diameter / 2 - section.centroid, section.centroid - edge)
    strain = np.max(expected, axis=1) * far / 0.9
    safe = names["last_safe"]
    assert strain[safe] <= 0.08 < strain[safe + 1]


def test_pull_and_release(margin):
    names = ran(3)[0]
    expected = np.sum([state.angle for state in A.march(names["path"].tension[:, 0])], axis=1)
    margin.within("loop", names["path"].total_angle - expected, ANGLE, "rad")
    width = np.degrees(expected[::-1] - expected)[:31]
    assert names["widest"] == width.argmax()
    margin.within("its width", names["width"].max() - width.max(), 5e-10, "deg")


def test_closing_order(margin):
    names = ran(4)[0]
    oracle = A.with_(depth=names["depths"])
    found = names["found"]
    margin.within("angle", found.angle - oracle.closing_angle, ANGLE, "rad")

    def left(tension: float, notch: int) -> float:
        """Moment that the tendon has beyond what the notch carries when it is just closed."""
        closed = oracle.closing_angle[notch]
        gap_tension = tension * np.exp(-oracle.mu * ahead(tension, notch))
        gap_tension *= np.exp(-oracle.mu * closed)
        return gap_tension * oracle.arm[notch] - oracle.elastic_moment(notch, closed)

    def ahead(tension: float, notch: int) -> float:
        return float(oracle.pull(tension)[0][:notch].sum())

    expected = [brentq(left, 0.5, 4.0, args=(notch,), xtol=1e-12) for notch in range(5)]
    margin.within("tension", found.tension - expected, 1e-9, "N")
    assert np.argsort(found.tension).tolist() == [4, 3, 2, 1, 0]


def test_weight_at_the_tip(margin):
    names = ran(5)[0]
    path, grams = names["path"], np.array(names["weights"])
    force, moment = left_over(path)
    margin.within("force left over, of all that acts", force, 1e-11)
    margin.within("moment left over, of all that acts", moment, 1e-11)
    # Where the first notch begins: the tendon's lever and the weight's, about its neutral line.
    # The weight's lever changes along the notch; the modes meet that to moment_error.
    weight = 9.81e-3 * grams
    by_hand = path.span_tension[:, 0, 1] * A.arm[0]
    by_hand += weight * (path.tip_position[:, 0] + A.centroid[0])
    error = path.notch_moment[:, 0] / by_hand - 1.0
    margin.within("moment of the first notch", error, 2e-3)
    margin.within("without weight", path.notch_angle[0] - A.pull(0.8)[0], ANGLE, "rad")
    assert (np.diff(path.total_angle) > 0.0).all()


def test_stroke_and_tension(margin):
    path = ran(6)[0]["path"]
    margin.within("stroke", A.stroke(path.notch_angle) - path.stroke[:, 0], 1e-11, "mm")
    margin.within("stroke as given", path.stroke - path.load.stroke, 1e-11, "mm")
    # The tensions found, given to the oracle in the same order, lead to the same angles.
    expected = [state.angle for state in A.march(path.tension[:, 0])]
    margin.within("angles", path.notch_angle - expected, 1e-11, "rad")


def test_antagonist(margin):
    names = ran(7)[0]
    sides = np.radians([0.0, 180.0])
    wrist = A.with_(height=(0.8,) * 6, uncut=(0.8,) * 6, depth=(1.36,) * 6, wrap="geometric")
    oracle = frames.Robot(wrist, np.tile(sides, 3), frames.Tendons(np.full(2, 0.7), sides))
    for other, state in zip(names["pretensions"], names["path"], strict=True):
        angle, _ = oracle.equilibrium(np.array([1.0, other]))
        margin.within(f"against {other} N", state.notch_angle - angle, 1e-11, "rad")
        total = angle[0::2].sum() - angle[1::2].sum()
        margin.within("total", state.total_angle - total, 1e-11, "rad")


def test_two_axis_workspace(margin):
    names = ran(8)[0]
    quarters = np.radians([0.0, 90.0, 180.0, 270.0])
    wrist = A.with_(height=(1.0,) * 8, uncut=(0.6,) * 8, depth=(1.30,) * 8, wrap="geometric")
    oracle = frames.Robot(wrist, np.tile(quarters, 2), frames.Tendons(np.full(4, 0.7), quarters))
    assert names["found"]["converged"].all()
    base = np.array([0.0, 0.0, 0.6])  # uncut before the first notch
    for row in (0, 13, 26, 33):
        angle, gap_tension = oracle.equilibrium(np.array(names["loads"][row].tension))
        expected = oracle.bodies(angle)[-1, :3, 3] + base
        reach = np.hypot(*expected[:2])
        # The oracle's notches bend toward their own side alone; those of the wrist give a little
        # sideways too, which is 4 % of the way and here added to first order.
        error = names["tip"][row] - expected - given_sideways(oracle, angle, gap_tension)
        margin.within("tip, of its way aside", np.linalg.norm(error) / reach, 0.004)


def given_sideways(robot: frames.Robot, angle: np.ndarray, gap_tension: np.ndarray) -> np.ndarray:
    """What tendons beside the plane of bending add to the tip [mm], linear and to first order."""
    wrist, bodies = robot.wrist, robot.bodies(angle)
    ro, ri = wrist.outer_diameter / 2, wrist.inner_diameter / 2
    added = np.zeros(3)
    for j, way in enumerate(robot.direction):
        half = np.arccos(wrist.depth[j] / ro - 1.0)  # half the angle of the annular sector left
        second_moment = (ro**4 - ri**4) / 4 * (half - np.sin(half) * np.cos(half))
        lever = robot.tendons.radius * np.sin(robot.tendons.direction - way)
        moment = (gap_tension[j] * lever).sum()
        turned = moment * wrist.height[j] / (wrist.material.elastic_modulus * second_moment)
        axis = (bodies[j] @ frames.about_z(way))[:3, 0]
        middle = (bodies[j] + bodies[j + 1])[:3, 3] / 2
        added -= turned * np.cross(axis, bodies[-1, :3, 3] - middle)
    return added


def test_compare_with_my_data(margin):
    names = ran(9)[0]
    table = np.genfromtxt(io.StringIO(names["MEASURED"]), delimiter=",", skip_header=1)
    oracle = A.with_(mu=names["mu"])
    expected = [oracle.pull(force)[0].sum() for force in table[:, 0]]
    error = np.degrees(expected) - table[:, 1:].sum(axis=1)
    found = np.degrees(names["found"].rmse_total)
    margin.within("error of the total", found - np.sqrt(np.mean(error**2)), 5e-11, "deg")


def test_what_friction_does(margin):
    names = ran(10)[0]
    for mu, bend, loop in zip(names["coefficients"], names["bends"], names["loops"], strict=True):
        states = A.with_(mu=mu).march(names["way"].tension[:, 0])
        angle = np.degrees([state.angle.sum() for state in states])
        margin.within(f"bend at mu {mu}", bend - angle[30], 2e-9, "deg")
        margin.within("loop", loop - (angle[::-1] - angle)[:31].max(), 2e-9, "deg")


def test_from_robot_to_cut_file(margin):
    pytest.importorskip("ezdxf", reason="needs the extra export")
    names = ran(12)[0]
    half = np.arccos(1.0 - 1.4 / 0.81)
    wanted = np.array([0.8, 2.0 * 0.81 * half]) - names["kerf"]
    margin.within("path of the beam", names["window"] - wanted, 1e-11, "mm")
    wide = half + 0.5 * names["kerf"] / 0.81
    larger = A.with_(
        depth=(0.81 * (1.0 - np.cos(wide)),) * 5,
        height=(0.8 + names["kerf"],) * 5,
        uncut=(1.2 - names["kerf"],) * 5,
    )
    expected = [np.degrees(one.pull(1.0)[0].sum()) for one in (A, larger)]
    margin.within("bends", names["bends"] - np.array(expected), 1e-9, "deg")


def test_run_it_in_mujoco(margin):
    """MuJoCo shares no code with the chain."""
    pytest.importorskip("mujoco", reason="needs the extra robotics")
    names, printed = ran(13)
    chain, angle = names["chain"], names["angle"]
    margin.within("total angle, part of its range", (angle - chain) / np.ptp(chain), 0.02)
    assert "area of the loop: 1.0" in printed


def test_which_dimension_to_control():
    names, printed = ran(11)
    found = names["found"]
    # Steeper than any other: a deviation of 5 % of the modulus, by its own difference.
    bends = [
        nf.solve(names["wrist"].with_value("material.elastic_modulus", modulus), nf.Load(0.9))
        for modulus in (9990.0, 10010.0)
    ]
    spread = 500.0 * abs(bends[1].total_angle - bends[0].total_angle) / 20.0
    index = found.sources.index("material.elastic_modulus")
    assert abs(found.linear.spread[0, index]) == pytest.approx(spread, rel=1e-4)
    assert found.order[0] == index
    assert "check material.elastic_modulus" in printed


def test_what_pushes_at_the_tip():
    names, printed = ran(15)
    sensed, push = names["sensed"], np.array(names["push"])
    assert ((sensed.low[:, 0] <= push) & (sensed.high[:, 0] >= push)).all()
    assert sensed.contact.tolist() == (push > 0.0).tolist()
    # Where the tendon sticks another force, solved by itself, gives the same stroke.
    other = names["read"].load[:5]
    moved = (nf.Load(tip_force=(0.0165, 0.0, 0.0)).external,)
    changed = nf.LoadPath(other.tension, other.stroke, external=(*other.external[:4], *moved))
    stroke = nf.simulate(names["wrist"], changed).stroke[-1, 0]
    assert abs(stroke - names["read"].stroke[4, 0]) < 1e-5
    assert "sticks" in printed.splitlines()[4]


def test_workspace_within_limits():
    names, _ = ran(16)
    careful, wrist = names["careful"], names["wrist"]
    assert careful.strain.max() <= 0.04
    # The last robot, pulled as far by itself, is at the limit.
    state = nf.solve(wrist, nf.Load(tension=float(careful.tension.max())))
    assert state.peak_strain.max() == pytest.approx(0.04, rel=2e-3)
    assert careful.angle.max() == pytest.approx(state.total_angle, abs=1e-6)


def test_follow_with_hysteresis(margin):
    """The tensions found are those at which a fine loop has the angles, on its own branch."""
    names, _ = ran(14)
    wrist, found, angle = names["wrist"], names["found"], names["angle"]
    peak = float(found.tension[2, 0])
    loop = nf.simulate(wrist, nf.pull(0.0, peak, steps=4001).release())
    total, tension = loop.total_angle, loop.tension[:, 0]
    for target, branch in ((0, slice(0, 4001)), (1, slice(0, 4001)), (3, slice(4001, None))):
        at = np.argsort(total[branch], kind="stable")
        expected = np.interp(angle[target], total[branch][at], tension[branch][at])
        margin.within("tension", found.tension[target, 0] - expected, 2e-6, "N")


def test_learning(margin):
    pytest.importorskip("gymnasium", reason="needs the extra learn")
    names, printed = ran(17)
    assert np.median(names["missed"]) < 1e-4  # of the policy that knows the history
    assert float(re.search(r"misses by ([\d.]+) mm", printed)[1]) > 0.1
    # The wrists after their first step, by the equations of the paper.
    settings = names["envs"].unwrapped.settings
    seen = names["observations"]
    angle, _ = A.pull(settings.change)
    margin.within("tension", seen[:, 0] * settings.largest - settings.change, 1e-12, "N")
    tip = nf.tip_from_angles(settings.model, np.array(angle))[0]
    margin.within("tip", seen[:, 1:4] * settings.length - tip, 1e-11, "mm")


def test_sweep_of_designs():
    """The best wrist has the same angle and strain as by itself; its neighbours are no better."""
    names, printed = ran(18)
    best, rows = names["best"], names["rows"]
    wrist = nf.load_robot("pacheco2021-a")
    for one in (best, rows.row(-1, named=True)):
        values = {name: one[name] for name in ("notch.depth", "notch.height")}
        state = nf.solve(wrist.with_values(values), nf.Load(tension=1.0))
        assert np.degrees(state.total_angle) == pytest.approx(one["total_angle_deg"], rel=2e-5)
        assert state.peak_strain[0] == pytest.approx(one["peak_strain_1"], rel=2e-5)
    assert rows["total_angle_deg"].is_between(55.0, 65.0).all()
    assert len(rows) == names["found"].counts["accepted"]
    assert f"{len(rows)} of 4096" in printed


def test_disks_on_a_backbone():
    """Twenty disks are near the continuous tendon, whose backbone is integrated."""
    _, printed = ran(20)
    found = [
        list(map(float, re.findall(r"-?[0-9.]+(?=[, ])", line))) for line in printed.splitlines()
    ]
    outward = np.eye(3)[0]

    def parallel(at: float) -> tuple[np.ndarray, np.ndarray]:
        return 10.0 * outward, 0.0 * outward

    def converging(at: float) -> tuple[np.ndarray, np.ndarray]:
        return (10.0 - 6.0 * at / 400.0) * outward, -6.0 / 400.0 * outward

    def winding(at: float) -> tuple[np.ndarray, np.ndarray]:
        angle = np.pi * at / 400.0
        cosine, sine = np.cos(angle), np.sin(angle)
        place = 10.0 * np.array([cosine, sine, 0.0])
        return place, 10.0 * np.pi / 400.0 * np.array([-sine, cosine, 0.0])

    for path, (*tip, _) in zip((parallel, converging, winding), found, strict=True):
        np.testing.assert_allclose(tip, continuous(path, 3.0, 400.0), atol=0.01 * 400.0)


@pytest.mark.nightly
def test_angles_from_photographs():
    """The interval holds the friction that bent the wrist, and the angles those that were drawn."""
    names, _ = ran(19)
    for one, angles in zip(names["found"].photographs, names["path"].notch_angle, strict=True):
        np.testing.assert_allclose(one.notch_angle, angles, atol=np.radians(0.3))
    interval = names["interval"]
    assert 0.17 < interval.lower < 0.18 < interval.upper < 0.19


def test_in_the_body():
    """At 37 deg C the wrist is one whose plateau lies 15 K times 6.5 MPa/K higher."""
    names, _ = ran(22)
    wrist = nf.load_robot("pacheco2021-a-true")
    higher = wrist.with_value("material.plateau_stress", wrist.material.plateau_stress + 97.5)
    for tension, angle in zip(names["tensions"], names["angles"][37.0], strict=True):
        state = nf.solve(higher, nf.Load(tension=tension))
        assert np.degrees(state.total_angle) == pytest.approx(angle, abs=1e-9)


def test_strain_cycle():
    """Mean and amplitude from rest to the strain e are e / 2: 0.55 % - 0.13 e / 2 = e / 2."""
    names, _ = ran(23)
    assert names["bent"].peak_strain.max() == pytest.approx(2.0 * 0.0055 / 1.13, abs=1e-7)


def test_what_a_bent_shaft_costs(margin):
    """Tensions, and stretch while the wire slides one way, are those of Euler's rope."""
    names, printed = ran(24)
    loop, limit = names["loop"], 0.15 * np.pi
    drive, base = loop.tension[:, 0], loop.base_tension[:, 0]
    held = np.clip(1.5 * np.exp(-limit), None, drive * np.exp(limit))
    margin.within("base", base - held, 1e-12, "N")
    wire = 1000.0 / 14137.0 * np.abs(drive - base) / limit
    stretch = (loop.stroke - loop.base_stroke)[:, 0]
    margin.within("stretch", (stretch - wire)[[0, 4, 5]], 1e-12, "mm")
    # The base falls at 0.58 N; the first contact of the wrist holds on until 0.5 N.
    moved = np.abs(loop.total_angle - loop.total_angle[0]) > 1e-9
    assert moved.tolist() == [False] * 5 + [True]
    assert (held < held[0]).tolist() == [False] * 4 + [True] * 2
    angle, _ = A.pull(1.5 * np.exp(-2.0 * limit))
    assert f"bent by 360 deg: {np.degrees(np.sum(angle)):5.1f} deg" in printed


def test_measured_joint_and_shaft():
    """Every joint has the moment of its tension, by a spline of SciPy through the points."""
    names, printed = ran(21)
    path, robot = names["path"], names["chain"]
    tension = path.span_tension[:, 0, 1::2][:, :4]  # in the gaps; along the wall the arm is 1.4
    angle, moment = (
        np.array([*np.negative(one[::-1]), 0.0, *one]) for one in (names["angle"], names["moment"])
    )
    angle = np.radians(angle)
    curve = CubicHermiteSpline(angle, moment, np.gradient(moment, angle, edge_order=2))
    np.testing.assert_allclose(curve(path.notch_angle), 1.4 * tension, rtol=1e-9, atol=1e-12)
    assert robot.number_of_notches == 4
    # The shaft bends by its moment over its stiffness, three times.
    state = nf.solve(names["both"], nf.Load(tension=1.0))
    shaft = np.degrees(0.7 * state.span_tension[0, 1:6:2] / 55.0)
    np.testing.assert_allclose(np.degrees(state.notch_angle[:3]), shaft, rtol=1e-9)
    assert f"the wrist bends {np.degrees(state.notch_angle[-5:].sum()):.2f} deg" in printed
