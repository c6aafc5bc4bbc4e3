"""Episodes: settings, targets that the robot can reach, and many side by side."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from notchflex import InputError, Robot, Stepper, load_robot, tip_from_angles
from notchflex.support import check_integer, check_is_robot, check_number, need, short_repr
from notchflex.workspaces import largest_tensions

Array = NDArray[np.float64]

# So many steps from a slack tendon to the largest tension, where no rate is given.
_STEPS_TO_LARGEST = 20
_MAX_STEPS, _MAX_HISTORY = 100_000, 1000
# Targets change a little slower than the tendons may, so that a policy can catch up.
_PART_OF_RATE = 0.8
_FAILED = 1.0  # cost of a tension without equilibrium
_REACHED = 1.0  # reward for reaching a target
_SIZE, _DOTS = 4.8, 100  # of a picture: inches, dots per inch
_ROOM = 0.75  # of the length of the robot, to either side


class EpisodeSettings:
    """Settings of an environment, checked; t tendons.

    Args:
        robot: The robot, or the name or file of one.
        tension: Largest tension of the tendons, N, one number or one per tendon; by default that
            which closes all notches.
        rate: Largest change of a tension in one step, N; by default a 20th of the largest tension.
        steps: Steps of an episode.
        history: How many earlier tensions and tip positions are observed.
        tolerance: Distance of the tip at which a target is reached, mm.

    Attributes:
        model: The robot.
        largest: Largest tension of every tendon, N, (t,).
        change: Largest change of a tension in one step, N.
        steps: Steps of an episode.
        history: How many earlier tensions and tip positions are observed.
        tolerance: Distance of the tip at which a target is reached, mm.
        length: Distance of the tip of the straight robot from its base, mm: the unit of positions.

    Raises:
        InputError: An unknown robot, or a number out of range.
    """

    def __init__(
        self,
        *,
        robot: Robot | str | Path = "pacheco2021-a",
        tension: float | Sequence[float] | None = None,
        rate: float | None = None,
        steps: int = 100,
        history: int = 0,
        tolerance: float = 0.1,
    ) -> None:
        """Read the robot and check the numbers."""
        self.model = check_is_robot(load_robot(robot) if isinstance(robot, str | Path) else robot)
        self.largest = largest_tensions(self.model, tension)
        self.change = float(self.largest.max()) / _STEPS_TO_LARGEST if rate is None else rate
        self.steps, self.history, self.tolerance = steps, history, tolerance
        for name, value, unit in (("rate", self.change, "N"), ("tolerance", tolerance, "mm")):
            if not 0.0 < check_number(value, name, f"a number of {unit}") < np.inf:
                raise InputError.OUT_OF_RANGE(
                    f"{name} must be positive and finite, {unit}; got {value:g}"
                )
        for name, value, least, most in (
            ("steps", steps, 1, _MAX_STEPS),
            ("history", history, 0, _MAX_HISTORY),
        ):
            if not least <= check_integer(value, name) <= most:
                raise InputError.OUT_OF_RANGE(f"{name} must be from {least} to {most}; got {value}")
        self._directions = np.radians([tendon.direction_deg for tendon in self.model.tendon])
        straight = np.zeros(self.model.number_of_notches)
        self.length = float(np.linalg.norm(tip_from_angles(self.model, straight)[0]))

    def spaces(self) -> tuple[Box, Box]:
        """Return the spaces of one observation and of one action."""
        # No point of a robot is further from its base than its length; targets are states too.
        full, far = np.ones(self.model.number_of_tendons), np.full(3, 2.0)
        high = np.append(np.tile(np.append(full, far), 1 + self.history), far)
        low = np.append(np.tile(np.append(0.0 * full, -far), 1 + self.history), -far)
        return Box(low, high, dtype=np.float64), Box(-full, full, dtype=np.float64)

    def random_pull(self, random: np.random.Generator) -> Array:
        """Return tensions toward a random side by a random amount, N, (t,)."""
        amount, tendon = random.uniform(), random.integers(len(self._directions))
        around = self._directions[tendon] + random.uniform(-0.5 * np.pi, 0.5 * np.pi)
        pull = np.maximum(np.cos(self._directions - around), 0.0)
        return self.largest * (amount * pull / pull.max())

    def random_way(self, random: np.random.Generator) -> Array:
        """Return tensions from 0 to one random pull after the other, N, (steps, t)."""
        way = [np.zeros((1, len(self.largest)))]
        while sum(map(len, way)) <= self.steps:
            begin, end = way[-1][-1], self.random_pull(random)
            number = np.ceil(np.abs(end - begin).max() / (_PART_OF_RATE * self.change))
            way.append(np.linspace(begin, end, max(1, int(number)) + 1)[1:])
        return np.concatenate(way)[1 : 1 + self.steps]


class Outcome(NamedTuple):
    """Outcome of a step, by row.

    Attributes:
        reward: Its reward.
        terminated: Whether the target is reached and the episode ends.
        truncated: Whether the episode ends after its last step.
        code: Name of the `Failure` where the tensions have no equilibrium; else "".
        distance: Of the tip from the target that it was to reach with this step, mm.
    """

    reward: Array
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    code: NDArray[Any]
    distance: Array


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
        self._stepper = Stepper(settings.model, "tip_position", cores=cores)
        self._rest, slack = self._stepper.rest(1), np.zeros((1, settings.model.number_of_tendons))
        self._tip_at_rest = self._stepper.step(self._rest, slack).values["tip_position"]
        self._states, self.tip = self._at_rest(rows)
        self._count, self.tension = np.zeros(rows, int), np.repeat(slack, rows, axis=0)
        self._targets = np.repeat(self.tip[:, None], settings.steps if follow else 1, axis=1)
        # The latest first: what a controller remembers of the history.
        self._past = np.repeat(self._seen()[:, None], settings.history, axis=1)

    def _at_rest(self, rows: int) -> tuple[Array, Array]:
        """Return states and tips of rows at rest."""
        return np.repeat(self._rest, rows, axis=0), np.repeat(self._tip_at_rest, rows, axis=0)

    def reset(self, which: Sequence[int], random: Sequence[np.random.Generator]) -> None:
        """Begin episodes anew, at rest and with other targets.

        Args:
            which: Numbers of the rows.
            random: Source of random numbers of each of them.
        """
        self._states[which], self.tip[which] = self._at_rest(len(which))
        self.tension[which], self._count[which] = 0.0, 0
        self._targets[which] = self._random_targets(random)
        self._past[which] = self._seen()[which][:, None]

    def step(self, actions: Any, ignored: NDArray[np.bool_] | None = None) -> Outcome:
        """Change the tensions of all rows.

        Args:
            actions: Change of every tension of all rows, as a part of the largest in one step.
            ignored: Rows whose actions are not looked at, and count as 0.

        Raises:
            InputError: Actions of another shape, or not finite.
        """
        settings = self.settings
        change = settings.change * np.clip(self._checked(actions, ignored), -1.0, 1.0)
        tension = np.clip(self.tension + change, 0.0, settings.largest)
        past = np.concatenate([self._seen()[:, None], self._past], axis=1)
        self._past = past[:, : settings.history]
        step = self._stepper.step(self._states, tension)
        self._states, converged = step.state, step.converged
        # Tensions without equilibrium are refused: the robot stays where it is.
        self.tension = np.where(converged[:, None], tension, self.tension)
        self.tip = np.where(converged[:, None], step.values["tip_position"], self.tip)
        distance = self.distance  # before the target moves on
        self._count += 1
        reached = converged & (distance <= settings.tolerance) & (not self._follow)
        last = ~reached & (self._count >= settings.steps)
        reward = _REACHED * reached - distance / settings.length - _FAILED * ~converged
        return Outcome(reward, reached, last, np.array(step.code, object), distance)

    @property
    def target(self) -> Array:
        """Target of the tip after the next step, mm, (n, 3); after the last step the last one."""
        step = np.minimum(self._count, self._targets.shape[1] - 1)
        return self._targets[np.arange(len(step)), step]

    @property
    def distance(self) -> Array:
        """Distance of the tip from that, mm, (n,)."""
        return np.sqrt(((self.tip - self.target) ** 2).sum(axis=1))

    @property
    def observation(self) -> Array:
        """Observation of every row, in parts of the largest tension and of the length, (n, m)."""
        past, target = self._past.reshape(len(self._count), -1), self.target / self.settings.length
        return np.concatenate([self._seen(), past, target], axis=1)

    def _seen(self) -> Array:
        """Tensions and position of the tip, without units."""
        # A tendon that is never pulled has a largest tension of 0.
        part = self.tension / np.maximum(self.settings.largest, 1e-300)
        return np.concatenate([part, self.tip / self.settings.length], axis=1)

    def _random_targets(self, random: Sequence[np.random.Generator]) -> Array:
        """Targets: where a robot with friction history comes when it is pulled at random."""
        settings = self.settings
        if self._follow:
            pulls = [settings.random_way(source) for source in random]
        else:  # first to another place, so that targets lie on branches of unloading too
            pulls = [[settings.random_pull(source) for _ in range(2)] for source in random]
        states, tip = self._at_rest(len(random))
        tips: list[Array] = []
        for pull in np.swapaxes(pulls, 0, 1):
            step = self._stepper.step(states, pull)
            states, moved = step.state, step.values["tip_position"]
            tip = np.where(step.converged[:, None], moved, tip)
            tips.append(tip)
        return np.stack(tips if self._follow else tips[-1:], axis=1)

    def _checked(self, actions: Any, ignored: NDArray[np.bool_] | None) -> Array:
        """Return the actions of all rows, 0 where they are ignored."""
        try:
            numbers = np.asarray(actions, float)
        except (TypeError, ValueError):
            raise InputError.WRONG_TYPE(
                f"an action is one number from -1 to 1 per tendon; got {short_repr(actions)}"
            ) from None
        if numbers.shape != self.tension.shape:
            raise InputError.WRONG_SHAPE(
                f"actions need the shape {self.tension.shape}, rows by tendons; got {numbers.shape}"
            )
        if ignored is not None:
            numbers = np.where(ignored[:, None], 0.0, numbers)
        if not np.isfinite(numbers).all():
            raise InputError.NOT_FINITE("an action is not finite; give numbers from -1 to 1")
        return numbers

    def picture(self, row: int) -> NDArray[np.uint8]:
        """Return a picture of one row, (h, w, 3).

        Raises:
            InputError: matplotlib is not installed.
        """
        need("matplotlib", "plot", 'render_mode="rgb_array"')
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        from notchflex.plotting import VERMILLION, house_style

        state = self._stepper.path(self._states[row], self.tension[row])[0]
        far, target = _ROOM * self.settings.length, self.target[row]
        side = np.radians(self.settings.model.notches[0].direction_deg)
        across, along = (-far, far), (-0.4 * far, 1.6 * far)
        with house_style():
            figure = Figure(figsize=(_SIZE, _SIZE), dpi=_DOTS, layout="constrained")
            canvas, axes = FigureCanvasAgg(figure), cast("Any", figure.add_subplot())
            try:
                state.plot(ax=axes)
                target = target[:2] @ [np.cos(side), np.sin(side)], target[2]
                axes.set_aspect("equal", adjustable="box")
                axes.set(xlim=across, ylim=along)
            except InputError:  # it bends in space
                axes.remove()
                axes = figure.add_subplot(projection="3d")
                state.plot(ax=axes)
                axes.set(xlim=across, ylim=across, zlim=along, box_aspect=(1.0, 1.0, 1.0))
            axes.plot(*np.transpose([target]), "o", color=VERMILLION, ms=7.0, zorder=20)
            if legend := axes.get_legend():
                legend.remove()
            canvas.draw()
        return np.asarray(canvas.buffer_rgba())[..., :3].copy()
