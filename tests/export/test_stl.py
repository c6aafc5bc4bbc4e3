"""Solids as STL: closed, of the volume of the closed forms, and bent as the chain is."""

import math

import numpy as np
import pytest
import trimesh

import notchflex as nf
from export.closed_form import volume_of_windows
from notchflex.export.cuts import cuts_of
from notchflex.export.formats import SolidOptions, Subject
from notchflex.export.solids import DeformationMap, _surface, stl_solid
from refusals import refused


def written(robot, tmp_path, warning="", **options):
    """The solid as another program reads it; `warning` is a part of one, where one is given."""
    file = tmp_path / "solid.stl"
    done = nf.export_robot(robot, file, SolidOptions(**options))
    assert warning in "".join(done.warnings)
    mesh = trimesh.load(file)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert len(mesh.faces) == done.facts["triangles"]
    # An STL holds single precision: 1e-6 mm at 10 mm.
    assert mesh.volume == pytest.approx(done.facts["volume_mm3"], rel=1e-5)
    return mesh


@pytest.mark.parametrize("name", ["pacheco2021-a", "pacheco2021-c", "york2015", "two-axis-wrist"])
def test_the_volume_is_that_of_sectors_and_segments(name, tmp_path):
    robot = nf.load_robot(name)
    tip = cuts_of(robot).end
    mesh = written(robot, tmp_path, shank=3.0)
    # Measured: 1e-6 to 2e-5; the issue asks for 1e-3.
    assert mesh.volume == pytest.approx(volume_of_windows(robot, tip + 3.0), rel=5e-5)
    assert mesh.bounds[:, 2] == pytest.approx([-3.0, tip], abs=1e-5)
    assert mesh.euler_number == 2 - 2 * (1 + robot.number_of_notches)


@pytest.mark.parametrize("name", ["liu2022", "gao2017"])
def test_cuts_straight_across_are_one_hole_each(name, tmp_path):
    robot = nf.load_robot(name)
    mesh = written(robot, tmp_path)
    assert mesh.euler_number == 2 - 2 * (1 + len(cuts_of(robot).cuts))


def test_a_notch_of_direction_0_is_open_toward_x(wrist, tmp_path):
    mesh = written(wrist, tmp_path)
    inside = mesh.vertices[(mesh.vertices[:, 2] > 0.0) & (mesh.vertices[:, 2] < 0.8)]
    assert inside.size == 0 or inside[:, 0].max() < 0.0
    turned = written(wrist.with_value("notch.direction_deg", 90.0), tmp_path)
    edge = turned.vertices[np.isclose(turned.vertices[:, 2], 0.8, atol=1e-6)]
    assert edge[:, 1].max() > 0.8


def test_a_channel_is_drilled_where_the_tendon_runs(tmp_path):
    robot = nf.load_robot("gao2017")
    plain, drilled = (written(robot, tmp_path, channels=width) for width in (0.0, 0.6))
    lost = plain.volume - drilled.volume
    tube = robot.tube
    uncut = 45.0 - 14 * 0.55  # 14 of the 28 slots open the side of the tendon
    assert lost == pytest.approx(uncut * math.pi * 0.3**2, rel=2e-3)
    assert tube.inner_radius < 2.5 - 0.3


@pytest.mark.parametrize(("width", "word"), [(0.99, "less than"), (0.2, "bore")])
def test_a_channel_that_does_not_fit_is_refused(width, word, tmp_path):
    robot = nf.load_robot("gao2017").with_value("tendon.radius", 1.5 if width == 0.2 else 2.5)
    with refused("OUT_OF_RANGE", word):
        nf.export_robot(robot, tmp_path / "a.stl", SolidOptions(channels=width))
    assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def bent(wrist):
    """Wrist A at 1 N, with precurvature that no load has made."""
    robot = wrist.with_value("notch[2].precurvature_deg", 3.0)
    return nf.solve(robot, nf.Load(tension=1.0))


