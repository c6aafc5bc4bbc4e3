"""A robot as rigid bodies, hinges with springs and friction, and tendons through holes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from notchflex.export.simulators.hinges import HingeChain, fit_hinges
from notchflex.export.simulators.levers import tendon_levers
from notchflex.export.simulators.samples import PullSamples, load_range, pull_samples
from notchflex.export.simulators.springs import HingeSpring, fit_spring
from notchflex.export.tendon_holes import Hole, tendon_holes
from notchflex.mechanics.chain import assemble
from notchflex.mechanics.chain.mass import body_lengths
from notchflex.mechanics.contact import closing_angles
from notchflex.robot import Robot


@dataclass(frozen=True)
class JointModel:
    """A robot of n hinges and t tendons for a simulator of rigid bodies. Units mm, N, g, rad.

    Attributes:
        robot: The robot.
        top: Largest tension of the range that the joints are fitted over, N.
        hinges: Where the hinges stand.
        springs: What each hinge answers with, N mm.
        limit: Angle from the free robot at which the lips of each notch meet, rad; infinite for one
            that does not close by turning.
        holes: The points that each tendon runs through.
        body_length: Length of each body on the tube axis, mm.
        body_mass: Mass of each body, g; 0 where the material has no density.
        body_centre: Its centre of mass in its frame, mm.
        pulls: The states of the robot that all this was fitted to, one entry per tendon.
    """

    robot: Robot
    top: float
    hinges: HingeChain
    springs: tuple[HingeSpring, ...]
    limit: Float[np.ndarray, " n"]
    holes: tuple[list[Hole], ...]
    body_length: Float[np.ndarray, " bodies"]
    body_mass: Float[np.ndarray, " bodies"]
    body_centre: Float[np.ndarray, "bodies 3"]
    pulls: tuple[PullSamples, ...]


def joint_model(robot: Robot, largest_tension: float | None = None) -> JointModel:
    """Fit a model of rigid bodies and hinges to the bending of a robot.

    Args:
        robot: The robot.
        largest_tension: Largest tension of the range, N; see `load_range`.

    Raises:
        InputError: The range is not usable, or a pull did not converge.

    Example:
        >>> from notchflex import load_robot
        >>> len(joint_model(load_robot("pacheco2021-a"), 2.0).springs)
        5
    """
    top = load_range(robot, largest_tension)
    pulls = tuple(pull_samples(robot, k, top) for k in range(len(robot.tendon)))
    hinges = fit_hinges(robot, pulls)
    holes = tuple(tendon_holes(robot, k) for k in range(len(robot.tendon)))
    chain = assemble(robot, flat=False)
    return JointModel(
        robot=robot,
        top=top,
        hinges=hinges,
        springs=_springs(hinges, pulls, holes, np.asarray(chain.stiffness)[:, 0]),
        limit=np.asarray(closing_angles(chain.rods)),
        holes=holes,
        body_length=body_lengths(robot.tube, robot.notches),
        body_mass=np.asarray(chain.body_mass),
        body_centre=np.asarray(chain.body_centre),
        pulls=pulls,
    )


def _springs(
    hinges: HingeChain,
    pulls: Sequence[PullSamples],
    holes: Sequence[list[Hole]],
    stiffness: Float[np.ndarray, " n"],
) -> tuple[HingeSpring, ...]:
    """Fit the moment of every hinge to all pulls together."""
    levers = [tendon_levers(hinges, holes[one.tendon], one.angle) for one in pulls]
    moments = [lever * one.tension[:, None] for lever, one in zip(levers, pulls, strict=True)]
    springs: list[HingeSpring] = []
    for j, own in enumerate(stiffness):
        rows = [one.slips[:, j] for one in pulls]
        angle = [one.angle[row, j] for one, row in zip(pulls, rows, strict=True)]
        moment = [each[row, j] for each, row in zip(moments, rows, strict=True)]
        rising = [
            np.where(one.loading[row], 1.0, -1.0) for one, row in zip(pulls, rows, strict=True)
        ]
        joined = [np.concatenate(each) for each in (angle, moment, rising)]
        springs.append(fit_spring(joined[0], joined[1], joined[2], float(own)))
    return tuple(springs)
