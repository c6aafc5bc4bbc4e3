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
from notchflex.mechanics.motion import left_slope, rotation_about

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
    base = np.asarray(rotation_about(constant(measured.load.base_rotation)))
    seen = measured.observed[name]
    moved = predicted.slopes
    count = len(next(iter(moved.values())))
    tables = [predicted.values]
    tables += [{key: table[k] for key, table in moved.items()} for k in range(count)]
    if name == "tip_rotation":
        rows = _turned(seen, base, [table[name] for table in tables])
    else:
        model = [_model(name, table, seen.shape) for table in tables]
        if name in LENGTHS:  # in the world, where coordinates may be missing one by one
            model = [one @ base.T for one in model]
        model[0] = model[0] - seen
        rows = [np.reshape(one, (len(seen), -1)) for one in model]
    slopes = np.array(rows[1:]).reshape(count, *rows[0].shape)  # of no constant, perhaps
    return Misfit(rows[0], slopes)


def _model(name: str, table: dict[str, np.ndarray], shape: tuple[int, ...]) -> np.ndarray:
    """What the model says of a quantity; linear in the outputs, so that slopes go through too."""
    if name == "tip_tension":
        spans = table["span_tension"]
        last = np.sum(np.isfinite(spans[0]), axis=-1) - 1
        return np.stack([spans[:, t, end] for t, end in enumerate(last)], axis=-1)
    return table[name][:, : shape[1]] if len(shape) == 2 else table[name]


def _turned(
    seen: Float[np.ndarray, "p 3"], base: Float[np.ndarray, "3 3"], model: list[np.ndarray]
) -> list[np.ndarray]:
    """Rotation vectors from the measured to the model's orientation, and their slopes."""
    was = Rotation.from_matrix(base).inv() * Rotation.from_rotvec(np.nan_to_num(seen))
    turned = Rotation.from_matrix(model[0]) * was.inv()
    vector = turned.as_rotvec()
    vector_of_turn = np.stack([np.linalg.inv(np.asarray(left_slope(one))) for one in vector])
    rows = [np.where(np.isnan(seen), np.nan, vector)]
    for change in model[1:]:
        spin = change @ np.swapaxes(model[0], -1, -2)
        turn = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=-1)
        rows.append(np.einsum("pij,pj->pi", vector_of_turn, turn))
    return rows


__all__ = ["ANGLES", "LENGTHS", "Misfit", "Residuals", "misfit", "outputs_for"]
