"""Environments of gymnasium: one robot at a time, and many in one call of the solver."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.envs.registration import register, registry
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from notchflex import InputError
from notchflex.learning.episode import EpisodeRows, EpisodeSettings
from notchflex.support import check_integer, short_repr

_MODES: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 20}


def _check_render_mode(render_mode: str | None) -> str | None:
    """Return a mode of rendering that there is.

    Raises:
        InputError: There is no such mode.
    """
    if render_mode not in (None, *_MODES["render_modes"]):
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

    metadata: ClassVar[dict[str, Any]] = _MODES  # pyright: ignore[reportIncompatibleVariableOverride]
    follows: ClassVar[bool]

    def __init__(self, *, render_mode: str | None = None, **settings: Any) -> None:
        self.settings = EpisodeSettings(**settings)
        self.render_mode = _check_render_mode(render_mode)
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
        self._rows.reset([0], [self.np_random])
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
        outcome: Any = self._rows.step(np.asarray(action)[None])
        reward, reached, last, code, distance = (values.item() for values in outcome)
        information = self._information(distance, code, reached)
        return self._rows.observation[0], reward, reached, last, information

    def render(self) -> Any:
        """Return a picture of the robot and its target; None without a mode of rendering."""
        return self._rows.picture(0) if self.render_mode else None

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


class RobotVectorEnv(VectorEnv[np.ndarray, np.ndarray, np.ndarray]):
    """Robots side by side, as many environments of one kind; n rows.

    The episodes are those of `num_envs` single environments. One that has ended begins anew with
    the next step, whose action it ignores (`AutoresetMode.NEXT_STEP`).

    Args:
        num_envs: How many.
        cores: How many cores to use; all where not given.
        render_mode: "rgb_array" for pictures, one per row, or None.
        settings: As for the single environment.

    Raises:
        InputError: Settings that cannot be used.
    """

    metadata: ClassVar[dict[str, Any]] = {  # pyright: ignore[reportIncompatibleVariableOverride]
        **_MODES,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }
    follows: ClassVar[bool]

    def __init__(
        self,
        num_envs: int = 1,
        *,
        cores: int | None = None,
        render_mode: str | None = None,
        **settings: Any,
    ) -> None:
        for name, value in (("num_envs", num_envs), ("cores", 1 if cores is None else cores)):
            if check_integer(value, name) < 1:
                raise InputError.OUT_OF_RANGE(f"{name} must be 1 or more; got {value}")
        self.settings, self.num_envs = EpisodeSettings(**settings), num_envs
        self.render_mode = _check_render_mode(render_mode)
        self.single_observation_space, self.single_action_space = self.settings.spaces()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._rows = EpisodeRows(self.settings, num_envs, follow=self.follows, cores=cores)
        self._random = [np.random.default_rng() for _ in range(num_envs)]
        self._ended = np.zeros(num_envs, bool)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin episodes anew.

        Args:
            seed: Of the first row, counted up from row to row; or one per row. Random numbers go on
                where not given.
            options: `reset_mask`, a flag per row, for some rows alone.

        Returns:
            Observations and information, rows as leading axis.

        Raises:
            InputError: Seeds or a mask of another number than that of the rows.
        """
        count, mask = self.num_envs, (options or {}).get("reset_mask")
        is_reset = np.ones(count, bool) if mask is None else np.asarray(mask)
        if is_reset.dtype != bool or is_reset.shape != (count,):
            raise InputError.WRONG_SHAPE(
                f"reset_mask is one flag per row, {count}; got {short_repr(mask)}"
            )
        if isinstance(seed, int | np.integer):
            seed = range(int(seed), int(seed) + count)
        seeds = [None] * count if seed is None else list(seed)
        if len(seeds) != count:
            raise InputError.WRONG_SHAPE(
                f"seed is one number or one per row, {count}; got {len(seeds)}"
            )
        for row in np.flatnonzero(is_reset):
            if seeds[row] is not None:
                self._random[row] = seeding.np_random(seeds[row])[0]
        self._begin(is_reset)
        self._ended[is_reset] = False
        codes = np.full(count, "", object)
        codes[~is_reset] = None
        information = self._information(is_reset, self._rows.distance, codes, ~np.ones(count, bool))
        return self._rows.observation, information

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Pull the tendons of all rows; rows whose episode has ended begin another one instead.

        Args:
            actions: Change of every tension, from -1 to 1 of the largest change, (n, t).

        Returns:
            Observations, rewards, terminations, truncations and information, rows as leading axis.

        Raises:
            InputError: Actions of another shape, or not finite.
        """
        anew = self._ended
        reward, reached, last, code, distance = self._rows.step(actions, anew)
        if anew.any():
            self._begin(anew)
            distance[anew], reward[anew], code[anew] = self._rows.distance[anew], 0.0, ""
            reached[anew] = last[anew] = False
        self._ended = reached | last
        information = self._information(np.ones(len(anew), bool), distance, code, reached.copy())
        return self._rows.observation, reward, reached, last, information

    def render(self) -> tuple[Any, ...] | None:
        """Return a picture of every row; None without a mode of rendering."""
        return tuple(map(self._rows.picture, range(self.num_envs))) if self.render_mode else None

    def _begin(self, is_begun: NDArray[np.bool_]) -> None:
        rows = np.flatnonzero(is_begun).tolist()
        self._rows.reset(rows, [self._random[row] for row in rows])

    def _information(
        self,
        is_given: NDArray[np.bool_],
        distance: NDArray[np.float64],
        code: NDArray[Any],
        reached: NDArray[np.bool_],
    ) -> dict[str, Any]:
        """Information in the form of gymnasium: an array, and which of its rows are given."""
        values = {"distance": np.where(is_given, distance, 0.0), "code": code}
        if not self.follows:
            values["is_success"] = reached
        return values | {f"_{name}": is_given.copy() for name in values}


class FollowVectorEnv(RobotVectorEnv):
    """`FollowEnv` in many rows.

    Example:
        >>> import gymnasium
        >>> envs = gymnasium.make_vec("notchflex.learning:notchflex/Follow-v0", num_envs=8)
        >>> observations, _ = envs.reset(seed=0)
        >>> observations, rewards, *_ = envs.step(envs.action_space.sample())
        >>> observations.shape, rewards.shape
        ((8, 7), (8,))
    """

    follows = True


class ReachVectorEnv(RobotVectorEnv):
    """`ReachEnv` in many rows."""

    follows = False


def register_environments() -> None:
    """Register all environments in gymnasium; those that are registered stay.

    The environments count their steps themselves, so that gymnasium adds no limit: a vector
    environment would have none.
    """
    for kind in ("Follow", "Reach"):
        name, entry = f"notchflex/{kind}-v0", f"notchflex.learning:{kind}"
        if name not in registry:
            register(name, f"{entry}Env", vector_entry_point=f"{entry}VectorEnv")
