"""URDF files and the transmission table beside them, against the chain."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import notchflex as nf
from notchflex.export.formats import SimulatorOptions


def numbers(element: ElementTree.Element, tag: str, key: str) -> np.ndarray:
    found = element.find(tag)
    assert found is not None
    return np.array([float(value) for value in found.get(key, "").split()])


def tip_of(file: Path, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Walk from link to link as the URDF specification says; return place (m) and rotation."""
    place, rotation = np.zeros(3), np.eye(3)
    turns = iter(angle)
    for joint in ElementTree.parse(file).getroot().iter("joint"):
        place = place + rotation @ numbers(joint, "origin", "xyz")
        rotation = (
            rotation @ Rotation.from_euler("xyz", numbers(joint, "origin", "rpy")).as_matrix()
        )
        if joint.get("type") == "revolute":
            axis = numbers(joint, "axis", "xyz")
            rotation = rotation @ Rotation.from_rotvec(next(turns) * axis).as_matrix()
    return place, rotation


@pytest.fixture(scope="module")
def bent_wrist(wrist) -> nf.Robot:
    """Wrist A, bent when free, its notches turned by 30 degrees."""
    return wrist.with_values({"notch.precurvature_deg": 4.0, "notch.direction_deg": 30.0}).replace(
        tendon=(nf.Tendon(0.70, direction_deg=30.0),)
    )


def check_tip(robot: nf.Robot, file: Path) -> None:
    exported = nf.export_robot(robot, file, SimulatorOptions(1.2))
    assert "no tendons" in exported.warnings[0]
    assert "no tendons" in file.read_text()
    path = nf.simulate(robot, nf.pull(0.0, 1.2, 5))
    for step in (0, -1):
        place, rotation = tip_of(file, path.notch_angle[step] - path.notch_angle[0])
        assert 1e3 * place == pytest.approx(path.tip_position[step], abs=0.02)
        assert rotation == pytest.approx(path.tip_rotation[step], abs=1e-6)


def test_the_tip_stands_where_the_chain_has_it(wrist, tmp_path):
    check_tip(wrist, tmp_path / "a.urdf")


@pytest.mark.nightly
def test_the_tip_of_a_wrist_bent_when_free(bent_wrist, tmp_path):
    check_tip(bent_wrist, tmp_path / "a.urdf")


def test_names_with_signs_of_xml_are_written(wrist, tmp_path):
    named = wrist.replace(name='a--b <&> "c"')
    nf.export_robot(named, tmp_path / "a.urdf", SimulatorOptions(1.2))
    nf.export_robot(named, tmp_path / "a.xml", SimulatorOptions(1.2))
    for name in ("a.urdf", "a.xml"):
        root = ElementTree.parse(tmp_path / name).getroot()
        assert "<&>" in str(root.attrib)


def test_a_body_without_length_has_an_inertia_that_simulators_take(wrist, tmp_path):
    nf.export_robot(wrist, tmp_path / "a.urdf", SimulatorOptions(1.2))
    link = ElementTree.parse(tmp_path / "a.urdf").find("link[@name='body_0']/inertial")
    assert link is not None
    assert numbers(link, "mass", "value") > 0.0
    assert 2.0 * numbers(link, "inertia", "ixx") > 1.01 * numbers(link, "inertia", "izz")


def test_masses_add_up(wrist, tmp_path):
    nf.export_robot(wrist, tmp_path / "a.urdf", SimulatorOptions(1.2))
    masses = [
        float(one.get("value", "nan"))
        for one in ElementTree.parse(tmp_path / "a.urdf").iter("mass")
    ]
    tube = np.pi * (0.81**2 - 0.70**2) * 5 * 1.2
    spines = 5 * 0.8 * float(nf.annular_sector(0.81, 0.70, 1.40).area)
    # The base has no length here; it carries half of the first spine.
    assert sum(masses) == pytest.approx(6450e-9 * (tube + spines), rel=1e-3)


def test_the_table_balances_the_tendon_on_both_branches(wrist, tmp_path):
    nf.export_robot(wrist, tmp_path / "a.csv", SimulatorOptions(1.5))
    rows = list(csv.DictReader(io.StringIO((tmp_path / "a.csv").read_text())))
    assert {row["joint"] for row in rows} == {f"notch_{j}" for j in range(1, 6)}
    up = np.linspace(0.0, 1.5, 31)
    path = nf.simulate(wrist, nf.pull(0.0, 1.5, 31).release())
    for j in range(5):
        own = [row for row in rows if row["joint"] == f"notch_{j + 1}"]
        at, lever, elastic, friction = (
            np.array([float(row[key]) for row in own])
            for key in (
                "angle_rad",
                "tendon_1_lever_mm",
                "elastic_moment_Nmm",
                "friction_moment_Nmm",
            )
        )
        assert (friction >= 0.0).all()
        for branch, sign in ((slice(0, 31), 1.0), (slice(31, 62), -1.0)):
            tension = (elastic + sign * friction) / lever
            angle = path.notch_angle[branch, j]
            moved = np.abs(np.gradient(angle)) > 1e-6
            known = np.interp(at, angle[moved][:: int(sign)], up[:: int(sign)][moved][:: int(sign)])
            inside = at < 0.95 * angle[moved].max()
            assert tension[inside] == pytest.approx(known[inside], abs=0.03)


def test_models_are_pulled_at_the_base_behind_a_sheath(wrist, tmp_path):
    """Friction and stretch of a sheath are not those of a hinge."""
    behind = wrist.with_values(
        {
            "tendon.sheath_length": 500.0,
            "tendon.sheath_friction": 0.1,
            "tendon.sheath_bend_deg": 90.0,
            "tendon.sheath_wire_stiffness": 14e3,
            "tendon.backlash": 0.1,
        }
    )
    tables = []
    for robot in (wrist, behind):
        nf.export_robot(robot, tmp_path / "a.csv", SimulatorOptions(1.5))
        tables.append((tmp_path / "a.csv").read_text())
    assert tables[0] == tables[1]
    nf.export_robot(behind, tmp_path / "a.urdf", SimulatorOptions(1.5))
    assert "the sheaths before it are left out" in (tmp_path / "a.urdf").read_text()
