"""Workspaces: their states are those of simulations, their volumes those of known shapes."""

import json
from functools import partial

import numpy as np
import pytest

import notchflex as nf
from notchflex.pieces import sobol_points
from notchflex.workspaces import workspace
from notchflex.workspaces.cloud import DIRECTIONS, alpha_size, hull_of, inside, overlaps, voxel_map
from notchflex.workspaces.explore import in_python, limits_of, rays
from refusals import refused

RNG = np.random.default_rng(0)


@pytest.fixture(scope="module")
def found(wrist):
    return workspace(wrist, states=2048, tension=1.4)


def test_states_are_those_of_a_simulation_with_its_history(wrist, found, margin):
    assert len(found) == found.tried == 2048
    for ray in (0, 7):
        rows = slice(32 * ray, 32 * ray + 32)
        tension = found.tension[rows]
        path = nf.simulate(wrist, nf.LoadPath(tension, np.full_like(tension, np.nan)))
        margin.within("tip", found.tip[rows] - path.tip_position, 1e-6, "mm")
        margin.within("direction", found.direction[rows] - path.tip_rotation[:, :, 2], 2e-7)
        assert found.loading[rows].tolist() == [True] * 16 + [False] * 16
        apart = np.linalg.norm(path.tip_position - path.tip_position[::-1], axis=1)
        margin.within("hysteresis", found.hysteresis[rows] - apart, 1e-6, "mm")
        assert apart.max() > 0.01


def test_without_friction_there_is_no_hysteresis(wrist):
    slick = wrist.with_value("friction.coefficient", 0.0)
    assert np.nanmax(workspace(slick, states=256, tension=0.8).hysteresis) < 1e-8


def test_limits_are_kept_and_reached(wrist):
    limited = workspace(wrist, states=512, tension=1.4, limits={"strain": 0.03})
    assert limited.beyond == 0
    assert limited.strain.max() <= 0.03
    assert limited.strain.max() > 0.0299  # pulled as far as allowed, to 1/384 of the range


@pytest.mark.nightly
def test_a_limit_from_below_is_kept_and_reached(wrist):
    gap = workspace(wrist, states=512, tension=1.4, limits={"gap": (0.3, None)})
    path = nf.solve_each(wrist, nf.LoadPath(gap.tension, np.full_like(gap.tension, np.nan)))
    assert path.gap[gap.loading].min() >= 0.3 - 1e-9
    assert path.gap[gap.loading].min() < 0.31


def test_a_limit_that_leaves_nothing_is_data(wrist):
    nothing = workspace(wrist, states=64, tension=1.0, limits={"peak_strain": -1.0})
    assert len(nothing) == 0
    assert nothing.beyond == nothing.tried
    with refused("NO_DATA"):
        _ = nothing.hull


def test_half_the_points_have_the_same_hull(wrist):
    one, half = (workspace(wrist, states=count, tension=1.4) for count in (2048, 1024))
    assert half.hull.size == pytest.approx(one.hull.size, rel=0.01)


@pytest.mark.nightly
def test_half_the_points_of_two_axes_have_the_same_hull():
    robot = nf.load_robot("two-axis-wrist")
    one, half = (workspace(robot, states=count, tension=6.9) for count in (40_000, 20_000))
    assert half.hull.size == pytest.approx(one.hull.size, rel=0.01)
    assert one.hull.dimension == 3


@pytest.mark.nightly
def test_stiffness_is_that_of_a_small_force(wrist):
    stiff = workspace(wrist, states=256, tension=0.8, stiffness=2)
    (first, _) = np.flatnonzero(np.isfinite(stiff.stiffness))
    tension = float(stiff.tension[first, 0])
    at = nf.tip_response(wrist, nf.Load(tension=tension))
    softest = np.linalg.svd(at.compliance[0, 3:, 3:])[0][:, 0]
    moved = [
        nf.solve(wrist, nf.Load(tension=tension, tip_force=tuple(size * softest))).tip_position
        for size in (-1e-5, 1e-5)
    ]
    by_force = np.linalg.norm(moved[1] - moved[0]) / 2e-5
    assert stiff.stiffness[first] == pytest.approx(1.0 / by_force, rel=1e-3)


def test_rays_pull_neighbours_up_and_down_again():
    robot = nf.load_robot("two-axis-wrist")
    largest = np.array([1.0, 2.0, 1.0, 2.0])
    points = partial(sobol_points, seed=0, start=0, stop=64, total=64)
    tension = rays(robot, largest, 5, 0.1, points)
    assert tension.shape == (64, 10, 4)
    assert np.array_equal(tension, tension[:, ::-1])
    assert (np.diff(tension[:, :5], axis=1) >= 0.0).all()
    assert (tension >= 0.1).all()
    assert (tension <= largest).all()
    pulled = tension[:, 4] > 0.1
    assert (pulled.sum(axis=1) <= 2).all()
    assert not (pulled[:, 0] & pulled[:, 2]).any()  # never both of a pair across the tube
    assert pulled.any(axis=0).all()


def test_hulls_of_known_shapes():
    corners = np.array([[x, y, z] for x in (0, 2) for y in (0, 3) for z in (0, 4)], float)
    within = RNG.uniform(0.0, 1.0, (200, 3)) * [2.0, 3.0, 4.0]
    box = hull_of(np.concatenate([corners, within]))
    assert (box.dimension, box.size, len(box.corners)) == (3, pytest.approx(24.0), 8)
    assert inside(box, np.array([[1.0, 1.0, 1.0], [3.0, 1.0, 1.0]])).tolist() == [True, False]
    turn = np.linalg.qr(RNG.normal(size=(3, 3)))[0]
    flat = hull_of(np.concatenate([corners[::2], within * [1.0, 1.0, 0.0]]) @ turn)
    assert (flat.dimension, flat.size) == (2, pytest.approx(6.0))
    line = hull_of(np.outer(np.linspace(1.0, 3.0, 9), [0.0, 0.6, 0.8]))
    assert (line.dimension, line.size) == (1, pytest.approx(2.0))
    assert hull_of(np.ones((3, 3))).dimension == 0


