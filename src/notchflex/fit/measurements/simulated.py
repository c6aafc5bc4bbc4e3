"""Measurements simulated with the model, whose constants are then known, and its rows solved."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from notchflex import InputError, Load, LoadPath, Robot, simulate, solve_each
from notchflex.analysis import axis_points
from notchflex.fit.measurements.measurements import Measurements, check_labels, check_quantities
from notchflex.support import load_path, spans_of

if TYPE_CHECKING:
    from notchflex import EquilibriumPath

_ANGLES = ("notch_angle", "total_angle", "edge_angle", "total_edge_angle", "tip_rotation")


def simulate_measurements(
    robot: Robot,
    load: Load | LoadPath | Iterable[Load],
    *,
    observed: Sequence[str] = ("notch_angle",),
    deviation: Mapping[str, float] | None = None,
    seed: int | np.random.Generator = 0,
    axis_at: ArrayLike = (),
    pull: Sequence[str] | None = None,
    from_rest: bool = True,
) -> Measurements:
    """Simulate measurements with the model, with Gaussian noise.

    Args:
        robot: The robot.
        load: The loads, P steps.
        observed: What is measured, by the names of `Measurements.observed`.
        deviation: Standard deviation of the noise, rad, mm or N, by the same names; 0 by default.
        seed: Seed of the noise, or a random generator.
        axis_at: Distances of the points on the axis from the base, mm; for "axis_points".
        pull: Label of the pull of every step; one pull by default.
        from_rest: True if every step is a pull from rest, False if each pull is one path.

    Raises:
        InputError: An unknown name, a deviation that is not positive, a point beyond the robot.
        ConvergenceError: A step has no equilibrium.

    Example:
        >>> from notchflex import load_robot, pull
        >>> wrist = load_robot("pacheco2021-a")
        >>> simulate_measurements(wrist, pull(0.2, 1.0, steps=5), deviation={"notch_angle": 0.005})
        <Measurements of synthetic: 5 rows of 1 pull, each from rest; notch_angle; deviations of
        notch_angle>
    """
    noise = dict(deviation or {})
    check_quantities((*observed, *noise))
    for name, value in noise.items():
        if name not in observed or not 0.0 < value < np.inf:
            raise InputError.OUT_OF_RANGE(
                f"the deviation of {name} must be positive and {name} be observed; got {value:g}"
            )
    path = load_path(load, robot.number_of_tendons)
    labels = ("1",) * len(path) if pull is None else tuple(map(str, pull))
    check_labels(labels, len(path), "steps")
    random = np.random.default_rng(seed)

    def read(states: EquilibriumPath) -> dict[str, NDArray[np.float64]]:
        return modelled(states.raise_if_failed(), observed, axis_at)

    values: dict[str, NDArray[np.float64]] = {}
    for name, exact in solved_rows(robot, path, labels, from_rest, read).items():
        noisy = exact + noise.get(name, 0.0) * random.standard_normal(exact.shape)
        values[name] = _as_read(noisy, name)
    return Measurements(
        source="synthetic",
        load=path,
        pull=labels,
        from_rest=from_rest,
        observed=values,
        deviation={
            name: np.full(values[name].shape, _as_read(one, name)) for name, one in noise.items()
        },
        axis_at=np.array(axis_at, float) if "axis_points" in observed else np.zeros(0),
    )


def solved_rows(
    robot: Robot,
    load: LoadPath,
    pull: Sequence[str],
    from_rest: bool,
    read: Callable[[EquilibriumPath], Mapping[str, NDArray[Any]]],
) -> dict[str, NDArray[Any]]:
    """Solve P rows, from rest or as steps of the paths of their pulls, and read arrays by name.

    `read` returns arrays of solved states, steps as leading axis; some may not have converged.
    """
    if from_rest:
        return dict(read(solve_each(robot, load)))
    results: dict[str, NDArray[Any]] = {}
    labels = np.array(pull)
    for label in dict.fromkeys(pull):
        rows = np.flatnonzero(labels == label)
        for name, part in read(simulate(robot, load[rows])).items():
            empty = np.empty((len(load), *part.shape[1:]), part.dtype)
            results.setdefault(name, empty)[rows] = part
    return results


def modelled(
    path: EquilibriumPath, observed: Sequence[str], axis_at: ArrayLike = ()
) -> dict[str, NDArray[np.float64]]:
    """Return what would be measured on solved states, as in `Measurements.observed`."""
    derived: dict[str, Callable[[], Any]] = {
        "tip_rotation": lambda: Rotation.from_matrix(path.tip_rotation).as_rotvec(),
        "total_edge_angle": lambda: path.edge_angle.sum(axis=-1),
        "tip_tension": lambda: _tip_tension(path),
        "axis_points": lambda: axis_points(path, axis_at),
    }
    return {
        name: np.asarray(derived[name]() if name in derived else getattr(path, name))
        for name in observed
    }


def _as_read(value: Any, name: str) -> Any:
    """A value as it is read from a file: an angle that a number of degrees gives exactly."""
    return np.radians(np.degrees(value)) if name in _ANGLES else value


def _tip_tension(path: EquilibriumPath) -> NDArray[np.float64]:
    last = [spans_of(path, tendon) - 1 for tendon in range(path.span_tension.shape[1])]
    return path.span_tension[:, np.arange(len(last)), last]
