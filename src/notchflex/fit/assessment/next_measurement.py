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
from notchflex.fit.estimation.calibration import Calibration
from notchflex.fit.measurements.measurements import OBSERVED, Measurements, check_quantities
from notchflex.fit.measurements.simulated import modelled
from notchflex.fit.model.residuals import Residuals
from notchflex.fit.model.samples import Samples
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
    _check(found, label, narrow, deviation or {})
    path = load_path(candidates, found.robots[label].number_of_tendons)
    if observed is None:
        measured = found.problem.samples.of_robot(label)
        observed = tuple(dict.fromkeys(name for one in measured for name in one.observed))
    noise = {name: _noise(found, name, deviation or {}) for name in observed}
    narrower = np.full((len(path), len(found.names)), np.nan)
    volume = np.full(len(path), np.nan)
    before = found.reached.curvature / found.widened**2
    width, size = _widths(before)
    solved, residuals = _solved(found, label, path, observed)
    if residuals is None:
        raise InputError.NOT_CONVERGED("none of the candidates has a solution; give smaller loads")
    sizes = np.array([noise[OBSERVED[quantity]] for quantity in residuals.quantity])
    scaled = residuals.slopes / sizes[:, None]
    for row, step in enumerate(solved):
        slopes = scaled[residuals.row == row]
        width_after, size_after = _widths(before + slopes.T @ slopes)
        narrower[step], volume[step] = width_after / width, np.exp(size_after - size)
    names, able = tuple(narrow), np.isfinite(volume)
    return NextMeasurement(label, path, narrower, volume, found.names, names, able)


def _check(
    calibration: Calibration, label: str, narrow: Sequence[str], deviation: Mapping[str, float]
) -> None:
    if label not in calibration.given:
        raise InputError.UNKNOWN_NAME(
            f"no robot of this fit is called {label}; there are {', '.join(calibration.given)}"
        )
    missing = [name for name in narrow if name not in calibration.names]
    if missing:
        raise InputError.UNKNOWN_NAME(
            f"{missing[0]} was not fitted; narrow some of {', '.join(calibration.names)}"
        )
    if calibration.tells_no_noise:
        raise InputError.TOO_FEW_DATA(
            "the noise is unknown, so that the gain of another measurement is unknown; "
            "measure more, or give standard deviations"
        )
    if any(not 0.0 < value < np.inf for value in deviation.values()):
        raise InputError.OUT_OF_RANGE("a deviation of the next measurement must be above 0")


def _noise(calibration: Calibration, name: str, deviation: Mapping[str, float]) -> float:
    if name in deviation:
        return float(deviation[name])
    check_quantities([name])
    mine = calibration.residuals.quantity == OBSERVED.index(name)
    if not mine.any():
        raise InputError.MISSING_VALUE(
            f"{name} was not measured so far; give its standard deviation"
        )
    return float(np.sqrt(np.mean(calibration.noise.deviation[mine] ** 2)))


def _solved(
    calibration: Calibration, label: str, loads: LoadPath, observed: Sequence[str]
) -> tuple[list[int], Residuals | None]:
    """Candidates that have a solution, and residuals with one row each; None if there are none."""
    axis_at = np.zeros(0)
    if "axis_points" in observed:
        measured = calibration.problem.samples.of_robot(label)
        axis_at = next((one.axis_at for one in measured if len(one.axis_at)), axis_at)
    model = solve_each(calibration.robots[label], loads)
    steps = np.flatnonzero(model.converged).tolist()
    if not steps:
        return steps, None
    rows = Measurements(
        source="candidates",
        load=loads[np.asarray(steps)],
        pull=tuple(map(str, steps)),
        from_rest=True,
        observed={name: one[steps] for name, one in modelled(model, observed, axis_at).items()},
        axis_at=axis_at,
    )
    samples = Samples.of(
        {label: calibration.given[label]}, {label: [rows]}, calibration.problem.unknowns
    )
    return steps, samples.residuals(calibration.best.values)


def _widths(information: Float[np.ndarray, "k k"]) -> tuple[Float[np.ndarray, " k"], float]:
    """Widths of the constants, and the logarithm of the k-th root of the volume of their region.

    A constant without information is very wide.
    """
    size = np.sqrt(np.maximum(np.diag(information), 1e-12))
    values, vectors = np.linalg.eigh(information / np.outer(size, size))
    inverse = (vectors / np.maximum(values, 1e-12)) @ vectors.T
    _, logarithm = np.linalg.slogdet(inverse)
    volume = (0.5 * logarithm - np.sum(np.log(size))) / len(size)
    return np.sqrt(np.diag(inverse)) / size, float(volume)
