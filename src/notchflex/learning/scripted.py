"""A scripted policy: what learned ones are compared with."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float

from notchflex.analysis.solve import simulate
from notchflex.control import Limits, TargetSearch, reach
from notchflex.errors import InputError
from notchflex.learning.environments import RobotEnv
from notchflex.loads import Load
from notchflex.loads.validation import short_repr
from notchflex.results.state import State
from notchflex.robot import Frictionless

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
        self._limits = Limits(tension=(0.0, self._settings.largest.tolist()))
        self.reset()

    def reset(self) -> None:
        """Begin with the robot at rest, as every episode does."""
        self._state: State | None = None

    def __call__(self, observation: Float[np.ndarray, " size"]) -> Float[np.ndarray, " t"]:
        """Return the action for an observation.

        Args:
            observation: As the environment returned it.
        """
        settings, robot = self._settings, self._robot
        tension = observation[: len(settings.largest)] * settings.largest
        target = observation[-3:] * settings.length
        limits, search = self._limits, TargetSearch(tolerance=_TOLERANCE, solves=_SOLVES)
        found = reach(
            robot, target, state=self._state, limits=limits, approach="direct", search=search
        )
        change = (found.tension - tension) / settings.change
        action = np.clip(change, -1.0, 1.0)
        # The model goes as far as the robot does: what the rate leaves is no history yet.
        next_tension = np.clip(tension + settings.change * action, 0.0, settings.largest)
        load = Load(tension=tuple(next_tension))
        self._state = simulate(robot, load, from_state=self._state).state
        return action


__all__ = ["ScriptedPolicy"]
