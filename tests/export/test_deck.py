"""Decks of finite elements: their mesh, their tendons, and CalculiX running them."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import notchflex as nf
from fem_rings import RingMotion, read_rings
from fem_wrists import solid, wrist
from margins import Margin
from notchflex.export.deck import ring_layers, tendon_spans
from notchflex.export.formats import DeckOptions
from notchflex.export.mesh import mesh_of
from reference_data import named_rows
from refusals import refused

COARSE = DeckOptions.of_mesh("coarse")
MEDIUM = DeckOptions.of_mesh("medium")

needs_ccx = pytest.mark.skipif(
    shutil.which("ccx") is None, reason="needs ccx, of Debian's package calculix-ccx"
)


def one_notch(**keys: Any) -> nf.Robot:
    """One off-axis notch between two rings, linear elastic."""
    notch = {"depth": 1.4, "height": 0.8, "uncut_length": 1.2}
    return nf.Robot(
        name="one notch",
        tube=nf.Tube(1.62, 1.40, base_length=1.2),
        notch=(nf.ArcNotch("off-axis", **(notch | keys)),),
        tendon=(nf.Tendon(0.70, path="straight"),),
        material=nf.Linear(60_000.0, poisson_ratio=0.33),
        friction=nf.Frictionless(),
    )


def turned(by: float = 0.0, cut: Any = "on-axis", **keys: Any) -> nf.Robot:
    """Two notches that open to sides 90 deg apart, with long rings; a tendon for each."""
    notch = {"depth": 1.3, "height": 1.0, "uncut_length": 3.0, "ends": "shell"} | keys
    sides = (by, by + 90.0)
    return nf.Robot(
        name="turned notches",
        tube=nf.Tube(1.62, 1.40, base_length=3.0),
        notch=tuple(nf.ArcNotch(cut, direction_deg=side, **notch) for side in sides),
        tendon=tuple(nf.Tendon(0.70, path="straight", direction_deg=side) for side in sides),
        material=nf.Linear(60_000.0, poisson_ratio=0.33),
        friction=nf.Frictionless(),
    )


def run(subject: Any, options: DeckOptions, folder: Path) -> RingMotion:
    """Write a deck, run CalculiX as the deck says, read the rings."""
    robot = subject if isinstance(subject, nf.Robot) else subject.robot
    nf.export_robot(subject, folder / "deck.inp", options)
    alone = {**os.environ, "OMP_NUM_THREADS": "1"}
    subprocess.run(["ccx", "deck"], cwd=folder, env=alone, check=True, capture_output=True)
    pulled = [0] if isinstance(subject, nf.Robot) else np.flatnonzero(subject.tension[-1] > 0.0)
    return read_rings(
        mesh_of(robot, options, [int(one) for one in pulled]), (folder / "deck.dat").read_text()
    )


def jacobians(mesh: Any) -> np.ndarray:
    """Return 8 times the determinant at 27 Gauss points of every element, with their weights."""
    corners = np.array(
        [
            *[(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1)],
            *[(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)],
            *[(0, -1, -1), (1, 0, -1), (0, 1, -1), (-1, 0, -1)],
            *[(0, -1, 1), (1, 0, 1), (0, 1, 1), (-1, 0, 1)],
            *[(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)],
        ]
    )
    at, weight = np.polynomial.legendre.leggauss(3)
    points = np.stack(np.meshgrid(at, at, at, indexing="ij"), -1).reshape(-1, 3)
    weights = np.einsum("i,j,k->ijk", weight, weight, weight).ravel()

    def shape(x: np.ndarray) -> np.ndarray:
        own = 1.0 + corners * x
        middle = corners == 0
        value = np.where(middle, 1.0 - x**2, own).prod(axis=1)
        at_corner = ~middle.any(axis=1)
        return np.where(at_corner, value * ((corners * x).sum(axis=1) - 2.0) / 8.0, value / 4.0)

    step = 1e-5
    slopes = [
        np.stack([(shape(x + e) - shape(x - e)) / (2 * step) for e in step * np.eye(3)])
        for x in points
    ]
    place = mesh.place[mesh.elements - 1]
    found = [np.linalg.det(np.einsum("an,mnb->mab", slope, place)) for slope in slopes]
    return np.array(found) * weights[:, None]


def check_mesh_fills(mesh: Any, cut: str, part: float) -> None:
    """The volume of a part of a tube with notches of 1.3 and 1.42 mm, without inverted elements."""
    parts = jacobians(mesh)
    assert parts.min() > 0.0
    tube = np.pi * (0.81**2 - 0.70**2)
    section = nf.annular_sector if cut == "on-axis" else nf.annular_segment
    areas = [float(section(0.81, 0.70, depth).area) for depth in (1.3, 1.42)]
    volume = part * (3 * 1.2 * tube + 0.8 * sum(areas))
    assert parts.sum() == pytest.approx(volume, rel=1e-4)
    assert len(np.unique(mesh.elements)) == len(mesh.place)


@pytest.mark.parametrize("cut", ["on-axis", "off-axis"])
def test_the_mesh_fills_half_of_the_tube(cut: Any) -> None:
    robot = one_notch().replace(
        notch=tuple(
            nf.ArcNotch(cut, depth=depth, height=0.8, uncut_length=1.2) for depth in (1.3, 1.42)
        )
    )
    mesh = mesh_of(robot, MEDIUM)
    check_mesh_fills(mesh, cut, 0.5)


def test_nodes_lie_on_the_cuts() -> None:
    mesh = mesh_of(one_notch(), MEDIUM)
    layer = mesh.place[mesh.layer(mesh.faces[0].sum() // 2) - 1]
    radius = np.linalg.norm(layer[:, :2], axis=1)
    for at in np.linspace(0.70, 0.81, 2 * MEDIUM.wall + 1):
        assert layer[abs(radius - at) < 1e-9, 0].max() == pytest.approx(0.81 - 1.4)
    assert mesh.heights[mesh.faces[0]] == pytest.approx([1.2, 2.0])


@pytest.mark.parametrize("cut", ["on-axis", "off-axis"])
@pytest.mark.parametrize("side", [90.0, 155.0, 180.0])
def test_the_mesh_of_a_whole_tube(cut: Any, side: float) -> None:
    notches = [nf.ArcNotch(cut, d, 0.8, uncut_length=1.2, direction_deg=a)
               for d, a in ((1.3, 20.0), (1.42, 20.0 + side))]  # fmt: skip
    robot = one_notch().replace(notch=tuple(notches))
    mesh = mesh_of(robot, MEDIUM)
    check_mesh_fills(mesh, cut, 1.0)
    for notch, faces in zip(notches, mesh.faces, strict=True):
        layer = mesh.layer(faces.sum() // 2)
        direction = np.radians(notch.direction_deg)
        along = mesh.place[layer - 1, :2] @ [np.cos(direction), np.sin(direction)]
        at_edge = 0.81 * (notch.depth / 0.81 - 1.0)  # of the outer surface, from the axis
        assert -along.max() == pytest.approx(at_edge if cut == "off-axis" else at_edge * 0.7 / 0.81)


def test_the_mesh_of_a_turned_robot_is_the_turned_mesh() -> None:
    first, second = (mesh_of(turned(by), COARSE, [0, 1]) for by in (0.0, 90.0))
    quarter = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    order = [np.lexsort(np.round(one, 9).T) for one in (first.place @ quarter, second.place)]
    assert (first.place @ quarter)[order[0]] == pytest.approx(second.place[order[1]], abs=1e-12)
    assert not first.is_half


def test_short_rings_between_turned_notches_are_warned_of(tmp_path: Path) -> None:
    for uncut, warned in ((0.6, True), (3.0, False)):
        robot = turned(uncut_length=uncut)
        options = DeckOptions.of_mesh("coarse", tip_moment=0.1)
        report = nf.export_robot(robot, tmp_path / "a.inp", options)
        assert any("opens to another side" in one for one in report.warnings) is warned


def test_tendons_of_a_whole_tube_lie_on_their_sides() -> None:
    robot = turned(20.0)
    mesh = mesh_of(robot, COARSE, [0, 1])
    for tendon, side in enumerate(np.radians([20.0, 110.0])):
        for span in tendon_spans(robot, mesh, tendon, np.ones(4)):
            ends = mesh.place[[point.ties[0][0] - 1 for point in span.ends], :2]
            assert ends == pytest.approx(
                np.tile(0.7 * np.array([np.cos(side), np.sin(side)]), (2, 1))
            )


def test_tendons_run_from_edge_to_edge() -> None:
    robot = wrist("A", 0.13)
    mesh = mesh_of(robot, COARSE)
    tension = np.linspace(1.0, 0.9, 10)
    spans = tendon_spans(robot, mesh, 0, tension)
    assert [span.tension for span in spans] == pytest.approx(tension)
    ends = np.array([[mesh.place[point.ties[0][0] - 1] for point in span.ends] for span in spans])
    assert ends[..., 0] == pytest.approx(0.70)
    edges = np.array([0.0, 1.2, 2.0, 3.2, 4.0, 5.2, 6.0, 7.2, 8.0, 9.2, 10.0])
    assert ends[:, 0, 2] == pytest.approx(edges[:-1])
    assert ends[:, 1, 2] == pytest.approx(edges[1:])


def test_without_a_base_the_tendon_starts_at_rest(wrist: nf.Robot) -> None:
    path = nf.simulate(wrist, nf.pull(0.0, 1.0, 3))
    straight = wrist.replace(tendon=(nf.Tendon(0.70, path="straight"),))
    mesh = mesh_of(straight, COARSE)
    spans = tendon_spans(straight, mesh, 0, path.span_tension[-1, 0])
    assert spans[0].ends[0].place == pytest.approx((0.70, 0.0, 0.0))
    assert not spans[0].ends[0].ties
    assert spans[0].tension == pytest.approx(path.span_tension[-1, 0, 1])


def test_rings_are_read_as_rigid_motions() -> None:
    robot = wrist("A")
    mesh = mesh_of(robot, COARSE)
    turn, shift = 0.3, np.array([0.5, 0.0, -0.2])
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    rows = ["displacements (vx,vy,vz) for set NRINGS and time  1.0", ""]
    for index in ring_layers(mesh):
        for number in mesh.layer(index).tolist():
            place = mesh.place[number - 1]
            moved = rotation @ place + shift - place
            rows.append(f" {number} " + " ".join(f"{value:.12e}" for value in moved))
    found = read_rings(mesh, "\n".join(rows))
    assert found.angle == pytest.approx(turn)
    height = mesh.heights[ring_layers(mesh)]
    middle = np.stack([0 * height, 0 * height, height], axis=1)
    assert found.position == pytest.approx(middle @ rotation.T + shift)
    with pytest.raises(ValueError, match="file has no displacement of node"):
        read_rings(mesh, "")


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda: nf.load_robot("gao2017"), "u-link"),
        (lambda: turned(uncut_length=0.0), "uncut_length"),
        (lambda: turned().with_value("tendon[1].direction_deg", 127.0), "near to an edge"),
        (lambda: one_notch(precurvature_deg=3.0), "precurvature"),
        (lambda: one_notch(depth=1.55), "solid strip"),
        (lambda: one_notch(uncut_length=0.0), "uncut_length"),
    ],
    ids=["u-link", "no room", "near", "precurvature", "strip", "no wall"],
)
def test_robots_that_the_mesh_cannot_have_are_refused(
    make: Callable[[], nf.Robot], name: str
) -> None:
    robot = make()
    with refused("UNSUPPORTED", name):
        tendon_spans(robot, mesh_of(robot, COARSE), 0, np.ones(2))


def test_nothing_is_written_of_a_robot_that_is_refused(tmp_path: Path) -> None:
    with refused("UNSUPPORTED", "u-link"):
        nf.export_robot(nf.load_robot("gao2017"), tmp_path / "a.inp", COARSE)
    assert not list(tmp_path.iterdir())


def test_without_a_tension_a_deck_has_half_of_what_closes_the_first_notch(tmp_path: Path) -> None:
    robot = one_notch()
    report = nf.export_robot(robot, tmp_path / "a.inp", COARSE)
    half = 0.5 * nf.closing(robot).tension[0]
    assert any(f"{half:.4g} N at tendon 1" in one for one in report.warnings)
    assert f"tendon 1 at {half:.6g} N" in (tmp_path / "a.inp").read_text()
    with refused("MISSING_VALUE", "tension"):  # a notch that no pull closes
        away = robot.with_value("tendon[1].direction_deg", 180.0)
        nf.export_robot(away, tmp_path / "a.inp", COARSE)


@pytest.mark.parametrize("radius", [0.05, 0.3, 0.6, 0.741])
@pytest.mark.parametrize("whole", [False, True])
def test_a_tendon_off_the_nodes_hangs_on_the_wall(radius: float, whole: bool) -> None:
    """Its points move with any rigid motion of the wall, and its force has their moment."""
    robot = turned(20.0) if whole else one_notch()
    robot = robot.with_value("tendon.radius", radius)
    mesh = mesh_of(robot, COARSE, [0, 1] if whole else [0])
    x_deg = 0.0 if whole else robot.notches[0].direction_deg
    turn = Rotation.from_rotvec([0.0, 0.9, 0.0] if mesh.is_half else [0.3, 0.9, -0.4]).as_matrix()
    for span in tendon_spans(robot, mesh, 0, np.ones(4)):
        for point in span.ends:
            side = np.radians(robot.tendon[0].direction_deg - x_deg)
            assert point.place[:2] == pytest.approx(radius * np.array([np.cos(side), np.sin(side)]))
            nodes, weights = (np.array(one) for one in zip(*point.ties, strict=True))
            place = mesh.place[nodes - 1]
            if mesh.is_half:  # the other half moves as its mirror image
                place = np.concatenate([place, place * [1.0, -1.0, 1.0]])
                weights = 0.5 * np.concatenate([weights, weights])
            moved = weights @ (place @ turn.T + [0.1, 0.0, 0.2])
            assert moved == pytest.approx(turn @ point.place + [0.1, 0.0, 0.2], abs=1e-9)


def test_loads_that_a_deck_does_not_carry_are_refused(wrist: nf.Robot, tmp_path: Path) -> None:
    path = nf.simulate(wrist, nf.pull(0.0, 0.5, 2))
    path = replace(path, load=path.load.loaded(tip_force=(0.01, 0.0, 0.0)))
    with refused("UNSUPPORTED", "forces"):
        nf.export_robot(path, tmp_path / "a.inp", COARSE)


@pytest.mark.parametrize(
    "keys",
    [{"wall": 0}, {"notch": 2.5}, {"uncut": True}, {"contact": 1}, {"tip_moment": float("nan")}],
)
def test_bad_options_are_refused(keys: dict[str, Any]) -> None:
    with refused("INVALID_INPUT", next(iter(keys))):
        DeckOptions(**keys)


def test_an_unknown_mesh_is_refused() -> None:
    with refused("UNKNOWN_NAME", "coarse"):
        DeckOptions.of_mesh("finest")  # type: ignore[arg-type]


@needs_ccx
@pytest.mark.nightly
def test_single_notch_under_a_moment(tmp_path: Path, margin: Margin) -> None:
    """Between rigid plates, as a single notch of other meshes and of another program's set-up."""
    moment, ring = 1e-3, 1.2
    rows = named_rows("fem_notch_clamped.csv")
    row = next(r for r in rows if (r["cut"], r["depth"], r["height"]) == ("off-axis", 1.3932, 0.8))
    second = float(nf.annular_segment(0.81, 0.70, 1.3932).second_moment_weak)
    known = moment * (0.8 + row["delta_weak"]) / (60e3 * second)
    options = DeckOptions.of_mesh("medium", tip_moment=moment)
    found = run(one_notch(depth=1.3932), options, tmp_path).notch_angle[0]
    # The known rotation is that of the plates: half of each ring, as a beam, lies outside ours.
    found += moment * ring / (60e3 * np.pi / 4 * (0.81**4 - 0.70**4))
    margin.within("rotation", found / known - 1.0, 0.01)


