"""Model less measurement at every measured number, with derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation

from notchflex._jax import constant
from notchflex.fit.measurements.measurements import OBSERVED, Measurements
from notchflex.fit.model.rows import OUTPUTS, Predicted
from notchflex.mechanics.motion import left_slope

ANGLES = ("notch_angle", "total_angle", "edge_angle", "total_edge_angle")
LENGTHS = ("tip_position", "axis_points")


@dataclass(frozen=True, eq=False)
class Residuals:
    """Model less measurement, R numbers, and what each belongs to.

    Attributes:
        values: Model less measurement (rad, mm, N), (R,).
        slopes: Their derivatives by the constants, (R, k).
        sample: Number of the measurements that each belongs to.
        robot: Number of the robot.
        row: Row of the measurements.
        quantity: Number in `OBSERVED`.
        part: Component of the quantity (a notch, a coordinate).
        pull: Pull, counted over all measurements.
        point: Point in space, for coordinates; of its own for each other number.
        rows: Number of rows measured of that robot.
        given: Standard deviation given with the measurement; NaN if there is none.
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
        """Number of measured numbers."""
        return len(self.values)

    def of(self, sample: int, quantity: str) -> np.ndarray:
        """Return whether each number belongs to a quantity of some measurements, (R,)."""
        return (self.sample == sample) & (self.quantity == OBSERVED.index(quantity))

    def root_mean_squares(self) -> dict[str, float]:
        """Return the root mean square by quantity (rad, mm, N)."""
        return {
            OBSERVED[number]: float(np.sqrt(np.mean(self.values[self.quantity == number] ** 2)))
            for number in np.unique(self.quantity)
        }


def misfit(
    name: str, measured: Measurements, predicted: Predicted
) -> tuple[Float[np.ndarray, "p c"], Float[np.ndarray, "k p c"]]:
    """Return model less measurement of a quantity, rows by components, and its derivatives.

    Both are NaN where nothing was measured.
    """
    observed, output = measured.observed[name], OUTPUTS.get(name, name)
    values = predicted.values[output]
    slopes = predicted.slopes.get(output, np.zeros((0, *values.shape)))
    if name == "tip_rotation":
        return _turned(observed, values, slopes)
    if name == "tip_tension":
        last = np.isfinite(values[0]).sum(axis=-1) - 1
        tendons = np.arange(len(last))
        values, slopes = values[:, tendons, last], slopes[:, :, tendons, last]
    if name == "total_edge_angle":
        values, slopes = values.sum(axis=-1), slopes.sum(axis=-1)
    values = (values - observed).reshape(len(observed), -1)
    return values, slopes.reshape(len(slopes), *values.shape)


def _turned(
    observed: Float[np.ndarray, "p 3"],
    rotation: Float[np.ndarray, "p 3 3"],
    slopes: Float[np.ndarray, "k p 3 3"],
) -> tuple[Float[np.ndarray, "p 3"], Float[np.ndarray, "k p 3"]]:
    """Rotation vectors from the measured to the model's orientation, and their derivatives."""
    turned = Rotation.from_matrix(rotation) * Rotation.from_rotvec(np.nan_to_num(observed)).inv()
    vector = turned.as_rotvec()
    spin = slopes @ np.swapaxes(rotation, -1, -2)
    turn = np.stack([spin[..., 2, 1], spin[..., 0, 2], spin[..., 1, 0]], axis=-1)
    by_turn = np.linalg.inv(np.asarray(left_slope(constant(vector))))
    values = np.where(np.isnan(observed), np.nan, vector)
    return values, np.einsum("pij,kpj->kpi", by_turn, turn)
