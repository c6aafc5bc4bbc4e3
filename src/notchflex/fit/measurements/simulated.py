"""Measurements made from the model: what tests and benchmarks fit to, its constants being known."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from notchflex.analysis import axis_points
from notchflex.errors import InputError
from notchflex.fit.measurements.measurements import OBSERVED, Measurements
from notchflex.fit.model.solved_rows import solved_rows
from notchflex.loads import Load, LoadPath
from notchflex.loads.load_path import load_path
from notchflex.results.quantities.registry import spans_of
from notchflex.robot import Robot

if TYPE_CHECKING:
    from notchflex.results import EquilibriumPath

_ANGLES = ("notch_angle", "total_angle", "tip_rotation")


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
    """Make measurements from the model, with Gaussian noise.

    Args:
        robot: The robot.
        load: What is done to it, P steps.
        observed: What is measured, by the names of `Measurements.observed`.
        deviation: Standard deviation of the noise, rad, mm or N, by the same names; what is not
            named has no noise, and no deviation in the result.
        seed: Of the noise: a number, or a generator to draw from.
        axis_at: Where points on the axis are measured, mm; for "axis_points".
        pull: Label of the pull of every step; all of one if left out.
        from_rest: True if every step is a pull from rest, False if each pull is one path.

    Returns:
        The measurements.

    Raises:
        InputError: A name that is none, a deviation that is not positive, a place beyond the robot.
        ConvergenceError: A step has no equilibrium.

    Example:
        >>> from notchflex import load_robot, pull
        >>> wrist = load_robot("pacheco2021-a")
        >>> simulate_measurements(wrist, pull(0.2, 1.0, steps=5), deviation={"notch_angle": 0.005})
        <Measurements of synthetic: 5 rows of 1 pull, each from rest; notch_angle; deviations of
        notch_angle>
    """
    noise = dict(deviation or {})
    wrong = [name for name in (*observed, *noise) if name not in OBSERVED]
    if wrong:
        raise InputError.UNKNOWN_NAME(
            f"`{wrong[0]}` is nothing that is measured; there are {', '.join(OBSERVED)}"
        )
    for name, value in noise.items():
        if name not in observed or not 0.0 < value < np.inf:
            raise InputError.OUT_OF_RANGE(
                f"the deviation of {name} must be positive and {name} be observed; got {value:g}"
            )
    path = load_path(load, robot.number_of_tendons)
    labels = ("1",) * len(path) if pull is None else tuple(str(label) for label in pull)
    if len(labels) != len(path):
        raise InputError.WRONG_SHAPE(
            f"{len(path)} steps need a label of their pull each; got {len(labels)}"
        )
    random = np.random.default_rng(seed)

    def read(states: EquilibriumPath) -> dict[str, NDArray[np.float64]]:
        return modelled(states.raise_if_failed(), observed, axis_at)

    model = solved_rows(robot, path, labels, from_rest, read)
    values: dict[str, NDArray[np.float64]] = {}
    for name, exact in model.items():
        noisy = exact + noise.get(name, 0.0) * random.standard_normal(exact.shape)
        values[name] = _told(noisy, name)
    return Measurements(
        source="synthetic",
        load=path,
        pull=labels,
        from_rest=from_rest,
        observed=values,
        deviation={
            name: np.full(values[name].shape, _told(spread, name)) for name, spread in noise.items()
        },
        axis_at=np.array(axis_at, float) if "axis_points" in observed else np.zeros(0),
    )


def modelled(
    path: EquilibriumPath, observed: Sequence[str], axis_at: ArrayLike = ()
) -> dict[str, NDArray[np.float64]]:
    """What would be measured on solved states, by the names of `Measurements.observed`.

    Args:
        path: The states, s steps.
        observed: Names of what is wanted.
        axis_at: Where points on the axis lie on the straight robot, mm.

    Returns:
        By name, steps as leading axis, in the shapes of `Measurements.observed`.
    """
    made = {
        "notch_angle": lambda: path.notch_angle,
        "total_angle": lambda: path.total_angle,
        "tip_position": lambda: path.tip_position,
        "tip_rotation": lambda: rotation_vectors(path.tip_rotation),
        "tip_tension": lambda: _tip_tension(path),
        "axis_points": lambda: axis_points(path, axis_at),
    }
    return {name: np.asarray(made[name]()) for name in observed}


def rotation_vectors(rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation vectors (s, 3), rad, of rotations (s, 3, 3) of up to half a turn."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(np.asarray(rotation)).as_rotvec()


def _told(value: Any, name: str) -> Any:
    """A value as a file can hold it: angles that have a number of degrees read back equal."""
    return np.radians(np.degrees(value)) if name in _ANGLES else value


def _tip_tension(path: EquilibriumPath) -> NDArray[np.float64]:
    last = [spans_of(path, tendon) - 1 for tendon in range(path.span_tension.shape[1])]
    return path.span_tension[:, np.arange(len(last)), last]


__all__ = ["modelled", "rotation_vectors", "simulate_measurements"]
