"""Reading the loads of measurements from the columns of a table."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex.errors import InputError
from notchflex.fit.measurements import columns
from notchflex.loads import BodyForce, ExternalLoad
from notchflex.results.files.csv_reading import Table, no_tendon_column, tendon_columns
from notchflex.results.quantities.registry import AXES
from notchflex.robot import Robot

_YES_OR_NO = {"0": False, "1": True, "false": False, "true": True}

Numbers = NDArray[np.float64]


@dataclass
class MeasurementReader:
    """A table of measurements of a robot; `used` are the columns read so far."""

    table: Table
    robot: Robot
    used: set[str] = field(default_factory=set[str])

    def texts(self, name: str) -> tuple[str, ...]:
        """Return a column of texts."""
        self.used.add(name)
        return self.table.texts(name)

    def numbers(self, name: str, *, may_miss: bool = False, is_load: bool = False) -> Numbers:
        """Return a column of numbers, of which some may be missing (NaN)."""
        self.used.add(name)
        return self.table.numbers(name, may_miss=may_miss, is_load=is_load)

    def vectors(self, patterns: dict[str, str], **number: object) -> dict[str, Numbers]:
        """Return vectors, (P, 3), for each argument that has a column; axes without one are 0."""
        values: dict[str, Numbers] = {}
        for argument, pattern in patterns.items():
            for axis, letter in enumerate(AXES):
                name = pattern.format(a=letter, **number)
                if name in self.table.header:
                    rows = values.setdefault(argument, np.zeros((len(self.table), 3)))
                    rows[:, axis] = self.numbers(name)
        return values

    def flags(self, name: str) -> list[bool] | None:
        """Return a column of 0 and 1; None if it is missing."""
        if name not in self.table.header:
            return None
        texts = self.texts(name)
        for row, text in enumerate(texts):
            if text.lower() not in _YES_OR_NO:
                raise InputError.NOT_A_NUMBER(
                    f"{self.table.at(row)}: {name} is {text or 'nothing'!r}; give 0 or 1."
                )
        return [_YES_OR_NO[text.lower()] for text in texts]

    def check_numbers(self) -> None:
        """Refuse columns of notches, tendons or bodies that the robot does not have."""
        robot, table = self.robot, self.table
        limits = {
            "notch": (1, robot.number_of_notches),
            "tendon": (1, robot.number_of_tendons),
            "body": (0, robot.number_of_notches),
        }
        for name in table.header:
            part, number = columns.numbered(name) or ("body", 0)  # the base, which every robot has
            first, last = limits[part]
            if not first <= number <= last:
                has = f"{part} {first}" if first == last else f"{part} {first} to {last}"
                raise InputError.TABLE_COLUMNS(
                    f"{table.name}: there is a column {name}, but {robot.name} has {has}; choose "
                    "the robot that was measured."
                )

    def from_rest(self) -> bool | None:
        """Return whether all rows were loaded from rest; None if the file does not say."""
        flags = self.flags(columns.FROM_REST)
        if flags is None:
            return None
        if len(set(flags)) > 1:
            row = flags.index(not flags[0])
            raise InputError.UNSUPPORTED(
                f"{self.table.at(row)}: {columns.FROM_REST} differs from the rows before; it is "
                "the same for all."
            )
        return flags[0]

    def base_rotation(self) -> Numbers:
        """Return the rotation vector of the base, rad, the same in all rows."""
        turned = self.vectors({"base": columns.BASE_TURN}).get("base", np.zeros((1, 3)))
        differs = np.flatnonzero((turned != turned[0]).any(axis=1))
        if len(differs):
            raise InputError.UNSUPPORTED(
                f"{self.table.at(differs[0])}: the base rotation differs from the row before "
                "it; write a file for each way that it is turned."
            )
        return np.radians(turned[0])

    def commands(self) -> tuple[Numbers, Numbers]:
        """Return measured tensions and strokes, rows by tendons; NaN where the other is given."""
        table, tendons = self.table, self.robot.number_of_tendons
        tension, stroke = (np.full((len(table), tendons), np.nan) for _ in range(2))
        by_force = tendon_columns(table.header, "tension", tendons)
        by_stroke = tendon_columns(table.header, "stroke", tendons)
        if not by_force and not by_stroke and not self.used:  # nor any external load
            raise no_tendon_column(table, tendons)
        for tendon in sorted({*by_force, *by_stroke}):
            names: list[str] = []
            if tendon in by_force:
                names.append(by_force[tendon])
                tension[:, tendon] = self.numbers(names[-1], may_miss=True, is_load=True)
            if tendon in by_stroke:
                names.append(by_stroke[tendon])
                values = table.numbers(names[-1], may_miss=True, is_load=True)
                stroke[:, tendon] = np.where(np.isnan(tension[:, tendon]), values, np.nan)
                if not np.isnan(stroke[:, tendon]).all():
                    self.used.add(names[-1])
            missing = np.flatnonzero(np.isnan(tension[:, tendon]) & np.isnan(stroke[:, tendon]))
            if len(missing):
                raise InputError.MISSING_VALUE(
                    f"{table.at(missing[0])}: {' and '.join(names)} "
                    f"{'are' if len(names) > 1 else 'is'} nothing; say what was done to the "
                    "tendon, 0 N where it was slack."
                )
        return tension, stroke

    def external(self) -> tuple[ExternalLoad, ...]:
        """Return the external loads, row by row."""
        at_tip, following = self.vectors(columns.TIP_VECTORS), self.flags(columns.FOLLOWING)
        mass = self.numbers(columns.TIP_MASS) if columns.TIP_MASS in self.table.header else None
        on_bodies = self._body_forces()
        loads: list[ExternalLoad] = []
        for row in range(len(self.table)):
            load: dict[str, Any] = {name: values[row].tolist() for name, values in at_tip.items()}
            load["body_forces"] = [
                one[row] for one in on_bodies if any((*one[row].force, *one[row].moment))
            ]
            if following is not None:
                load["following"] = following[row]
            if mass is not None:
                load["tip_mass"] = float(mass[row])
            try:
                loads.append(ExternalLoad(**load))
            except InputError as problem:
                raise InputError(f"{self.table.at(row)}: {problem}.", problem.code) from None
            has_mass = self.robot.material.density is not None or load.get("tip_mass")
            if any(load.get("gravity", ())) and not has_mass:
                raise InputError.UNSUPPORTED(
                    f"{self.table.at(row)}: gravity has nothing to act on, because the density of "
                    f"{self.robot.name} is not known; give material.density, or a "
                    f"{columns.TIP_MASS}."
                )
        return tuple(loads)

    def _body_forces(self) -> list[list[BodyForce]]:
        """Forces on every body that has columns, row by row."""
        forces: list[list[BodyForce]] = []
        rows = range(len(self.table))
        for body in range(self.robot.number_of_notches + 1):
            vectors = self.vectors(columns.BODY_VECTORS, b=body)
            follows = self.flags(columns.BODY_FOLLOWING.format(b=body)) or [False for _ in rows]
            if vectors:
                vectors = {"force": np.zeros((len(self.table), 3))} | vectors
                lists = {name: values.tolist() for name, values in vectors.items()}
                of_rows = [{name: values[row] for name, values in lists.items()} for row in rows]
                forces.append(
                    [BodyForce(body, **of_rows[row], following=follows[row]) for row in rows]
                )
        return forces
