"""A controller for loops: one target in, drives out, within a fixed number of solves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from notchflex import Failure, InputError, Load, Robot, State
from notchflex.control.limits import Drive, Limits
from notchflex.control.observer import Observer
from notchflex.control.problem_setup import ProblemOptions, make_problem, present_drives
from notchflex.control.program.drive_model import Response
from notchflex.control.search.iterative_search import search_iteratively, solve_directly
from notchflex.control.search.problem import TargetSearch
from notchflex.control.search.rate import cross_dead_bands, limit_rate
from notchflex.control.targets import DIRECTION, LARGEST_TARGET, Targets, target_shapes
from notchflex.support import check_is_robot, check_number, short_repr


class ControlStatus(NamedTuple):
    """Status of the last step of a controller.

    Attributes:
        reached: Whether the model meets the target.
        code: Name of the `Failure` where it does not; "INVALID_INPUT" for a target or a
            measurement that cannot be used; empty otherwise.
        error: Weighted distance of the model from the target (mm, N, rad); NaN where none is known.
        solves: How many loads were solved.
        held: Whether the command is the last good one, because none was found.
    """

    reached: bool
    code: str
    error: float
    solves: int
    held: bool


_START = ControlStatus(False, "", float("nan"), 0, False)


class Controller:
    """Drives for one target after the other, for use in a loop.

    A step never raises for what it is given, and never takes more than its number of solves.
    Feedforward is the exact inverse with friction history. Two kinds of measurements correct it:
    the target quantity itself, such as the position of the tip, and tension with stroke, which
    correct the friction history and the coefficient of friction.

    Args:
        robot: The robot.
        aim: Name of the quantity that targets give, or several names.
        state: The present state; rest where not given.
        load: External loads, and tendons that are held; as for `notchflex.reach`.
        drive: Whether "tension" (N) or "stroke" (mm) is commanded.
        limits: Limits on drives and robot.
        weights: What an error of a quantity counts per unit (mm, N, rad); 1 each.
        search: Tolerance, and the largest number of solves in a step.
        feedback: Part of the measured deviation that a step takes up, 0 to 1.
        observer: Corrects history and friction by measured tension and stroke; none where None.

    Raises:
        InputError: Anything that cannot be used. Steps do not raise.

    Example:
        >>> from notchflex import load_robot
        >>> controller = Controller(load_robot("pacheco2021-a"), "total_angle")
        >>> [round(float(controller.step(angle)[0]), 3) for angle in (0.3, 0.6, 0.3)]
        [0.322, 0.66, 0.307]
    """

    def __init__(
        self,
        robot: Robot,
        aim: str | Sequence[str] = "tip_position",
        *,
        state: State | None = None,
        load: Load | None = None,
        drive: Drive = "tension",
        limits: Limits | None = None,
        weights: Mapping[str, float] | None = None,
        search: TargetSearch | None = None,
        feedback: float = 0.3,
        observer: Observer | None = None,
    ) -> None:
        shapes = target_shapes(check_is_robot(robot))
        names = (aim,) if isinstance(aim, str) else tuple(aim)
        for name in names:
            if name not in shapes:
                raise InputError.UNKNOWN_NAME(
                    f"there is no target {short_repr(name)}; there are {', '.join(shapes)}"
                )
        if not 0.0 <= check_number(feedback, "feedback") <= 1.0:
            raise InputError.OUT_OF_RANGE(f"feedback is from 0 to 1; got {feedback:g}")
        self._shapes = {name: shapes[name] for name in names}
        some = Targets({name: np.zeros((1, *shape)) for name, shape in self._shapes.items()})
        search = search or TargetSearch(tolerance=1e-5, solves=16)
        options = ProblemOptions(state, load, drive, limits, weights, search)
        self._problem, aims = make_problem(robot, some, options)
        self._rate = options.rate
        self._feedback, self.observer = feedback, observer
        self._deviation = np.zeros(aims.goals.shape[1])
        self._before = self._problem.model.first
        self._command = present_drives(self._problem, self._before)
        self._known: Response | None = None
        self.status = _START
        # Programs are compiled or read now, not within the loop.
        self._problem.model.solve(self._before, self._command)

    def step(
        self,
        target: Any,
        *,
        measured: Any = None,
        tension: Any = None,
        stroke: Any = None,
    ) -> Float[np.ndarray, " t"]:
        """Return drives for a target.

        Args:
            target: Values of the target quantity, by name if there are several (mm, N,
                rad); NaN where an entry is free.
            measured: The same as measured now; NaN where it was not. Nothing where None.
            tension: Measured tension of every tendon, N; for the observer.
            stroke: Measured stroke of every tendon, mm; for the observer.

        Returns:
            Tensions (N) or strokes (mm) to command. `status` says how the step went; after a
            failure they are the last good ones, or those that come nearest.
        """
        try:
            goal = self._flat(target)
            if (np.abs(goal) > LARGEST_TARGET).any() or np.isnan(goal).all():
                raise InputError.OUT_OF_RANGE("a target is a number of a size that a robot has")
            seen = None if measured is None else self._flat(measured)
            if self.observer is not None and tension is not None and stroke is not None:
                self._observe(tension, stroke)
        except InputError:
            # A control loop must continue after invalid input: the command stays unchanged.
            self.status = ControlStatus(False, "INVALID_INPUT", float("nan"), 0, True)
            return self._command.copy()
        if seen is not None:
            self._correct(seen)
        self._seek(goal - self._deviation)
        return self._command.copy()

    @property
    def command(self) -> Float[np.ndarray, " t"]:
        """The last command, N or mm."""
        return self._command.copy()

    @property
    def values(self) -> Float[np.ndarray, " m"]:
        """Model values of the target quantities at the last command, flattened."""
        if self._known is None:
            self._known = self._problem.model.solve(self._before, self._command)
        return self._known.values[self._problem.entries]

    def _flat(self, given: Any) -> np.ndarray:
        """Values by name, or those of the only quantity, as one vector."""
        named = given if isinstance(given, Mapping) else {next(iter(self._shapes)): given}
        if set(named) != set(self._shapes):
            raise InputError.UNKNOWN_NAME(f"give {', '.join(self._shapes)}, and nothing else")
        parts = []
        for name, shape in self._shapes.items():
            try:
                part = np.asarray(named[name], float)
            except (ArithmeticError, RuntimeError, TypeError, ValueError) as error:
                raise InputError.WRONG_TYPE(f"{name} is no number") from error
            if part.shape != shape:
                raise InputError.WRONG_SHAPE(f"{name} has the shape {shape}; got {part.shape}")
            if name == DIRECTION:
                part = part / np.sqrt(part @ part)
            parts.append(part.ravel())
        return np.concatenate(parts)

    def _correct(self, measured: np.ndarray) -> None:
        """Take up a part of how far the robot is from the model."""
        deviation = measured - self.values
        is_measured = np.isfinite(deviation)
        change = self._feedback * (deviation - self._deviation)
        self._deviation = np.where(is_measured, self._deviation + change, self._deviation)

    def _observe(self, tension: Any, stroke: Any) -> None:
        """Continue from the state estimated from measured tension and stroke."""
        assert self.observer is not None
        model, state = self.observer.observe(tension, stroke)
        if not self.observer.accepted:
            raise InputError.NOT_FINITE(
                "tension and stroke are finite numbers, one for each tendon"
            )
        if state.shape == self._before.shape:
            self._problem = self._problem._replace(
                model=self.observer.seen_by(model, self._problem)
            )
            self._before, self._known = state, None

    def _seek(self, goal: np.ndarray) -> None:
        problem = limit_rate(self._problem, self._command, self._rate)
        attempt = solve_directly(problem, self._before, self._command, goal, self._known)
        left = problem.search.solves - attempt.solves
        if attempt.failure is not None and left > 0:
            fewer = problem._replace(search=replace(problem.search, solves=left))
            # One tendon goes on from where it came nearest. Several, of which one may have turned
            # round, begin anew; so does one whose dead band is still to be crossed.
            begin, response = attempt.drive, attempt.response
            if problem.driven.sum() > 1:
                begin, response = self._command, self._known
            alone = bool(np.count_nonzero(self._command) < 2)
            stays = begin is self._command and alone
            other = search_iteratively(fewer, self._before, begin, goal, response, over_bands=stays)
            attempt = other._replace(solves=attempt.solves + other.solves)
        attempt = cross_dead_bands(
            self._problem, self._rate, self._before, self._command, goal, attempt, self._known
        )
        failure, solved = attempt.failure, attempt.response.converged and np.isfinite(attempt.error)
        code = failure.name if failure else ""
        if solved:
            self._command, self._before, self._known = (
                attempt.drive,
                attempt.response.state,
                attempt.response,
            )
        elif failure is None:
            code = Failure.SEARCH_STOPPED.name
        self.status = ControlStatus(
            failure is None, code, attempt.error, attempt.solves, not solved
        )
