"""Robots of Nitinol with hysteresis: the memory of the material in solver, states and batches."""

from __future__ import annotations

import dataclasses
import itertools
from pathlib import Path

import numpy as np
import pytest

import notchflex as nf
from margins import Margin
from notchflex._jax import jax

NITINOL = nf.Nitinol(10_000.0, 280.0, 3_000.0, unloading_stress=120.0)
FREE = nf.Capstan(0.0)  # not `Frictionless`: with friction and without share a program
WRIST = dataclasses.replace(nf.load_robot("pacheco2021-a"), material=NITINOL, friction=FREE)
NOTCH = nf.ArcNotch("on-axis", depth=1.4, height=0.8, uncut_length=1.2, repeat=5, ends="shell")
FLATTENS = dataclasses.replace(WRIST, notch=(NOTCH,), material=nf.Nitinol(unloading_stress=150.0))
TENSIONS = [0.8, 1.6, 1.0, 0.5, 0.8, 1.2, 0.8, 0.5, 0.9, 1.6, 0.0]


def pulls(tensions: list[float]) -> list[nf.Load]:
    return [nf.Load(tension=one) for one in tensions]


@pytest.fixture(scope="module")
def path() -> nf.EquilibriumPath:
    found = nf.simulate(WRIST, pulls(TENSIONS))
    assert found.converged.all()
    return found


def test_unloading_lags_and_inner_loops_return(path: nf.EquilibriumPath) -> None:
    angle = path.total_angle
    assert angle[2] > nf.solve(WRIST, nf.Load(tension=1.0)).total_angle + 0.05
    # 0.5 -> 1.2 -> 0.5 N is a loop inside the way down from 1.6 N.
    np.testing.assert_allclose(path.notch_angle[7], path.notch_angle[3], rtol=1e-10)
    np.testing.assert_allclose(path.notch_angle[9], path.notch_angle[1], rtol=1e-10)
    np.testing.assert_allclose(path.notch_angle[10], 0.0, atol=1e-10)
    assert abs(angle[6] - angle[4]) > 1e-4  # up and down differ inside it


def test_without_friction_the_work_is_stored_or_lost_in_the_material() -> None:
    loads = nf.pull(0.0, 1.6, steps=300).release()
    found = nf.simulate(WRIST, loads)
    lost = found.material_dissipation.sum(axis=-1)
    balance = found.tendon_work[:, 0] - found.stored_energy - lost
    assert np.abs(balance).max() < 1e-4 * found.tendon_work.max()
    assert (np.diff(found.material_dissipation, axis=0) >= -1e-14).all()
    assert lost[-1] > 0.1 * found.stored_energy.max()
    assert not nf.simulate(nf.load_robot("pacheco2021-a"), loads).material_dissipation.any()


def test_a_saved_state_continues_as_the_uninterrupted_path(
    path: nf.EquilibriumPath, tmp_path: Path
) -> None:
    first = nf.simulate(WRIST, pulls(TENSIONS[:5]))
    first.state.save(tmp_path / "state.json")
    rest = nf.simulate(
        WRIST, pulls(TENSIONS[5:]), from_state=nf.State.load(tmp_path / "state.json")
    )
    np.testing.assert_array_equal(rest.notch_angle, path.notch_angle[5:])
    np.testing.assert_allclose(
        first.material_dissipation[-1] + rest.material_dissipation[-1],
        path.material_dissipation[-1],
        rtol=1e-12,
    )
    # A path that is read back counts from the state that it continued, too.
    nf.save_path(rest, tmp_path / "rest.json")
    read = nf.read_path(tmp_path / "rest.json")
    np.testing.assert_allclose(read.material_dissipation, rest.material_dissipation, rtol=1e-12)


