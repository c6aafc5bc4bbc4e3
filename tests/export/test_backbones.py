"""Solids, hinges and refusals of robots of disks on a backbone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import notchflex as nf
from notchflex.errors import InputError
from notchflex.export import MovingSolids, SimulatorOptions, SolidOptions, export_robot

trimesh = pytest.importorskip("trimesh", reason="the extra `export` is not installed")
pytest.importorskip("manifold3d", reason="the extra `export` is not installed")


def disks(bore: float = 0.0, *sides: float) -> nf.Robot:
    """Four disks 2 mm thick in a pitch of 20 mm, on a base of 3 mm."""
    return nf.Robot(
        "disks",
        nf.Tube(24.0, 1.6, base_length=3.0),
        (nf.RodGap(18.0, 1.4, bore, uncut_length=2.0, repeat=4),),
        tuple(nf.Tendon(10.0, side, path="straight") for side in sides or (0.0,)),
        nf.Linear(54e3, poisson_ratio=0.3),
        nf.Frictionless(),
    )


@pytest.mark.parametrize("bore", [0.0, 0.8])
@pytest.mark.parametrize("bent", [False, True])
def test_volume(tmp_path: Path, bore: float, bent: bool) -> None:
    """That of the disks, with the backbone in their holes, and of the free backbone."""
    robot, file = disks(bore), tmp_path / "disks.stl"
    path = nf.simulate(robot, nf.Load(tension=5.0)) if bent else robot
    export_robot(path, file, SolidOptions(shank=5.0, chord=0.01))
    solid = trimesh.load(file)
    assert solid.is_watertight
    filled = 12.0**2 * (8.0 + 4 * 2.0) + 0.7**2 * 4 * 18.0
    volume = np.pi * (filled - 0.25 * bore**2 * 88.0)
    assert solid.volume == pytest.approx(volume, rel=1e-4)


def test_moving_solids_follow_the_state() -> None:
    robot = disks(0.0, 0.0, 90.0)
    path = nf.simulate(robot, nf.Load(tension=(5.0, 4.0)))
    solids = MovingSolids(robot, shank=2.0)
    shape, flexures = solids.at(path)
    np.testing.assert_allclose(shape.tip, path.tip_position[0])
    for points, line in zip(flexures, shape.flexures, strict=True):
        # All points of its outside lie the radius of the backbone from its line.
        start, step = line.position[:-1], np.diff(line.position, axis=0)
        seen = points[:, None] - start
        part = np.clip(np.sum(seen * step, axis=-1) / np.sum(step**2, axis=-1), 0.0, 1.0)
        away = np.linalg.norm(seen - part[..., None] * step, axis=-1).min(axis=1)
        assert away.max() == pytest.approx(0.7, rel=0.01)
    for points, faces in solids.bodies:
        assert trimesh.Trimesh(points, faces, process=False).is_watertight


def test_holes_of_disks_are_drawn_where_they_are() -> None:
    """The sides of the disks and the slope of a hole through one: that of the spans beside it."""
    sides = (30.0, 60.0, 90.0, 120.0)
    tendon = nf.Tendon(10.0, path="straight", disk_direction_deg=sides)
    robot = disks().replace(tendon=(tendon,))
    line = robot.geometry.shape(np.zeros(4)).tendon(0)
    middles = 0.5 * (line[2::2] + line[3::2])
    angles = np.radians(sides)
    wanted = np.stack([10 * np.cos(angles), 10 * np.sin(angles), 22.0 + 20.0 * np.arange(4)], 1)
    np.testing.assert_allclose(middles, wanted, atol=1e-9)
    through = line[5] - line[4]  # the second disk, halfway in turn between the first and the third
    across = wanted[2] - wanted[0]
    np.testing.assert_allclose(np.cross(through, across), 0.0, atol=1e-9)


def test_mujoco_model_has_disks_and_backbones(tmp_path: Path) -> None:
    file = tmp_path / "disks.xml"
    exported = export_robot(disks(), file, SimulatorOptions(largest_tension=1.0))
    text = file.read_text(encoding="utf-8")
    assert text.count('type="cylinder"') == 5 + 8  # disks with the base, and halves of backbones
    for error in exported.facts.get("errors", ()):  # where MuJoCo is installed
        assert error["total_angle"] < 1e-6
        assert error["tip_position"] < 1e-3  # a hinge stays where an arc moves


@pytest.mark.parametrize(
    ("file", "options", "words"),
    [
        ("a.dxf", None, "no flat pattern"),
        ("a.pdf", None, "no flat pattern"),
        ("a.xml", SimulatorOptions(largest_tension=1.0), "out of one plane"),
        ("a.stl", SolidOptions(polishing=0.1), "leave polishing out"),
    ],
)
def test_refused(tmp_path: Path, file: str, options: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        export_robot(disks(0.0, 0.0, 90.0), tmp_path / file, options)
