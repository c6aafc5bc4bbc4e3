"""Setup of a search: robot, limits and targets from the arguments of a user."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, get_args

import numpy as np

from notchflex import InputError, Load, LoadPath, Robot, State
from notchflex.control.limits import Drive, Limits, bounds_of_robot
from notchflex.control.program.drive_model import DriveModel
from notchflex.control.search.problem import Problem, TargetSearch
from notchflex.control.targets import Aim, Targets, aim_at
from notchflex.results.state import check_robot
from notchflex.support import load_path, short_repr

# Default limit of drives, as a multiple of about the closing value of a notch.
_MAX_FACTOR = {"tension": 4.0, "stroke": 2.0}
# A program is compiled for every set of quantities; those of a group cost little beside each other.
_ASKED_TOGETHER = (
    ("tip_position", "tip_rotation", "total_angle"),
    ("tension", "stroke", "peak_strain", "gap"),
)


class ProblemOptions(NamedTuple):
    """Arguments common to `reach`, `follow` and `Controller`.

    Attributes:
        state: The present state; rest where None.
        load: External loads, and tendons that are held.
        drive: Whether "tension" (N) or "stroke" (mm) is commanded.
        limits: Limits on drives and robot.
        weights: What an error of a quantity counts per unit (mm, N, rad).
        search: Tolerance and budget.
    """

    state: State | None
    load: Load | None
    drive: Drive
    limits: Limits | None
    weights: Mapping[str, float] | None
    search: TargetSearch | None

    @property
    def rate(self) -> float:
        """Largest change of a drive from target to target, N or mm."""
        rate = None if self.limits is None else self.limits.rate
        return np.inf if rate is None else rate

    def check(self, robot: Robot) -> None:
        """Check all but the weights.

        Raises:
            InputError: Anything of another type, or a state of another robot.
        """
        if self.drive not in get_args(Drive):
            raise InputError.UNKNOWN_NAME(
                f'drive is "tension" or "stroke"; got {short_repr(self.drive)}'
            )
        for value, kind, name in (
            (self.load, Load, "load"),
            (self.limits, Limits, "limits"),
            (self.search, TargetSearch, "search"),
            (self.state, State, "state"),
        ):
            if value is not None and not isinstance(value, kind):  # pyright: ignore
                raise InputError.WRONG_TYPE(f"{name} cannot be {short_repr(value)}; see its help")
        if self.state is not None:
            check_robot(self.state, robot)


def make_problem(robot: Robot, targets: Targets, options: ProblemOptions) -> tuple[Problem, Aim]:
    """Return what a search needs of robot and limits, and the targets as numbers.

    Raises:
        InputError: Anything that cannot be used.
    """
    options.check(robot)
    tendons, limits = robot.number_of_tendons, options.limits or Limits()
    drive, given = options.drive, load_path(options.load or Load(), tendons)
    held = ~np.isnan(given.tension[0]) | ~np.isnan(given.stroke[0])
    if held.all():
        raise InputError.CONFLICT(
            "the load commands every tendon, so that none is left to be driven; "
            "leave the tension of those to be driven out"
        )
    low, high = limits.bounds(drive, tendons)
    fixed = np.where(np.isnan(given.stroke[0]), given.tension[0], given.stroke[0])
    bounds = tuple(bounds_of_robot(limits, drive, tendons, robot.number_of_notches))
    outputs = [*targets.outputs, *(one.quantity for one in bounds)]
    # With those usually asked beside them: fewer programs.
    groups = [group for group in _ASKED_TOGETHER if set(group) & set(outputs)]
    usual = [name for group in groups for name in group]
    names = tuple(dict.fromkeys([*usual, *sorted(set(outputs))]))
    # A command for every tendon, of what is driven a zero.
    tables = {"tension": given.tension.copy(), "stroke": given.stroke.copy()}
    tables[drive][0, ~held] = 0.0
    load = LoadPath(**tables, base_rotation=given.base_rotation, external=given.external)
    model = DriveModel(robot, load, names, options.state)
    chain = model.prepared.chain
    unit = float(chain.closing_force)
    if drive == "stroke":
        unit = float(np.asarray(chain.rods.length).sum())
    most = _MAX_FACTOR[drive] * unit
    low = np.where(held, fixed, np.maximum(low, -most if drive == "stroke" else 0.0))
    chosen = held | (high <= most)
    high = np.where(held, fixed, np.maximum(np.minimum(high, most), low))
    aim = aim_at(targets, model.slices, options.weights)
    problem = Problem(
        model=model,
        entries=aim.entries,
        weights=aim.weights,
        driven=~held,
        low=low,
        high=high,
        chosen=chosen,
        bounds=bounds,
        unit=unit,
        by_tension=drive == "tension",
        search=options.search or TargetSearch(),
    )
    return problem, aim


def present_drives(problem: Problem, state: np.ndarray) -> np.ndarray:
    """Return the drives of a packed state; of held tendons what they are held at."""
    return np.where(problem.driven, problem.model.drives(state), problem.low)
