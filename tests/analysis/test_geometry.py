"""The geometry of robots against values by hand, and shapes against poses of bodies."""

import pickle

import numpy as np
import pytest

import notchflex as nf
from notchflex.export.cuts import cuts_of
from notchflex.export.solids import SolidOptions, straight_solid
from refusals import refused


@pytest.fixture(scope="module")
def wrist() -> nf.Robot:
    return nf.load_robot("pacheco2021-a")


@pytest.fixture(scope="module")
def state(wrist: nf.Robot) -> nf.Equilibrium:
    load = nf.Load(tension=0.8, base_rotation=(0.3, -0.2, 0.5), tip_force=(0.01, 0.02, 0.0))
    return nf.solve(wrist, load)


def test_bodies_of_a_wrist_by_hand(wrist: nf.Robot):
    geometry = wrist.with_value("tube.base_length", 3.0).geometry
    np.testing.assert_allclose(geometry.body_length, [3.0, 1.2, 1.2, 1.2, 1.2, 1.2])
    np.testing.assert_allclose(geometry.body_start, [0.0, 3.8, 5.8, 7.8, 9.8, 11.8], atol=1e-12)
    assert geometry.length == pytest.approx(13.0, abs=1e-12)
    assert geometry.has_spine.all()
    assert not nf.load_robot("gao2017").geometry.has_spine.any()


def test_notches_close_where_the_opposite_fibre_has_no_length(wrist: nf.Robot):
    tube, notch = wrist.tube, wrist.notches[0]
    cosine = (notch.depth - tube.outer_radius) / tube.outer_radius
    half = np.arccos(cosine)  # half the angle of the spine
    outer, inner = tube.outer_radius, tube.inner_radius
    ybar = 2.0 / 3.0 * np.sin(half) / half * (outer**3 - inner**3) / (outer**2 - inner**2)
    wanted = notch.height / (outer + ybar)
    np.testing.assert_allclose(wrist.geometry.closing_angle, wanted, rtol=1e-12)
    curved = wrist.with_value("notch.precurvature_deg", 5.0).geometry
    np.testing.assert_allclose(curved.free_angle, np.radians(5.0), rtol=1e-12)
    slots = nf.load_robot("gao2017").geometry
    assert np.isinf(slots.closing_angle).all()


def test_masses_add_up_to_the_tube_without_its_cuts(wrist: nf.Robot):
    assert not wrist.replace(material=nf.Linear(7510.0)).geometry.body_mass.any()
    geometry = wrist.with_value("material.density", 6450.0).geometry
    tube, notch = wrist.tube, wrist.notches[0]
    half = np.arccos((notch.depth - tube.outer_radius) / tube.outer_radius)
    rings = tube.outer_radius**2 - tube.inner_radius**2
    volume = np.pi * rings * 6.0 + half * rings * 4.0  # five rings, and five spines
    assert geometry.body_mass.sum() == pytest.approx(6450.0e-6 * volume, rel=1e-9)
    assert geometry.body_centre.shape == (6, 3)


def solid_of(robot: nf.Robot) -> tuple[float, float]:
    """Volume of the solid up to the robot's end, mm^3, and its middle along the tube, mm."""
    whole = straight_solid(robot, cuts_of(robot), SolidOptions())
    mesh = whole.trim_by_plane((0.0, 0.0, -1.0), -robot.geometry.length).to_mesh()
    corners = np.asarray(mesh.vert_properties, float)[np.asarray(mesh.tri_verts), :3]
    volume = np.linalg.det(corners) / 6.0  # of tetrahedra with the origin
    return volume.sum(), volume @ corners[..., 2].sum(axis=1) / 4.0 / volume.sum()


def weighed(robot: nf.Robot) -> tuple[float, float]:
    """The same of the masses of the bodies."""
    geometry = robot.geometry
    assert (geometry.body_mass[1:] > 0.0).all()
    place = geometry.body_start + geometry.body_centre[:, 2]
    mass = geometry.body_mass.sum()
    return mass / (1e-6 * robot.material.density), geometry.body_mass @ place / mass


@pytest.mark.parametrize("name", ["liu2022", "gao2017"])
@pytest.mark.parametrize("uncut", [0.0, 2.0, 4.0])
@pytest.mark.parametrize("ends", ["rigid", "elastic"])
def test_strips_weigh_what_their_solid_does(name: str, uncut: float, ends: str):
    robot = nf.load_robot(name).with_values({"notch.ends": ends, "notch.uncut_length": uncut})
    np.testing.assert_allclose(weighed(robot), solid_of(robot), rtol=2e-4)


