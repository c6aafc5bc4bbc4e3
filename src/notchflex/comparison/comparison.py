"""The model at every measured row, and its errors."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from notchflex import InputError, Robot, equal_stroke, tip_from_angles
from notchflex.analysis import axis_points
from notchflex.fit.measurements.measurements import Measurements
from notchflex.fit.measurements.simulated import solved_rows
from notchflex.fit.model.residuals import OUTPUTS, Predicted, branch_words, misfit
from notchflex.support import QUANTITIES

if TYPE_CHECKING:
    from notchflex import EquilibriumPath

_COLUMNS = ("tension", "stroke", "notch_angle", "total_angle", "tip_position", "converged")
# Quantities without a column of their own in a comparison: only their errors are kept.
_OTHERS = ("edge_angle", "tip_rotation", "tip_tension", "axis_points")
_POINTS = ("tip_rotation", "axis_points")


@dataclass(frozen=True, eq=False, repr=False)
class Comparison:
    """A robot beside its measurements, P rows, n notches, t tendons.

    Errors are taken over the rows that were solved; they are NaN for what was not measured.

    Attributes:
        robot: The robot.
        measured: The measurements; their `from_rest` says how the rows were loaded.
        tension: Base tension in the model [N], (P, t).
        stroke: Stroke in the model [mm], (P, t).
        notch_angle: Notch angles of the model [rad], (P, n): of `angle`, which was measured.
        total_angle: Total angle of the model [rad], (P,); the sum of the edge angles where these
            were measured without a total angle.
        tip: Tip of the model in the world [mm], (P, 3).
        converged: Whether the equilibrium was found, (P,).
        reason: Why not, P texts, "" if it was.
        others: Root-mean-square errors of other measured quantities, by the names of
            `Measurements.observed`: "tip_rotation" [rad], "tip_tension" [N], "axis_points" [mm].
        stroke_lost: Stroke that closed notches could not take in the kinematic model [mm], (P,);
            None for a model with forces.
        beyond_faces: Where edge angles were measured, by how much less these are than the angles of
            the model's rings [rad], (P, n); else 0.
    """

    robot: Robot
    measured: Measurements
    tension: Float[np.ndarray, "p t"]
    stroke: Float[np.ndarray, "p t"]
    notch_angle: Float[np.ndarray, "p n"]
    total_angle: Float[np.ndarray, " p"]
    tip: Float[np.ndarray, "p 3"]
    converged: Bool[np.ndarray, " p"]
    reason: tuple[str, ...]
    others: dict[str, float] = field(default_factory=dict[str, float])
    stroke_lost: Float[np.ndarray, " p"] | None = None
    beyond_faces: Float[np.ndarray, "p n"] | float = 0.0

    @property
    def angle(self) -> str:
        """The measured angle of notches, by its name: "notch_angle" or "edge_angle"."""
        return _angle(self.measured)

    @cached_property
    def measured_notch_angle(self) -> Float[np.ndarray, "p n"]:
        """Measured angle of every notch [rad], (P, n); NaN where it was not measured."""
        nothing = np.full(self.notch_angle.shape, np.nan)
        return self.measured.observed.get(self.angle, nothing)

    @cached_property
    def measured_total_angle(self) -> Float[np.ndarray, " p"]:
        """Measured total angle [rad], (P,): its own column, or else the sum of all notches."""
        added = np.sum(self.measured_notch_angle, axis=1)
        observed = self.measured.observed
        total = observed.get("total_angle", observed.get("total_edge_angle"))
        return added if total is None else np.where(np.isnan(total), added, total)

    @cached_property
    def measured_tip(self) -> Float[np.ndarray, "p 3"]:
        """Measured tip in the world [mm], (P, 3); NaN for unknown coordinates.

        As measured, or else that of the model, moved as arcs of the measured notch angles lie from
        arcs of the model's: strips and U-links are no arcs, but bend nearly as the model's do.
        """
        angles = self.measured_notch_angle + self.beyond_faces
        complete = np.isfinite(angles).all(axis=1)
        tip = np.full(self.tip.shape, np.nan)
        if complete.any():
            of_model = self.notch_angle + self.beyond_faces
            measured, modelled = (
                _tip_in_world(self.robot, self.measured, one[complete])
                for one in (angles, of_model)
            )
            tip[complete] = self.tip[complete] + measured - modelled
        measured = self.measured.observed.get("tip_position")
        if measured is None:
            return tip
        return np.where(np.isfinite(measured).any(axis=1, keepdims=True), measured, tip)

    @property
    def points(self) -> int:
        """Number of rows that the errors are taken over."""
        return int(self.converged.sum())

    @property
    def rmse_notches(self) -> Float[np.ndarray, " n"]:
        """Root-mean-square error of every notch angle [rad], (n,)."""
        return self._rms(self.notch_angle - self.measured_notch_angle)

    @property
    def rmse_total(self) -> float:
        """Root-mean-square error of the total angle [rad]."""
        return float(self._rms(self.total_angle - self.measured_total_angle))

    @property
    def tip_error(self) -> Float[np.ndarray, " p"]:
        """Distance of the tip from the measured tip [mm], (P,), over its measured coordinates."""
        off = self.tip - self.measured_tip
        return np.where(np.isnan(off).all(axis=1), np.nan, np.sqrt(np.nansum(off**2, axis=1)))

    @property
    def rmse_tip(self) -> float:
        """Root-mean-square distance of the tip from the measured tip [mm]."""
        return float(self._rms(self.tip_error))

    @property
    def diagnosis(self) -> tuple[str, ...]:
        """Sentences that a user should know before trusting the errors."""
        off = np.where(self.converged, self.measured_total_angle - self.total_angle, np.nan)
        return branch_words(off, "total_angle", self.measured)

    def _rms(self, errors: NDArray[np.float64]) -> NDArray[np.float64]:
        is_known = np.isfinite(errors) & self.converged.reshape(-1, *(1,) * (errors.ndim - 1))
        count = is_known.sum(axis=0)
        total = np.sum(np.where(is_known, errors, 0.0) ** 2, axis=0)
        return np.sqrt(np.where(count > 0, total / np.maximum(count, 1), np.nan))

    def __repr__(self) -> str:
        """Return the errors on a few lines."""
        from notchflex.comparison.tables import summary

        return summary(self)

    def _repr_html_(self) -> str:
        """Return the same for a notebook."""
        from html import escape

        return f"<pre>{escape(repr(self))}</pre>"


def compare(robot: Robot, measurements: Measurements) -> Comparison:
    """Solve a robot at every measured row.

    Args:
        robot: The robot that was measured.
        measurements: P rows, as `read_measurements` reads them or `Measurements` holds them;
            their `from_rest` says whether each row is loaded from rest or each pull is one path.

    Returns:
        The comparison. A row that does not converge is marked and left out of the errors.

    Raises:
        InputError: The measurements are not of such a robot.

    Example:
        >>> from notchflex import Measurements, load_robot, pull
        >>> robot = load_robot("pacheco2021-a")
        >>> angle = {"total_angle": np.radians([13.3, 27.1])}
        >>> seen = Measurements("by hand", pull(0.25, 0.5, steps=2), ("1", "1"), True, angle)
        >>> round(float(np.degrees(compare(robot, seen).rmse_total)), 2)
        0.54
    """
    _check(robot, measurements)
    others = [name for name in _OTHERS if name in measurements.observed]
    at_faces = _angle(measurements) == "edge_angle"

    def read(path: EquilibriumPath) -> dict[str, Any]:
        names = [*_COLUMNS, *(OUTPUTS.get(name, name) for name in others if name != "axis_points")]
        columns = {name: np.asarray(getattr(path, name)) for name in names}
        columns["reason"] = np.array(path.reason, object)
        if "axis_points" in others:
            columns["axis_points"] = np.asarray(axis_points(path, measurements.axis_at))
        return columns

    model = solved_rows(robot, measurements.load, measurements.pull, measurements.from_rest, read)
    angle, total = model[_angle(measurements)], model["total_angle"]
    if at_faces and "total_angle" not in measurements.observed:
        total = angle.sum(axis=1)
    return Comparison(
        robot=robot,
        measured=measurements,
        tension=model["tension"],
        stroke=model["stroke"],
        notch_angle=angle,
        total_angle=total,
        beyond_faces=model["notch_angle"] - angle if at_faces else 0.0,
        tip=model["tip_position"],
        converged=model["converged"],
        reason=tuple(str(one) for one in model["reason"]),
        others={
            name: _error(name, measurements, model)
            for name in others
            if not (at_faces and name == "edge_angle")
        },
    )


def compare_kinematics(comparison: Comparison) -> Comparison:
    """Compare the model that shares the stroke equally over the notches (Pacheco 2021, eq. 1-3).

    It takes the measured stroke or, if only the force was measured, the stroke of the full model.
    Equal notches then add up to the total angle of the full model, whatever was measured: only the
    notches and the tip distinguish the two models.

    Args:
        comparison: The full model, for a robot of one tendon.

    Returns:
        The comparison of the kinematic model with the same measurement.

    Raises:
        InputError: The robot has several tendons.
    """
    robot = comparison.robot
    if robot.number_of_tendons != 1:
        raise InputError.UNSUPPORTED(
            f"the kinematic model shares the stroke of one tendon; {robot.name} has "
            f"{robot.number_of_tendons}."
        )
    measured = comparison.measured.load.stroke[:, 0]
    is_measured = ~np.isnan(measured)
    stroke = np.where(is_measured, measured, comparison.stroke[:, 0])
    shared = equal_stroke(robot, stroke)
    angles = shared.notch_angle
    # A stroke past the last closing has no equilibrium, but here it is the closed shape.
    solved = comparison.converged | is_measured
    return replace(
        comparison,
        stroke=stroke[:, None],
        notch_angle=angles,
        total_angle=angles.sum(axis=1),
        tip=_tip_in_world(robot, comparison.measured, angles),
        converged=solved,
        others={},
        beyond_faces=0.0,
        stroke_lost=shared.stroke_lost,
        reason=tuple(np.where(solved, "", comparison.reason).tolist()),
    )


def _angle(measured: Measurements) -> str:
    observed = measured.observed
    return (
        "edge_angle"
        if "edge_angle" in observed and "notch_angle" not in observed
        else "notch_angle"
    )


def _check(robot: Robot, measurements: Measurements) -> None:
    if not isinstance(measurements, Measurements):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError.WRONG_TYPE(
            "compare needs Measurements; read_measurements reads them from a CSV, and "
            f"simulate_measurements makes them; got {type(measurements).__name__}"
        )
    notches = measurements.observed.get(_angle(measurements))
    if notches is not None and notches.shape[1] != robot.number_of_notches:
        raise InputError.WRONG_SHAPE(
            f"{measurements.source} has angles of {notches.shape[1]} notches, but {robot.name} has "
            f"{robot.number_of_notches}; choose the robot that was measured"
        )


def _tip_in_world(
    robot: Robot, measured: Measurements, angles: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Forward kinematics of notch angles, with the base rotation."""
    tip, _ = tip_from_angles(robot, angles)
    return QUANTITIES["tip_position"].turned(np.asarray(tip), measured.load.base_to_world)


def _error(name: str, measured: Measurements, model: dict[str, Any]) -> float:
    """Root-mean-square error of a quantity over the solved rows; of points that of distances."""
    rows = np.flatnonzero(model["converged"])
    if not len(rows) or not np.isfinite(measured.observed[name][rows]).any():
        return float("nan")
    output = OUTPUTS.get(name, name)
    predicted = Predicted({output: model[output][rows]}, np.ones(len(rows), bool), {})
    off, _ = misfit(name, measured.taken(rows), predicted)
    squares = off.reshape(len(rows), -1, 3 if name in _POINTS else 1) ** 2
    is_known = np.isfinite(squares).any(axis=2)
    return float(np.sqrt(np.nansum(squares) / is_known.sum()))