@needs_ccx
@pytest.mark.nightly
def test_wrist_a_on_a_coarse_mesh(tmp_path: Path, margin: Margin) -> None:
    case = solid("A_lin_mu013_medium")
    level = [round(float(load.tension), 6) for load in case.loads].index(1.0)  # type: ignore[arg-type]
    path = nf.simulate(case.robot, nf.pull(0.0, 1.0, 5))
    found = np.degrees(run(path, COARSE, tmp_path).notch_angle)
    margin.within("notch angles", found / case.angles[level] - 1.0, 0.03)


@needs_ccx
@pytest.mark.nightly
def test_closed_notches_press_on_each_other(tmp_path: Path) -> None:
    """Beyond closing the angle stays near that of the chain; without contact it goes far on."""
    robot = one_notch(height=0.2, ends="shell", closing="elastic")
    path = nf.simulate(robot, nf.pull(0.0, 6.0, 11))
    assert path.closed[-1, 0]
    angle = run(path, COARSE, tmp_path).notch_angle[0]
    assert angle == pytest.approx(path.notch_angle[-1, 0], rel=0.04)


@needs_ccx
@pytest.mark.nightly
def test_notches_that_open_to_two_sides(tmp_path: Path, margin: Margin) -> None:
    """Both tendons pulled: turns of the chain, balance of forces, and the same turned by 90 deg."""
    found = []
    for number, by in enumerate((0.0, 90.0)):
        folder = tmp_path / str(number)
        folder.mkdir()
        robot = turned(by)
        path = nf.simulate(robot, [nf.Load(tension=[k / 4.0, k / 8.0]) for k in range(1, 5)])
        found.append(run(path, COARSE, folder))
        rotation = path.body_rotation[-1]
        known = Rotation.from_matrix(np.swapaxes(rotation[:-1], 1, 2) @ rotation[1:]).as_rotvec()
        off = np.linalg.norm(found[-1].notch_turn - known, axis=1)
        # The coarse mesh is 1.7 % off.
        margin.within("turns", off / np.linalg.norm(known, axis=1).max(), 0.025)
        total = (folder / "deck.dat").read_text().split("for set NCLAMP")[-1].split("\n")[2]
        assert np.array(total.split(), float) == pytest.approx(0.0, abs=1e-7)
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    assert found[1].position == pytest.approx(found[0].position @ quarter.T, abs=1e-7)
    assert found[1].rotation == pytest.approx(quarter @ found[0].rotation @ quarter.T, abs=1e-7)


