"""Bands of a prediction: tolerances of a robot propagated along a path of loads."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, cast

import numpy as np
from jaxtyping import Float, Int

from notchflex._quantity import REGISTERED
from notchflex._summary import Displayed, Summary, course
from notchflex.analysis.batch import batch
from notchflex.analysis.closing_loads import Closing
from notchflex.analysis.draws import draw_robots, tolerances_of
from notchflex.analysis.outputs import OUTPUTS, check_outputs
from notchflex.analysis.solve import simulate
from notchflex.errors import InputError
from notchflex.loads import Load, LoadPath
from notchflex.loads.load import check_integer, check_is_robot
from notchflex.results.path import EquilibriumPath
from notchflex.results.quantities import DEGREES, QUANTITIES, holds
from notchflex.results.tables import entries_of, is_listed
from notchflex.robot import Robot
from notchflex.robot.problems import Tolerance
from notchflex.robot.value_names import numbers_at
from notchflex.solver.newton import Settings

LEVELS = (0.05, 0.50, 0.95)
"""Quantiles of the draws at the low end, the middle and the high end of a band."""
DRAWS = 256

USUAL = ("total_angle", "tip_position", "notch_angle", "peak_strain", "tension", "stroke")


@dataclass(frozen=True)
class Band:
    """The 5th, 50th and 95th percentile of a quantity, in the shape that a path has it.

    Attributes:
        low: 5 % of the draws lie below.
        median: Half of the draws lie below.
        high: 95 % of the draws lie below.
    """

    low: Float[np.ndarray, "s ..."]
    median: Float[np.ndarray, "s ..."]
    high: Float[np.ndarray, "s ..."]


@dataclass(frozen=True, repr=False)
class Bands(Displayed, Mapping[str, Band]):
    """Bands by name of the quantity, in the units of `EquilibriumPath` (mm, N, rad).

    Attributes:
        path: The robot of the drawing under the same loads, S steps.
        tolerances: What deviated.
        assumed: Names of the values whose tolerance the robot does not give.
        samples: The quantities of every draw, (draws, S, ...); NaN where it did not converge.
        drawn: The numbers of the drawn robots by name, (draws,).
        converged: How many draws converged, step by step.
        redrawn: Number of draws that gave no valid robot and were drawn again.
        seed: Of the draws.
    """

    path: EquilibriumPath
    tolerances: tuple[Tolerance, ...]
    assumed: tuple[str, ...]
    samples: Mapping[str, Float[np.ndarray, "draws s ..."]]
    drawn: Mapping[str, Float[np.ndarray, " draws"]]
    converged: Int[np.ndarray, " s"]
    redrawn: int
    seed: int

    def __getitem__(self, name: str) -> Band:
        """Return the band of a quantity."""
        return self._bands_by_name[name]

    @cached_property
    def _bands_by_name(self) -> dict[str, Band]:
        return {name: band(samples) for name, samples in self.samples.items()}

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of the quantities."""
        return iter(self.samples)

    def __len__(self) -> int:
        """Return the number of quantities."""
        return len(self.samples)

    @property
    def draws(self) -> int:
        """Number of drawn robots."""
        return len(next(iter(self.samples.values())))

    def variance_shares(self, name: str, step: int) -> dict[str, float]:
        """Return the parts of the variance of a number that groups of values explain, of 1.

        They are those of the linear regression on the drawn numbers, which are drawn independently;
        what no line explains is "interactions".

        Args:
            name: A quantity that is one number a step, such as "total_angle".
            step: Which step of the path.

        Returns:
            Shares of "material", "friction", "cuts", "law" (of a notch), "other" and
            "interactions"; none where too few draws converged.
        """
        values = self.samples[name][:, step]
        finite = np.isfinite(values)
        values = values[finite]
        if not len(values) or not np.ptp(values):
            return {}
        levels: dict[str, np.ndarray] = {}
        for parameter, draws in self.drawn.items():
            numbers = draws[finite]
            if np.ptp(numbers) > 0.0:
                level = (numbers - numbers.mean()) / numbers.std()
                # Notches that deviate together are one number.
                if not any(np.allclose(level, other) for other in levels.values()):
                    levels[parameter] = level
        if len(values) < 4 * len(levels):
            return {}
        table = np.stack(list(levels.values()), axis=1)
        slopes = np.linalg.lstsq(table, values - values.mean(), rcond=None)[0]
        shares = dict.fromkeys(("material", "friction", "cuts", "law", "other"), 0.0)
        for parameter, slope in zip(levels, slopes.tolist(), strict=True):
            section = parameter.partition(".")[0].partition("[")[0]
            group = {"notch": "cuts"}.get(section, section)
            if parameter.endswith(".stiffness_factor"):
                group = "law"
            shares[group if group in shares else "other"] += slope**2 / values.var()
        total = sum(shares.values())
        shares = {group: share / max(total, 1.0) for group, share in shares.items()}
        return shares | {"interactions": max(1.0 - total, 0.0)}

    def end(self, name: str) -> EquilibriumPath:
        """Return one end of the bands as tables and files read a path.

        Args:
            name: "low", "median" or "high".

        Returns:
            What has the quantities of a path: those with a band at that end, others as they are.
        """
        return cast("EquilibriumPath", _End(self, name))

    def warnings(self) -> list[str]:
        """Return a sentence for each limitation of the bands."""
        sentences: list[str] = []
        failed = np.flatnonzero(self.converged < self.draws)
        if len(failed):
            min_converged = int(self.converged.min())
            sentences.append(
                f"{self.draws - min_converged} of {self.draws} draws did not converge, the first "
                f"at step {failed[0] + 1}: from there on the bands leave them out, and may be too "
                "narrow."
            )
        if self.redrawn:
            sentences.append(
                f"{self.redrawn} of {self.draws} draws made no valid robot and were drawn again: "
                "the tolerances reach beyond what the tube allows."
            )
        fewest = round(1.0 / LEVELS[0])  # one of them lies at each end
        if self.draws < fewest:
            sentences.append(
                f"{self.draws} draws have no 5 in a hundred at an end: the bands are narrower than "
                f"5 to 95 %; give {fewest} draws or more."
            )
        return sentences

    def _summary(self) -> Summary:
        rows: list[tuple[str, str]] = []
        for name in ("total_angle", "notch_angle", "tension"):
            quantity = QUANTITIES[name]
            if name in self and self.samples[name].ndim == 2:
                ends = self[name].low, self[name].high
                low, high = (course(end * quantity.scale) for end in ends)
                rows.append((quantity.title, f"{low} {quantity.unit}; {high} {quantity.unit}"))
        rows.append(("bands of", ", ".join(self)))
        rows.append(("assumed", ", ".join(self.assumed) or "nothing"))
        title = f"Bands of {self.draws} draws over {len(self.path)} steps, 5 to 95 %"
        return Summary(title, rows, '["total_angle"].low, .median, .high; nf.plot(it) draws them')


