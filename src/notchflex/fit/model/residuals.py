"""Model less measurement at every number that was measured, and how that changes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation

from notchflex._jax import constant
from notchflex.fit.measurements.measurements import Measurements
from notchflex.fit.model.rows import Predicted
from notchflex.mechanics.motion import left_slope

ANGLES = ("notch_angle", "total_angle")
LENGTHS = ("tip_position", "axis_points")

# What of the model they need, where it is not of the same name.
_OUTPUTS = {"tip_tension": "span_tension"}


@dataclass(frozen=True, eq=False)
class Residuals:
    """Model less measurement, R numbers, and what each belongs to.

    Attributes:
        values: Model less measurement (rad, mm, N), (R,).
        slopes: Their derivatives by the constants, (R, k).
        sample: Which measurement each belongs to, by number.
        robot: Which robot.
        row: Which row of the measurement.
        quantity: Which of `OBSERVED`.
        part: Which of its components (a notch, a coordinate).
        pull: Which pull, counted over all measurements.
        point: Which point in space, for coordinates; each number alone otherwise.
        rows: How many rows the measurements of that robot have.
        given: Standard deviation given with the measurement; NaN where there is none.
    """

    values: Float[np.ndarray, " r"]
    slopes: Float[np.ndarray, "r k"]
    sample: Int[np.ndarray, " r"]
    robot: Int[np.ndarray, " r"]
    row: Int[np.ndarray, " r"]
    quantity: Int[np.ndarray, " r"]
    part: Int[np.ndarray, " r"]
    pull: Int[np.ndarray, " r"]
    point: Int[np.ndarray, " r"]
    rows: Int[np.ndarray, " r"]
    given: Float[np.ndarray, " r"]

    def __len__(self) -> int:
        """How many numbers were measured."""
        return len(self.values)


class Misfit(NamedTuple):
    """Model less measurement of one quantity, rows and components, and its slopes in front."""

    values: Float[np.ndarray, "p c"]
    slopes: Float[np.ndarray, "k p c"]


def outputs_for(quantities: tuple[str, ...]) -> tuple[str, ...]:
    """Outputs of the model that measured quantities are compared with."""
    return tuple(dict.fromkeys(_OUTPUTS.get(name, name) for name in quantities))


def misfit(name: str, measured: Measurements, predicted: Predicted) -> Misfit:
    """Model less measurement of one quantity; NaN where nothing was measured."""
    seen, output = measured.observed[name], _OUTPUTS.get(name, name)
    values, slopes = predicted.values[output], predicted.slopes.get(output)
    if slopes is None:
        slopes = np.zeros((0, *values.shape))
    if name == "tip_rotation":
        return _turned(seen, values, slopes)
    if name == "tip_tension":
        last = np.isfinite(values[0]).sum(axis=-1) - 1
        tendons = np.arange(len(last))
        values, slopes = values[:, tendons, last], slopes[:, :, tendons, last]
    values = (values - seen).reshape(len(seen), -1)
    return Misfit(values, slopes.reshape(len(slopes), *values.shape))


def _turned(
    seen: Float[np.ndarray, "p 3"],
    rotation: Float[np.ndarray, "p 3 3"],
    slopes: Float[np.ndarray, "k p 3 3"],
) -> Misfit:
    """Rotation vectors from the measured to the model's orientation, and their slopes."""
    turned = Rotation.from_matrix(rotation) * Rotation.from_rotvec(np.nan_to_num(seen)).inv()
    vector = turned.as_rotvec()
    spin = slopes @ np.swapaxes(rotation, -1, -2)
    turn = np.stack([spin[..., 2, 1], spin[..., 0, 2], spin[..., 1, 0]], axis=-1)
    by_turn = np.linalg.inv(np.asarray(left_slope(constant(vector))))
    values = np.where(np.isnan(seen), np.nan, vector)
    return Misfit(values, np.einsum("pij,kpj->kpi", by_turn, turn))


__all__ = ["ANGLES", "LENGTHS", "Misfit", "Residuals", "misfit", "outputs_for"]
