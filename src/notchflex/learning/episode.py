"""Settings of an episode: the robot, the rate of its tendons, the observation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from notchflex.analysis.kinematics import tip_from_angles
from notchflex.errors import InputError
from notchflex.loads.validation import check_integer, check_number, short_repr
from notchflex.robot import Robot, load_robot
from notchflex.workspaces.actuation import largest_tensions

# So many steps from a slack tendon to the largest tension, where no rate is given.
_STEPS_TO_LARGEST = 20
_MAX_STEPS, _MAX_HISTORY = 100_000, 1000


@dataclass(frozen=True, kw_only=True, eq=False)
class EpisodeSettings:
    """Settings of an environment, checked; t tendons.

    Attributes:
        robot: The robot, or the name or file of one.
        tension: Largest tension of the tendons, N, one number or one per tendon; by default that
            which closes all notches.
        rate: Largest change of a tension in one step, N; by default a 20th of the largest tension.
        steps: Steps of an episode.
        history: How many earlier tensions and tip positions are observed.
        tolerance: Distance of the tip at which a target is reached, mm.

    Raises:
        InputError: An unknown robot, or a number out of range.
    """

    robot: Robot | str | Path = "pacheco2021-a"
    tension: float | Sequence[float] | None = None
    rate: float | None = None
    steps: int = 100
    history: int = 0
    tolerance: float = 0.1

    def __post_init__(self) -> None:
        """Read the robot and check the numbers."""
        if isinstance(self.robot, str | Path):
            object.__setattr__(self, "robot", load_robot(self.robot))
        elif not isinstance(self.robot, Robot):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise InputError.WRONG_TYPE(
                "robot must be a notchflex.Robot, or the name or file of one; "
                f"got {short_repr(self.robot)}"
            )
        largest = largest_tensions(self.model, self.tension)
        object.__setattr__(self, "tension", tuple(largest.tolist()))
        rate = float(largest.max()) / _STEPS_TO_LARGEST if self.rate is None else self.rate
        for name, value, unit in (("rate", rate, "N"), ("tolerance", self.tolerance, "mm")):
            if not 0.0 < check_number(value, name, f"a number of {unit}") < np.inf:
                raise InputError.OUT_OF_RANGE(
                    f"{name} must be positive and finite, {unit}; got {value:g}"
                )
        object.__setattr__(self, "rate", float(rate))
        for name, least, most in (("steps", 1, _MAX_STEPS), ("history", 0, _MAX_HISTORY)):
            if not least <= check_integer(getattr(self, name), name) <= most:
                raise InputError.OUT_OF_RANGE(
                    f"{name} must be from {least} to {most}; got {getattr(self, name)}"
                )

    @property
    def model(self) -> Robot:
        """The robot."""
        assert isinstance(self.robot, Robot)
        return self.robot

    @cached_property
    def largest(self) -> Float[np.ndarray, " t"]:
        """Largest tension of every tendon, N."""
        return np.array(self.tension, float)

    @property
    def change(self) -> float:
        """Largest change of a tension in one step, N."""
        assert self.rate is not None
        return self.rate

    @cached_property
    def length(self) -> float:
        """Distance of the tip of the straight robot from its base, mm: the unit of positions."""
        return float(np.linalg.norm(self.straight_tip))

    @cached_property
    def straight_tip(self) -> Float[np.ndarray, " 3"]:
        """Tip position of the straight robot, mm."""
        return np.asarray(tip_from_angles(self.model, np.zeros(self.model.number_of_notches))[0])

    @cached_property
    def directions(self) -> Float[np.ndarray, " t"]:
        """Directions of the tendons across the tube, rad."""
        return np.radians([one.direction_deg for one in self.model.tendon])

    def spaces(self) -> Any:
        """Return the spaces of one observation and of one action."""
        from gymnasium.spaces import Box

        tendons = self.model.number_of_tendons
        # No point of a robot is further from its base than its length; targets are states too.
        low = np.concatenate([np.zeros(tendons), np.full(3, -2.0)])
        high = np.concatenate([np.ones(tendons), np.full(3, 2.0)])
        low, high = (np.tile(one, 1 + self.history) for one in (low, high))
        ends = np.append(low, np.full(3, -2.0)), np.append(high, np.full(3, 2.0))
        one = np.ones(tendons)
        return Box(*ends, dtype=np.float64), Box(-one, one, dtype=np.float64)
