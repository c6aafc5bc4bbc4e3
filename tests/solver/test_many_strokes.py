"""Several tendons drawn at once: contacts slide where other tendons bend the robot."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf


def circling(robot: nf.Robot, slack: float, stroke: float, turns: float, steps: int) -> nf.LoadPath:
    """Return strokes that bend a robot to all sides in turn; half of its tendons give way."""
    sides = np.radians([tendon.direction_deg for tendon in robot.tendon])
    angle = np.linspace(0.0, 2.0 * np.pi * turns, steps)[:, None]
    grows = np.minimum(1.0, np.arange(steps) / 10.0)[:, None]
    return nf.LoadPath(stroke=slack + stroke * grows * np.cos(angle - sides))


@pytest.mark.parametrize(("friction", "stiffness"), [(0.1, 1e3), (0.3, 1e3), (0.5, 200.0)])
def test_contacts_at_constant_base_tension_are_found(friction: float, stiffness: float) -> None:
    """Each step takes few iterations, though tendons that keep their tension slide as well."""
    robot = nf.load_robot("two-axis-wrist").replace(friction=nf.Capstan(friction))
    robot = robot.with_value("tendon.axial_stiffness", stiffness)
    robot = robot.with_value("tendon.free_length", 100.0)
    path = nf.simulate(robot, circling(robot, 0.1, 0.4, 2.0, 80)).raise_if_failed()
    assert np.mean(path.iterations) < 12.0
    assert (path.tension == 0.0).any(), "no tendon gives way: nothing is tried"


@pytest.mark.parametrize("friction", [0.1, 0.3])
def test_thirty_notches_are_followed(friction: float) -> None:
    """Where contacts are not found directly, the rest of a load goes on as they were found."""
    short = nf.load_robot("two-axis-wrist")
    notches = tuple(short.notches[number % short.number_of_notches] for number in range(30))
    tendons = tuple(
        nf.Tendon(tendon.radius, tendon.direction_deg, end_body=30, path=tendon.path)
        for tendon in short.tendon
    )
    robot = short.replace(notch=notches, tendon=tendons, friction=nf.Capstan(friction))
    path = nf.simulate(robot, circling(robot, 0.05, 1.5, 1.0, 60))
    assert path.converged.all(), path[int(np.argmin(path.converged))].reason


@pytest.mark.parametrize(("seed", "free_length"), [(1, 100.0), (5, 100.0), (1, 0.0), (2, 0.0)])
def test_two_contacts_at_a_thin_disk_share_what_they_hold(seed: int, free_length: float) -> None:
    """Nine tendons bend one segment after the other; disks have no thickness.

    Without a length before the base the drive can have any tension while the first contact sticks.
    """
    sides = [120.0 * tendon + 40.0 * segment for segment in range(3) for tendon in range(3)]
    elastic = {"axial_stiffness": 1000.0, "free_length": free_length}
    tendons = tuple(
        nf.Tendon(4.5, side, end_body=10 * (1 + number // 3), path="straight", **elastic)
        for number, side in enumerate(sides)
    )
    gaps = (nf.RodGap(6.0, 1.0, uncut_length=0.0, repeat=30),)
    steel = nf.Linear(50e3, poisson_ratio=0.3)
    robot = nf.Robot("segments", nf.Tube(11.0, 1.0), gaps, tendons, steel, nf.Capstan(0.3))
    random = np.random.default_rng(seed)
    bend, strokes = np.zeros((3, 2)), list[np.ndarray]()
    for segment in (0, 2, 1, 2, 0):
        further = bend.copy()
        further[segment] = random.uniform(-4.0, 4.0, 2)
        for part in np.linspace(0.0, 1.0, 7)[1:]:
            bent = np.repeat(bend + part * (further - bend), 3, axis=0)
            angle = np.radians(sides)
            drawn = bent[:, 0] * np.cos(angle) + bent[:, 1] * np.sin(angle)
            strokes.append(np.round(drawn, 2) - 0.2)
        bend = further
    path = nf.simulate(robot, nf.LoadPath(stroke=np.array(strokes)))
    assert path.converged.all(), path[int(np.argmin(path.converged))].reason
    assert free_length == 0.0 or np.mean(path.iterations) < 20.0
