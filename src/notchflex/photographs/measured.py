"""The measured photographs."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import compress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex import Robot
from notchflex.fit import MEASURED, deviation_header, headers
from notchflex.support import document_head, write_columns

PHOTOGRAPH = "photograph"
"""Column with the name of the file; `calibrate` passes over it."""

Numbers = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MeasuredPhotograph:
    """One photograph of a robot of n notches. Units mm, rad, px.

    Attributes:
        source: The file.
        reason: Why nothing is reported; "" if the photograph was measured.
        notch_angle: Angle of every notch, base to tip, (n,); NaN if refused.
        notch_angle_deviation: Their standard deviations, (n,).
        tip_position: Tip on the tube axis, in the frame of the base, (3,). Its y is 0: the robot
            bends in a plane.
        tip_deviation: Standard deviations of x and z, (3,); NaN for y, which is not measured.
        scale: Pixels of the photograph per mm.
        roll: Roll of the robot about the axis of its base, from the side view.
        tilt: Tilt of its base out of the photograph.
        noise: Spread of the edges about the outline, px.
        found: Share of the outline that was found, 0 to 1.
        outline: Points of the fitted outline in the photograph, px, (N, 2).
        seen: Whether an edge was found at each of them, (N,).
        chain: Points of the fitted tube axis in the photograph, px, (n + 2, 2): before the first
            notch, where it starts, and the end of every body behind a notch, the tip last.
    """

    source: str
    reason: str
    notch_angle: Numbers
    notch_angle_deviation: Numbers
    tip_position: Numbers
    tip_deviation: Numbers
    scale: float = float("nan")
    roll: float = float("nan")
    tilt: float = float("nan")
    noise: float = float("nan")
    found: float = 0.0
    outline: Numbers = field(default_factory=lambda: np.zeros((0, 2)), repr=False)
    seen: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, bool), repr=False)
    chain: Numbers = field(default_factory=lambda: np.zeros((0, 2)), repr=False)

    @property
    def measured(self) -> bool:
        """Whether angles are reported."""
        return not self.reason

    @classmethod
    def refused(cls, source: str, notches: int, reason: str, **view: Any) -> MeasuredPhotograph:
        """Return a photograph of which nothing is reported, with the reason."""
        nothing, nowhere = np.full(notches, np.nan), np.full(3, np.nan)
        return cls(source, reason, nothing, nothing, nowhere, nowhere, **view)

    def view(self) -> dict[str, Any]:
        """Return how the robot is seen, by the keys of the JSON document."""
        return {
            "scale_px_mm": self.scale,
            "roll_deg": math.degrees(self.roll),
            "tilt_deg": math.degrees(self.tilt),
            "edge_noise_px": self.noise,
            "outline_found": self.found,
        }

    def entry(self) -> dict[str, Any]:
        """Return the entry of the JSON document, without the loads."""
        head: dict[str, Any] = {"photograph": self.source, "measured": self.measured}
        if not self.measured:
            return {**head, "reason": self.reason}
        return {
            **head,
            "notch_angle_deg": np.degrees(self.notch_angle),
            "notch_angle_sd_deg": np.degrees(self.notch_angle_deviation),
            "tip_position_mm": self.tip_position,
            "tip_position_sd_mm": self.tip_deviation,
            **self.view(),
        }


@dataclass(frozen=True, eq=False)
class MeasuredPhotographs:
    """Photographs of one robot, with the loads they were taken under.

    Attributes:
        robot: The robot.
        photographs: What was measured in each, in the order given.
        loads: Columns of a file of measurements (`tendon_force_N`, ...) with one text for each
            photograph.

    Example:
        >>> import notchflex as nf  # doctest: +SKIP
        >>> found = nf.measure(["pull_1N.jpg"], nf.load_robot("wrist.toml"))  # doctest: +SKIP
        >>> found.photographs[0].notch_angle  # doctest: +SKIP
    """

    robot: Robot
    photographs: tuple[MeasuredPhotograph, ...]
    loads: dict[str, tuple[str, ...]] = field(default_factory=dict)

    def __len__(self) -> int:
        """Number of photographs."""
        return len(self.photographs)

    @property
    def measured(self) -> tuple[MeasuredPhotograph, ...]:
        """Those that were measured."""
        return tuple(photograph for photograph in self.photographs if photograph.measured)

    @property
    def refused(self) -> tuple[MeasuredPhotograph, ...]:
        """Those that were refused; each has its `reason`."""
        return tuple(photograph for photograph in self.photographs if not photograph.measured)

    def columns(self) -> dict[str, list[Any]]:
        """Return the columns of the CSV that `calibrate` reads, the measured photographs only."""
        is_measured = [photograph.measured for photograph in self.photographs]
        table: dict[str, list[Any]] = {
            PHOTOGRAPH: [photograph.source for photograph in self.measured]
        }
        for name, texts in self.loads.items():
            table[name] = list(compress(texts, is_measured))
        notches = (self.robot.number_of_notches,)
        for index, header in headers(MEASURED["notch_angle"].columns, notches).items():
            for name, field_name in (
                (header, "notch_angle"),
                (deviation_header(header), "notch_angle_deviation"),
            ):
                values = [getattr(seen, field_name)[index] for seen in self.measured]
                table[name] = np.degrees(values).tolist()
        return table

    def document(self) -> dict[str, Any]:
        """Return the JSON document: all photographs, the refused with their reasons."""
        entries = [
            {
                **photograph.entry(),
                "loads": {name: texts[row] for name, texts in self.loads.items()},
            }
            for row, photograph in enumerate(self.photographs)
        ]
        return {**document_head(self.robot), "photographs": entries}

    def write_csv(self, target: str) -> None:
        """Write the measured photographs as the CSV that `calibrate` reads, `-` for output.

        Raises:
            InputError: The file cannot be written.
        """
        write_columns(target, self.columns())
