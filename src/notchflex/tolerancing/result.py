"""The result of a tolerance analysis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from notchflex._summary import Displayed, Summary, short
from notchflex.pieces.codes import ACCEPTED, CODES, FAILED, INVALID
from notchflex.results.path import EquilibriumPath
from notchflex.robot import Robot
from notchflex.robot.tolerance import Tolerance
from notchflex.tolerancing.control import Control
from notchflex.tolerancing.criteria import Criterion
from notchflex.tolerancing.drawn import DrawnPieces, DrawnRobots
from notchflex.tolerancing.linear import LinearEffects
from notchflex.tolerancing.sensitivity import SobolIndices
from notchflex.tolerancing.yields import REPLICATES, yield_interval


@dataclass(frozen=True, repr=False)
class ToleranceAnalysis(Displayed):
    """Effect of tolerances on a robot with limits; k numbers with limits, d sources.

    Attributes:
        robot: The robot of the drawing.
        paths: The same under every load, by name.
        criteria: The numbers that have limits.
        tolerances: What deviates.
        assumed: Names of the values whose tolerance the robot does not give.
        sources: Names of independent deviations, such as `notch[3].depth`.
        linear: Worst case and root sum of squares, by gradients.
        drawn: The robots that were drawn, or what is summed up of those in pieces.
        sobol: Sobol indices.
        control: What each tolerance alone does to the yield.
        wanted_yield: The part of robots that should be accepted; None where not given.
        seed: Of the draws.
    """

    robot: Robot
    paths: Mapping[str, EquilibriumPath]
    criteria: tuple[Criterion, ...]
    tolerances: tuple[Tolerance, ...]
    assumed: tuple[str, ...]
    sources: tuple[str, ...]
    linear: LinearEffects
    drawn: DrawnRobots | DrawnPieces
    sobol: SobolIndices
    control: Control
    wanted_yield: float | None
    seed: int

    @property
    def draws(self) -> int:
        """Number of drawn robots."""
        return int(self.drawn.codes.sum())

    @property
    def accepted_fraction(self) -> float:
        """The yield: the part of drawn robots that meet all limits, failed ones counted."""
        return int(self.drawn.codes[ACCEPTED]) / self.draws

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval of the yield, from independent replicates of the draws."""
        return yield_interval(self.drawn.accepted, self.draws // REPLICATES)

    @property
    def counts(self) -> dict[str, int]:
        """Number of robots accepted, rejected, not converged, and invalid."""
        return dict(zip(CODES, self.drawn.codes.tolist(), strict=True))

    @property
    def below(self) -> Float[np.ndarray, " k"]:
        """Part of the drawn robots below the lower limit of each number."""
        return self.drawn.beyond(self.criteria)[0] / self.draws

    @property
    def above(self) -> Float[np.ndarray, " k"]:
        """Part of the drawn robots above the upper limit of each number."""
        return self.drawn.beyond(self.criteria)[1] / self.draws

    def percentile(self, part: float) -> Float[np.ndarray, " k"]:
        """Return the value of each number that a part of the drawn robots stays below.

        Args:
            part: Between 0 and 1. Robots without a result are left out.
        """
        return self.drawn.percentile(part)

    @property
    def order(self) -> Int[np.ndarray, " d"]:
        """Places of the sources, that first whose control brings the most yield.

        If the yield does not decide, the one with the largest share of the variance of a number.
        """
        gained = np.round(self.control.exact - self.accepted_fraction, 3)
        share = self.linear.share.max(axis=0, initial=0.0)
        return np.lexsort((-share, -np.maximum(gained, 0.0)))

    def warnings(self) -> list[str]:
        """Return a sentence for each thing that makes the result less than it seems."""
        warnings: list[str] = []
        counts = self.counts
        if counts[CODES[FAILED]]:
            warnings.append(
                f"{counts[CODES[FAILED]]} of {self.draws} drawn robots did not converge; they "
                "count as rejected, and mean and percentiles leave them out."
            )
        if counts[CODES[INVALID]]:
            warnings.append(
                f"{counts[CODES[INVALID]]} of {self.draws} draws make no valid robot, because the "
                "tolerances reach beyond what the tube allows; they count as rejected."
            )
        return warnings

    def _summary(self) -> Summary:
        low, high = self.interval
        rows = [("yield", f"{_percent(self.accepted_fraction)} ({_percent(low)} to "
                          f"{_percent(high)})")]  # fmt: skip
        for index, one in enumerate(self.criteria):
            quantity = one.quantity
            worst = self.linear.worst_case[index] * quantity.scale
            spread = self.linear.sd[index] * quantity.scale
            rows.append(
                (
                    one.name,
                    f"{short(self.linear.nominal[index] * quantity.scale)} {quantity.unit}, "
                    f"standard deviation {short(spread)}, worst case {short(worst[0])} to "
                    f"{short(worst[1])}",
                )
            )
        rows.append(("control first", ", ".join(self.sources[one] for one in self.order[:2])))
        title = f"Tolerances of {self.robot.name}, {self.draws} draws"
        return Summary(title, rows, ".linear, .drawn, .sobol, .control; nf.plot(it) draws them")


def _percent(part: float) -> str:
    return f"{100.0 * part:.4g} %"
