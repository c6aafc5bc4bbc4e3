"""Whatever computes results returns them in the one world, however the base is turned."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import notchflex as nf
from notchflex._quantity import REGISTERED
from notchflex.analysis.outputs import OUTPUTS
from notchflex.errors import ErrorCode
from refusals import refused

IN_WORLD = tuple(name for name in OUTPUTS if name in REGISTERED and REGISTERED[name].in_world)
WRIST = nf.load_robot("pacheco2021-a")
SEEDS = pytest.mark.parametrize(
    "seed", [1, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in (2, 3))]
)


def turned_loads(seed: int) -> tuple[nf.LoadPath, Rotation]:
    """A pull of wrist A in a random orientation; but for the first, loads in space at its tip."""
    generator = np.random.default_rng(seed)
    turn = Rotation.from_rotvec(generator.uniform(-2.0, 2.0, 3))
    push = tuple(generator.uniform(-0.05, 0.05, 3))
    loads = nf.pull(0.3, generator.uniform(0.8, 1.8), steps=3)
    turned = nf.LoadPath(loads.tension, loads.stroke, turn.as_rotvec())
    return turned if seed == 1 else turned.loaded(tip_mass=5.0, tip_force=push), turn


def agree(values, expected, name: str) -> None:
    size = max(1.0, float(np.abs(expected).max()))
    np.testing.assert_allclose(values, expected, rtol=0, atol=1e-12 * size, err_msg=name)


@SEEDS
def test_all_agree(wrist: nf.Robot, seed: int):
    loads, turn = turned_loads(seed)
    path = nf.simulate(wrist, loads).raise_if_failed()
    rows = nf.simulate_batch(wrist, [loads, loads], outputs=IN_WORLD)
    bands = nf.uncertain(wrist, loads, draws=2, tolerances=(), outputs=("tip_position",))
    at_once = nf.differentiable(
        wrist, loads, "notch.depth", outputs=("total_angle", "tip_position")
    )
    external = replace(loads[0], tension=None)
    stepper = nf.Stepper(wrist, IN_WORLD, loads=external)
    driven = stepper.step(stepper.rest(), loads.tension[0]).values
    for name in IN_WORLD:
        agree(rows[name][1], path.quantity(name), name)
        agree(driven[name], path.quantity(name)[0], name)
    agree(path.body_rotation[:, 0], np.broadcast_to(turn.as_matrix(), (3, 3, 3)), "base")
    agree(at_once()["tip_position"], path.tip_position, "differentiable")
    agree(bands.samples["tip_position"], np.stack([path.tip_position] * 2), "bands")


def test_the_mirror_of_the_base(wrist: nf.Robot):
    """A base turned by half a turn about x has its tip below it, whoever is asked."""
    load = nf.Load(tension=1.0, base_rotation=(np.pi, 0.0, 0.0), tip_mass=5.0)
    state, batch = nf.solve(wrist, load), nf.solve_batch(wrist, load)
    assert state.tip_position[2] < -5.0
    agree(batch["tip_position"][0], state.tip_position, "tip")


def test_paths_of_bases_turned_in_other_ways_are_not_joined():
    first, second = nf.pull(0.0, 1.0, steps=2), nf.pull(1.0, 0.0, steps=2)
    turned = nf.LoadPath(second.tension, second.stroke, np.array([0.0, 1.0, 0.0]))
    assert len(turned.then(turned)) == 4
    assert (turned.then(turned).base_rotation == turned.base_rotation).all()
    with refused(ErrorCode.CONFLICT, "base_rotation"):
        first.then(turned)


@SEEDS
def test_a_workspace_and_a_sweep_are_in_the_world(tmp_path, seed: int):
    _, turn = turned_loads(seed)
    vector = turn.as_rotvec()
    load = nf.Load(base_rotation=tuple(vector))
    plain, turned = (nf.workspace(WRIST, tension=1.0, states=64, load=one) for one in (None, load))
    agree(turned.tip, turn.apply(plain.tip), "workspace")
    depths = [1.36, 1.4]
    plan = {
        "robot": "pacheco2021-a",
        "variable": [{"value": "notch.depth", "values": depths}],
        "load": {"pulled": {"tension": 1.0, "base_rotation": np.degrees(vector).tolist()}},
        "keep": [{"quantity": "tip_position", "axis": axis} for axis in "xyz"],
    }
    swept = nf.sweep(plan, tmp_path).lazy().collect()
    pulled = nf.Load(tension=1.0, base_rotation=tuple(vector))
    robots = [WRIST.with_value("notch.depth", depth) for depth in depths]
    tips = [nf.solve(robot, pulled).tip_position for robot in robots]
    agree(swept.select([c for c in swept.columns if "tip" in c]).to_numpy(), tips, "sweep")
