"""The tolerance analysis of a robot: worst case, yield, sensitivity, remedies; its documents."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import brentq

from notchflex import EquilibriumPath, InputError, Robot, Settings
from notchflex.pieces import CODES, FAILED, INVALID, PieceFolder, sobol_points
from notchflex.specification import whole
from notchflex.support import (
    AnyPath,
    Displayed,
    Summary,
    Tolerance,
    check_is_robot,
    deviation,
    document_head,
    moments,
    short,
    short_repr,
)
from notchflex.tolerancing.spec import Criterion, ToleranceSpec, read_tolerance_spec
from notchflex.tolerancing.study import (
    REPLICATES,
    DrawnPieces,
    DrawnRobots,
    Study,
    ToleranceTask,
    draw,
    draw_in_pieces,
    drawn_numbers,
    limited_columns,
    study_of,
    tolerances_for,
    yield_interval,
)

BySource = Float[np.ndarray, "k d"]
"""A number for each limit and source."""

ByLimit = Float[np.ndarray, " k"]
WORST_SD = 3.0
"""Number of standard deviations in the worst case of an untruncated normal distribution."""


class LinearEffects(NamedTuple):
    """Effect of small tolerances on the numbers that have limits, for each source.

    Attributes:
        nominal: The numbers of the drawing, (k,).
        shift: Change of each number by the mean of each source, (k, d).
        spread: Change by one standard deviation of each source, with its sign, (k, d).
        low: Change by the worse end of each source toward smaller values, (k, d), not positive.
        high: The same toward larger values, not negative.
    """

    nominal: ByLimit
    shift: BySource
    spread: BySource
    low: BySource
    high: BySource

    @property
    def worst_case(self) -> Float[np.ndarray, "k 2"]:
        """Smallest and largest value: all sources at their worse ends at once."""
        ends = [self.nominal + end.sum(axis=1) for end in (self.low, self.high)]
        return np.stack(ends, axis=-1)

    @property
    def mean(self) -> ByLimit:
        """Mean of the robots."""
        return self.nominal + self.shift.sum(axis=1)

    @property
    def sd(self) -> ByLimit:
        """Standard deviation of the robots: the root of the sum of squares."""
        return np.sqrt((self.spread**2).sum(axis=1))

    @property
    def share(self) -> BySource:
        """Part of each source in the variance of each number; 0 where nothing varies."""
        total = (self.spread**2).sum(axis=1, keepdims=True)
        return np.divide(self.spread**2, total, out=np.zeros_like(self.spread), where=total > 0.0)


def linear_effects(study: Study) -> LinearEffects:
    """Differentiate the numbers that have limits by all that deviates.

    Derivatives are those of the solved path, through the memory of the contacts; where a notch is
    about to close or a contact to slip they are of one side.
    """
    names = [name for source in study.sources for name in source.nominal]
    slopes, nominal = np.empty((len(study.criteria), len(names))), np.empty(len(study.criteria))
    for path, criteria, outputs in study.loads.values():
        jacobian = path.jacobian(names, outputs)
        for place, criterion in criteria.items():
            quantity = criterion.quantity.name
            slopes[place] = criterion.of(np.moveaxis(jacobian[quantity], -1, 0))
            nominal[place] = criterion.of(np.asarray(path.quantity(quantity))[None])[0]
    # Mean, standard deviation and both ends of each name, which moves with its source alone.
    deviations = np.zeros((4, len(names), len(study.sources)))
    for column, source in enumerate(study.sources):
        for name, value in source.nominal.items():
            mean, sd = moments(source.tolerance, value)
            ends = np.array([deviation(source.tolerance, value, level) for level in (0.0, 1.0)])
            ends = np.where(np.isfinite(ends), ends, [-WORST_SD * sd, WORST_SD * sd])
            deviations[:, names.index(name), column] = mean, sd, *ends
    shift, spread, *ends = slopes @ deviations
    low, high = np.minimum(*ends), np.maximum(*ends)
    return LinearEffects(nominal, shift, spread, np.minimum(low, 0.0), np.maximum(high, 0.0))


_POINTS = 2048
"""Points of a yield with one tolerance changed, and of each set of Sobol's indices, at most."""
_LEAST_POINTS = 16
_WIDEST = 2.0
"""Largest factor on a tolerance that is tried."""
_ACCURACY = 0.02
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
    wanted: float | None,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
) -> Control:
    """Change one tolerance after the other, with the same draws.

    Args:
        study: What deviates, and the numbers that have limits.
        draws: About how many robots the yield is found of.
        wanted: The wanted yield, between 0 and 1; None to look for no tolerance.
        seed: Of the points.
        progress: Called with the sources done and all of them.
    """
    points = min(2 ** int(np.log2(draws)), _POINTS)
    numbers = drawn_numbers(
        study.sources, sobol_points(len(study.sources), seed, 0, points, points)
    )
    exact, factors = [], []
    for index, source in enumerate(study.sources):

        @lru_cache
        def yield_at(factor: float, nominal: dict[str, float] = source.nominal) -> float:
            changed = {
                name: value + factor * (numbers[name] - value) for name, value in nominal.items()
            }
            return float(study.solved(numbers | changed, points).accepted.mean())

        exact.append(yield_at(0.0))
        factors.append(np.nan if wanted is None else _factor(yield_at, wanted))
        if progress is not None:
            progress(index + 1, len(study.sources))
    return Control(np.array(exact), None if wanted is None else np.array(factors), points)


