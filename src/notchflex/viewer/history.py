"""What has been done to the robot so far, and what came of it: the loop that a plot shows."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from notchflex.results import Equilibrium
from notchflex.viewer.controls import TENSION, Controls


@dataclass
class History:
    """Solved steps in order; each is one entry of every list.

    Attributes:
        controls: What was set.
        tension: Tension of every tendon at the base, N, (t,).
        stroke: Tendon drawn out at the base, mm, (t,).
        total_angle: Bending angle of the whole robot, rad.
    """

    controls: list[Controls] = field(default_factory=list[Controls])
    tension: list[np.ndarray] = field(default_factory=list[np.ndarray])
    stroke: list[np.ndarray] = field(default_factory=list[np.ndarray])
    total_angle: list[float] = field(default_factory=list[float])

    def __len__(self) -> int:
        """Number of steps."""
        return len(self.controls)

    def add(self, controls: Controls, state: Equilibrium) -> None:
        """Take up a solved step."""
        self.controls.append(controls)
        self.tension.append(np.asarray(state.tension, float))
        self.stroke.append(np.asarray(state.stroke, float))
        self.total_angle.append(float(state.total_angle))

    def loop(self, tendon: int, by: str = TENSION) -> tuple[np.ndarray, np.ndarray]:
        """Return tension [N] or stroke [mm] of a tendon (from 0) and total angle [rad], by steps.

        Args:
            tendon: The tendon.
            by: `TENSION` or `STROKE`.
        """
        steps = self.tension if by == TENSION else self.stroke
        drawn = [values[tendon] for values in steps if tendon < len(values)]
        return np.array(drawn), np.array(self.total_angle[: len(drawn)])


__all__ = ["History"]
