"""A robot in SI units (m, N, rad) for a ROS 2 node; nothing here needs ROS.

The units of notchflex are mm, N and rad. Lengths are converted here, and nowhere else. Messages may
be wrong: no method raises for what a message holds. What cannot be used is named by a code, and the
robot stays where it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

import notchflex as nf

MM_PER_M = 1000.0
# A target is met to a micrometre, or as well as so many solves allow: the node answers in time.
SEARCH = nf.TargetSearch(tolerance=1e-3, solves=12)
MOST_READINGS = 12


@dataclass(frozen=True)
class JointValues:
    """Tendons and notches as joints, for `sensor_msgs/JointState`.

    Tendons: position is the length drawn out (m), effort the tension (N). Notches: position is the
    bending angle (rad), effort the largest bending moment along the notch (N·m).
    """

    name: list[str]
    position: list[float]
    effort: list[float]


@dataclass(frozen=True)
class Pose:
    """A pose in the frame of the base: position (m) and quaternion (x, y, z, w)."""

    position: list[float]
    orientation: list[float]


@dataclass(frozen=True)
class FeltForce:
    """A force on the tip (N), in the frame of the tip, and whether a contact is certain.

    `low` and `high` are the ends of the 95 % interval along the axes of the base that `axes` names.
    """

    force: list[float]
    contact: bool
    axes: tuple[str, ...]
    low: list[float]
    high: list[float]


class RobotCore:
    """A robot with its friction history, commanded, steered and read in SI units.

    `drive` is "tension" or "stroke": what commands are, and what a target is reached by.
    """

    def __init__(self, robot: nf.Robot, drive: str = "tension") -> None:
        if drive not in ("tension", "stroke"):
            raise nf.InputError(f'drive is "tension" or "stroke"; got {drive!r}')
        self.robot, self.drive = robot, drive
        tendons = range(1, robot.number_of_tendons + 1)
        notches = range(1, robot.number_of_notches + 1)
        self.tendons = [f"tendon_{number}" for number in tendons]
        self.notches = [f"notch_{number}" for number in notches]
        self.now = nf.solve(robot, nf.Load(tension=(0.0,) * len(self.tendons)))
        self._readings: list[np.ndarray] = []

    def command(self, values: list[float]) -> str:
        """Go to tensions (N) or strokes (m), one per tendon; return a code, "" if all is well."""
        numbers = _finite(values, len(self.tendons))
        if numbers is None:
            return "INVALID_INPUT"
        if self.drive == "stroke":
            load = nf.Load(stroke=tuple(MM_PER_M * numbers))
        else:
            load = nf.Load(tension=tuple(numbers))
        return self._go(load)

    def steer(self, position: list[float]) -> str:
        """Bring the tip to a position in the frame of the base (m), or as near as it comes.

        Returns:
            A code: "" if the tip is there, "TARGET_OUT_OF_REACH" where it is next to it.
        """
        place = _finite(position, 3)
        if place is None:
            return "INVALID_INPUT"
        try:
            found = nf.reach(
                self.robot,
                MM_PER_M * place,
                state=self.now.state,
                drive=self.drive,
                approach="direct",
                search=SEARCH,
            )
        except nf.InputError as problem:
            return problem.code.name
        return self._go(found.load) or found.code

    def joints(self) -> JointValues:
        """Return where tendons and notches are."""
        stroke, angle = self.now.stroke / MM_PER_M, self.now.notch_angle
        moment = self.now.notch_moment / MM_PER_M  # N·mm to N·m
        return JointValues(
            [*self.tendons, *self.notches],
            [*map(float, stroke), *map(float, angle)],
            [*map(float, self.now.tension), *map(float, moment)],
        )

    def tip(self) -> Pose:
        """Return where the tip is."""
        turn = Rotation.from_matrix(self.now.tip_rotation)
        place = self.now.tip_position / MM_PER_M
        return Pose(list(map(float, place)), list(map(float, turn.as_quat())))

    def read(self, name: list[str], position: list[float], effort: list[float]) -> str:
        """Take measured strokes (m) and tensions (N) of the tendons; others are left out.

        Returns:
            A code: "" if they can be used.
        """
        if not len(name) == len(position) == len(effort):
            return "INVALID_INPUT"
        rows = {one: (p, e) for one, p, e in zip(name, position, effort, strict=True)}
        if not set(self.tendons) <= set(rows):
            return "INVALID_INPUT"
        numbers = _finite([value for one in self.tendons for value in rows[one]], None)
        if numbers is None:
            return "INVALID_INPUT"
        stroke, tension = numbers.reshape(-1, 2).T
        reading = np.concatenate([np.maximum(tension, 0.0), MM_PER_M * stroke])
        # Between turns all goes on in proportion: only where the tendons turn are readings needed.
        kept = self._readings
        if len(kept) > 1 and (np.sign(reading - kept[-1]) == np.sign(kept[-1] - kept[-2])).all():
            kept = kept[:-1]
        self._readings = [*kept, reading][-MOST_READINGS:]  # another thread may be reading these
        return ""

    def feel(self) -> FeltForce | None:
        """Return the force on the tip by what was read; None where nothing can be told."""
        rows, count = np.array(self._readings), len(self.tendons)
        if not len(rows) or not rows[:, :count].any():
            return None
        try:
            found = nf.sense(self.robot, rows[:, :count], rows[:, count:])
        except nf.InputError:
            return None
        if found.path is None or not found.converged[-1]:
            return None
        in_tip = found.path[len(found.path) - 1].tip_rotation.T @ found.vector[-1]
        low, high = (list(map(float, ends[-1])) for ends in (found.low, found.high))
        force = list(map(float, in_tip))
        return FeltForce(force, bool(found.contact[-1]), found.components, low, high)

    def reset(self) -> None:
        """Forget what was read: the robot is known to be at rest, with slack tendons."""
        self.now = nf.solve(self.robot, nf.Load(tension=(0.0,) * len(self.tendons)))
        self._readings = []

    def _go(self, load: nf.Load) -> str:
        try:
            path = nf.simulate(self.robot, load, from_state=self.now.state)
        except nf.InputError as problem:
            return problem.code.name
        if not path.converged[0]:
            return str(path.reason_code[0])
        self.now = path[0]
        return ""


def _finite(values: list[float], count: int | None) -> np.ndarray | None:
    """Return finite numbers, so many if a count is given; None for anything else."""
    try:
        numbers = np.asarray(values, float)
    except (TypeError, ValueError):
        return None
    right = numbers.ndim == 1 and count in (None, len(numbers))
    return numbers if right and np.isfinite(numbers).all() else None