def _factor(yield_at: Callable[[float], float], wanted: float) -> float:
    """Find the factor on a tolerance at which the yield falls to what is wanted."""
    if yield_at(0.0) < wanted:
        return 0.0
    low, high = 0.0, 1.0
    while yield_at(high) >= wanted:
        if high >= _WIDEST:
            return np.inf
        low, high = high, 2.0 * high
    # The yield is a staircase: a root of the difference lies on a step.
    root: Any = brentq(lambda factor: yield_at(factor) - wanted, low, high, xtol=_ACCURACY * high)
    return float(root)


class SobolIndices(NamedTuple):
    """Sobol indices of the numbers that have limits, and last of acceptance itself.

    Attributes:
        first: Part of the variance that a source makes alone, (k + 1, d); NaN where nothing varies.
        total: The same with what it makes together with others, (k + 1, d).
        robots: How many robots were solved.
        failed: How many of them had no result; they and their counterparts are left out.
    """

    first: BySource
    total: BySource
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
    points = min(2 ** int(np.log2(max(draws / (sources + 2), _LEAST_POINTS))), _POINTS)
    first, second = np.split(sobol_points(2 * sources, seed, 0, points, points), 2, axis=1)
    mixed = np.where(np.eye(sources, dtype=bool)[:, None], second, first)
    levels = np.concatenate([first, second, *mixed])
    outcomes = study.at_levels(levels, progress)
    values = np.column_stack([outcomes.values, outcomes.accepted])
    failed = int(np.isnan(values).any(axis=1).sum())
    sets = np.moveaxis(values.reshape(sources + 2, points, -1), 1, 2)
    sets = sets[..., np.isfinite(sets).all(axis=(0, 1))]
    if not sets.size:
        nothing = np.full((sets.shape[1], sources), np.nan)
        return SobolIndices(nothing, nothing, len(levels), failed)
    sets = sets - sets[:2].mean(axis=(0, 2))[:, None]  # smaller errors than about a distant mean
    (one, other), mixed = sets[:2], sets[2:]
    varies = np.ptp(sets[:2], axis=(0, 2)) > 0.0
    variance = np.where(varies, sets[:2].var(axis=(0, 2)), np.nan)
    alone = (other * (mixed - one)).mean(axis=2) / variance
    together = 0.5 * ((mixed - one) ** 2).mean(axis=2) / variance
    return SobolIndices(alone.T, together.T, len(levels), failed)


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
        return self.counts["accepted"] / self.draws

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval of the yield, from independent replicates of the draws."""
        return yield_interval(self.drawn.accepted, self.draws // REPLICATES)

    @property
    def counts(self) -> dict[str, int]:
        """Number of robots accepted, rejected, not converged, and invalid."""
        return dict(zip(CODES, self.drawn.codes.tolist(), strict=True))

    @property
    def below(self) -> ByLimit:
        """Part of the drawn robots below the lower limit of each number."""
        return self.drawn.below / self.draws

    @property
    def above(self) -> ByLimit:
        """Part of the drawn robots above the upper limit of each number."""
        return self.drawn.above / self.draws

    def percentile(self, part: float) -> ByLimit:
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
        failed, invalid = self.drawn.codes[FAILED], self.drawn.codes[INVALID]
        warnings: list[str] = []
        if failed:
            warnings.append(
                f"{failed} of {self.draws} drawn robots did not converge; they count as rejected, "
                "and mean and percentiles leave them out."
            )
        if invalid:
            warnings.append(
                f"{invalid} of {self.draws} draws make no valid robot, because the tolerances "
                "reach beyond what the tube allows; they count as rejected."
            )
        return warnings

    def _summary(self) -> Summary:
        part, low, high = (f"{100.0 * x:.4g} %" for x in (self.accepted_fraction, *self.interval))
        rows = [("yield", f"{part} ({low} to {high})")]
        for index, criterion in enumerate(self.criteria):
            linear, quantity = self.linear, criterion.quantity
            values = (linear.nominal[index], linear.sd[index], *linear.worst_case[index])
            drawing, sd, least, most = (short(value * quantity.scale) for value in values)
            words = f"{drawing} {quantity.unit}, standard deviation {sd}, worst case {least} to "
            rows.append((criterion.name, f"{words}{most}"))
        rows.append(("control first", ", ".join(self.sources[place] for place in self.order[:2])))
        title = f"Tolerances of {self.robot.name}, {self.draws} draws"
        return Summary(title, rows, ".linear, .drawn, .sobol, .control; nf.plot(it) draws them")


_MAX_DRAWS, _MAX_IN_PIECES = 10_000_000, 10_000_000_000
"""Draws in memory at most, and in pieces."""


Stage = Callable[[str, int, int], None]
"""Called with what is computed, how much of it is done, and how much there is."""


def tolerance_analysis(
    robot: Robot,
    spec: ToleranceSpec | AnyPath,
    *,
    draws: int = 100_000,
    seed: int = 0,
    settings: Settings | None = None,
    refinement: int = 0,
    cores: int | None = None,
    progress: Stage | None = None,
    folder: PieceFolder | AnyPath | None = None,
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
    whole(draws, "draws", 2 * REPLICATES, _MAX_DRAWS if folder is None else _MAX_IN_PIECES)
    if isinstance(spec, str | os.PathLike):
        spec = read_tolerance_spec(spec, robot)
    elif not isinstance(spec, ToleranceSpec):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError.WRONG_TYPE(
            f"a notchflex.ToleranceSpec is needed, or the path of a file; got {short_repr(spec)}"
        )
    study = study_of(robot, spec, settings, refinement, cores)
    if not study.sources:
        raise InputError.NO_DATA("nothing deviates: all tolerances are 0; give one that is not.")
    effects = linear_effects(study)

    def report(stage: str, done: int, total: int, *_: int) -> None:
        if progress is not None:
            progress(stage, done, total)

    if folder is None:
        drawn = draw(study, draws, seed, partial(report, "drawing"))
    else:
        task = ToleranceTask(robot, spec, draws, seed, settings, refinement)
        drawn = draw_in_pieces(task, PieceFolder.of(folder), cores, partial(report, "drawing"))
    return ToleranceAnalysis(
        robot=robot,
        paths=study.paths,
        criteria=tuple(study.criteria),
        tolerances=study.tolerances,
        assumed=tolerances_for(robot, spec)[1],
        sources=tuple(source.name for source in study.sources),
        linear=effects,
        drawn=drawn,
        sobol=sobol(study, draws, seed, partial(report, "sensitivity")),
        control=control(study, draws, spec.wanted_yield, seed, partial(report, "tolerances")),
        wanted_yield=spec.wanted_yield,
        seed=seed,
    )


PERCENTILES = (2.5, 50.0, 97.5)


def tolerance_document(analysis: ToleranceAnalysis) -> dict[str, Any]:
    """Return a tolerance analysis as a document of plain values, at the edge units.

    Args:
        analysis: The analysis.

    Returns:
        `yield` (with `interval`), `limits`, one for each number that has limits, and `sources`, one
        for each deviation. Angles in deg, lengths in mm, forces in N.
    """
    return {
        **document_head(analysis.robot),
        "draws": analysis.draws,
        "seed": analysis.seed,
        "tolerances": {one.value: one.written for one in analysis.tolerances},
        "assumed": list(analysis.assumed),
        "yield": {
            "accepted": analysis.accepted_fraction,
            "interval": list(analysis.interval),
            "wanted": analysis.wanted_yield,
            "counts": analysis.counts,
        },
        "worst_case_sd": WORST_SD,
        "limits": _limits(analysis),
        "sources": _sources(analysis),
        "sobol_robots": analysis.sobol.robots,
        "sobol_failed": analysis.sobol.failed,
        "control_robots": analysis.control.robots,
    }


def _limits(analysis: ToleranceAnalysis) -> list[dict[str, Any]]:
    linear = analysis.linear
    values = {
        "drawing": linear.nominal,
        "worst_case": linear.worst_case,
        "rss_mean": linear.mean,
        "rss_sd": linear.sd,
    }
    parts = {f"{level:g}": analysis.percentile(level / 100.0) for level in PERCENTILES}
    documents: list[dict[str, Any]] = []
    for index, criterion in enumerate(analysis.criteria):
        scale = criterion.quantity.scale
        # A limit that was turned to rad and back has a rounding error.
        ends = {end: float(f"{getattr(criterion, end) * scale:.12g}") for end in ("lower", "upper")}
        documents.append(
            {
                "name": criterion.name,
                "quantity": criterion.quantity.name,
                "unit": criterion.quantity.unit,
                "load": criterion.load,
                "step": criterion.step + 1,
                **{end: value if np.isfinite(value) else None for end, value in ends.items()},
                **{name: column[index] * scale for name, column in values.items()},
                "percentiles": {level: part[index] * scale for level, part in parts.items()},
                "below": analysis.below[index],
                "above": analysis.above[index],
            }
        )
    return documents


def _sources(analysis: ToleranceAnalysis) -> list[dict[str, Any]]:
    """Return what is found of every deviation; lists are in the order of `limits`."""
    sobol, control = analysis.sobol, analysis.control
    scales = np.array([criterion.quantity.scale for criterion in analysis.criteria])
    return [
        {
            "name": name,
            "one_sd": analysis.linear.spread[:, index] * scales,
            "variance_share": analysis.linear.share[:, index],
            "sobol_first": sobol.first[:-1, index],
            "sobol_total": sobol.total[:-1, index],
            "sobol_total_of_acceptance": sobol.total[-1, index],
            "yield_if_exact": control.exact[index],
            "allowed_factor": None if control.factor is None else control.factor[index],
        }
        for index, name in enumerate(analysis.sources)
    ]


def tolerance_columns(analysis: ToleranceAnalysis) -> dict[str, Sequence[Any]]:
    """Return the drawn robots as columns: their numbers, those with limits, and what became of it.

    Args:
        analysis: The analysis.

    Returns:
        `robot` from 1, the numbers that deviate by name (mm, N, MPa, deg), the numbers that have
        limits with their unit, empty where there is no result, and `outcome`: accepted, rejected,
        NOT_CONVERGED or INVALID_ROBOT.

    Raises:
        InputError: They were drawn in pieces.
    """
    drawn = analysis.drawn
    if isinstance(drawn, DrawnPieces):
        raise InputError.UNSUPPORTED(
            f"the drawn robots are rows of the files in {drawn.directory}; read those."
        )
    columns = {**drawn.numbers, **limited_columns(analysis.criteria, drawn.outcomes.values)}
    return {
        "robot": range(1, analysis.draws + 1),
        **{name: values.tolist() for name, values in columns.items()},
        "outcome": [CODES[code] for code in drawn.outcomes.codes],
    }
