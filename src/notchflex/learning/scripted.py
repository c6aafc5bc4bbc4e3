"""A scripted policy: what learned ones are compared with."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex import Frictionless, InputError
from notchflex.control import Controller, Limits, TargetSearch
from notchflex.learning.environments import RobotEnv
from notchflex.support import short_repr

_TOLERANCE, _SOLVES = 1e-4, 20  # mm; loads solved in a step


class ScriptedPolicy:
    """Actions from a model of the robot, by the inverse of its equilibrium.

    With friction the model has the same history as the robot, so that the error is what the rate
    leaves. Without, the policy knows all but the hysteresis: what a learned policy has to gain.

    Args:
        env: A `FollowEnv` or `ReachEnv`, wrapped or not.
        friction: Whether the model has friction.

    Raises:
        InputError: Another environment.

    Example:
        >>> import gymnasium
        >>> env = gymnasium.make("notchflex.learning:notchflex/Follow-v0", steps=5)
        >>> policy = ScriptedPolicy(env)
        >>> observation, _ = env.reset(seed=0)
        >>> observation, _, _, _, info = env.step(policy(observation))
        >>> info["distance"] < 1e-3
        True
    """

    def __init__(self, env: Any, *, friction: bool = True) -> None:
        unwrapped = getattr(env, "unwrapped", env)
        if not isinstance(unwrapped, RobotEnv):
            raise InputError.WRONG_TYPE(
                "a scripted policy needs a notchflex Follow or Reach environment of one robot; "
                f"got {short_repr(env)}"
            )
        self._settings = unwrapped.settings
        robot = self._settings.model
        self._robot = robot if friction else robot.replace(friction=Frictionless())
        # A step goes as far as the rate lets it, and the history of the model with it.
        largest = self._settings.largest.tolist()
        self._limits = Limits(tension=(0.0, largest), rate=self._settings.change)
        self.reset()

    def reset(self) -> None:
        """Begin with the robot at rest, as every episode does."""
        search = TargetSearch(tolerance=_TOLERANCE, solves=_SOLVES)
        self._controller = Controller(self._robot, limits=self._limits, search=search)

    def __call__(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the action for an observation.

        Args:
            observation: As the environment returned it.
        """
        settings = self._settings
        tension = observation[: len(settings.largest)] * settings.largest
        command = self._controller.step(observation[-3:] * settings.length)
        return np.clip((command - tension) / settings.change, -1.0, 1.0)
