"""A controller for loops: one target in, drives out, within a fixed number of solves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from notchflex import InputError, Load, Robot, State
from notchflex.control.limits import Drive, Limits
from notchflex.control.observer import Observer
from notchflex.control.problem import (
    Drives,
    Goal,
    ProblemOptions,
    Response,
    TargetSearch,
    make_problem,
)
from notchflex.control.search import DriveSearch, find
from notchflex.control.targets import DIRECTION, LARGEST_TARGET, Targets, target_shapes
from notchflex.specification import known
from notchflex.support import check_is_robot, check_number


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
        if not 0.0 <= check_number(feedback, "feedback") <= 1.0:
            raise InputError.OUT_OF_RANGE(f"feedback is from 0 to 1; got {feedback:g}")
        self._shapes = {name: known(name, shapes, "target") for name in names}
        some = Targets({name: np.zeros((1, *shape)) for name, shape in self._shapes.items()})
        search = search or TargetSearch(tolerance=1e-5, solves=16)
        self._problem = make_problem(
            robot, some, ProblemOptions(state, load, drive, limits, weights, search)
        )
        self._feedback, self.observer = feedback, observer
        models = observer.robots if observer else ()
        start = replace(self._problem.stepper, from_state=None)
        self._steppers = [replace(start, robot=model) for model in models]
        self._deviation = np.zeros(len(self._problem.entries))
        self._before = self._problem.stepper.start()
        self._command = self._problem.present(self._before)
        self.status = _START
        # Programs are compiled or read now, not within the loop.
        self._known = self._present()

    def step(
        self,
        target: Any,
        *,
        measured: Any = None,
        tension: Any = None,
        stroke: Any = None,
    ) -> Drives:
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
            if not np.fmax.reduce(np.abs(goal)) <= LARGEST_TARGET:  # NaN where all is free
                raise InputError.OUT_OF_RANGE("a target is a number of a size that a robot has")
            seen = None if measured is None else self._flat(measured)
            if self.observer is not None and tension is not None and stroke is not None:
                self._observe(self.observer, tension, stroke)
        except InputError:
            # A control loop must continue after invalid input: the command stays unchanged.
            self.status = ControlStatus(False, "INVALID_INPUT", float("nan"), 0, True)
            return self._command.copy()
        if seen is not None:  # a part of how far the robot is from the model
            deviation = seen - self.values
            change = self._feedback * (deviation - self._deviation)
            change = np.where(np.isfinite(deviation), change, 0.0)
            self._deviation = self._deviation + change
        self._seek(goal - self._deviation)
        return self._command.copy()

    @property
    def command(self) -> Drives:
        """The last command, N or mm."""
        return self._command.copy()

    @property
    def values(self) -> Goal:
        """Model values of the target quantities at the last command, flattened."""
        return self._known.step.flat_values[self._problem.entries]

    def _present(self) -> Response:
        """Solve the present command."""
        return DriveSearch(self._problem, self._before, self._deviation).present()[0]

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

    def _observe(self, observer: Observer, tension: Any, stroke: Any) -> None:
        """Continue from the state estimated from measured tension and stroke."""
        model, state = observer.observe(tension, stroke)
        if not observer.accepted:
            raise InputError.NOT_FINITE("tension and stroke are one finite number for each tendon")
        if state.shape == self._before.shape:
            self._problem = self._problem._replace(stepper=self._steppers[model])
            self._before = state
            self._known = self._present()

    def _seek(self, goal: Goal) -> None:
        problem = self._problem.near(self._command)
        budget = problem.search.solves
        attempt = find(problem, self._before, goal, self._known, budget, elsewhere=False)
        if attempt.solved:
            self._known = attempt.response
            self._command, self._before = attempt.drives, attempt.response.step.state
        code = attempt.failure.name if attempt.failure else ""
        self.status = ControlStatus(
            not code, code, attempt.error, attempt.solves, not attempt.solved
        )
