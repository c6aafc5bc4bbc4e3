"""Flexures that only fill a program up to its length change no number of a robot."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from notchflex.solver.programs import prepare

ANGLE = 1e-12  # rad
NOTCH = nf.ArcNotch(cut="on-axis", depth=1.4, height=0.8, uncut_length=1.2)


def _arcs(*paths: str) -> nf.Robot:
    """Two notches, tendons on opposite sides in turn, with friction."""
    return nf.Robot(
        name="short",
        tube=nf.Tube(1.62, 1.40),
        notch=[NOTCH, NOTCH],
        tendon=[nf.Tendon(0.7, direction_deg=180.0 * k, path=path) for k, path in enumerate(paths)],
        material=nf.Linear(7510.0),
        friction=nf.Capstan(0.2),
    )


def _strips() -> nf.Robot:
    """Five strips of Liu's robot, tendons that turn with their chords."""
    robot = nf.load_robot("liu2022").with_value("friction.turning", "chord")
    return robot.replace(notch=robot.notches[:5], tendon=[nf.Tendon(2.0, path="straight")])


@pytest.mark.nightly
@pytest.mark.parametrize(
    "robot",
    [
        _arcs("straight", "wall-arc", "straight-dead", "straight-follower"),
        _strips(),
    ],
    ids=["tendons of every path", "chords"],
)
def test_a_short_robot_in_a_longer_program(robot: nf.Robot, margin, monkeypatch) -> None:
    every = np.eye(robot.number_of_tendons)
    loads = [nf.Load(tension=pull * alone) for alone in every for pull in (0.1, 0.3, 0.2)]
    usual = nf.simulate(robot, loads)
    assert usual.prepared.long.chain.flexures > usual.chain.flexures
    assert usual.converged.all(), usual.reason
    with monkeypatch.context() as patched:
        patched.setattr(prepare, "capacity", lambda flexures: flexures)
        prepare.prepare.cache_clear()
        own = nf.simulate(robot, loads)
    prepare.prepare.cache_clear()
    assert own.prepared.long.chain.flexures == own.chain.flexures
    assert own.converged.all(), own.reason
    assert (np.abs(own.total_angle) > 1e-4).all(), "nothing bends"
    margin.within("angles", usual.notch_angle - own.notch_angle, ANGLE, "rad")
    margin.within("strokes", usual.stroke - own.stroke, 1e-12, "mm")
