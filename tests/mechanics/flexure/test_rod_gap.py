"""Backbones with disks against closed forms, own integration of rods, and continuous tendons."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from scipy.special import ellipkinc

import notchflex as nf
from backbones import RATIO, YOUNG, Z, continuous, shot, stiffness
from notchflex.errors import InputError
from notchflex.mechanics.flexure import relative_pose, rod, rotation_error_estimate
from notchflex.robot import from_table, robot_from_text, robot_text, to_table


def backbone(
    gaps: int,
    length: float,
    diameter: float = 1.4,
    *tendons: nf.Tendon,
    **gap: Any,
) -> nf.Robot:
    """A backbone that is free over its whole length; its disks have no thickness."""
    options: dict[str, Any] = {"uncut_length": 0.0, "repeat": gaps} | gap
    return nf.Robot(
        "backbone",
        nf.Tube(30.0, 2.0),
        (nf.RodGap(length / gaps, diameter, **options),),
        tendons or (nf.Tendon(10.0, path="straight"),),
        nf.Linear(YOUNG, poisson_ratio=RATIO),
        nf.Frictionless(),
    )


@pytest.mark.parametrize("load", [1.0, 5.0])
def test_elastica_under_a_dead_force(load: float) -> None:
    """A thin cantilever under F L^2/EI across it, by elliptic integrals."""
    length, diameter = 2000.0, 0.05  # so thin that it neither stretches nor shears

    def beyond(k: float) -> float:  # sqrt(load) = K(k) - F(k, phi), sin phi = 1/(k sqrt 2)
        low = np.arcsin(min(1.0, 1.0 / (k * np.sqrt(2.0))))
        return ellipkinc(np.pi / 2, k**2) - ellipkinc(low, k**2) - np.sqrt(load)

    k: Any = brentq(beyond, np.sqrt(0.5) * (1 + 1e-15), 1 - 1e-12, xtol=1e-16)
    # The height along the tube is sqrt(2 EI/F sin(theta)) at the slope theta of the tip.
    height = length * np.sqrt(2.0 * (2 * k**2 - 1.0) / load)
    force = load * stiffness(diameter)[0][0] / length**2
    robot = backbone(4, length, diameter)
    state = nf.solve(robot, nf.Load(tip_force=(force, 0.0, 0.0)), refinement=2).raise_if_failed()
    assert state.tip_position[2] == pytest.approx(height, abs=1e-8 * length)


@pytest.mark.parametrize("following", [False, True])
def test_thick_rod_in_the_plane(following: bool) -> None:
    """Stretch and shear of a rod as thick as a fifth of its length, precurved."""
    force, moment = np.array([180.0, 0.0, -60.0]), np.array([0.0, 900.0, 0.0])
    turn = 20.0
    expected = shot(force, moment, 2.0, 10.0, following, np.radians(4 * turn) / 10.0)
    robot = backbone(4, 10.0, 2.0, precurvature_deg=turn)
    load = nf.Load(tip_force=tuple(force), tip_moment=tuple(moment), following=following)
    state = nf.solve(robot, load, refinement=3).raise_if_failed()
    np.testing.assert_allclose(state.tip_position, expected, atol=1e-8 * 10.0)


def test_helix_under_a_moment() -> None:
    """A dead moment oblique to a straight rod: its tangent turns about it at a constant rate."""
    diameter, length = 1.4, 100.0
    bending, _ = stiffness(diameter)
    moment = np.array([60.0, 90.0, 110.0])
    rate, axis = np.linalg.norm(moment) / bending[0], moment / np.linalg.norm(moment)
    along, across = (axis @ Z) * axis, Z - (axis @ Z) * axis
    angle = rate * length
    tip = (
        along * length
        + (across * np.sin(angle) + np.cross(axis, across) * (1 - np.cos(angle))) / rate
    )
    load = nf.Load(tip_moment=tuple(moment))
    errors = [
        np.linalg.norm(
            nf.solve(backbone(7, length, diameter), load, refinement=r).tip_position - tip
        )
        for r in (0, 1)
    ]
    assert errors[0] < 1e-5 * length
    assert errors[1] < 1e-8 * length


@pytest.mark.parametrize("following", [False, pytest.param(True, marks=pytest.mark.nightly)])
def test_rod_in_space(following: bool) -> None:
    """Force and moment in space, dead and following."""
    force, moment = np.array([0.25, -0.2, 0.15]), np.array([-25.0, 30.0, 40.0])
    expected = shot(force, moment, 1.4, 140.0, following)
    load = nf.Load(tip_force=tuple(force), tip_moment=tuple(moment), following=following)
    state = nf.solve(backbone(7, 140.0), load, refinement=1).raise_if_failed()
    np.testing.assert_allclose(state.tip_position, expected, atol=1e-8 * 140.0)


@pytest.mark.parametrize("kind", ["converging", "helical"])
def test_tendon_of_many_disks_becomes_continuous(kind: str) -> None:
    length, turn, shrink = 400.0, 1.5 * np.pi, 0.6

    def path(at: float) -> tuple[np.ndarray, np.ndarray]:
        part = at / length
        radius, rate = (10.0 * (1 - shrink * part), -10.0 * shrink / length)
        angle, twist = 0.0, 0.0
        if kind == "helical":
            radius, rate, angle, twist = 10.0, 0.0, turn * part, turn / length
        outward, around = (
            np.array([np.cos(angle + by), np.sin(angle + by), 0.0]) for by in (0.0, np.pi / 2)
        )
        return radius * outward, rate * outward + radius * twist * around

    expected = continuous(path, 3.0, length)
    errors = list[float]()
    for gaps in (7, 14):
        part = np.arange(1, gaps + 1) / gaps
        holes: dict[str, Any] = {"disk_radius": tuple(10.0 * (1 - shrink * part))}
        if kind == "helical":
            holes = {"disk_direction_deg": tuple(np.degrees(turn * part))}
        robot = backbone(gaps, length, 1.4, nf.Tendon(10.0, path="straight", **holes))
        tip = nf.solve(robot, nf.Load(tension=3.0)).raise_if_failed().tip_position
        errors.append(float(np.linalg.norm(tip - expected)))
    assert errors[1] < 0.3 * errors[0]  # of second order
    assert errors[1] < 0.02 * length


def test_lists_of_disks() -> None:
    """A tendon whose lists are all alike is the tendon without them; its end is its length."""
    plain = backbone(4, 80.0)
    listed = nf.Tendon(
        10.0, path="straight", disk_radius=(10.0,) * 4, disk_direction_deg=(0.0,) * 4
    )
    load = nf.Load(tension=5.0)
    found, same = (nf.solve(one, load) for one in (plain, backbone(4, 80.0, 1.4, listed)))
    np.testing.assert_allclose(found.tip_position, same.tip_position, rtol=1e-12)
    np.testing.assert_allclose(found.shape.tendon(0), same.shape.tendon(0), atol=1e-12)
    assert from_table(to_table(backbone(4, 80.0, 1.4, listed))).tendon == (listed,)


def test_friction_turns_by_the_bend_of_the_path() -> None:
    """A straight converging tendon rubs nowhere but at the base, whose hole is along the tube."""
    part = np.arange(1, 5) / 4
    tendon = nf.Tendon(10.0, path="straight", disk_radius=tuple(10.0 - 4.0 * part))
    robot = backbone(4, 80.0, 1.4, tendon).replace(friction=nf.Capstan(0.2))
    state = nf.solve(robot, nf.Load(tension=1e-4))  # which hardly bends it
    kept = 1e-4 * np.exp(-0.2 * np.arctan2(4.0, 80.0))
    assert state.span_tension[0][1] == pytest.approx(kept, rel=1e-5)
    assert state.span_tension[0][-1] == pytest.approx(kept, rel=1e-5)


def test_weight_of_a_backbone_and_its_disks() -> None:
    """A cantilever: w L^4/8 EI by its own weight, F a^2 (3 L - a)/6 EI by a disk at a."""
    robot = backbone(4, 80.0, disk_mass=0.5).with_value("material.density", 6450.0)
    bending, _ = stiffness(1.4)
    mass = 6450e-9 * np.pi * 0.7**2  # kg/mm
    sag = 9.81 * mass * 80.0**4 / (8 * bending[0])
    for at in (20.0, 40.0, 60.0, 80.0):
        sag += 0.5e-3 * 9.81 * at**2 * (240.0 - at) / (6 * bending[0])
    assert robot.geometry.body_mass.sum() == pytest.approx(2.0 + 80e3 * mass)
    state = nf.solve(robot, nf.Load(gravity=(9.81, 0.0, 0.0)))
    assert state.tip_position[0] == pytest.approx(sag, rel=2e-3)


def test_disks_of_a_known_mass_weigh_without_a_density() -> None:
    """Disks alone, on a backbone without weight; a mass at the tip changes nothing of that."""
    robot = backbone(4, 80.0, disk_mass=0.5)
    assert robot.material.density is None
    assert robot.geometry.body_mass == pytest.approx([0.0, 0.5, 0.5, 0.5, 0.5])
    for load, mass in ((nf.Load(gravity=(9.81, 0.0, 0.0)), 2.0),
                       (nf.Load(gravity=(9.81, 0.0, 0.0), tip_mass=1.0), 3.0)):  # fmt: skip
        state = nf.solve(robot, load)
        assert state.base_force[0] == pytest.approx(-9.81e-3 * mass)
    lighter = nf.solve(robot.with_value("notch.disk_mass", 0.0), nf.Load(tip_mass=1.0))
    assert lighter.converged


def test_a_tendon_stretches_all_along_the_holes_of_its_disks() -> None:
    """Thick disks with holes that lean: nothing bends, so the stroke is stretch alone."""
    part = np.arange(1, 5) / 4
    winding = nf.Tendon(
        5.0, 0.0, path="straight", axial_stiffness=20.0, disk_direction_deg=tuple(160.0 * part)
    )
    rigid = nf.Linear(1e9, poisson_ratio=RATIO)
    robot = backbone(4, 80.0, 1.4, winding, uncut_length=12.0).replace(material=rigid)
    state = nf.solve(robot, nf.Load(tension=1.0))
    turn = np.radians(np.append(0.0, 160.0 * part))
    place = 5.0 * np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    gap, thick = robot.notches[0].length, 12.0
    rises = gap + thick * np.array([0.5, 1.0, 1.0, 1.0])
    spans = np.diff(place, axis=0) + rises[:, None] * np.eye(3)[2]
    along = spans / np.linalg.norm(spans, axis=1)[:, None]
    both = along + np.append(along[1:], np.zeros((1, 3)), axis=0)
    enters, leaves = (place[1:] + side * 0.5 * thick * both / both[:, 2:] for side in (-1.0, 1.0))
    middle = np.append(0.0, np.cumsum(rises))[1:, None] * np.eye(3)[2]
    points = [
        place[:1],
        *(np.stack(pair) + at for *pair, at in zip(enters, leaves, middle, strict=True)),
    ]
    length = np.linalg.norm(np.diff(np.concatenate(points), axis=0), axis=1).sum()
    length += robot.tube.base_length
    assert state.stroke[0] == pytest.approx(length / 20.0, rel=1e-5)


@pytest.mark.parametrize(
    "material",
    [
        nf.Superelastic(54e3, 20e3, 0.01),
        nf.Nitinol(54e3, 400.0, 4e3),
        nf.StressStrain(strain=(0.01, 0.05), stress=(540.0, 800.0)),
    ],
    ids=lambda material: material.kind,
)
def test_constant_moment_of_every_material(material: Any) -> None:
    """The moment is that of all fibres; of Pacheco's law that of the outer one, as I/r of it."""
    robot = backbone(2, 40.0, 1.4, inner_diameter=0.6).replace(material=material)
    moment = 200.0
    state = nf.solve(robot, nf.Load(tip_moment=(0.0, moment, 0.0))).raise_if_failed()
    curvature = state.notch_angle.sum() / 40.0
    radii, shares = np.polynomial.legendre.leggauss(400)
    radii, shares = 0.5 + 0.2 * radii, 0.2 * shares
    angles = 2 * np.pi * (np.arange(2000) + 0.5) / 2000
    arms = np.outer(radii, np.cos(angles))
    strain = curvature * np.abs(arms)
    if material.kind == "nitinol":
        yields = 400.0 / 54e3
        stress = np.where(strain < yields, 54e3 * strain, 400.0 + 4e3 * (strain - yields))
    else:
        stress = np.where(strain < 0.01, 54e3 * strain, 540.0 + 6.5e3 * (strain - 0.01))
    areas = np.outer(radii * shares, np.full(2000, 2 * np.pi / 2000))
    assert strain.max() > 0.012
    found = np.sum(areas * stress * np.abs(arms))
    if material.kind == "superelastic":
        outer = 540.0 + 20e3 * (0.7 * curvature - 0.01)
        found = np.pi / 4 * (0.7**4 - 0.3**4) * outer / 0.7
    assert found == pytest.approx(moment, rel=2e-3)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"disk_radius": (10.0, 9.0)}, "has 2 values; give 4"),
        ({"disk_radius": (10.0, 9.0, 8.0, 16.0)}, "outside the disk"),
        ({"disk_direction_deg": (0.0,) * 5}, "has 5 values; give 4"),
        ({"path": "wall-arc"}, "straight from disk to disk"),
    ],
)
def test_refused_tendons(change: dict[str, Any], words: str) -> None:
    values: dict[str, Any] = {"radius": 10.0, "path": "straight"} | change
    tendon = nf.Tendon(**values)
    with pytest.raises(InputError, match=words):
        backbone(4, 80.0, 1.4, tendon)


