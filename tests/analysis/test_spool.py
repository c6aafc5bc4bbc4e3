"""Two tendons on one spool, against the linear system of a wrist without friction."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from notchflex.robot import robot_text
from notchflex.robot.reading import robot_from_text
from refusals import refused
from robots import ready

SHEATH = {"sheath_length": 800.0, "sheath_wire_stiffness": 9000.0}


def antagonists(**values: float) -> nf.Robot:
    """Return wrist A with a second tendon on its spine, both in straight sheaths, on one spool."""
    wrist = ready("a").with_values({"friction.kind": "frictionless", "material.kind": "linear"})
    tendon = wrist.tendon[0]
    both = [nf.Tendon(0.7, side, **(SHEATH | values), path=tendon.path) for side in (0.0, 180.0)]
    spool = nf.Drive(tendon=1, antagonist=2, pretension=0.3)
    return wrist.replace(tendon=both, drive=[spool])


def test_a_spool_draws_one_and_releases_the_other(margin):
    robot, ways = antagonists(), [0.0, 0.01, -0.01, 0.02]
    path = nf.simulate(robot, nf.spool_path(robot, ways)).raise_if_failed()
    unit = nf.solve_each(robot, [nf.Load(tension=(0.1, 0.0)), nf.Load(tension=(0.0, 0.1))])
    flexibility = 10.0 * unit.stroke.T
    moved = np.outer([0.0, *ways], [1.0, -1.0])
    tension = 0.3 + np.linalg.solve(flexibility, moved.T).T
    margin.within("tensions", path.tension - tension, 1e-9, "N")
    margin.within("strokes", path.stroke - path.stroke[0] - moved, 1e-12, "mm")


def test_a_spool_stands_at_zero_under_the_loads_that_act():
    robot, turn = antagonists(), np.radians([0.0, 30.0, 0.0])
    loads = {"tip_force": (0.05, 0.0, 0.0), "sheath_bend_deg": 40.0}
    load = nf.spool_path(robot, [0.0, 0.01], base_rotation=turn, **loads)
    assert load.external[2].tip_force == loads["tip_force"]
    assert load.base_rotation == pytest.approx(turn)
    path = nf.simulate(robot, load).raise_if_failed()
    assert path.tension[1] == pytest.approx([0.3, 0.3], abs=1e-9)
    assert path.stroke[0, 0] > nf.simulate(robot, nf.spool_path(robot, [0.0])).stroke[0, 0] + 1e-3


def test_friction_and_sheath_remember_the_turns():
    robot = antagonists(sheath_friction=0.15, sheath_bend_deg=180.0)
    path = nf.simulate(robot, nf.spool_path(robot, [0.0, 0.2, 0.0, -0.2, 0.0])).raise_if_failed()
    angle = path.total_angle
    assert angle[2] > angle[3] > angle[4]
    assert abs(angle[5] - angle[3]) > 1e-3, "no lost motion"


def test_robot_files_keep_the_spool():
    robot = antagonists()
    again = robot_from_text(robot_text(robot))
    assert again == robot
    changed = again.with_value("drive.pretension", 0.4)
    assert robot_from_text(robot_text(changed)).drive[0].pretension == 0.4


def test_what_is_refused():
    with refused("NOT_FINITE"):
        nf.spool_path(antagonists(), [0.0, np.inf])
    robot = antagonists()
    with pytest.raises(nf.InputError, match="has no spool"):
        nf.spool_path(ready("a"), [0.0])
    with pytest.raises(nf.InputError, match="steps by 1 spools"):
        nf.spool_path(robot, np.zeros((3, 2)))
    with refused("NOT_CONVERGED", "no state", "pretension", "smaller drive.pretension"):
        uneven = {"tendon[2].radius": 0.6, "tendon.path": "straight", "drive.pretension": 100.0}
        nf.spool_path(robot.with_values(uneven), [0.0])
    with pytest.raises(nf.InputError, match="the robot has 2 tendons"):
        robot.with_value("drive.antagonist", 3)
    with pytest.raises(nf.InputError, match="a spool drives already"):
        robot.with_value("drive.antagonist", 1)
    stiff = [nf.Tendon(0.7, side) for side in (0.0, 180.0)]
    with pytest.raises(nf.InputError, match="cannot be stretched"):
        robot.replace(tendon=stiff)
