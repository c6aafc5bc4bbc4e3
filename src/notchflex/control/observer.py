"""The state of a robot from measured tension and stroke: history, and coefficient of friction.

How far a tendon has been drawn at a tension depends on the friction on its way there. Several
models with different friction are pulled as the robot is, each with its own history; those that
draw as much tendon as the robot count more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float

from notchflex import InputError, Load, Robot, Stepper
from notchflex.support import check_is_robot, check_number, number_at

FRICTION = "friction.coefficient"


class Observer:
    """Models of a robot with different friction, pulled as the robot is.

    Attributes:
        accepted: Whether the last measurement could be used.

    Args:
        robot: The robot, at rest.
        factors: Coefficients of friction of the models, as multiples of that of the robot.
        noise: Standard deviation of a measured stroke, mm.
        memory: How many measurements count; older ones are forgotten.
        load: External loads.

    Raises:
        InputError: A factor, the noise or the memory is not positive, or a robot without a
            coefficient of friction.

    Example:
        >>> from notchflex import Load, load_robot, pull, simulate
        >>> wrist = load_robot("pacheco2021-a")
        >>> rough = simulate(
        ...     wrist.with_value("friction.coefficient", 0.156), pull(0.1, 1.5, steps=15)
        ... )
        >>> observer = Observer(wrist)
        >>> for tension, stroke in zip(rough.tension, rough.stroke):
        ...     _ = observer.observe(tension, stroke)
        >>> round(observer.friction, 3)
        0.156
    """

    def __init__(
        self,
        robot: Robot,
        factors: Sequence[float] = (0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4),
        *,
        noise: float = 0.01,
        memory: float = 50.0,
        load: Load | None = None,
    ) -> None:
        for value, what in (
            (noise, "noise"),
            (memory, "memory"),
            *((f, "a factor") for f in factors),
        ):
            if not 0.0 < check_number(value, what) < np.inf:
                raise InputError.OUT_OF_RANGE(
                    f"{what} of an observer must be positive; got {value!r}"
                )
        self._coefficients = number_at(check_is_robot(robot), FRICTION) * np.array(factors, float)
        loads = replace(load or Load(), tension=None, stroke=None)
        self._models = [
            Stepper(robot.with_value(FRICTION, float(coefficient)), "stroke", loads=loads)
            for coefficient in self._coefficients
        ]
        self._states = [model.rest() for model in self._models]
        self._noise, self._forgets = noise, 1.0 - 1.0 / max(memory, 1.0)
        self._cost = np.zeros(len(self._models))
        self.accepted = True

    def observe(self, tension: Any, stroke: Any) -> tuple[int, Float[np.ndarray, " state"]]:
        """Pull all models by a measured tension, and compare their strokes with the measured one.

        It never raises: a measurement that cannot be used (a wrong type or shape, a number that is
        not finite) changes nothing, and `accepted` is false.

        Args:
            tension: Tension of every tendon, N; a negative one, by noise, counts as 0.
            stroke: Stroke of every tendon, mm; NaN where it was not measured.

        Returns:
            Number of the model that fits best, and its state, packed.
        """
        read = self._checked(tension, stroke)
        self.accepted = read is not None
        if read is not None:
            pulled, drawn = read
            for number, model in enumerate(self._models):
                step = model.step(self._states[number], pulled)
                if not step.converged:
                    continue
                self._states[number] = step.state
                miss = (step.flat_values - drawn) / self._noise
                miss = miss[np.isfinite(miss) & (pulled > 0.0)]
                self._cost[number] = self._forgets * self._cost[number] + float(miss @ miss)
        best = int(np.argmin(self._cost))
        return best, self._states[best]

    def _checked(self, tension: Any, stroke: Any) -> tuple[np.ndarray, np.ndarray] | None:
        """A measurement as arrays; None where it cannot be used."""
        try:
            pulled, drawn = np.maximum(np.asarray(tension, float), 0.0), np.asarray(stroke, float)
        except (ArithmeticError, TypeError, ValueError):
            return None
        shape = (len(self._models[0].drives),)
        right = pulled.shape == drawn.shape == shape and np.isfinite(pulled).all()
        return (pulled, drawn) if right and not np.isinf(drawn).any() else None

    @property
    def weights(self) -> Float[np.ndarray, " models"]:
        """Probability of each model; the sum is 1."""
        likely = np.exp(-0.5 * (self._cost - self._cost.min()))
        return likely / likely.sum()

    @property
    def friction(self) -> float:
        """Coefficient of friction, the mean of the models by their weights."""
        return float(self.weights @ self._coefficients)

    @property
    def robots(self) -> list[Robot]:
        """The robots of the models."""
        return [model.robot for model in self._models]