def test_refused_backbones() -> None:
    with pytest.raises(InputError, match="must be less than the diameter"):
        backbone(4, 80.0, 1.4, inner_diameter=1.5)
    with pytest.raises(InputError, match="must fit the hole"):
        backbone(4, 80.0, 2.5)
    side = nf.Tendon(10.0, 90.0, path="straight")
    with pytest.raises(InputError, match="leaves the plane of the gaps"):
        backbone(4, 80.0, 1.4, side).replace(material=nf.Nitinol(54e3, 400.0, 4e3))
    wrist = nf.load_robot("pacheco2021-a")
    listed = nf.Tendon(0.7, path="straight", disk_radius=(0.7,) * 5)
    with pytest.raises(InputError, match='is for gaps of kind = "rod"'):
        wrist.replace(tendon=(listed,))


def test_robot_files_and_forms() -> None:
    robot = nf.load_robot("disks-two-segments")
    assert robot_from_text(robot_text(robot, "")) == robot
    assert robot.geometry.length == 400.0


def test_slopes_and_batches_know_every_number() -> None:
    """Slopes by numbers of a gap are differences of solves; rows of a batch are solves."""
    part = np.arange(1, 5) / 4
    converging = nf.Tendon(10.0, path="straight", disk_radius=tuple(10.0 - 4.0 * part))
    gap = {"inner_diameter": 0.4, "precurvature_deg": 3.0, "disk_mass": 0.5, "uncut_length": 2.0}
    robot = backbone(4, 72.0, 1.4, converging, **gap).with_value("material.density", 6450.0)
    load = nf.Load(tension=6.0, gravity=(9.81, 0.0, 0.0))
    numbers = {
        "notch.diameter": 1.4,
        "notch.length": 18.0,
        "notch.inner_diameter": 0.4,
        "notch.precurvature_deg": 3.0,
        "notch.disk_mass": 0.5,
        "tendon[1].radius": 10.0,
    }
    slopes = nf.simulate(robot, load).jacobian([*numbers], ["tip_position"])
    for (name, value), slope in zip(numbers.items(), slopes["tip_position"][0].T, strict=True):
        low, high = (
            nf.solve(robot.with_value(name, value * (1.0 + more)), load).tip_position
            for more in (-1e-4, 1e-4)
        )
        np.testing.assert_allclose((high - low) / (2e-4 * value), slope, rtol=1e-6, atol=1e-8)
    diameters = np.array([1.2, 1.4, 1.6])
    rows = nf.batch(robot, {"notch.diameter": diameters}, load)["tip_position"]
    for diameter, row in zip(diameters, rows, strict=True):
        single = nf.solve(robot.with_value("notch.diameter", diameter), load)
        np.testing.assert_allclose(np.squeeze(row), single.tip_position, atol=1e-11)


