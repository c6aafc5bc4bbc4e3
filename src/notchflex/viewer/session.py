"""A robot, its load history and its state: the model behind the page, and drives toward a point."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from notchflex import (
    Equilibrium,
    EquilibriumPath,
    InputError,
    Robot,
    list_robots,
    load_robot,
    simulate,
)
from notchflex.control import Limits, TargetSearch, reach
from notchflex.robot.part import unit_of
from notchflex.support import Friction, Material, fields_of, is_list, kinds_of, to_table
from notchflex.viewer.controls import STROKE, TENSION, ControlRanges, Controls


class LoopStep(NamedTuple):
    """A solved step: tension [N] and stroke [mm] of every tendon, total angle [rad]."""

    controls: Controls
    tension: np.ndarray
    stroke: np.ndarray
    total_angle: float


def hysteresis(history: Sequence[LoopStep], tendon: int, by: str = TENSION) -> np.ndarray:
    """Return tension [N] or stroke [mm] of a tendon (from 0) and total angle [rad], (S, 2)."""
    return np.array([(getattr(step, by)[tendon], step.total_angle) for step in history])


class Session:
    """A robot with history, pointing in a direction of `POINTING`.

    Every setting is reached from the one before. One that does not converge changes neither the
    state nor the history; `go` and `change` return why, and "" if it was reached.

    Example:
        >>> from notchflex import load_robot
        >>> session = Session(load_robot("pacheco2021-a"))
        >>> rest = session.controls
        >>> angle = []
        >>> for tension in (0.5, 1.0, 0.5):
        ...     assert not session.go(rest.with_tendon(0, "tension", tension))
        ...     angle.append(float(session.state.total_angle))
        >>> angle[2] > angle[0]  # hysteresis
        True
    """

    def __init__(self, robot: Robot, pointing: str = "up") -> None:
        """Solve the robot at rest."""
        self.robot = robot
        self.pointing = pointing
        self._compiled: set[tuple[bool, ...]] = set()
        self.reset()

    def reset(self) -> None:
        """Return to the robot at rest and clear all history."""
        self.before: list[LoopStep] = []  # the loop before the robot was last changed
        self.history: list[LoopStep] = []
        rest = Controls.at_rest(self.robot, self.pointing)
        self._keep(rest, simulate(self.robot, rest.load()))

    def _keep(self, controls: Controls, solved: EquilibriumPath) -> None:
        self.controls, self.solved, state = controls, solved, solved[0]
        self._compiled.add(_form(controls))
        angle = float(state.total_angle)
        self.history.append(LoopStep(controls, state.tension, state.stroke, angle))

    @property
    def state(self) -> Equilibrium:
        """The current state; `solved` holds it as a path of one step."""
        return self.solved[0]

    def where(self, tendon: int, by: str) -> float:
        """Return the current tension [N] or stroke [mm] of a tendon (from 0)."""
        values = self.state.stroke if by == STROKE else self.state.tension
        return float(values[tendon])

    def go(self, controls: Controls) -> str:
        """Solve a setting from the current state; the direction of the tube stays."""
        controls = replace(controls, pointing=self.pointing)
        solved = simulate(self.robot, controls.load(), from_state=self.solved.state)
        if not solved.converged[0]:
            return solved.reason[0]
        self._keep(controls, solved)
        return ""

    def is_new(self, controls: Controls) -> bool:
        """Return whether a setting may need a program that is not compiled, which takes seconds."""
        return _form(controls) not in self._compiled

    def change(
        self,
        robot: Robot | None = None,
        pointing: str | None = None,
        go_on: Callable[[int, int], bool] | None = None,
    ) -> str:
        """Replace the robot or the direction of its tube, and repeat the load history.

        The former loop is kept in `before`. A robot with another number of tendons begins at rest.
        `go_on` is called after every step with the number of steps done and of all; the rest is
        omitted if it returns False.

        Raises:
            InputError: The other robot cannot be solved; this one is unchanged.
        """
        past, changed = self.history, robot or self.robot
        # First: a robot that cannot be solved leaves this one unchanged.
        again = Session(changed, pointing or self.pointing)
        reason, count = "", len(past)
        if changed.number_of_tendons == self.robot.number_of_tendons:
            again.before = past if count > 1 else []
            for number, step in enumerate(past[1:], start=2):
                if reason := again.go(step.controls):
                    reason = f"step {number} of {count} repeated: {reason}"
                    break
                if go_on is not None and not go_on(number, count) and number < count:
                    reason = f"stopped after step {number} of {count} repeated"
                    break
        self.__dict__.update(again.__dict__)
        return reason

    def path(self) -> EquilibriumPath:
        """Return the whole history as one path from rest, as `notchflex.simulate` finds it."""
        return simulate(self.robot, [step.controls.load() for step in self.history])


def _form(controls: Controls) -> tuple[bool, ...]:
    """Return what selects the program of a load; rather too fine than too coarse."""
    x, y, z = (force != 0.0 for force in controls.tip_force)
    return STROKE in controls.by, x or y, z, controls.tip_mass > 0.0


# Finer than a screen shows, and never longer than an update may take.
_SEARCH = TargetSearch(tolerance=1e-3, solves=8)


def steer(
    session: Session, ends: ControlRanges, point: Float[np.ndarray, " 3"]
) -> tuple[Controls, float]:
    """Find settings of the tendons that bring the tip to a point, within their sliders.

    Tendons that are pulled by tension are driven, all others held; where there are none, all
    strokes. Where the tip is at the point already, nothing moves: a smaller tension that friction
    lets hold the tip would only make the robot creep while the mouse rests.

    Args:
        session: The robot in its present state, with its friction history.
        ends: Ends of the sliders.
        point: Where the tip is to be, in the world, mm.

    Returns:
        The settings, and the distance of the tip from the point there, mm.
    """
    controls, numbers = session.controls, session.controls.numbers
    away = float(np.linalg.norm(session.solved.tip_position - point))
    if away <= _SEARCH.tolerance:
        return controls, away
    drive = TENSION if TENSION in controls.by else STROKE
    driven = [by == drive for by in controls.by]
    load = replace(controls.load(), **{drive: [None] * len(driven)})
    limits = zip(*(ends.ends(tendon, drive) for tendon in range(len(driven))), strict=True)
    reached = reach(
        session.robot,
        point,
        state=session.solved.state,
        load=load,
        drive=drive,
        limits=replace(Limits(), **{drive: tuple(limits)}),
        approach="direct",
        search=_SEARCH,
    )
    values = getattr(reached.following.load, drive)[-1]
    numbers[: len(driven)] = np.where(driven, values, controls.value)
    return controls.with_numbers(numbers), reached.error


SECTIONS: dict[str, type] = {"friction": Friction, "material": Material}


class PartNumber(NamedTuple):
    """A number of a part: key in the robot file, value, unit ("" for none), description."""

    key: str
    value: float
    unit: str
    text: str


def kinds(section: str) -> list[str]:
    """Return the kinds of a part, `friction` or `material`, whose values are single numbers."""
    every = kinds_of(SECTIONS[section])
    return [kind for kind, cls in every.items() if not any(map(is_list, fields_of(cls).values()))]


def with_kind(robot: Robot, section: str, kind: str, original: Robot | None = None) -> Robot:
    """Return a robot with another kind of `friction` or `material`.

    Values that both kinds have are kept. Others come from the original robot, as its file describes
    it, if it is of this kind, else from the first ready robot of this kind.

    Raises:
        InputError: The kind is unknown, or no robot has values for it.
    """
    if original is not None and getattr(original, section).kind == kind:
        return robot.replace(**{section: getattr(original, section)})
    with suppress(InputError):
        return robot.with_value(f"{section}.kind", kind)
    present = to_table(robot)[section]
    for ready in list_robots():
        table = to_table(load_robot(ready))[section]
        if table["kind"] == kind:
            shared = {key: present.get(key, value) for key, value in table.items()}
            for values in (shared, table):  # values of both kinds need not fit together
                named = {f"{section}.{key}": value for key, value in values.items()}
                with suppress(InputError):
                    return robot.with_values({**named, f"{section}.kind": kind})
    raise InputError.UNKNOWN_NAME(
        f'no ready robot has a {section} of the kind "{kind}" to take values from'
    )


def numbers(robot: Robot, section: str) -> Iterator[PartNumber]:
    """Yield the numbers of the `friction` or the `material` of a robot.

    Example:
        >>> [one.key for one in numbers(load_robot("pacheco2021-a"), "friction")]
        ['coefficient']
    """
    part = getattr(robot, section)
    for key, info in fields_of(type(part)).items():
        value = getattr(part, key)
        if isinstance(value, float):
            yield PartNumber(key, value, unit_of(info), str(info.description))
