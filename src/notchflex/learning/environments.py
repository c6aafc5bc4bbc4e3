"""One robot at a time: `FollowEnv` and `ReachEnv`."""

from __future__ import annotations

from typing import Any, ClassVar

import gymnasium
import numpy as np

from notchflex.errors import InputError
from notchflex.learning.episode import EpisodeSettings
from notchflex.learning.frames import frame
from notchflex.learning.rows import EpisodeRows
from notchflex.loads.validation import short_repr

RENDER_MODES = ["rgb_array"]
_ROW = np.zeros(1, int)


def check_render_mode(render_mode: str | None) -> str | None:
    """Return a mode of rendering that there is.

    Raises:
        InputError: There is no such mode.
    """
    if render_mode not in (None, *RENDER_MODES):
        raise InputError.UNKNOWN_NAME(
            f'render_mode is "rgb_array" or None; got {short_repr(render_mode)}'
        )
    return render_mode


class RobotEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """A robot whose tendons are pulled step by step, toward targets for its tip.

    An action changes every tension, by a part from -1 to 1 of `rate`. An observation has the
    tensions (parts of the largest), the tip position (parts of the length), the same of
    `history` steps before, the latest first, and the target.

    Args:
        render_mode: "rgb_array" for pictures, or None.
        settings: As for `EpisodeSettings`: `robot`, `tension`, `rate`, `steps`, `history`,
            `tolerance`.

    Raises:
        InputError: Settings that cannot be used.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": RENDER_MODES, "render_fps": 20}  # pyright: ignore[reportIncompatibleVariableOverride]
    follows: ClassVar[bool]

    def __init__(self, *, render_mode: str | None = None, **settings: Any) -> None:
        self.settings = EpisodeSettings(**settings)
        self.render_mode = check_render_mode(render_mode)
        self.observation_space, self.action_space = self.settings.spaces()
        self._rows = EpisodeRows(self.settings, 1, follow=self.follows, cores=1)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode: the robot at rest, another target.

        Args:
            seed: Of the random targets; those before go on where not given.
            options: Not used.

        Returns:
            Observation and information.
        """
        super().reset(seed=seed)
        self._rows.reset(_ROW, [self.np_random])
        return self._rows.observation[0], self._information(float(self._rows.distance[0]))

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Pull the tendons.

        Args:
            action: Change of every tension, from -1 to 1 of the largest change.

        Returns:
            Observation, reward, whether the target is reached, whether the last step is done, and
            information: `distance` from the target of the step (mm), `code` of a failure.

        Raises:
            InputError: An action of another shape, or not finite.
        """
        outcome = self._rows.step(_ROW, np.asarray(action)[None])
        reached = bool(outcome.terminated[0])
        info = self._information(float(outcome.distance[0]), outcome.code[0], reached)
        reward, truncated = float(outcome.reward[0]), bool(outcome.truncated[0])
        return self._rows.observation[0], reward, reached, truncated, info

    def render(self) -> Any:
        """Return a picture of the robot and its target; None without a mode of rendering."""
        return frame(self._rows, 0) if self.render_mode == "rgb_array" else None

    def _information(
        self, distance: float, code: str = "", reached: bool = False
    ) -> dict[str, Any]:
        info: dict[str, Any] = {"distance": distance, "code": code}
        return info if self.follows else {**info, "is_success": reached}


class FollowEnv(RobotEnv):
    """Follow a target that moves as the tip of a robot with friction history does.

    The reward of a step is minus the distance of the tip from its target, in lengths of the robot,
    and minus 1 where the tensions have no equilibrium and the robot stays where it is. An episode
    is truncated after `steps`.

    Example:
        >>> import gymnasium
        >>> env = gymnasium.make("notchflex.learning:notchflex/Follow-v0", history=2)
        >>> observation, info = env.reset(seed=0)
        >>> observation.shape
        (15,)
    """

    follows = True


class ReachEnv(RobotEnv):
    """Reach a target that stands still.

    Rewards are as for `FollowEnv`, and 1 more when the tip is within `tolerance` of the target,
    which terminates the episode.

    Example:
        >>> import gymnasium
        >>> env = gymnasium.make("notchflex.learning:notchflex/Reach-v0")
        >>> observation, info = env.reset(seed=0)
        >>> info["is_success"]
        False
    """

    follows = False


__all__ = ["FollowEnv", "ReachEnv", "RobotEnv", "check_render_mode"]
