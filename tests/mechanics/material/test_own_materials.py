"""Robots of several tubes and materials: against robots of one, balance of energy, slopes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import notchflex as nf
from notchflex.robot import robot_from_text, robot_text
from notchflex.robot.value_names import number_at

NITINOL = nf.Nitinol(42e3, 350.0, 6e3, unloading_stress=150.0)
SHAFT = nf.Linear(20e3)
ARC = nf.ArcNotch("on-axis", depth=1.38, height=0.8, uncut_length=1.2)


def robot_of(*notches: nf.ArcNotch | nf.TableNotch, **parts: Any) -> nf.Robot:
    usual: dict[str, Any] = {
        "name": "several",
        "tube": nf.Tube(1.62, 1.40),
        "tendon": (nf.Tendon(0.70),),
        "material": SHAFT,
        "friction": nf.Frictionless(),
    }
    return nf.Robot(notch=notches, **(usual | parts))


def with_parts(notch: nf.ArcNotch, **parts: Any) -> nf.ArcNotch:
    return nf.ArcNotch(
        notch.cut, notch.depth, notch.height, uncut_length=notch.uncut_length, **parts
    )


LOADS = [nf.Load(tension=tension) for tension in (0.5, 1.5, 2.4, 1.2, 0.3)]


@pytest.mark.parametrize("name", ["pacheco2021-a", "pacheco2021-b-true", "york2015", "liu2022"])
def test_own_material_equal_to_that_of_the_robot_changes_nothing(name: str):
    robot = nf.load_robot(name)
    table = {"material": robot.material}
    own = robot.with_values({f"notch[{k}].material": table["material"] for k in (1, 2)})
    for load in (nf.Load(tension=0.4), nf.Load(tension=0.4, tip_force=(0.004, 0.003, -0.01))):
        state, expected = nf.solve(own, load), nf.solve(robot, load)
        assert expected.converged
        for quantity in ("tip_position", "notch_angle", "stored_energy", "peak_strain"):
            values = getattr(state, quantity), getattr(expected, quantity)
            np.testing.assert_allclose(*values, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(own.geometry.body_mass, robot.geometry.body_mass, rtol=1e-15)


def test_materials_in_series_carry_one_moment():
    """Without friction all notches have the moment of the tendon: angles are those of one."""
    own = with_parts(ARC, material=NITINOL)
    softer = with_parts(ARC, material=nf.Linear(8e3))
    mixed = nf.simulate(robot_of(ARC, own, softer, own), LOADS)
    assert mixed.converged.all()
    for notches, material in (([0], SHAFT), ([1, 3], NITINOL), ([2], nf.Linear(8e3))):
        alone = nf.simulate(robot_of(ARC, material=material), LOADS)
        expected = np.repeat(alone.notch_angle, len(notches), axis=1)
        np.testing.assert_allclose(mixed.notch_angle[:, notches], expected, rtol=1e-9, atol=1e-12)
        lost = np.repeat(alone.material_dissipation, len(notches), axis=1)
        np.testing.assert_allclose(
            mixed.material_dissipation[:, notches], lost, rtol=1e-8, atol=1e-12
        )
    assert mixed.material_dissipation[-1, 1] > 1e-3
    assert not mixed.material_dissipation[:, [0, 2]].any()


def mixed_robot() -> nf.Robot:
    own = with_parts(ARC, material=NITINOL, repeat=2)
    table = nf.TableNotch(1.0, (5.0, 12.0, 30.0), (0.5, 1.4, 2.4), uncut_length=1.0)
    wide = with_parts(ARC, tube=nf.Tube(1.8, 1.5))
    tendon = nf.Tendon(0.70, axial_stiffness=5e3)
    return robot_of(ARC, own, table, wide, tendon=(tendon,), friction=nf.Capstan(0.13))


def test_energy_of_mixed_materials_balances():
    tension = np.concatenate([np.linspace(0.0, 2.0, 300), np.linspace(2.0, 0.2, 300)])
    path = nf.simulate(mixed_robot(), [nf.Load(tension=one) for one in tension])
    assert path.converged.all()
    assert path.material_dissipation[-1, [1, 2]].min() > 1e-3
    left = path.tendon_work.sum(axis=1) - path.stored_energy
    lost = path.material_dissipation.sum(axis=1) + np.nansum(path.dissipation, axis=(1, 2))
    np.testing.assert_allclose(left, lost, atol=1e-5 * path.stored_energy.max())


def test_states_and_files_know_every_material(tmp_path: Path):
    robot = mixed_robot()
    path = nf.simulate(robot, LOADS)
    assert path.converged.all()
    resumed = nf.simulate(robot, LOADS[3:], from_state=path[2].state)
    np.testing.assert_array_equal(resumed.tip_position, path.tip_position[3:])
    nf.save_path(path, tmp_path / "path.json")
    read = nf.read_path(tmp_path / "path.json")
    assert read.robot == robot
    np.testing.assert_array_equal(read.material_dissipation, path.material_dissipation)
    with pytest.raises(nf.InputError, match=r"notch\[2\].material.plateau_stress"):
        nf.simulate(
            robot.with_value("notch[2].material.plateau_stress", 360.0),
            LOADS[:1],
            from_state=path[2].state,
        )


def test_numbers_of_own_parts_differentiate_and_vary():
    robot, names = (
        mixed_robot(),
        ["notch[2].material.plateau_stress", "notch[5].tube.inner_diameter"],
    )
    path = nf.simulate(robot, LOADS[:4])
    slopes = path.jacobian([*names, "material.elastic_modulus"], "total_angle")["total_angle"]
    for name, value, slope in zip(
        [*names, "material.elastic_modulus"], (350.0, 1.5, 20e3), slopes.T, strict=True
    ):
        ends = [
            nf.simulate(robot.with_value(name, value * part), LOADS[:4]).total_angle
            for part in (0.99999, 1.00001)
        ]
        np.testing.assert_allclose(
            (ends[1] - ends[0]) / (2e-5 * value), slope, rtol=2e-4, atol=1e-9
        )
    columns = {names[0]: np.linspace(330.0, 370.0, 6), names[1]: np.linspace(1.48, 1.52, 6)}
    many = nf.batch(robot, columns, LOADS[2])["total_angle"]
    rows = zip(*columns.values(), strict=True)
    each = [nf.solve(robot.with_values(zip(names, row, strict=True)), LOADS[2]) for row in rows]
    np.testing.assert_allclose(many, [state.total_angle for state in each], rtol=0.0, atol=1e-12)


def test_own_tube_is_that_of_a_robot_of_it():
    wide, load = nf.Tube(1.9, 1.6), nf.Load(tension=1.0, gravity=(0.0, 3.0, -9.0))
    dense = nf.Linear(20e3, density=7000.0)
    own = robot_of(with_parts(ARC, tube=wide, repeat=3), material=dense)
    state, expected = (
        nf.solve(own, load),
        nf.solve(robot_of(with_parts(ARC, repeat=3), tube=wide, material=dense), load),
    )
    assert expected.converged
    np.testing.assert_allclose(state.tip_position, expected.tip_position, atol=1e-13)
    np.testing.assert_allclose(
        own.geometry.body_mass[1:],
        robot_of(with_parts(ARC, repeat=3), tube=wide, material=dense).geometry.body_mass[1:],
        rtol=1e-14,
    )


def test_own_density_is_that_of_the_piece_and_half_of_each_flexure_beside():
    heavy = with_parts(ARC, material=nf.Linear(20e3, density=7000.0))
    robot = robot_of(ARC, heavy, ARC, material=nf.Linear(20e3, density=1000.0))
    light = robot_of(ARC, ARC, ARC, material=nf.Linear(20e3, density=1000.0)).geometry.body_mass
    ring = 1e-6 * 1000.0 * np.pi * (0.81**2 - 0.70**2) * 1.2
    flexure = 2.0 * (light[3] - ring)  # half of one is left at the tip
    more = np.array([0.0, 0.5 * flexure, ring + 0.5 * flexure, 0.0])
    np.testing.assert_allclose(robot.geometry.body_mass, light + 6.0 * more, rtol=1e-12)
    with pytest.raises(nf.InputError, match="give the densities of both"):
        robot_of(ARC, heavy)


def test_names_of_own_parts():
    robot = robot_of(with_parts(ARC, material=NITINOL, repeat=3))
    one = robot.with_value("notch[2].material.elastic_modulus", 40e3)
    moduli = [number_at(one, f"notch[{k}].material.elastic_modulus") for k in (1, 2, 3)]
    assert moduli == [42e3, 40e3, 42e3]
    assert one.with_value("notch.material.elastic_modulus", 42e3).notches == robot.notches
    new = robot_of(ARC, ARC).with_values(
        {"notch[2].material.elastic_modulus": 9e3, "notch[2].material.kind": "linear"}
    )
    assert [notch.material for notch in new.notches] == [None, nf.Linear(9e3)]
    assert robot_from_text(robot_text(new)) == new
    template = robot_text(new).replace(
        "[[tendon]]",
        "[notch.tube]  # a sleeve\nouter_diameter = 1.7"
        "\ninner_diameter = 1.5  # guessed\n\n[[tendon]]",
    )
    sleeve = robot_from_text(template)
    rewritten = robot_text(sleeve.with_value("notch[2].tube.inner_diameter", 1.52))
    assert "[notch.tube]  # a sleeve" in rewritten
    assert "inner_diameter = 1.52  # guessed (changed from 1.5)" in rewritten
    for name, words in (
        ("notch[1].material.elastic_modulus", "no notch that is meant has a material of its own"),
        ("notch[2].material.elastic_modlus", "did you mean `elastic_modulus`"),
        ("notch[2].material.kind", 'allowed: "linear"'),
    ):
        with pytest.raises(nf.InputError) as caught:
            new.with_value(name, 1.0)
        assert words in str(caught.value)
    with pytest.raises(nf.InputError, match=r"`notch\[1\].tube.base_length` is for \[tube\]"):
        robot_of(with_parts(ARC, tube=nf.Tube(1.7, 1.5, base_length=2.0)))
    with pytest.raises(nf.InputError, match="outside the wall"):
        robot_of(nf.ArcNotch("on-axis", 1.0, 0.8, uncut_length=1.2, tube=nf.Tube(1.3, 1.1)))


def test_files_of_one_piece_refuse_several_tubes(tmp_path: Path):
    robot = mixed_robot().replace(notch=(ARC, with_parts(ARC, tube=nf.Tube(1.8, 1.5))))
    with pytest.raises(nf.InputError, match="made of several tubes or materials"):
        nf.export_robot(robot, tmp_path / "a.dxf")