@needs_ccx
@pytest.mark.nightly
def test_a_whole_tube_bends_as_half_of_it(tmp_path: Path, margin: Margin) -> None:
    robot = one_notch(ends="shell")
    path = nf.simulate(robot, nf.pull(0.0, 1.0, 3))
    half = run(path, COARSE, tmp_path).notch_angle[0]
    more = (*robot.tendon, nf.Tendon(0.70, path="straight", direction_deg=180.0))
    loads = [nf.Load(tension=[level, 1e-6]) for level in (0.5, 1.0)]
    path = nf.simulate(robot.replace(tendon=more), loads)
    whole = run(path, COARSE, tmp_path).notch_angle[0]
    margin.within("angle", whole / half - 1.0, 0.01)


@needs_ccx
@pytest.mark.nightly
@pytest.mark.parametrize("whole", [False, True])
def test_a_tendon_in_the_lumen_bends_as_the_chain(
    tmp_path: Path, margin: Margin, whole: bool
) -> None:
    """At 0.45 mm the tendon has 0.64 of the moment that it has at the wall, 0.70 mm."""
    robot = one_notch(ends="shell").with_value("tendon[1].radius", 0.45)
    if whole:  # a tendon that is as good as slack on another side
        slack = nf.Tendon(0.45, path="straight", direction_deg=90.0)
        robot = robot.replace(tendon=(*robot.tendon, slack))
    loads = [nf.Load(tension=[level, 1e-6][: 1 + whole]) for level in (0.5, 1.0)]
    path = nf.simulate(robot, loads)
    angle = np.linalg.norm(run(path, COARSE, tmp_path).notch_turn[0])
    margin.within("angle", angle / path.notch_angle[-1, 0] - 1.0, 0.02)