@pytest.mark.parametrize("force", [(0.02, 0.0, 0.0), (0.01, 0.01, 0.0)])
def test_flexures_of_any_nodes_go_on_under_loads_in_the_plane_and_in_space(
    force: tuple[float, float, float],
) -> None:
    # Under the tendon alone rods have five nodes, the table and the arcs have one.
    others = (
        nf.RodGap(4.0, 0.8, 0.5, uncut_length=0.5, repeat=2),
        nf.TableNotch(2.0, angle_deg=(10.0, 40.0), moment=(3.1, 8.0), uncut_length=1.0),
    )
    tendon = nf.Tendon(0.7, path="straight")
    mixed = FLATTENS.replace(notch=(*others, NOTCH), tendon=(tendon,))
    loads = [*pulls([0.5, 1.6, 1.2]), *(nf.Load(pull, tip_force=force) for pull in (1.2, 0.6))]
    loads.append(nf.Load(1.5))
    whole, first = nf.simulate(mixed, loads), nf.simulate(mixed, loads[:3])
    rest = nf.simulate(mixed, loads[3:], from_state=first.state)
    assert whole.converged.all()
    assert len(first.chain.law.rest(first.chain.rods.section)[0]) == 5
    memory = first.state.fitted(rest.chain).memory.material
    np.testing.assert_allclose(
        memory, whole.state_at(2).fitted(rest.chain).memory.material, atol=1e-14
    )
    assert np.abs(memory).max() > 0.005
    np.testing.assert_allclose(rest.notch_angle, whole.notch_angle[3:], atol=1e-7)
    np.testing.assert_allclose(
        first.material_dissipation[-1] + rest.material_dissipation[-1],
        whole.material_dissipation[-1],
        atol=1e-9,
    )


def test_a_batch_is_its_rows(path: nf.EquilibriumPath) -> None:
    other = WRIST.with_value("material.unloading_stress", 200.0)
    rows = nf.simulate_batch([WRIST, other], path.load)["total_angle"]
    np.testing.assert_allclose(rows[0], path.total_angle, atol=1e-12)
    alone = nf.simulate(other, pulls(TENSIONS)).total_angle
    np.testing.assert_allclose(rows[1], alone, atol=1e-12)
    assert np.abs(rows[0] - rows[1]).max() > 0.01


def test_derivatives_pass_through_the_memory() -> None:
    robot = dataclasses.replace(WRIST, friction=nf.Capstan(0.1))
    values = {
        "material.elastic_modulus": 10_000.0,
        "material.plateau_stress": 280.0,
        "material.unloading_stress": 120.0,
        "notch[*].height": WRIST.notches[0].height,
    }
    loads = pulls([1.37, 0.83, 0.61, 1.03])
    function = nf.differentiable(robot, loads, list(values))

    def angles(name: str, change: float) -> np.ndarray:
        return np.asarray(function(values | {name: values[name] + change})["total_angle"])

    for name, value in values.items():
        step = 1e-5 * value
        difference = (angles(name, step) - angles(name, -step)) / (2.0 * step)
        change = {key: np.asarray(float(key == name)) for key in values}
        start = {key: np.asarray(float(one)) for key, one in values.items()}
        exact = jax.jvp(function, (start,), (change,))[1]["total_angle"]
        np.testing.assert_allclose(exact, difference, rtol=2e-5, atol=1e-7 / value)


@pytest.mark.nightly
@pytest.mark.filterwarnings("ignore::notchflex.InputWarning")  # any material
@pytest.mark.parametrize("name", ["liu2022", "gao2017"])
def test_every_notch_kind_takes_nitinol(name: str) -> None:
    robot = nf.load_robot(name)
    modulus = robot.material.elastic_modulus

    def of(scale: float) -> nf.Robot:
        """The robot of a material that yields at this part of a hundredth of its modulus."""
        stress = 0.01 * scale * modulus
        material = nf.Nitinol(modulus, stress, 0.3 * modulus, unloading_stress=0.5 * stress)
        return dataclasses.replace(robot, material=material)

    others = [0.0] * (len(robot.tendon) - 1)
    loads = [nf.Load(tension=[one, *others]) for one in (0.5, 0.2)]
    linear = dataclasses.replace(robot, material=nf.Linear(modulus))
    expected = nf.solve(linear, loads[0]).tip_position
    np.testing.assert_allclose(nf.solve(of(1e4), loads[0]).tip_position, expected, atol=1e-9)
    path = nf.simulate(of(0.02), loads)
    assert path.converged.all()
    assert path.material_dissipation[-1].sum() > 0.0


