"""The tolerance analysis of a robot: worst case, yield, sensitivity, remedies."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import brentq
from scipy.stats import qmc, sobol_indices

from notchflex import EquilibriumPath, InputError, Robot, Settings
from notchflex.analysis.draws import tolerances_of
from notchflex.pieces.folder import ACCEPTED, CODES, FAILED, INVALID
from notchflex.pieces.run import PieceFolder
from notchflex.support import (
    Displayed,
    Summary,
    Tolerance,
    check_integer,
    check_is_robot,
    short,
    short_repr,
)
from notchflex.tolerancing.linear import LinearEffects, linear_effects
from notchflex.tolerancing.spec import Criterion, ToleranceSpec, read_tolerance_spec
from notchflex.tolerancing.study import (
    DrawnPieces,
    DrawnRobots,
    Outcomes,
    Study,
    draw_in_pieces,
    study_of,
)
from notchflex.tolerancing.yields import REPLICATES, points_of_each, replicates, yield_interval

_POINTS = 2048
_WIDEST = 2.0
"""Largest factor on a tolerance that is tried."""
_EXACT = 0.02
"""Relative accuracy of the factor on a tolerance."""


class Control(NamedTuple):
    """Effect of one tolerance on the yield, the others unchanged.

    Attributes:
        exact: Yield if the source had no deviation at all, (d,).
        factor: Factor on the deviations of the source that gives the wanted yield, (d,): below 1
            they must be smaller, above 1 they may be larger. 0 where even no deviation is not
            enough; infinite where twice the deviations are not too many. None where no yield is
            wanted.
        robots: How many robots each yield is of.
    """

    exact: Float[np.ndarray, " d"]
    factor: Float[np.ndarray, " d"] | None
    robots: int


def control(
    study: Study,
    draws: int,
    target: float | None,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
) -> Control:
    """Change one tolerance after the other, with the same draws.

    Args:
        study: What deviates, and the numbers that have limits.
        draws: About how many robots the yield is found of.
        target: The wanted yield, between 0 and 1; None to look for no tolerance.
        seed: Of the points.
        progress: Called with the sources done and all of them.
    """
    points = min(2 ** int(np.log2(draws)), _POINTS)
    sampler = qmc.Sobol(len(study.sources), scramble=True, rng=np.random.default_rng(seed))
    levels = sampler.random(points)
    exact, factors = [], []
    for index in range(len(study.sources)):
        yields: dict[float, float] = {}

        def yield_at(
            factor: float, index: int = index, computed: dict[float, float] = yields
        ) -> float:
            if factor not in computed:
                drawn = study.drawn(levels)
                source = study.sources[index]
                for name, value in source.nominal.items():
                    drawn[name] = value + factor * (drawn[name] - value)
                computed[factor] = float(study.solved(drawn, points).accepted.mean())
            return computed[factor]

        exact.append(yield_at(0.0))
        if target is not None:
            factors.append(_factor(yield_at, target))
        if progress is not None:
            progress(index + 1, len(study.sources))
    return Control(np.array(exact), None if target is None else np.array(factors), points)


def _factor(yield_at: Callable[[float], float], target: float) -> float:
    """Find the factor on a tolerance at which the yield falls to its target."""
    if yield_at(0.0) < target:
        return 0.0
    low, high = 0.0, 1.0
    while yield_at(high) >= target:
        if high >= _WIDEST:
            return np.inf
        low, high = high, 2.0 * high
    # The yield is a staircase: a root of the difference lies on a step.
    root: Any = brentq(lambda factor: yield_at(factor) - target, low, high, xtol=_EXACT * high)
    return float(root)


_MAX_POINTS, _MIN_POINTS = 2048, 16
"""Points of each of the two sets; all indices need d + 2 times as many robots."""


class SobolIndices(NamedTuple):
    """Sobol indices of the numbers that have limits, and last of acceptance itself.

    Attributes:
        first: Part of the variance that a source makes alone, (k + 1, d); NaN where nothing varies.
        total: The same with what it makes together with others, (k + 1, d).
        robots: How many robots were solved.
        failed: How many of them had no result; a neighbour's stands in for it.
    """

    first: Float[np.ndarray, "k d"]
    total: Float[np.ndarray, "k d"]
    robots: int
    failed: int


def sobol(
    study: Study, draws: int, seed: int, progress: Callable[[int, int], None] | None = None
) -> SobolIndices:
    """Compute Sobol indices after Saltelli (2010).

    Args:
        study: What deviates, and the numbers that have limits.
        draws: About how many robots may be solved.
        seed: Of the points.
        progress: Called with the robots done and all of them.
    """
    sources = len(study.sources)
    points = 2 ** int(math.log2(max(draws / (sources + 2), _MIN_POINTS)))
    points = min(points, _MAX_POINTS)
    sampler = qmc.Sobol(2 * sources, scramble=True, rng=np.random.default_rng(seed))
    both = sampler.random(points)
    first, second = both[:, :sources], both[:, sources:]
    mixed = np.repeat(first[None], sources, axis=0)
    for index in range(sources):
        mixed[index, :, index] = second[:, index]
    levels = np.concatenate([first, second, *mixed])
    outcomes = study.at_levels(levels, progress)
    values = np.column_stack([outcomes.values, outcomes.accepted.astype(float)])
    sets = values.reshape(sources + 2, points, -1)
    is_finite = np.isfinite(sets).all(axis=(0, 2))
    failed = int(np.isnan(values).any(axis=1).sum())
    size = sets.shape[2]
    if not is_finite.any():
        nothing = np.full((size, sources), np.nan)
        return SobolIndices(nothing, nothing, len(levels), failed)
    # A set of robots with one that failed is replaced by the good set before it.
    last = np.maximum.accumulate(np.where(is_finite, np.arange(points), -1))
    sets = sets[:, np.where(last >= 0, last, np.argmax(is_finite))]
    sets = sets - sets[:2].mean(axis=(0, 1))  # smaller errors than about a distant mean
    ordered = np.moveaxis(sets, 1, 2)
    varies = np.ptp(ordered[:2], axis=(0, 2)) > 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        indices = sobol_indices(
            func={"f_A": ordered[0], "f_B": ordered[1], "f_AB": ordered[2:]}, n=points
        )
    first_order, total = (
        np.where(varies[:, None], one.reshape(size, sources), np.nan)
        for one in (indices.first_order, indices.total_order)
    )
    return SobolIndices(first_order, total, len(levels), failed)


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


DRAWS = 100_000
MIN_DRAWS = 2 * REPLICATES
MAX_DRAWS, MAX_IN_PIECES = 10_000_000, 10_000_000_000
"""Draws in memory at most, and in pieces."""

Stage = Callable[[str, int, int], None]
"""Called with what is computed, how much of it is done, and how much there is."""


def tolerance_analysis(
    robot: Robot,
    spec: ToleranceSpec | str | os.PathLike[str],
    *,
    draws: int = DRAWS,
    seed: int = 0,
    settings: Settings | None = None,
    refinement: int = 0,
    cores: int | None = None,
    progress: Stage | None = None,
    folder: PieceFolder | str | os.PathLike[str] | None = None,
) -> ToleranceAnalysis:
    """Find out what tolerances do to a robot that must meet acceptance limits.

    Args:
        robot: The robot of the drawing.
        spec: Loads, limits and tolerances; or the file that holds them.
        draws: About how many robots are drawn: 25 independent sets of scrambled Sobol points, each
            as large as the nearest power of two.
        seed: The same seed draws the same robots.
        settings: Tolerance and limits of the solver.
        refinement: More strain modes, as for `simulate`.
        cores: As for `batch`.
        progress: Called with what is computed, how much of it is done, and how much there is.
        folder: Draw in pieces, which this folder keeps: for more draws than fit into memory, by
            many processes (`PieceFolder`), resumed by the same call.

    Returns:
        Worst case and root sum of squares, yield, Sobol indices, and what each tolerance does.

    Raises:
        InputError: Limits, loads or tolerances that cannot be used, or the robot of the drawing
            does not converge under a load.

    Example:
        >>> import notchflex as nf
        >>> limit = nf.AcceptanceLimit("total_angle", lower=0.52, upper=0.60)
        >>> spec = nf.ToleranceSpec([limit], {"pulled": nf.Load(tension=1.0)})
        >>> found = nf.tolerance_analysis(nf.load_robot("pacheco2021-a"), spec, draws=200)
        >>> found.draws
        200
    """
    check_is_robot(robot)
    if check_integer(draws, "draws") < MIN_DRAWS:
        raise InputError.OUT_OF_RANGE(f"draws must be {MIN_DRAWS} or more; got {draws}")
    folder = None if folder is None else PieceFolder.of(folder)
    if draws > (MAX_DRAWS if folder is None else MAX_IN_PIECES):
        more = "; give a folder, which draws in pieces" if folder is None else ""
        most = MAX_DRAWS if folder is None else MAX_IN_PIECES
        raise InputError.OUT_OF_RANGE(f"draws must be at most {most:,}{more}; got {draws}")
    asked = _spec(spec, robot)
    chosen, assumed = tolerances_for(robot, asked)
    study = study_of(robot, asked, chosen, settings, refinement, cores)
    if not study.sources:
        raise InputError.NO_DATA("nothing deviates: all tolerances are 0; give one that is not.")
    effects = linear_effects(study)
    report = {
        name: None if progress is None else partial(progress, name)
        for name in ("drawing", "sensitivity", "tolerances")
    }
    if folder is None:
        drawn = _draw(study, draws, seed, report["drawing"])
    else:
        told = report["drawing"]
        of_pieces = None if told is None else lambda done, count, *_: told(done, count)
        drawn = draw_in_pieces(study, asked, draws, seed, folder, of_pieces)
    return ToleranceAnalysis(
        robot=robot,
        paths=study.paths,
        criteria=tuple(study.criteria),
        tolerances=chosen,
        assumed=assumed,
        sources=tuple(one.name for one in study.sources),
        linear=effects,
        drawn=drawn,
        sobol=sobol(study, draws, seed, report["sensitivity"]),
        control=control(study, draws, asked.wanted_yield, seed, report["tolerances"]),
        wanted_yield=asked.wanted_yield,
        seed=seed,
    )


def _spec(spec: ToleranceSpec | str | os.PathLike[str], robot: Robot) -> ToleranceSpec:
    if isinstance(spec, ToleranceSpec):
        return spec
    if not isinstance(spec, str | os.PathLike):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError.WRONG_TYPE(
            f"a notchflex.ToleranceSpec is needed, or the path of a file; got {short_repr(spec)}"
        )
    return read_tolerance_spec(spec, robot)


def tolerances_for(
    robot: Robot, asked: ToleranceSpec
) -> tuple[tuple[Tolerance, ...], tuple[str, ...]]:
    """Return the tolerances, and the names of those that are assumed.

    Args:
        robot: The robot of the drawing.
        asked: What is asked of it.
    """
    if asked.tolerances is None:
        return tolerances_of(robot)
    return robot.replace(tolerance=asked.tolerances).tolerance, ()


def _draw(
    study: Study, draws: int, seed: int, progress: Callable[[int, int], None] | None
) -> DrawnRobots:
    levels = np.concatenate(list(replicates(len(study.sources), points_of_each(draws), seed)))
    outcomes: Outcomes = study.at_levels(levels, progress)
    return DrawnRobots(study.drawn(levels), outcomes)