@pytest.mark.parametrize(
    "change",
    [
        {"notch[2].direction_deg": 180.0},
        {"notch[2].height": 1.0},
        {"notch[2].tube": nf.Tube(11.0, 6.0)},
        {"notch[2].uncut_length": 1.0},
    ],
)
def test_cuts_that_meet_take_their_share_of_the_tube_once(change: dict[str, object]):
    robot = nf.load_robot("liu2022").with_values({"notch.depth": 5.6, **change})
    np.testing.assert_allclose(weighed(robot), solid_of(robot), rtol=5e-4)


def test_weights_have_slopes_where_triangular_notches_adjoin():
    """A notch can only get longer there; cuts begin and end at the same places."""
    robot = nf.load_robot("liu2022").with_value("friction.coefficient", 0.0)
    load = nf.Load(tension=(0.3, 0.1), gravity=(3.0, 0.0, -9.0))
    state = nf.solve(robot, load)
    slope = state.path.jacobian(["notch.uncut_length"], "tip_position")["tip_position"][0]
    moved = nf.solve(robot.with_value("notch.uncut_length", 1e-5), load)
    found = (moved.tip_position - state.tip_position) / 1e-5
    np.testing.assert_allclose(np.ravel(slope), found, rtol=1e-4, atol=1e-8)


def test_cuts_stand_where_the_notches_do(wrist: nf.Robot):
    cuts = [layout.cuts[0] for layout in wrist.geometry.cuts]
    starts = [cut.corners[0][0] for cut in cuts]
    np.testing.assert_allclose(starts, [0.0, 2.0, 4.0, 6.0, 8.0], atol=1e-12)
    depth = wrist.tube.outer_radius - cuts[0].corners[1][1]
    assert depth == pytest.approx(wrist.notches[0].depth, abs=1e-12)


def test_arrays_cannot_be_written_to_and_are_not_sent_to_other_processes(wrist: nf.Robot):
    geometry = wrist.geometry
    assert wrist.geometry is geometry
    for name in ("body_length", "body_start", "body_mass", "closing_angle", "has_spine"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(geometry, name)[0] = 1.0
    assert "geometry" not in vars(pickle.loads(pickle.dumps(wrist)))


def test_a_shape_lies_in_the_world(state: nf.Equilibrium, wrist: nf.Robot):
    shape = state.shape
    np.testing.assert_allclose(shape.tip, state.tip_position, atol=1e-12)
    np.testing.assert_array_equal(shape.position, state.body_position)
    np.testing.assert_array_equal(shape.rotation, state.body_rotation)
    np.testing.assert_allclose(shape.axis([wrist.geometry.length])[0], shape.tip, atol=1e-9)
    for number, flexure in enumerate(shape.flexures):
        # a flexure starts on the face of one body and ends on that of the next, off the axis
        ends = flexure.position[[0, -1]]
        for end, body, along in (
            (0, number, wrist.geometry.body_length[number]),
            (1, number + 1, 0.0),
        ):
            local = (ends[end] - shape.position[body]) @ shape.rotation[body]
            assert local[2] == pytest.approx(along, abs=1e-9)
            assert np.hypot(*local[:2]) > 0.5


def test_a_shape_seen_from_its_base(state: nf.Equilibrium):
    shape = state.shape.from_base()
    np.testing.assert_allclose(shape.rotation[0], np.eye(3), atol=1e-15)
    np.testing.assert_allclose(shape.position[0], 0.0, atol=1e-15)
    back = shape.tip @ state.body_rotation[0].T
    np.testing.assert_allclose(back, state.tip_position, atol=1e-12)


def test_a_tendon_runs_at_its_radius_through_the_bodies(state: nf.Equilibrium, wrist: nf.Robot):
    shape, tendon = state.shape, wrist.tendon[0]
    contacts = shape.contacts(0)
    assert len(contacts) == state.contact_bound.shape[1]
    for number, contact in enumerate(contacts):
        body = (number + 1) // 2
        local = (contact - shape.position[body]) @ shape.rotation[body]
        assert np.hypot(*local[:2]) == pytest.approx(tendon.radius, abs=1e-12)
    end = (shape.tendon(0)[-1] - shape.position[-1]) @ shape.rotation[-1]
    np.testing.assert_allclose(end, [tendon.radius, 0.0, 1.2], atol=1e-12)


def test_shapes_of_angles_and_of_states_agree(wrist: nf.Robot):
    state = nf.solve(wrist, nf.Load(tension=0.8))
    shape = wrist.geometry.shape(state.notch_angle)
    np.testing.assert_allclose(shape.position, state.body_position, atol=1e-6)
    for one, other in zip(shape.flexures, state.shape.flexures, strict=True):
        np.testing.assert_allclose(one.position, other.position, atol=1e-6)


def test_what_is_not_there_is_refused(wrist: nf.Robot, state: nf.Equilibrium):
    with refused("WRONG_SHAPE", "5 notches"):
        wrist.geometry.shape([0.1, 0.2])
    with refused("OUT_OF_RANGE", "10 mm"):
        state.shape.axis([11.0])