@pytest.mark.nightly
def test_derivatives_where_friction_holds_a_notch(margin) -> None:
    """A held notch rests on a kink: value and slope are of the same side."""
    notch = nf.ArcNotch("on-axis", depth=1.4, height=1.0, uncut_length=1.0, repeat=2)
    robot = nf.Robot(
        name="held",
        tube=nf.Tube(1.62, 1.40),
        notch=(notch,),
        tendon=(nf.Tendon(0.70, path="straight"),),
        material=nf.Nitinol(unloading_stress=150.0),
        friction=nf.Capstan(0.15),
    )
    tension = np.concatenate([np.linspace(0.1, 1.6, 8), np.linspace(1.58, 1.2, 20)])
    loads = [nf.Load(tension=float(one)) for one in tension]
    model = nf.differentiable(robot, loads, ["material.elastic_modulus"], outputs=["total_angle"])
    slope = jax.jacfwd(lambda start: model(start)["total_angle"])(model.start)
    value, step = 42_000.0, 0.42
    ends = [
        nf.simulate(robot.with_value("material.elastic_modulus", value + by), loads).total_angle
        for by in (step, -step)
    ]
    difference = (ends[0] - ends[1]) / (2.0 * step)
    found = np.asarray(slope["material.elastic_modulus"])
    margin.within("slope, per modulus", (found - difference) * value, 1e-6)


def balance(
    friction: nf.Capstan, corners: list[float], count: int
) -> tuple[nf.EquilibriumPath, np.ndarray]:
    """Path over strokes in so many steps each, and what is missing as a part of the work."""
    robot = dataclasses.replace(FLATTENS, friction=friction)
    parts = [np.linspace(*pair, count + 1)[1:] for pair in itertools.pairwise(corners)]
    path = nf.simulate(robot, [nf.Load(stroke=float(one)) for one in np.concatenate(parts)])
    assert path.converged.all(), path.reason
    lost = path.material_dissipation.sum(axis=-1) + np.nansum(path.dissipation, axis=(1, 2))
    assert (np.diff(path.material_dissipation.sum(axis=-1)) > -1e-9).all()  # no loop gains work
    missing = path.tendon_work[:, 0] - path.stored_energy - lost
    return path, missing / path.tendon_work.max()


@pytest.mark.parametrize("friction", [FREE, nf.Capstan(0.13)], ids=["frictionless", "capstan"])
def test_work_is_stored_or_lost_where_notches_flatten(friction: nf.Capstan, margin: Margin) -> None:
    """Flattening and hysteresis together: what is missing falls with the square of the steps."""
    corners = [0.0, 1.7, 0.7, 1.3, 0.3, 1.6, 0.4]
    coarse, fine = (balance(friction, corners, count)[1] for count in (80, 320))
    margin.within("balance, part of the work", fine, 1.25e-5)
    margin.within("the same without steps, extrapolated", (16.0 * fine[3::4] - coarse) / 15.0, 1e-6)
    assert np.abs(coarse).max() > 12.0 * np.abs(fine[3::4]).max()  # 16 by the trapezoid rule


@pytest.mark.nightly
def test_work_is_stored_or_lost_where_a_notch_closes(margin: Margin) -> None:
    """Rigid lips do no work, but their force jumps as they meet: the trapezoid rule counts some."""
    corners = [0.0, 2.4, 0.7, 1.3, 0.3, 2.3, 0.4]
    missing, without_lips = {}, {}
    for count in (40, 160):
        path, missing[count] = balance(nf.Capstan(0.13), corners, count)
        force, closing = path.contact_force, -np.diff(path.gap, axis=0)
        counted = np.sum(0.5 * (force[1:] + force[:-1]) * closing, axis=-1)
        counted = np.append(0.0, np.cumsum(counted)) / path.tendon_work.max()
        without_lips[count] = np.abs(missing[count] - counted).max()
        # The shape is continuous where the tension jumps: no energy is lost there.
        closes = int(np.flatnonzero(path.closed[:, 0])[0])
        jump = path.tension[closes, 0] - path.tension[closes - 1, 0]
        turned = np.abs(np.diff(path.notch_angle, axis=0)).max(axis=1)
        assert jump > 0.05
        assert turned[closes - 1] < turned[closes - 2]
    margin.within("balance without the lips, part of the work", without_lips[160], 5e-5)
    assert without_lips[40] > 12.0 * without_lips[160]  # 16 by the trapezoid rule
    assert np.abs(missing[160]).max() > 5.0 * without_lips[160]