def test_the_alpha_shape_leaves_hollows_out():
    angle = RNG.uniform(0.0, 2.0 * np.pi, 6000)
    radius = np.sqrt(RNG.uniform(1.0, 4.0, 6000))
    ring = np.stack([radius * np.cos(angle), 0.0 * angle, radius * np.sin(angle)], axis=1)
    assert alpha_size(ring, 0.2) == pytest.approx(3.0 * np.pi, rel=0.03)
    assert hull_of(ring).size == pytest.approx(4.0 * np.pi, rel=0.02)
    # A cube of unit cells without the 4 x 4 x 4 in its middle.
    grid = np.stack(np.meshgrid(*[np.arange(11.0)] * 3), axis=-1).reshape(-1, 3)
    shell = grid[~((grid > 3.5) & (grid < 6.5)).all(axis=1)]
    shell += RNG.uniform(-1e-3, 1e-3, shell.shape)
    # Cells in its corners and edges have so many corners left that spheres fit them.
    assert 1000.0 - 64.0 - 1.0 < alpha_size(shell, 1.0) < 1000.0 - 32.0
    assert hull_of(shell).size == pytest.approx(1000.0, rel=0.01)


def test_dexterity_counts_directions():
    every = RNG.normal(size=(20_000, 3))
    every /= np.linalg.norm(every, axis=1)[:, None]
    points = np.zeros((20_000, 3))
    points[10_000:] = 5.0
    directions = np.concatenate([every[:10_000], np.tile([[0.0, 0.0, 1.0]], (10_000, 1))])
    map_ = voxel_map(points, directions, {"hysteresis": np.arange(20_000.0)}, 1.0)
    assert map_.dexterity.tolist() == [1.0, 1.0 / DIRECTIONS]
    assert map_.states.tolist() == [10_000, 10_000]
    assert map_.values["hysteresis"].tolist() == [9_999.0, 19_999.0]


def test_two_workspaces_are_compared(wrist, found):
    less = workspace(wrist, states=512, tension=0.7)
    (both,) = overlaps({"all": found, "less": less})
    assert both.second_in_first > 0.9
    assert both.first_in_second < 0.8
    assert both.first_alone > both.second_alone


def test_limits_in_the_units_of_files():
    (limit,) = limits_of(in_python({"angle": (None, 90.0)}))
    assert (limit.quantity, limit.upper) == ("total_angle", pytest.approx(np.pi / 2))
    assert limit.text == "total bending angle at most 90 deg"


BAD = {
    "quantity": ("UNKNOWN_NAME", {"limits": {"colour": 1.0}}),
    "flag": ("UNKNOWN_NAME", {"limits": {"closed": 1.0}}),
    "reversed": ("OUT_OF_RANGE", {"limits": {"strain": (0.05, 0.01)}}),
    "bound": ("WRONG_TYPE", {"limits": {"strain": "much"}}),
    "three bounds": ("WRONG_SHAPE", {"limits": {"strain": (0.0, 0.1, 0.2)}}),
    "no bound": ("WRONG_SHAPE", {"limits": {"strain": (None, None)}}),
    "NaN": ("NOT_FINITE", {"limits": {"strain": np.nan}}),
    "no mapping": ("WRONG_TYPE", {"limits": [("strain", 0.1)]}),
    "tensions": ("WRONG_SHAPE", {"tension": [1.0, 2.0]}),
    "text": ("WRONG_TYPE", {"tension": "much"}),
    "negative": ("OUT_OF_RANGE", {"tension": -1.0}),
    "zero": ("OUT_OF_RANGE", {"tension": 0.0}),
    "infinite": ("NOT_FINITE", {"tension": np.inf}),
    "few": ("OUT_OF_RANGE", {"states": 3}),
    "many": ("OUT_OF_RANGE", {"states": 10**9}),
    "half": ("WRONG_TYPE", {"states": 100.5}),
    "pretension": ("OUT_OF_RANGE", {"pretension": 2.0}),
    "pretension is NaN": ("OUT_OF_RANGE", {"pretension": np.nan}),
    "seed": ("OUT_OF_RANGE", {"seed": -1}),
    "stiffness": ("OUT_OF_RANGE", {"stiffness": -1}),
    "cores": ("OUT_OF_RANGE", {"cores": 0}),
    "load": ("WRONG_TYPE", {"load": 3}),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_has_a_code(wrist, case):
    code, change = BAD[case]
    with refused(code):
        workspace(wrist, **({"states": 64, "tension": 1.0} | change))


def test_a_robot_whose_notches_never_close_needs_a_tension():
    with refused("MISSING_VALUE"):
        workspace(nf.load_robot("liu2022"), states=64)


def test_files_hold_all_states(found, tmp_path):
    xarray = pytest.importorskip("xarray")
    from notchflex.results.tables import json_text
    from notchflex.workspaces.cloud import save_netcdf, workspace_document

    save_netcdf({"a": found, "b/c": found}, str(tmp_path / "both.nc"))
    read = xarray.load_dataset(tmp_path / "both.nc", engine="h5netcdf", group="b-c")
    assert np.array_equal(read["tip_position"], found.tip)
    assert read["tip_position"].attrs["units"] == "mm"
    document = json.loads(json_text(workspace_document(found)))
    assert document["states"]["kept"] == 2048
    assert document["convex_hull"]["size"] == pytest.approx(found.hull.size)