class _End:
    """One end of bands, in place of a path."""

    def __init__(self, bands: Bands, end: str) -> None:
        self._bands, self._end = bands, end
        self.converged = bands.converged > 0
        self.closed = np.zeros_like(bands.path.closed)  # which differs from draw to draw

    def __getattr__(self, name: str) -> Any:
        bands = self._bands
        return getattr(bands[name], self._end) if name in bands else getattr(bands.path, name)


def band(samples: Float[np.ndarray, "draws ..."]) -> Band:
    """Return the percentiles of samples along the first axis; NaN are left out."""
    with np.errstate(invalid="ignore"):
        empty = np.isnan(samples).all(axis=0)
        low, median, high = np.nanquantile(np.where(empty, 0.0, samples), LEVELS, axis=0)
    return Band(*(np.where(empty, np.nan, percentile) for percentile in (low, median, high)))


def uncertain(
    robot: Robot,
    loads: Load | LoadPath | Iterable[Load],
    tolerances: Mapping[str, Any] | None = None,
    *,
    outputs: Sequence[str] | None = None,
    draws: int = DRAWS,
    seed: int = 0,
    settings: Settings | None = None,
    refinement: int = 0,
    cores: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Bands:
    """Simulate loads with robots drawn within tolerances, for bands of the real robot.

    Every draw follows all loads with its own friction history.

    Args:
        robot: The robot of the drawing.
        loads: As for `simulate`.
        tolerances: What deviates and how far, as in the `[tolerance]` table of a robot file, such
            as `{"notch.depth": 0.01, "material.elastic_modulus": "5 %"}`, and nothing else. None
            takes the table of the robot, and assumes the rest.
        outputs: Names of quantities of `EquilibriumPath`; None for angles, tip, strains, tensions
            and strokes. Only numbers have bands.
        draws: How many robots are drawn, as a Latin hypercube; 2 or more.
        seed: The same seed makes the same robots.
        settings: Tolerance and limits of the solver.
        refinement: More strain modes, as for `simulate`.
        cores: As for `batch`.
        progress: Called with the draws done and all of them.

    Returns:
        The bands, by name of the quantity.

    Raises:
        InputError: Invalid loads or tolerances, no such output, or no valid robot within the
            tolerances.

    Example:
        >>> from notchflex import load_robot, pull
        >>> bands = uncertain(load_robot("pacheco2021-a"), pull(0.0, 1.0, steps=3))
        >>> angle = bands["total_angle"]
        >>> bool(angle.low[2] < bands.path.total_angle[2] < angle.high[2])
        True
    """
    check_is_robot(robot)
    if check_integer(draws, "draws") < 2:
        raise InputError.OUT_OF_RANGE(f"draws must be 2 or more; got {draws}")
    if tolerances is None:
        chosen, assumed = tolerances_of(robot)
    else:
        chosen, assumed = robot.replace(tolerance=tolerances).tolerance, ()
    path = simulate(robot, loads, settings=settings, refinement=refinement)
    names = check_outputs(USUAL if outputs is None else outputs)
    names = [name for name in names if _has_band(name) and holds(path, QUANTITIES[name])]
    sample = draw_robots(robot, chosen, draws, check_integer(seed, "seed"))
    results = batch(
        sample.robot if sample.values else [sample.robot] * draws,
        sample.values,
        path.load,
        outputs=names,
        settings=settings,
        refinement=refinement,
        cores=cores,
        progress=progress,
    )
    converged = results["converged"]
    samples = {name: results[name] for name in names}
    return Bands(
        path, chosen, assumed, samples, sample.values, converged.sum(axis=0), sample.redrawn, seed
    )


def band_names(more: Iterable[str]) -> list[str]:
    """Return the names of the usual bands and of further quantities that can have one."""
    return [*dict.fromkeys([*USUAL, *(name for name in more if _has_band(name))])]


def _has_band(name: str) -> bool:
    """Return whether a quantity has numbers that a batch returns."""
    quantity = REGISTERED[name]
    return name in OUTPUTS and quantity.kind is float and "row" not in quantity.per


# Effect of tolerances on the closing of notches, and of 10 µm of depth.

DEPTH = 0.010
"""The change of depth whose effect is reported, mm."""

_DRAWS, _STEPS, _BEYOND = 128, 32, 1.6


class ClosingBands(NamedTuple):
    """Results of `notchflex show` on tolerances, n notches."""

    bands: Bands
    notches: Int[np.ndarray, " n"]  # from 1: those that `tendon` closes
    tension: Band  # N; infinite beyond 1.6 times what closes all notches of the drawing
    angle: Band  # at which they close, rad
    load: float  # half the tension that closes the first notch, N
    tendon: int  # from 1: the one that closes a notch first
    total_angle: Band  # at that load, rad
    by_depth: float  # its change if all notches are cut 10 µm deeper, rad; NaN without a depth
    shares: dict[str, float]  # of its variance; see `Bands.variance_shares`


def closing_bands(robot: Robot, table: Closing) -> ClosingBands | None:
    """Propagate the tolerances of a robot to the closing of its notches; None if none closes."""
    if not np.isfinite(table.tension).any():
        return None
    first = int(np.nanargmin(table.tension))
    tendon = int(table.tendon[first])
    notches = np.flatnonzero(np.isfinite(table.tension) & (table.tendon == tendon))
    load = 0.5 * float(table.tension[first])
    loads = np.linspace(0.0, _BEYOND * table.tension[notches].max(), _STEPS)
    loads = np.sort(np.append(loads, load))
    names = ("total_angle", "notch_angle", "gap", "contact_force")
    bands = uncertain(robot, _pull(robot, tendon, loads), outputs=names, draws=_DRAWS)
    gaps, forces = (bands.samples[name][:, :, notches] for name in ("gap", "contact_force"))
    stiffness = np.asarray(bands.path.chain.contact_stiffness)[notches]
    angles = bands.samples["notch_angle"][:, :, notches]
    # The gap of a notch of a draw falls almost evenly until it is closed and stands still then, so
    # the last two open steps are continued.
    closed = forces > gaps * stiffness
    first_closed = np.argmax(closed, axis=1)
    steps = [np.maximum(first_closed - back, 0) for back in range(3)]
    after, before, earlier = (loads[step] for step in steps)
    angle, near, far = (
        np.take_along_axis(values, step[:, None], axis=1)[:, 0]
        for values, step in zip((angles, gaps, gaps), steps, strict=True)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        extrapolated = before + near * (before - earlier) / (far - near)
    closes, never = closed.any(axis=1), np.where(np.isnan(gaps).any(axis=1), np.nan, np.inf)
    extrapolated = np.clip(extrapolated, before, after)
    tension = np.where(first_closed > 1, extrapolated, 0.5 * (before + after))
    tension, angle = np.where(closes, tension, never), np.where(closes, angle, np.nan)
    step = int(np.searchsorted(loads, load))
    total = band(bands.samples["total_angle"][:, step])
    shares = bands.variance_shares("total_angle", step)
    by_depth = _by_depth(robot, _pull(robot, tendon, np.array([load])))
    # Of tensions of which some are infinite: huge numbers in their place have quantiles.
    ends = vars(band(np.nan_to_num(tension, nan=np.nan))).values()
    closing = Band(*(np.where(end <= loads[-1], end, np.inf) for end in ends)), band(angle)
    return ClosingBands(bands, notches + 1, *closing, load, tendon, total, by_depth, shares)


def closing_document(closing_bands: ClosingBands) -> dict[str, Any]:
    """Return the document of `notchflex show --json` on tolerances, in output units."""
    return {
        "draws": closing_bands.bands.draws,
        "tolerances": {
            tolerance.value: tolerance.written for tolerance in closing_bands.bands.tolerances
        },
        "assumed": list(closing_bands.bands.assumed),
        "tendon": closing_bands.tendon,
        "notches": closing_bands.notches,
        "closing_tension_N": _ends(closing_bands.tension),
        "closing_angle_deg": _ends(closing_bands.angle, DEGREES),
        "load_N": closing_bands.load,
        "total_angle_deg": _ends(closing_bands.total_angle, DEGREES),
        "total_angle_variance_shares": closing_bands.shares,
        "total_angle_deg_by_10um_depth": closing_bands.by_depth * DEGREES,
    }


def _ends(percentiles: Band, scale: float = 1.0) -> dict[str, Any]:
    ends = vars(percentiles).items()
    return {name: np.where(np.isfinite(end), end * scale, np.nan) for name, end in ends}


def _pull(robot: Robot, tendon: int, loads: Float[np.ndarray, " s"]) -> LoadPath:
    """Pull one tendon (from 1), the others slack."""
    tensions = np.zeros((len(loads), robot.number_of_tendons))
    tensions[:, tendon - 1] = loads
    return LoadPath(tensions)


def _by_depth(robot: Robot, load: LoadPath) -> float:
    """Return the change of the total angle for each 10 µm of depth, by a central difference."""
    try:
        depths = numbers_at(robot, "notch.depth")
    except InputError:  # no depth
        return float("nan")
    values = {name: depth + DEPTH * np.array([1.0, -1.0]) for name, depth in depths.items()}
    states = batch(robot.replace(tolerance=None), values, load, outputs=("total_angle",))
    deeper, shallower = states["total_angle"][:, 0]  # NaN where the spine is thinner than that
    return 0.5 * float(deeper - shallower)


# Bands in files: columns of a table, and a document for JSON.

ENDS = ("low", "median", "high")


def band_columns(bands: Bands) -> dict[str, Sequence[Any]]:
    """Return columns beside those of a path, such as `total_deg_low`, `total_deg_median`."""
    columns: dict[str, Sequence[Any]] = {"draws_converged": bands.converged.tolist()}
    for name in bands:
        quantity = QUANTITIES[name]
        if quantity.column and is_listed(quantity):
            ends = [list(entries_of(bands.end(end), quantity)) for end in ENDS]
            for entries in zip(*ends, strict=True):
                columns |= {
                    f"{entry.header}_{end}": entry.values
                    for entry, end in zip(entries, ENDS, strict=True)
                }
    return columns


def band_document(bands: Bands) -> dict[str, Any]:
    """Return bands as a document of plain values and arrays, at the edge units."""
    quantities = [QUANTITIES[name] for name in bands]
    return {
        "draws": bands.draws,
        "seed": bands.seed,
        "percentiles": [100.0 * level for level in LEVELS],
        "tolerances": {tolerance.value: tolerance.written for tolerance in bands.tolerances},
        "assumed": list(bands.assumed),
        "redrawn": bands.redrawn,
        "steps": [
            {
                "step": step + 1,
                "converged": converged,
                **{
                    quantity.key: {
                        end: values[step] * quantity.scale
                        for end, values in vars(bands[quantity.name]).items()
                    }
                    for quantity in quantities
                    if quantity.key
                },
            }
            for step, converged in enumerate(bands.converged)
        ],
    }
