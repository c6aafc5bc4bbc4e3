"""Control: what to command so that the robot meets a target, with friction history."""

from notchflex.control.controller import Controller, ControlStatus
from notchflex.control.following import Following, Reach
from notchflex.control.inverse import follow, reach
from notchflex.control.limits import Limits
from notchflex.control.observer import Observer
from notchflex.control.problem import TargetSearch
from notchflex.control.targets import Targets, read_targets

__all__ = [
    "ControlStatus",
    "Controller",
    "Following",
    "Limits",
    "Observer",
    "Reach",
    "TargetSearch",
    "Targets",
    "follow",
    "reach",
    "read_targets",
]
