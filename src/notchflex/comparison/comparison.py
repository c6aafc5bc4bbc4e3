"""The model at every measured point, and how far it is from the measurement."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import notchflex as nf
from notchflex.comparison.measured import Measured
from notchflex.errors import InputError
from notchflex.robot import Robot


@dataclass(frozen=True)
class Comparison:
    """A robot beside its measurement, P points, n notches, t tendons.

    The errors are taken over the points whose equilibrium was found.

    Attributes:
        robot: The robot that was compared.
        measured: The measurement.
        from_rest: True if every point is a pull from rest, False if each trial is one path.
        tension: Base tension in the model [N], (P, t).
        stroke: Stroke in the model [mm], (P, t).
        notch_angle: Notch angles of the model [rad], (P, n).
        total_angle: Total angle of the model [rad], (P,).
        tip: Tip of the model [mm], (P, 3).
        measured_tip: Forward kinematics of the measured notch angles [mm], (P, 3).
        converged: Whether the equilibrium was found, (P,).
        reason: Why not, P texts, "" where it was.
        stroke_lost: Stroke that closed notches could not take in the kinematic model [mm], (P,);
            None for a model with forces.
    """

    robot: Robot
    measured: Measured
    from_rest: bool
    tension: NDArray[np.float64]
    stroke: NDArray[np.float64]
    notch_angle: NDArray[np.float64]
    total_angle: NDArray[np.float64]
    tip: NDArray[np.float64]
    measured_tip: NDArray[np.float64]
    converged: NDArray[np.bool_]
    reason: tuple[str, ...]
    stroke_lost: NDArray[np.float64] | None = None

    @property
    def points(self) -> int:
        """Number of points that the errors are taken over."""
        return int(self.converged.sum())

    @property
    def rmse_notches(self) -> NDArray[np.float64]:
        """Root-mean-square error of every notch angle [rad], (n,)."""
        return self._rms(self.notch_angle - self.measured.notch_angle)

    @property
    def rmse_total(self) -> float:
        """Root-mean-square error of the total angle [rad]."""
        return float(self._rms(self.total_angle - self.measured.total_angle))

    @property
    def tip_error(self) -> NDArray[np.float64]:
        """Distance of the tip from the measured tip [mm], (P,)."""
        return np.linalg.norm(self.tip - self.measured_tip, axis=-1)

    @property
    def tip_rmse(self) -> float:
        """Root-mean-square distance of the tip from the measured tip [mm]."""
        return float(self._rms(self.tip_error))

    def _rms(self, errors: NDArray[np.float64]) -> NDArray[np.float64]:
        good = errors[self.converged]
        if not len(good):
            return np.full(errors.shape[1:], np.nan)
        return np.sqrt(np.mean(good**2, axis=0))


def compare(robot: Robot, measured: Measured, *, from_rest: bool = True) -> Comparison:
    """Solve a robot at every measured point.

    Args:
        robot: The robot that was measured.
        measured: P points with forces or displacements. A negative force is 0 N in the model.
        from_rest: True if every point is a pull from rest; False if the points of each trial, in
            their order, are one path with memory of friction.

    Returns:
        The comparison. A point that does not converge is marked and left out of the errors.

    Example:
        >>> from notchflex import load_robot
        >>> robot = load_robot("pacheco2021-a")
        >>> angles = np.radians([[2.7, 2.7, 2.7, 2.7, 2.6]])
        >>> pull = Measured(
        ...     "by hand", np.array([[0.25]]), np.array([[np.nan]]), angles, angles.sum(1), ("1",)
        ... )
        >>> round(float(np.degrees(compare(robot, pull).rmse_total)), 2)
        0.01
    """
    model = (_from_rest if from_rest else _along_trials)(robot, measured)
    measured_tip, _ = nf.tip_from_angles(robot, measured.notch_angle)
    return Comparison(
        robot=robot,
        measured=measured,
        from_rest=from_rest,
        measured_tip=np.asarray(measured_tip),
        **model,
    )


def compare_kinematics(comparison: Comparison) -> Comparison:
    """Compare the model that shares the stroke equally over the notches (Pacheco 2021, eq. 1-3).

    It knows no forces: it takes the measured stroke, and where only the force was measured the
    stroke that the full model finds under it.

    Args:
        comparison: The full model, for a robot of one tendon.

    Returns:
        The comparison of the kinematic model with the same measurement.

    Raises:
        InputError: The robot has several tendons.
    """
    robot = comparison.robot
    if robot.number_of_tendons != 1:
        raise InputError(
            f"the kinematic model shares the stroke of one tendon; {robot.name} has "
            f"{robot.number_of_tendons}."
        )
    given = ~np.isnan(comparison.measured.stroke[:, 0])
    stroke = np.where(given, comparison.measured.stroke[:, 0], comparison.stroke[:, 0])
    shared = nf.equal_stroke(robot, stroke)
    angles = shared.notch_angle
    tip, _ = nf.tip_from_angles(robot, angles)
    # A stroke past the last closing has no equilibrium, but here it is the closed shape.
    solved = comparison.converged | given
    return replace(
        comparison,
        stroke=stroke[:, None],
        notch_angle=angles,
        total_angle=angles.sum(axis=1),
        tip=np.asarray(tip),
        converged=solved,
        stroke_lost=shared.stroke_lost,
        reason=tuple(
            "" if good else why for good, why in zip(solved, comparison.reason, strict=True)
        ),
    )


FIELDS = {
    "tension": "tension",
    "stroke": "stroke",
    "notch_angle": "notch_angle",
    "total_angle": "total_angle",
    "tip": "tip_position",
    "converged": "converged",
    "reason": "reason",
}
"""Field of a comparison to the attribute of the solved state that fills it."""


def _from_rest(robot: Robot, measured: Measured) -> dict[str, Any]:
    from notchflex.statics import solve_each

    path = solve_each(robot, nf.LoadPath(tension=measured.model_tension, stroke=measured.stroke))
    columns = {field: np.asarray(getattr(path, name)) for field, name in FIELDS.items()}
    return {**columns, "reason": tuple(path.reason)}


def _along_trials(robot: Robot, measured: Measured) -> dict[str, Any]:
    columns: dict[str, Any] = {}
    for label in dict.fromkeys(measured.trial):
        rows = np.array([trial == label for trial in measured.trial])
        path = nf.simulate(
            robot,
            nf.LoadPath(tension=measured.model_tension[rows], stroke=measured.stroke[rows]),
        )
        for field, attribute in FIELDS.items():
            part = np.asarray(getattr(path, attribute))
            if field == "reason":
                part = part.astype(object)
            if field not in columns:
                columns[field] = np.empty((len(measured), *part.shape[1:]), part.dtype)
            columns[field][rows] = part
    columns["reason"] = tuple(str(reason) for reason in columns["reason"])
    return columns
