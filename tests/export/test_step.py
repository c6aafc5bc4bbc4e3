"""Solids as STEP, read back by build123d: exact volumes, and the tip of the chain."""

import dataclasses
import importlib.util
import math

import numpy as np
import pytest

import notchflex as nf
from export.closed_form import volume_of_windows
from notchflex.export.cuts import cuts_of
from notchflex.export.export import build
from notchflex.export.formats import SolidOptions, Subject
from refusals import refused

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.skipif(
        importlib.util.find_spec("build123d") is None,
        reason="build123d is not installed: pip install 'notchflex[cad]'",
    ),
]


def written(robot, tmp_path, **options):
    """The one solid of a file, as another program reads it."""
    import build123d

    file = tmp_path / "solid.step"
    nf.export_robot(robot, file, SolidOptions(**options))
    (solid,) = build123d.import_step(file).solids()
    assert solid.is_valid
    return solid


def end_face(solid, tip, normal):
    """The middle of the flat face whose plane holds the tip [mm]."""
    faces = [
        one
        for one in solid.faces()
        if one.is_planar
        and abs(np.array(tuple(one.normal_at())) @ normal) > 1.0 - 1e-9
        and abs((np.array(tuple(one.center())) - tip) @ normal) < 1e-6
    ]
    (face,) = faces
    return np.array(tuple(face.center()))


@pytest.mark.parametrize("name", ["pacheco2021-a", "york2015", "two-axis-wrist"])
def test_the_volume_is_that_of_sectors_and_segments(name, tmp_path):
    robot = nf.load_robot(name)
    solid = written(robot, tmp_path, shank=3.0)
    wanted = volume_of_windows(robot, cuts_of(robot).end + 3.0)
    assert solid.volume == pytest.approx(wanted, rel=1e-9)


def test_a_channel_takes_its_volume(tmp_path):
    robot = nf.load_robot("gao2017")
    robot = robot.replace(
        notch=(dataclasses.replace(robot.notch[0], repeat=3),),
        tendon=(dataclasses.replace(robot.tendon[0], end_body=3),),
    )
    plain, drilled = (written(robot, tmp_path, channels=width).volume for width in (0.0, 0.6))
    uncut = cuts_of(robot).end + 10.0 - 2 * 0.55
    assert plain - drilled == pytest.approx(uncut * math.pi * 0.3**2, rel=1e-6)


def test_the_tip_of_the_free_robot_is_that_of_the_chain(tmp_path):
    robot = nf.load_robot("pacheco2021-c-specimen")
    free = np.radians([[notch.precurvature_deg for notch in robot.notches]])
    tip, rotation = (np.array(one[0]) for one in nf.tip_from_angles(robot, free))
    found = end_face(written(robot, tmp_path), tip, rotation[:, 2])
    assert found == pytest.approx(tip, abs=1e-6)


def test_a_bent_robot_ends_at_the_tip_of_its_state(wrist, tmp_path):
    state = nf.solve(wrist, nf.Load(tension=1.0))
    solid = written(state, tmp_path)
    tip, normal = np.array(state.tip_position), np.array(state.body_rotation)[-1][:, 2]
    assert end_face(solid, tip, normal) == pytest.approx(tip, abs=1e-6)
    # The loft through nine sections.
    straight = volume_of_windows(wrist, cuts_of(wrist).end + 10.0)
    assert solid.volume == pytest.approx(straight, rel=1e-4)


def test_a_bent_strip_is_refused(wrist):
    path = nf.simulate(wrist, nf.pull(0.0, 1.0, steps=2))  # of any robot: it is not looked at
    with refused("UNSUPPORTED", "STL"):
        build("step", Subject(nf.load_robot("liu2022"), path, 1))


def test_the_same_robot_gives_the_same_file(wrist, tmp_path):
    texts = []
    for name in ("a", "b"):
        nf.export_robot(wrist, tmp_path / f"{name}.step")
        texts.append((tmp_path / f"{name}.step").read_text())
    assert texts[0] == texts[1]
    assert "notchflex" in texts[0]
