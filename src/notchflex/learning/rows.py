"""Episodes side by side: what the single and the vector environments share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from notchflex.analysis.stepping import BatchStepper
from notchflex.errors import InputError
from notchflex.learning.episode import EpisodeSettings
from notchflex.learning.random_paths import random_pull, random_tensions
from notchflex.loads.validation import short_repr

FAILED = 1.0
"""Cost of a tension without equilibrium."""
REACHED = 1.0
"""Reward for reaching a target."""


class Outcome(NamedTuple):
    """Outcome of a step, by row.

    Attributes:
        reward: Its reward.
        terminated: Whether the target is reached and the episode ends.
        truncated: Whether the episode ends after its last step.
        code: Name of the `Failure` where the tensions have no equilibrium; else "".
        distance: Of the tip from the target that it was to reach with this step, mm.
    """

    reward: Float[np.ndarray, " k"]
    terminated: Bool[np.ndarray, " k"]
    truncated: Bool[np.ndarray, " k"]
    code: list[str]
    distance: Float[np.ndarray, " k"]


class EpisodeRows:
    """Robots at work, a row each.

    Args:
        settings: Robot and episode.
        rows: How many.
        follow: Whether targets move from step to step; else one stays until it is reached.
        cores: How many cores to use; all where not given.
    """

    def __init__(
        self, settings: EpisodeSettings, rows: int, *, follow: bool, cores: int | None = None
    ) -> None:
        """Put all robots at rest."""
        self.settings, self._follow = settings, follow
        robot = settings.model
        self._stepper = BatchStepper(robot, ("tip_position",), cores)
        self._rest = self._stepper.at_rest(1)
        slack = np.zeros((1, robot.number_of_tendons))
        self._tip_at_rest = self._stepper.step(self._rest, slack)[1]["tip_position"][0]
        self._states = np.repeat(self._rest, rows, axis=0)
        self._count = np.zeros(rows, int)
        self.tension = np.zeros((rows, robot.number_of_tendons))
        self.tip = np.repeat(self._tip_at_rest[None], rows, axis=0)
        self._targets = np.repeat(self.tip[:, None], settings.steps if follow else 1, axis=1)
        # The latest first: what a controller remembers of the history.
        self._past = np.zeros((rows, settings.history, self._seen(np.arange(rows)).shape[1]))

    def reset(self, which: Int[np.ndarray, " k"], random: Sequence[np.random.Generator]) -> None:
        """Begin episodes anew, at rest and with other targets.

        Args:
            which: Numbers of the rows.
            random: Source of random numbers of each of them.
        """
        self._states[which] = self._rest
        self.tension[which], self.tip[which], self._count[which] = 0.0, self._tip_at_rest, 0
        self._targets[which] = self._drawn(random)
        self._past[which] = self._seen(which)[:, None]

    def step(self, which: Int[np.ndarray, " k"], actions: Float[np.ndarray, "k t"]) -> Outcome:
        """Change the tensions of some rows.

        Args:
            which: Their numbers.
            actions: Change of every tension, as a part of the largest in one step.

        Raises:
            InputError: Actions of another shape, or not finite.
        """
        settings = self.settings
        change = settings.change * np.clip(self._checked(actions, len(which)), -1.0, 1.0)
        tension = np.clip(self.tension[which] + change, 0.0, settings.largest)
        if settings.history:
            older = self._past[which, :-1]
            self._past[which, 0] = self._seen(which)
            self._past[which, 1:] = older
        states, outputs, converged = self._stepper.step(self._states[which], tension)
        code = [""] * len(which)
        for row in np.flatnonzero(~converged):
            path = self._stepper.path(self._states[which[row]], tension[row])
            code[row] = path.reason_code[0] or "NO_EQUILIBRIUM"
        # Tensions without equilibrium are refused: the robot stays where it is.
        self.tension[which] = np.where(converged[:, None], tension, self.tension[which])
        self.tip[which] = np.where(converged[:, None], outputs["tip_position"], self.tip[which])
        self._states[which] = states
        distance = self.distance[which]  # before the target moves on
        self._count[which] += 1
        reached = (distance <= settings.tolerance) & converged & (not self._follow)
        reward = REACHED * reached - distance / settings.length - FAILED * ~converged
        last = (self._count[which] >= settings.steps) & ~reached
        return Outcome(reward, reached, last, code, distance)

    @property
    def target(self) -> Float[np.ndarray, "n 3"]:
        """Target of the tip after the next step, mm; after the last step the last target."""
        last = self._targets.shape[1] - 1
        return self._targets[np.arange(len(self._count)), np.minimum(self._count, last)]

    @property
    def distance(self) -> Float[np.ndarray, " n"]:
        """Distance of the tip from that, mm."""
        return np.sqrt(((self.tip - self.target) ** 2).sum(axis=1))

    @property
    def observation(self) -> Float[np.ndarray, "n size"]:
        """Observation of every row, in parts of the largest tension and of the length."""
        rows = np.arange(len(self._count))
        observed, target = self._seen(rows), self.target / self.settings.length
        return np.concatenate([observed, self._past.reshape(len(rows), -1), target], axis=1)

    def path(self, row: int) -> Any:
        """Return the present state of one row as a path of one load, for pictures."""
        return self._stepper.path(self._states[row], self.tension[row])

    def _seen(self, which: Int[np.ndarray, " k"]) -> Float[np.ndarray, "k seen"]:
        """Tensions and position of the tip, without units."""
        settings = self.settings
        # A tendon that is never pulled has a largest tension of 0.
        part = self.tension[which] / np.maximum(settings.largest, 1e-300)
        return np.concatenate([part, self.tip[which] / settings.length], axis=1)

    def _drawn(self, random: Sequence[np.random.Generator]) -> Float[np.ndarray, "k s 3"]:
        """Targets: where a robot with friction history comes when it is pulled at random."""
        settings = self.settings
        if self._follow:
            limits = settings.directions, settings.largest, settings.change, settings.steps
            pulls = np.stack([random_tensions(one, *limits) for one in random])
        else:  # first to another place, so that targets lie on branches of unloading too
            pulls = settings.largest * np.stack(
                [[random_pull(one, settings.directions) for _ in range(2)] for one in random]
            )
        states = np.repeat(self._rest, len(random), axis=0)
        tips = np.empty((*pulls.shape[:2], 3))
        for number in range(pulls.shape[1]):
            states, outputs, _ = self._stepper.step(states, pulls[:, number])
            tips[:, number] = outputs["tip_position"]
        return tips if self._follow else tips[:, -1:]

    def _checked(self, actions: Any, rows: int) -> np.ndarray:
        shape = rows, self.settings.model.number_of_tendons
        try:
            numbers = np.asarray(actions, float)
        except (TypeError, ValueError):
            raise InputError.WRONG_TYPE(
                f"an action is one number from -1 to 1 per tendon; got {short_repr(actions)}"
            ) from None
        if numbers.shape != shape:
            raise InputError.WRONG_SHAPE(
                f"actions need the shape {shape}, rows by tendons; got {numbers.shape}"
            )
        if not np.isfinite(numbers).all():
            raise InputError.NOT_FINITE("an action is not finite; give numbers from -1 to 1")
        return numbers
