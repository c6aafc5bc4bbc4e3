"""Deviations of robots within tolerances, as directions of a design."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from notchflex.analysis.uncertainty.draws import moments, sources_of
from notchflex.robot import Robot
from notchflex.robot.tolerance import Tolerance


@dataclass(frozen=True)
class Deviation:
    """A number that is drawn, and the values that follow it.

    Attributes:
        nominal: Values of the drawing, by path.
        sd: Their standard deviations.
        mean: Mean of the deviation, in standard deviations.
    """

    nominal: Mapping[str, float]
    sd: Mapping[str, float]
    mean: float

    @property
    def law(self) -> str | None:
        """The path of a constant of material or friction, where this is one."""
        path = next(iter(self.nominal))
        return path if path.startswith(("material.", "friction.")) else None

    def moved(self, robot: Robot, part: float) -> Robot:
        """Return a robot that deviates by a number of standard deviations.

        Raises:
            InputError: No robot can have these values.
        """
        return robot.with_values({p: one + part * self.sd[p] for p, one in self.nominal.items()})


def deviations_of(robot: Robot, tolerances: Sequence[Tolerance]) -> list[Deviation]:
    """Return what deviates; as many, in the same order, for all robots of one form.

    Args:
        robot: The robot with the values of the drawing.
        tolerances: The tolerances.
    """
    deviations: list[Deviation] = []
    for source in sources_of(robot, tolerances):
        both = {path: moments(source.tolerance, value) for path, value in source.nominal.items()}
        mean, sd = next(iter(both.values()))
        sds = {path: one for path, (_, one) in both.items()}
        deviations.append(Deviation(source.nominal, sds, mean / sd if sd > 0.0 else 0.0))
    return deviations
