"""Episodes: settings, targets that the robot can reach, and many side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from notchflex import InputError, Robot, Stepper, load_robot, tip_from_angles
from notchflex.support import check_integer, check_number, need, short_repr
from notchflex.workspaces import largest_tensions

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


# Targets change a little slower than the tendons may, so that a policy can catch up.
_PART_OF_RATE = 0.8


def random_pull(
    random: np.random.Generator, directions: Float[np.ndarray, " t"]
) -> Float[np.ndarray, " t"]:
    """Return tensions toward a random side, as parts of the largest, by a random amount.

    Args:
        random: Source of random numbers.
        directions: Directions of the tendons across the tube, rad.
    """
    amount, tendon = random.uniform(), random.integers(len(directions))
    around = directions[tendon] + random.uniform(-0.5 * np.pi, 0.5 * np.pi)
    pull = np.maximum(np.cos(directions - around), 0.0)
    return amount * pull / pull.max()


def random_tensions(
    random: np.random.Generator,
    directions: Float[np.ndarray, " t"],
    largest: Float[np.ndarray, " t"],
    rate: float,
    steps: int,
) -> Float[np.ndarray, "s t"]:
    """Return tensions that go from 0 to one random pull after the other, N.

    Args:
        random: Source of random numbers.
        directions: Directions of the tendons across the tube, rad.
        largest: Largest tension of every tendon, N.
        rate: Largest change of a tension in one step, N.
        steps: How many steps.
    """
    begin, parts, count = np.zeros(len(directions)), [], 0
    while count < steps:
        end = largest * random_pull(random, directions)
        number = max(1, int(np.ceil(np.abs(end - begin).max() / (_PART_OF_RATE * rate))))
        way = np.arange(1, min(number, steps - count) + 1)[:, None] / number
        parts.append(begin + way * (end - begin))
        begin, count = end, count + number
    return np.concatenate(parts)


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
        self._stepper = Stepper(robot, "tip_position", cores=cores)
        self._rest = self._stepper.rest(1)
        slack = np.zeros((1, robot.number_of_tendons))
        self._tip_at_rest = self._stepper.step(self._rest, slack).values["tip_position"][0]
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
        step = self._stepper.step(self._states[which], tension)
        converged, tip = step.converged, step.values["tip_position"]
        # Tensions without equilibrium are refused: the robot stays where it is.
        self.tension[which] = np.where(converged[:, None], tension, self.tension[which])
        self.tip[which] = np.where(converged[:, None], tip, self.tip[which])
        self._states[which] = step.state
        distance = self.distance[which]  # before the target moves on
        self._count[which] += 1
        reached = (distance <= settings.tolerance) & converged & (not self._follow)
        reward = REACHED * reached - distance / settings.length - FAILED * ~converged
        last = (self._count[which] >= settings.steps) & ~reached
        return Outcome(reward, reached, last, step.code, distance)

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
        tips = [np.repeat(self._tip_at_rest[None], len(random), axis=0)]
        for pull in pulls.swapaxes(0, 1):
            step = self._stepper.step(states, pull)
            states, tip = step.state, step.values["tip_position"]
            tips.append(np.where(step.converged[:, None], tip, tips[-1]))
        return np.stack(tips[1:] if self._follow else tips[-1:], axis=1)

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


_SIZE, _DOTS = 4.8, 100  # inches, dots per inch
_ROOM = 0.75  # of the length of the robot, to either side


def frame(rows: EpisodeRows, row: int) -> UInt8[np.ndarray, "h w 3"]:
    """Return a picture of one row.

    Raises:
        InputError: matplotlib is not installed.
    """
    need("matplotlib", "plot", 'render_mode="rgb_array"')
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from notchflex.plotting import (
        VERMILLION,
        bending_plane,
        dots,
        draw_panel,
        house_style,
        project,
        state_shape,
    )

    panel, far = state_shape(rows.path(row), 0), _ROOM * rows.settings.length
    view: Any = None if panel.z_label else bending_plane(rows.settings.model)
    target = rows.target[row][None]
    points = target if view is None else project(target, view)
    mark = dots(points, VERMILLION, 7.0, name="target", layer=20)
    panel = replace(panel, items=[*panel.items, mark], legend="")
    with house_style():
        figure = Figure(figsize=(_SIZE, _SIZE), dpi=_DOTS, layout="constrained")
        canvas = FigureCanvasAgg(figure)
        axes: Any = figure.add_subplot(projection="3d" if panel.z_label else None)
        draw_panel(axes, panel)
        if panel.z_label:
            axes.set(xlim=(-far, far), ylim=(-far, far), zlim=(-0.4 * far, 1.6 * far))
            axes.set_box_aspect((1.0, 1.0, 1.0))
        else:
            axes.set(xlim=(-far, far), ylim=(-0.4 * far, 1.6 * far))
            axes.set_aspect("equal", adjustable="box")
        canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()
