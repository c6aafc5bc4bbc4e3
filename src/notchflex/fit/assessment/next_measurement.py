"""Which measurement to make next: the one that narrows the intervals most.

The information of a measurement is the square of its slopes by the constants over its noise; that
of a fit is the curvature of its misfit (Fedorov 1972). Candidates are weighed by it, one by one.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from notchflex.analysis import solve_each
from notchflex.errors import InputError
from notchflex.fit.estimation.calibration import Calibration
from notchflex.fit.measurements.measurements import OBSERVED, Measurements, rows_of
from notchflex.fit.measurements.simulated import modelled
from notchflex.fit.model.samples import Samples
from notchflex.loads import Load, LoadPath
from notchflex.loads.conversion import load_path


@dataclass(frozen=True, eq=False)
class NextMeasurement:
    """What one more row would tell, for each candidate.

    Attributes:
        label: The robot that is measured.
        loads: The candidates.
        narrower: Width of every constant's interval after it over that before, candidates by
            constants, in a straight-line view of the model; 1 tells nothing new.
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
    converged: np.ndarray

    @property
    def gain(self) -> Float[np.ndarray, " c"]:
        """Width after over width before of what is wanted; NaN without a solution."""
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
    """Weigh loads by how much measuring under them would narrow the intervals.

    Args:
        found: The fit so far.
        candidates: Loads, each a row from rest.
        robot: Label of the robot that is measured; the first where not given.
        narrow: Constants to be narrowed (c-optimal: mean width of their intervals); where not
            given all together (D-optimal: the volume of their region).
        observed: What would be measured; as so far where not given.
        deviation: Its noise (rad, mm, N) by quantity; as so far where not given.

    Returns:
        What each candidate would tell.

    Raises:
        InputError: There is no such robot, constant or quantity, or its noise is not known.

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
    if label not in found.given:
        raise InputError.UNKNOWN_NAME(
            f"no robot of this fit is called {label}; there are {', '.join(found.given)}"
        )
    missing = [name for name in narrow if name not in found.names]
    if missing:
        raise InputError.UNKNOWN_NAME(
            f"{missing[0]} was not fitted; narrow some of {', '.join(found.names)}"
        )
    if found.tells_no_noise:
        raise InputError.TOO_FEW_DATA(
            "nothing tells the noise, so that nobody knows what another measurement would add; "
            "measure more, or give standard deviations"
        )
    if any(not 0.0 < value < np.inf for value in (deviation or {}).values()):
        raise InputError.OUT_OF_RANGE("a deviation of the next measurement must be above 0")
    fitted = found.robots[label]
    path = load_path(candidates, fitted.number_of_tendons)
    seen = tuple(observed or _observed(found, label))
    noise = {name: _noise(found, name, deviation) for name in seen}
    narrower = np.full((len(path), len(found.names)), np.nan)
    volume = np.full(len(path), np.nan)
    before = found.reached.curvature / found.widened**2
    width = _widths(before)
    for step, slopes in _slopes(found, label, path, seen, noise):
        after = before + slopes.T @ slopes
        narrower[step] = _widths(after) / width
        volume[step] = np.exp(_half_volume(after) - _half_volume(before))
    told = np.isfinite(volume)
    if not told.any():
        raise InputError.NOT_CONVERGED("none of the candidates has a solution; give smaller loads")
    return NextMeasurement(label, path, narrower, volume, found.names, tuple(narrow), told)


def _observed(found: Calibration, label: str) -> tuple[str, ...]:
    every = (one.measured for one in found.problem.samples.every if one.label == label)
    return tuple(dict.fromkeys(name for one in every for name in one.observed))


def _noise(found: Calibration, name: str, deviation: Mapping[str, float] | None) -> float:
    if deviation and name in deviation:
        return float(deviation[name])
    if name not in OBSERVED:
        raise InputError.UNKNOWN_NAME(
            f"{name} is nothing that is measured; there are {', '.join(OBSERVED)}"
        )
    own: np.ndarray = found.residuals.quantity == OBSERVED.index(name)
    if not own.any():
        raise InputError.MISSING_VALUE(
            f"{name} was not measured so far; tell its standard deviation"
        )
    return float(np.sqrt(np.mean(found.noise.deviation[own] ** 2)))


def _slopes(
    found: Calibration,
    label: str,
    loads: LoadPath,
    observed: Sequence[str],
    noise: Mapping[str, float],
) -> Iterator[tuple[int, Float[np.ndarray, "m k"]]]:
    """Candidates that have a solution, and slopes of what would be measured, over its noise."""
    own = [one.measured for one in found.problem.samples.every if one.label == label]
    places: Any = next((one.axis_at for one in own if len(one.axis_at)), np.zeros(0))
    axis_at: Any = places if "axis_points" in observed else np.zeros(0)
    model = solve_each(found.robots[label], loads)
    able = np.flatnonzero(model.converged)
    if not len(able):
        return
    rows = Measurements(
        "candidates",
        rows_of(loads, able),
        tuple(str(step) for step in able),
        True,
        {name: one[able] for name, one in modelled(model, observed, axis_at).items()},
        axis_at=axis_at,
    )
    samples = Samples.of({label: found.given[label]}, {label: [rows]}, found.problem.unknowns)
    residuals = samples.residuals(found.best.values)
    if residuals is None:
        return
    sizes = np.array([noise[OBSERVED[int(quantity)]] for quantity in residuals.quantity])
    scaled = residuals.slopes / sizes[:, None]
    for number, step in enumerate(able):
        yield int(step), scaled[residuals.row == number]


def _widths(information: Float[np.ndarray, "k k"]) -> Float[np.ndarray, " k"]:
    size, inverse = _scaled_inverse(information)
    return np.sqrt(np.diag(inverse)) / size


def _half_volume(information: Float[np.ndarray, "k k"]) -> float:
    """Logarithm of the k-th root of the volume of the region that information leaves."""
    size, inverse = _scaled_inverse(information)
    _, logarithm = np.linalg.slogdet(inverse)
    return float((0.5 * logarithm - np.sum(np.log(size))) / len(size))


def _scaled_inverse(information: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The inverse without units, and the units; what is not known at all is very wide."""
    size = np.sqrt(np.maximum(np.diag(information), 1e-12))
    values, vectors = np.linalg.eigh(information / np.outer(size, size))
    return size, (vectors / np.maximum(values, 1e-12)) @ vectors.T


__all__ = ["NextMeasurement", "next_measurement"]