def test_the_error_of_the_rotation_is_estimated() -> None:
    """Against the same strains with fourteen places of the rotation for five."""
    gap, tube = nf.RodGap(10.0, 1.0, uncut_length=0.0), nf.Tube(10.0, 1.0)
    coarse, fine = rod(gap, tube), rod(gap, tube, 3)
    # Modes are polynomials strain by strain; the fine rod has more of each.
    strains, in_fine = (np.abs(each.basis).sum(axis=0).argmax(axis=0) for each in (coarse, fine))
    random = np.random.default_rng(1)
    ratios = list[float]()
    for _ in range(60):
        modes: Any = np.zeros(coarse.modes)
        same: Any = np.zeros(fine.modes)
        for strain, scale in ((0, 0.3), (1, 0.3), (2, 0.1)):
            own = np.flatnonzero(strains == strain)
            modes[own] = scale * random.normal(size=len(own)) / np.arange(1, len(own) + 1)
            same[np.flatnonzero(in_fine == strain)[: len(own)]] = modes[own]
        ends = (relative_pose(coarse, modes).rotation, relative_pose(fine, same).rotation)
        error = float(Rotation.from_matrix(np.asarray(ends[0]).T @ np.asarray(ends[1])).magnitude())
        ratios.append(float(rotation_error_estimate(coarse, modes)) / error)
    assert min(ratios) > 0.8
    assert np.quantile(ratios, 0.9) < 3.0
