"""A short fingerprint of the values of a robot, to tell which robot a file was made from."""

import hashlib
import json

from notchflex.robot.robot import Robot, to_table

_DIGITS = 12


def robot_digest(robot: Robot) -> str:
    """Return 12 hexadecimal digits that depend on every value of a robot, its name included.

    Args:
        robot: The robot; comments and the order of keys in its file have no effect.

    Example:
        >>> from notchflex.robot import load_robot
        >>> wrist = load_robot("pacheco2021-a")
        >>> robot_digest(wrist) == robot_digest(wrist.with_value("notch.depth", 1.39))
        False
    """
    text = json.dumps(to_table(robot), sort_keys=True, ensure_ascii=False)
    return hashlib.sha256(text.encode()).hexdigest()[:_DIGITS]
