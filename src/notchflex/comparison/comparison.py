"""The model at every measured row, and its errors; as JSON and as columns of a CSV."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from html import escape
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from notchflex import InputError, Robot, equal_stroke, tip_from_angles
from notchflex.analysis import axis_points
from notchflex.fit import MEASURED, MeasuredRows, Measurements, branch_words, edge, headers, misfit
from notchflex.support import DEGREES, QUANTITIES, document_head

Numbers = Float[np.ndarray, "..."]

# Quantities without a column of their own in a comparison: only their errors are kept.
_OTHERS = (
    "edge_angle",
    "tip_rotation",
    "tip_tension",
    "drive_tension",
    "drive_stroke",
    "axis_points",
)


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
    tension: Numbers
    stroke: Numbers
    notch_angle: Numbers
    total_angle: Numbers
    tip: Numbers
    converged: Bool[np.ndarray, " p"]
    reason: tuple[str, ...]
    others: dict[str, float] = field(default_factory=dict[str, float])
    stroke_lost: Numbers | None = None
    beyond_faces: Numbers | float = 0.0

    @property
    def angle(self) -> str:
        """The measured angle of notches, by its name: "notch_angle" or "edge_angle"."""
        return angle_of(self.measured)

    @cached_property
    def measured_notch_angle(self) -> Numbers:
        """Measured angle of every notch [rad], (P, n); NaN where it was not measured."""
        nothing = np.full(self.notch_angle.shape, np.nan)
        return self.measured.observed.get(self.angle, nothing)

    @cached_property
    def measured_total_angle(self) -> Numbers:
        """Measured total angle [rad], (P,): its own column, or else the sum of all notches."""
        added = np.sum(self.measured_notch_angle, axis=1)
        observed = self.measured.observed
        total = observed.get("total_angle", observed.get("total_edge_angle"))
        return added if total is None else np.where(np.isnan(total), added, total)

    @cached_property
    def measured_tip(self) -> Numbers:
        """Measured tip in the world [mm], (P, 3); NaN for unknown coordinates.

        As measured, or else that of the model, moved as arcs of the measured notch angles lie from
        arcs of the model's: strips and U-links are no arcs, but bend nearly as the model's do.
        """
        tip = np.full(self.tip.shape, np.nan)
        complete = np.isfinite(self.measured_notch_angle).all(axis=1)
        if complete.any():
            measured, modelled = (
                _tip_in_world(self.robot, self.measured, (angles + self.beyond_faces)[complete])
                for angles in (self.measured_notch_angle, self.notch_angle)
            )
            tip[complete] = self.tip[complete] + measured - modelled
        measured = self.measured.observed.get("tip_position", tip)
        return np.where(np.isfinite(measured).any(axis=1, keepdims=True), measured, tip)

    @property
    def points(self) -> int:
        """Number of rows that the errors are taken over."""
        return int(self.converged.sum())

    @property
    def rmse_notches(self) -> Numbers:
        """Root-mean-square error of every notch angle [rad], (n,)."""
        return self._rms(self.notch_angle - self.measured_notch_angle)

    @property
    def rmse_total(self) -> float:
        """Root-mean-square error of the total angle [rad]."""
        return float(self._rms(self.total_angle - self.measured_total_angle))

    @property
    def tip_error(self) -> Numbers:
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

    def _rms(self, errors: Numbers) -> Numbers:
        """Return the root mean square over the rows that were solved; NaN without any."""
        errors = errors[self.converged]
        count = np.isfinite(errors).sum(axis=0)
        total = np.nansum(errors**2, axis=0)
        return np.sqrt(np.where(count > 0, total / np.maximum(count, 1), np.nan))

    def __repr__(self) -> str:
        """Return the errors on a few lines."""
        measured = self.measured
        way = "each from rest" if measured.from_rest else "each pull one path"
        lines = [
            f"{self.robot.name} beside {measured.source}",
            f"{self.points} of {len(measured)} rows solved, {way}",
            "root-mean-square errors:",
            f"  notches      {', '.join(map(_number, self.rmse_notches * DEGREES))} deg",
            f"  total angle  {_number(self.rmse_total * DEGREES)} deg",
            f"  tip          {_number(self.rmse_tip)} mm",
        ]
        for name, value in self.others.items():
            title, unit, scale = edge(name)
            lines.append(f"  {title}  {_number(value * scale)} {unit}")
        return "\n".join([*lines, *self.diagnosis])

    def _repr_html_(self) -> str:
        """Return the same for a notebook."""
        return f"<pre>{escape(repr(self))}</pre>"


def _number(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "-"


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
    rows = MeasuredRows(robot, measurements.load, measurements.pull, measurements.from_rest)
    path = rows.solve()

    def of_model(name: str) -> Any:
        if name == "axis_points":
            return rows.sorted_back(axis_points(path, measurements.axis_at))
        return rows.sorted_back(np.asarray(getattr(path, name)))

    angle_name, converged = angle_of(measurements), of_model("converged")
    angle, total = of_model(angle_name), of_model("total_angle")
    if angle_name == "edge_angle" and "total_angle" not in measurements.observed:
        total = angle.sum(axis=1)
    others: dict[str, float] = {}
    for name in _OTHERS:
        if name in measurements.observed and name != angle_name:
            # Over the solved rows; of points that of distances.
            values, others[name] = of_model(MEASURED[name].output)[converged], float("nan")
            observed = measurements.observed[name][converged]
            if np.isfinite(observed).any():
                off, _ = misfit(name, observed, values, np.zeros((0, *values.shape)))
                squares = off.reshape(-1, 3 if MEASURED[name].is_vector else 1) ** 2
                known = np.isfinite(squares).any(axis=1).sum()
                others[name] = float(np.sqrt(np.nansum(squares) / known))
    return Comparison(
        robot=robot,
        measured=measurements,
        tension=of_model("tension"),
        stroke=of_model("stroke"),
        notch_angle=angle,
        total_angle=total,
        beyond_faces=of_model("notch_angle") - angle,
        tip=of_model("tip_position"),
        converged=converged,
        reason=tuple(map(str, rows.sorted_back(np.array(path.reason, object)))),
        others=others,
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


def angle_of(measured: Measurements) -> str:
    """Return the name of the angles of notches that were measured."""
    only_edges = "edge_angle" in measured.observed and "notch_angle" not in measured.observed
    return "edge_angle" if only_edges else "notch_angle"


def _check(robot: Robot, measurements: Measurements) -> None:
    if not isinstance(measurements, Measurements):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError.WRONG_TYPE(
            "compare needs Measurements; read_measurements reads them from a CSV, and "
            f"simulate_measurements makes them; got {type(measurements).__name__}"
        )
    notches = measurements.observed.get(angle_of(measurements))
    if notches is not None and notches.shape[1] != robot.number_of_notches:
        raise InputError.WRONG_SHAPE(
            f"{measurements.source} has angles of {notches.shape[1]} notches, but {robot.name} has "
            f"{robot.number_of_notches}; choose the robot that was measured"
        )


def _tip_in_world(robot: Robot, measured: Measurements, angles: Numbers) -> Numbers:
    """Forward kinematics of notch angles, with the base rotation."""
    tip, _ = tip_from_angles(robot, angles)
    return QUANTITIES["tip_position"].turned(np.asarray(tip), measured.load.base_to_world)


def _pairs(comparison: Comparison) -> dict[str, tuple[Numbers, Numbers]]:
    """Measured and modelled numbers by quantity, rows as leading axis, in deg, mm and N."""
    measured = comparison.measured
    pairs = {
        "tension": (measured.measured_tension, comparison.tension),
        "stroke": (measured.load.stroke, comparison.stroke),
        comparison.angle: (comparison.measured_notch_angle, comparison.notch_angle),
        "total_angle": (comparison.measured_total_angle, comparison.total_angle),
        "tip_position": (comparison.measured_tip, comparison.tip),
    }
    return {
        name: (first * QUANTITIES[name].scale, second * QUANTITIES[name].scale)
        for name, (first, second) in pairs.items()
    }


def comparison_document(comparison: Comparison) -> dict[str, Any]:
    """Return a comparison as a document for `notchflex.support.write_json`.

    Args:
        comparison: The comparison.

    Returns:
        `rmse_deg.notches`, `rmse_deg.total`, `tip_rmse_mm`, `points`, `negative_forces`,
        `from_rest` with `order` (how the order of the rows was understood), `diagnosis`, the
        columns that were ignored, and every row, measured beside modelled. None marks what
        was not measured.
    """
    measured = comparison.measured
    pairs = {QUANTITIES[name].key: pair for name, pair in _pairs(comparison).items()}
    rows: list[dict[str, Any]] = []
    for row, pull in enumerate(measured.pull):
        seen, model = ({key: pair[side][row] for key, pair in pairs.items()} for side in (0, 1))
        model |= {"converged": comparison.converged[row], "reason": comparison.reason[row]}
        rows.append({"trial": pull, "measured": seen, "model": model})
    reason = next(filter(None, comparison.reason), "")
    return {
        **document_head(comparison.robot),
        "data": measured.source,
        "from_rest": measured.from_rest,
        "order": measured.order,
        **errors_document(comparison),
        "negative_forces": measured.negative_forces,
        "diagnosis": list(comparison.diagnosis),
        "ignored_columns": measured.ignored,
        "converged": not reason,
        "reason": reason,
        "rows": rows,
    }


def errors_document(comparison: Comparison) -> dict[str, Any]:
    """Return the errors of a comparison: `rmse_deg`, `tip_rmse_mm` and the number of `points`.

    `rmse_others` holds those of the tip's rotation, of tensions at the tip and of points on the
    axis, if they were measured. For the kinematic model also `stroke_from` ("measurement", or
    "model" if some row has only forces) and `stroke_lost_mm`, which closed notches could not take,
    by row.
    """
    lost: dict[str, Any] = {}
    if comparison.stroke_lost is not None:
        source = "model" if takes_stroke_of_model(comparison) else "measurement"
        lost = {"stroke_from": source, "stroke_lost_mm": comparison.stroke_lost}
    measured = comparison.angle in comparison.measured.observed
    return {
        "rmse_deg": {
            "notches": comparison.rmse_notches * DEGREES if measured else None,
            "total": comparison.rmse_total * DEGREES,
        },
        "tip_rmse_mm": comparison.rmse_tip,
        "rmse_others": {
            f"{name}_{edge(name)[1]}": value * edge(name)[2]
            for name, value in comparison.others.items()
        },
        "points": comparison.points,
        **lost,
    }


def comparison_columns(comparison: Comparison) -> dict[str, Any]:
    """Return a comparison as columns for a CSV: header to P values, in deg, mm and N."""
    columns: dict[str, Any] = {"trial": comparison.measured.pull}
    for name, (values, model) in _pairs(comparison).items():
        for index, header in headers(QUANTITIES[name].column, model.shape[1:]).items():
            if not np.isnan(values[:, *index]).all():
                columns[header] = values[:, *index]
            columns[f"{header}_model"] = model[:, *index]
    columns["tip_error_mm"] = comparison.tip_error
    columns["converged"] = comparison.converged
    columns["reason"] = comparison.reason
    return columns


def takes_stroke_of_model(kinematics: Comparison) -> bool:
    """Return whether the kinematic model takes the stroke of the full model in some row."""
    return bool(np.isnan(kinematics.measured.load.stroke[:, 0]).any())