def test_a_bent_solid_is_closed_and_keeps_its_volume(bent, tmp_path):
    straight = stl_solid(
        Subject(bent.robot.with_value("notch.precurvature_deg", 0.0)), SolidOptions()
    )
    mesh = written(bent, tmp_path)
    assert mesh.volume == pytest.approx(straight.facts["volume_mm3"], rel=1e-4)
    assert mesh.euler_number == straight.content.genus() * -2 + 2


def test_the_tip_ring_of_a_bent_solid_is_at_the_tip_of_the_chain(bent, tmp_path):
    mesh = written(bent, tmp_path)
    pose = np.array(bent.body_rotation[-1])
    along = (mesh.vertices - np.array(bent.tip_position)) @ pose[:, 2]
    ring = mesh.vertices[abs(along) < 1e-5]
    assert len(ring) > 90
    middle = 0.5 * (ring.min(axis=0) + ring.max(axis=0))
    # The vertices of the end face, in single precision.
    assert middle == pytest.approx(np.array(bent.tip_position), abs=1e-4)


@pytest.mark.parametrize("shank", [0.0, 0.5, 5000.0])
def test_a_bent_solid_has_few_triangles_where_the_tube_is_straight(bent, tmp_path, shank):
    mesh = written(bent, tmp_path, shank=shank)
    assert mesh.bounds[0, 2] == pytest.approx(-shank, abs=1e-3 if shank > 100 else 1e-5)
    assert len(mesh.faces) < 40_000


def test_the_free_shape_has_the_precurvature(bent, tmp_path):
    robot = bent.robot
    free = np.radians([[notch.precurvature_deg for notch in robot.notches]])
    tip, rotation = nf.tip_from_angles(robot, free)
    mesh = written(robot, tmp_path)
    along = (mesh.vertices - tip[0]) @ np.array(rotation[0])[:, 2]
    assert np.sum(abs(along) < 1e-5) > 90
    assert along.max() < 1e-5


@pytest.mark.parametrize(
    "name",
    [
        "pacheco2021-a",
        pytest.param("gao2017", marks=pytest.mark.nightly),
        pytest.param("liu2022", marks=pytest.mark.nightly),
    ],
)
def test_points_of_a_robot_at_rest_do_not_move(name):
    robot = nf.load_robot(name)
    motion = DeformationMap(Subject(robot), cuts_of(robot))
    draws = np.random.default_rng(1).uniform([-3, -3, -1], [3, 3, 35], (500, 3))
    assert motion(draws) == pytest.approx(draws, abs=1e-9)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("name", "tension", "most"),
    [
        ("york2015", 1.0, 1e-4),
        ("two-axis-wrist", [1.0, 0.3, 0.0, 0.0], 1e-4),
        ("pacheco2021-a-true", 1.0, 1e-3),
        # Their strips overlap with the walls that they turn into: what lies between is stretched.
        ("gao2017", 8.0, 2e-2),
        ("liu2022", [9.0, 0.0], 2e-2),
    ],
)
def test_every_robot_bends_into_a_closed_solid(name, tension, most, tmp_path):
    robot = nf.load_robot(name)
    state = nf.solve(robot, nf.Load(tension=tension))
    straight = stl_solid(Subject(robot), SolidOptions())
    mesh = written(state, tmp_path, warning="stretched" if most > 1e-3 else "")
    assert mesh.volume == pytest.approx(straight.facts["volume_mm3"], rel=most)
    assert mesh.euler_number == 2 - 2 * straight.content.genus()


def test_points_of_a_surface_do_not_keep_the_mesh_they_come_from(wrist):
    """A mesh that is alive at the end of the process is told by its library as a leak."""
    for array in _surface(stl_solid(Subject(wrist), SolidOptions()).content):
        while isinstance(array, np.ndarray):
            array = array.base
        assert array is None
