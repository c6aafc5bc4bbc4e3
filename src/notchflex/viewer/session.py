"""A robot, what has been done to it and where it stands: what the page shows, without the page."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

from notchflex.analysis import simulate
from notchflex.results import Equilibrium, EquilibriumPath
from notchflex.robot import Robot
from notchflex.viewer.controls import STROKE, Controls
from notchflex.viewer.history import History


class Step(NamedTuple):
    """What came of a setting.

    Attributes:
        state: The state that the robot is in now.
        reason: Why the setting was not reached, and the robot is where it was; empty if it was.
    """

    state: Equilibrium
    reason: str


class Session:
    """A robot with memory: every setting is reached from the one before.

    A setting that does not converge changes nothing: neither where the robot stands nor what it
    remembers.

    Args:
        robot: The robot.
        pointing: Where its tube points, a key of `POINTING`.

    Example:
        >>> from notchflex import load_robot
        >>> session = Session(load_robot("pacheco2021-a"))
        >>> rest = session.controls
        >>> angle = []
        >>> for tension in (0.5, 1.0, 0.5):
        ...     step = session.go(rest.with_tendon(0, "tension", tension))
        ...     angle.append(float(step.state.total_angle))
        >>> angle[2] > angle[0]  # friction holds it
        True
    """

    def __init__(self, robot: Robot, pointing: str = "up") -> None:
        """Stand at rest."""
        self.robot = robot
        self.pointing = pointing
        self.before: History | None = None  # the loop before the robot was last changed
        self._known: set[tuple[object, ...]] = set()
        self._rest()

    def _rest(self) -> None:
        self.controls = Controls.at_rest(self.robot, self.pointing)
        self.solved = simulate(self.robot, self.controls.load())
        self.history = History()
        self.history.add(self.controls, self.state)
        self._known.add(self._form(self.controls))

    @property
    def state(self) -> Equilibrium:
        """The state that the robot is in; `solved` holds it as a path of one step."""
        return self.solved[0]

    def where(self, tendon: int, by: str) -> float:
        """Return the tension [N] or stroke [mm] that a tendon (from 0) has now.

        Args:
            tendon: The tendon.
            by: `TENSION` or `STROKE`.
        """
        found = self.state.stroke if by == STROKE else self.state.tension
        return float(found[tendon])

    def reset(self) -> Step:
        """Go back to the free robot that remembers nothing, nor any earlier loop."""
        self.before = None
        self._rest()
        return Step(self.state, "")

    def go(self, controls: Controls) -> Step:
        """Solve a setting from where the robot stands.

        Args:
            controls: What is set; the tube points where it pointed.

        Returns:
            The state then, and why it is the last good one where it is.
        """
        controls = replace(controls, pointing=self.pointing)
        found = simulate(self.robot, controls.load(), from_state=self.solved.state)
        self._known.add(self._form(controls))
        if not found.converged[0]:
            return Step(self.state, found.reason[0])
        self.controls, self.solved = controls, found
        self.history.add(controls, self.state)
        return Step(self.state, "")

    def is_new(self, controls: Controls) -> bool:
        """Whether a setting may ask for a program that is not compiled yet, which takes seconds."""
        return self._form(controls) not in self._known

    def _form(self, controls: Controls) -> tuple[object, ...]:
        """What decides which program is asked for; rather too fine than too coarse."""
        robot = self.robot
        kinds = (robot.material.kind, robot.friction.kind, *(one.kind for one in robot.notches))
        tip = (any(controls.tip_force), any(controls.tip_force[:2]), controls.tip_mass > 0.0)
        return (*kinds, STROKE in controls.by, controls.pointing if any(tip) else "", *tip)

    def change(
        self,
        robot: Robot | None = None,
        pointing: str | None = None,
        go_on: Callable[[int, int], bool] | None = None,
    ) -> Step:
        """Put another robot in, or point it elsewhere, and do to it all that was done before.

        The loop so far is kept in `before`, to be seen beside the new one. A robot with another
        number of tendons begins at rest.

        Args:
            robot: The other robot.
            pointing: Where its tube points.
            go_on: Called after every step with the number of steps done and of all; where it
                returns False, the rest is left out.

        Returns:
            The state then; where a step did not converge, the one before it and the reason.

        Raises:
            InputError: The other robot cannot be solved; this one is as it was.
        """
        past = self.history
        changed = self.robot if robot is None else robot
        fits = changed.number_of_tendons == self.robot.number_of_tendons
        # Done first: a robot that cannot be solved leaves this one as it is.
        again = Session(changed, self.pointing if pointing is None else pointing)
        again._known |= self._known
        step = Step(again.state, "")
        if fits:
            again.before = past if len(past) > 1 else None
            step = again._repeat(past.controls[1:], go_on)
        self.__dict__.update(again.__dict__)
        return step

    def _repeat(self, settings: list[Controls], go_on: Callable[[int, int], bool] | None) -> Step:
        """Go to settings one after the other, until one is not reached or `go_on` says no."""
        count = len(settings) + 1
        for number, controls in enumerate(settings, start=2):
            step = self.go(controls)
            if step.reason:
                return Step(self.state, f"step {number} of {count} again: {step.reason}")
            if go_on is not None and not go_on(number, count) and number < count:
                return Step(self.state, f"stopped after step {number} of {count} again")
        return Step(self.state, "")

    def path(self) -> EquilibriumPath:
        """All that was done as one path from rest, as `notchflex.simulate` finds it."""
        return simulate(self.robot, [one.load() for one in self.history.controls])


__all__ = ["Session", "Step"]
