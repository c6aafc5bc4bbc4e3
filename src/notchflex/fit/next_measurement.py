"""Which measurement to make next: the one that narrows the intervals most.

The information of a measurement is the square of its derivatives by the constants over its noise;
that of a fit is the curvature of its misfit (Fedorov 1972). It ranks the candidates one by one.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from notchflex import InputError, Load, LoadPath, solve_each
from notchflex.fit.calibration import Calibration
from notchflex.fit.measurements.measurements import (
    OBSERVED,
    Measurements,
    check_quantities,
    modelled,
)
from notchflex.fit.objective import Vector
from notchflex.fit.residuals import Residuals, Samples
from notchflex.support import load_path


@dataclass(frozen=True, eq=False)
class NextMeasurement:
    """Reduction of the intervals by one more row, for each candidate.

    Attributes:
        label: The robot that is measured.
        loads: The candidates.
        narrower: Width of every constant's interval after it over that before, candidates by
            constants, with the model linearised; 1 adds nothing.
        volume: The same for all constants together: the k-th root of the volume of their region.
        names: The constants.
        wanted: The constants to be narrowed; all together if none are named.
        converged: Which candidates have a solution.
    """

    label: str
    loads: LoadPath
    narrower: Float[np.ndarray, "c k"]
    volume: Float[np.ndarray, " c"]
    names: tuple[str, ...]
    wanted: tuple[str, ...]
    converged: Bool[np.ndarray, " c"]

    @property
    def gain(self) -> Float[np.ndarray, " c"]:
        """Width after over width before of the wanted intervals; NaN without a solution."""
        if not self.wanted:
            return self.volume
        columns = [self.names.index(name) for name in self.wanted]
        return np.mean(self.narrower[:, columns], axis=1)

    @property
    def best(self) -> int:
        """Number of the candidate that narrows most."""
        return int(np.nanargmin(self.gain))


def next_measurement(
    found: Calibration,
    candidates: Load | LoadPath | Iterable[Load],
    *,
    robot: str | None = None,
    narrow: Sequence[str] = (),
    observed: Sequence[str] | None = None,
    deviation: Mapping[str, float] | None = None,
) -> NextMeasurement:
    """Rank loads by how much measuring under them would narrow the intervals.

    Args:
        found: The fit so far.
        candidates: Loads, each a row from rest.
        robot: Label of the robot that is measured; the first by default.
        narrow: Constants to be narrowed (c-optimal: mean width of their intervals); by default all
            together (D-optimal: the volume of their region).
        observed: Quantities that would be measured; as so far by default.
        deviation: Their noise (rad, mm, N) by quantity; as so far by default.

    Raises:
        InputError: There is no such robot, constant or quantity, its noise is not known, or no
            candidate has a solution.

    Example:
        >>> from notchflex import load_robot, pull
        >>> from notchflex.fit import calibrate, simulate_measurements
        >>> wrist = load_robot("pacheco2021-a")
        >>> seen = simulate_measurements(
        ...     wrist, pull(0.1, 0.5, steps=5), deviation={"notch_angle": 0.01}
        ... )
        >>> found = calibrate(wrist, seen, "friction.coefficient", starts=1, intervals=False)
        >>> next_measurement(found, pull(0.2, 1.2, steps=6)).best
        5
    """
    label = robot or next(iter(found.given))
    noise = dict(deviation or {})
    if label not in found.given:
        raise InputError.UNKNOWN_NAME(
            f"no robot of this fit is called {label}; there are {', '.join(found.given)}"
        )
    for name in narrow:
        found.number_of(name)
    if found.tells_no_noise:
        raise InputError.TOO_FEW_DATA(
            "the noise is unknown, so that the gain of another measurement is unknown; "
            "measure more, or give standard deviations"
        )
    if any(not 0.0 < value < np.inf for value in noise.values()):
        raise InputError.OUT_OF_RANGE("a deviation of the next measurement must be above 0")
    path = load_path(candidates, found.robots[label].number_of_tendons)
    measured = found.problem.samples.of_robot(label)
    if observed is None:
        observed = tuple(dict.fromkeys(name for one in measured for name in one.observed))
    check_quantities(observed)
    for name in observed:
        so_far = found.noise.deviation[found.residuals.are(name)]
        size = float(np.sqrt(np.mean(so_far**2))) if len(so_far) else float("nan")
        noise.setdefault(name, size)
        if np.isnan(noise[name]):
            raise InputError.MISSING_VALUE(
                f"{name} was not measured so far; give its standard deviation"
            )
    residuals, steps = _solved(found, label, path, observed)
    sizes = np.array([noise[OBSERVED[quantity]] for quantity in residuals.quantity])
    scaled = residuals.slopes / sizes[:, None]
    narrower = np.full((len(path), len(found.names)), np.nan)
    volume = np.full(len(path), np.nan)
    before = found.reached.curvature / found.widened**2
    count = len(found.names)
    width, size = _widths(before, count)
    for row, step in enumerate(steps):
        slopes = scaled[residuals.row == row]
        width_after, size_after = _widths(before + slopes.T @ slopes, count)
        narrower[step], volume[step] = width_after / width, np.exp(size_after - size)
    return NextMeasurement(
        label, path, narrower, volume, found.names, tuple(narrow), np.isfinite(volume)
    )


def _solved(
    calibration: Calibration, label: str, loads: LoadPath, observed: Sequence[str]
) -> tuple[Residuals, list[int]]:
    """Residuals of the candidates that have a solution, one row each, and their numbers."""
    samples = calibration.problem.samples
    points = [table.axis_at for table in samples.of_robot(label) if len(table.axis_at)]
    axis_at = points[0] if points and "axis_points" in observed else np.zeros(0)
    model = solve_each(calibration.robots[label], loads)
    steps = np.flatnonzero(model.converged).tolist()
    if steps:
        values = {name: modelled(model, name, axis_at)[steps] for name in observed}
        labels = tuple(map(str, steps))
        rows = Measurements(
            "candidates", loads[np.array(steps)], labels, True, values, axis_at=axis_at
        )
        robots = {label: calibration.given[label]}
        candidates = Samples.of(robots, {label: [rows]}, calibration.problem.varied)
        if (residuals := candidates.residuals(calibration.best.values)) is not None:
            return residuals, steps
    raise InputError.NOT_CONVERGED("none of the candidates has a solution; give smaller loads")


def _widths(information: Float[np.ndarray, "n n"], count: int) -> tuple[Vector, float]:
    """Widths of the first k constants, and the logarithm of the k-th root of their region's volume.

    A constant without information is very wide.
    """
    size = np.sqrt(np.maximum(np.diag(information), 1e-12))
    values, vectors = np.linalg.eigh(information / np.outer(size, size))
    values = np.maximum(values, 1e-12)
    covariance = ((vectors / values) @ vectors.T / np.outer(size, size))[:count, :count]
    return np.sqrt(np.diag(covariance)), 0.5 * float(np.linalg.slogdet(covariance)[1]) / count
