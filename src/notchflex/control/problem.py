"""The problem of a search for drives: robot, limits and targets from the arguments of a user."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple, get_args

import numpy as np
from jaxtyping import Bool, Float, Int

from notchflex import Failure, InputError, Load, Robot, State, Step, Stepper
from notchflex.control.limits import Drive, Limits, limits_of_robot
from notchflex.control.targets import Targets, weigh
from notchflex.search.least_squares import KEPT
from notchflex.support import check_integer, check_number, load_path, short_repr

Drives = Float[np.ndarray, " t"]
"""A value for every tendon, N or mm."""
Which = Bool[np.ndarray, " t"]
"""Which of the tendons."""
Goal = Float[np.ndarray, " m"]
"""Values of all targeted entries, NaN where an entry is free."""
PackedState = Float[np.ndarray, " state"]
"""A state as `Stepper` has it."""

# Default limit of drives, as a multiple of about the closing value of a notch.
_MAX_FACTOR = {"tension": 4.0, "stroke": 2.0}
# A program is compiled for every set of quantities; those of a group cost little beside each other.
_ASKED_TOGETHER = (
    ("tip_position", "tip_rotation", "total_angle"),
    ("tension", "stroke", "peak_strain", "gap"),
)
# Limits smaller than this (N, mm, or a strain) are kept within parts of it.
_MIN_LIMIT = 1e-3


@dataclass(frozen=True, kw_only=True)
class TargetSearch:
    """Tolerance and budget of a search for a target.

    Attributes:
        tolerance: Weighted error (mm, N, rad) at which the search ends.
        near: Distance from lengths of a target at which it counts as met, mm.
        near_angle: Angle from angles of a target at which it counts as met, rad.
        solves: Largest number of solves for one target.

    Raises:
        InputError: A number that is not positive.
    """

    tolerance: float = 1e-7
    near: float = 0.05
    near_angle: float = math.radians(0.2)
    solves: int = 80

    def __post_init__(self) -> None:
        """Check the numbers."""
        check_integer(self.solves, "the number of solves of a search")
        for name, value in vars(self).items():
            if not check_number(value, f"{name} of a search") > 0.0:
                raise InputError.OUT_OF_RANGE(
                    f"{name} of a search must be greater than 0; got {value!r}"
                )


class ProblemOptions(NamedTuple):
    """Arguments common to `reach`, `follow` and `Controller`."""

    state: State | None
    load: Load | None
    drive: Drive
    limits: Limits | None
    weights: Mapping[str, float] | None
    search: TargetSearch | None

    def check(self) -> None:
        """Check all but the weights.

        Raises:
            InputError: Anything of another type.
        """
        if self.drive not in get_args(Drive):
            raise InputError.UNKNOWN_NAME(
                f'drive is "tension" or "stroke"; got {short_repr(self.drive)}'
            )
        for name, kind in _KINDS.items():
            value = getattr(self, name)
            if value is not None and not isinstance(value, kind):
                raise InputError.WRONG_TYPE(f"{name} cannot be {short_repr(value)}; see its help")


_KINDS = {"load": Load, "limits": Limits, "search": TargetSearch, "state": State}


class Response(NamedTuple):
    """A solved step of the drives.

    Attributes:
        step: The step.
        slopes: Slopes by the drives of what is targeted, then of what is limited; of tendons that
            stick as they last slid.
        stuck: Which tendons stick, or may.
        slid: By how much each tendon was moved when it last slid, N or mm; 0 if it has not.
    """

    step: Step
    slopes: Float[np.ndarray, "m t"]
    stuck: Which
    slid: Drives


class LimitedEntries(NamedTuple):
    """Limits on quantities beside the drives.

    Attributes:
        entries: Which numbers of a step are limited.
        limits: Their limits.
        factors: One over the size of a limit; negative for a lowest value.
    """

    entries: Int[np.ndarray, " c"]
    limits: Float[np.ndarray, " c"]
    factors: Float[np.ndarray, " c"]


class Problem(NamedTuple):
    """What does not change from target to target.

    Attributes:
        stepper: The robot.
        entries: Entries of a step's values that have a target.
        weights: What an error of one unit counts.
        driven: Which tendons are driven; the others keep what the load commands.
        low: Lowest drive of every tendon, N or mm.
        high: Highest drive.
        allowed: Both without the limit on the rate.
        widest: Both without any limits of the user.
        rate: Largest change of a drive from target to target, N or mm.
        limited: Limits on other quantities.
        unit: Drive that about closes a notch, N or mm.
        by_tension: Whether drives are tensions; otherwise they are strokes.
        search: Tolerance and budget.
    """

    stepper: Stepper
    entries: Int[np.ndarray, " m"]
    weights: Goal
    driven: Which
    low: Drives
    high: Drives
    allowed: tuple[Drives, Drives]
    widest: tuple[Drives, Drives]
    rate: float
    limited: LimitedEntries
    unit: float
    by_tension: bool
    search: TargetSearch

    def present(self, state: PackedState) -> Drives:
        """Return the drives of a state; of held tendons what they are held at."""
        return np.where(self.driven, self.stepper.drives_of(state), self.low)

    def near(self, present: Drives) -> Problem:
        """Return the problem with drives no farther from the present ones than the rate."""
        if not np.isfinite(self.rate):
            return self
        low, high = (
            np.where(self.driven, np.clip(present + rate, *self.allowed), self.low)
            for rate in (-self.rate, self.rate)
        )
        return self._replace(low=low, high=high)

    def slopes(self, step: Step) -> Float[np.ndarray, "m t"]:
        """Return the slopes of what is targeted, then of what is limited."""
        rows = step.flat_jacobian[self.entries]
        if not self.limited.entries.size:
            return rows
        # At a kink some limited quantities have no slopes.
        return np.concatenate([rows, np.nan_to_num(step.flat_jacobian[self.limited.entries])])

    def room(self, step: Step) -> Float[np.ndarray, " c"]:
        """Return how far limited quantities are from their limits, as parts of them."""
        entries, limits, factors = self.limited
        return factors * (limits - step.flat_values[entries]) if entries.size else limits


class Attempt(NamedTuple):
    """Result of a search.

    Attributes:
        response: The solved step.
        error: Weighted distance from the target.
        excess: Largest violation of a limit, as a part of it; 0 where all are kept.
        solves: How many loads were solved.
        failure: Why the target is not met; None where it is.
    """

    response: Response
    error: float
    excess: float
    solves: int
    failure: Failure | None

    @property
    def rank(self) -> tuple[bool, bool, float]:
        """Order of attempts at one target, the best first."""
        failed = self.failure is not None
        size = self.error if failed else float(np.linalg.norm(self.drives))
        return failed, self.excess > KEPT, float(f"{size:.9g}")

    @property
    def drives(self) -> Drives:
        """Drives of all tendons, N or mm."""
        return self.response.step.drives

    @property
    def solved(self) -> bool:
        """Whether there is an equilibrium."""
        return bool(self.response.step.converged)


def make_problem(robot: Robot, targets: Targets, options: ProblemOptions) -> Problem:
    """Return what a search needs of robot, limits and targets.

    Raises:
        InputError: Anything that cannot be used.
    """
    options.check()
    tendons, limits, drive = robot.number_of_tendons, options.limits or Limits(), options.drive
    commands = load_path(options.load or Load(), tendons)
    tension, stroke = commands.tension[0], commands.stroke[0]
    held = ~np.isnan(tension) | ~np.isnan(stroke)
    if held.all():
        raise InputError.CONFLICT(
            "the load commands every tendon, so that none is left to be driven; "
            "leave the tension of those to be driven out"
        )
    limited = limits_of_robot(limits, drive, robot)
    outputs = {*targets.outputs, *(quantity for quantity, _, _ in limited)}
    words = np.where(held, np.where(np.isnan(stroke), "tension", "stroke"), drive).tolist()
    # With those usually asked beside them: fewer programs.
    usual = [name for group in _ASKED_TOGETHER if outputs & {*group} for name in group]
    stepper = Stepper(
        robot,
        tuple(dict.fromkeys([*usual, *sorted(outputs)])),
        drives=words,
        jacobian=True,
        loads=replace(options.load or Load(), tension=None, stroke=None),
        from_state=options.state,
        refinement=0 if options.state is None else options.state.refinement,
    )
    chain = stepper.prepared.chain
    by_tension = drive == "tension"
    unit = float(chain.closing_force if by_tension else np.asarray(chain.rods.length).sum())
    most = _MAX_FACTOR[drive] * unit
    least = 0.0 if by_tension else -most
    low, high = limits.bounds(drive, tendons)
    low = np.maximum(low, least)
    high = np.maximum(np.minimum(high, most), low)
    fixed = np.where(np.isnan(stroke), tension, stroke)
    low, high, least, most = (np.where(held, fixed, end) for end in (low, high, least, most))
    places = {name: place for name, (place, _) in stepper.places.items()}
    entries, weights = weigh(targets, places, options.weights)
    rate = np.inf if limits.rate is None else limits.rate
    search = options.search or TargetSearch()
    return Problem(
        stepper, entries, weights, ~held, low, high, (low, high), (least, most), rate,
        _limited_entries(limited, places), unit, by_tension, search,
    )  # fmt: skip


def _limited_entries(
    limited: list[tuple[str, float, np.ndarray]], places: Mapping[str, slice]
) -> LimitedEntries:
    entries = [np.r_[places[quantity]] for quantity, _, _ in limited]
    factors = [side / np.maximum(np.abs(limit), _MIN_LIMIT) for _, side, limit in limited]
    limits = [limit for _, _, limit in limited]
    rows = np.array([np.concatenate([[], *part]) for part in (entries, limits, factors)])
    entries, limits, factors = rows[:, np.isfinite(rows[1])]
    return LimitedEntries(entries.astype(int), limits, factors)
