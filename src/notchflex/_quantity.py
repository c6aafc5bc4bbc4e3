"""The registry of quantities: each is registered once, beside its formula, by a decorator.

Typed properties, JSON keys, CSV columns, the attributes of xarray, outputs of batches, axes of
pictures and the documentation follow from it. Inside Python: mm, N, MPa, rad. At the edges (files,
pictures, terminal): mm, N, MPa, deg; `Quantity.scale` takes a number from the inside to the edge.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from typing import Any, Literal, TypeVar

DEGREES = 180.0 / math.pi

_Formula = TypeVar("_Formula", bound=Callable[[Any], Any])
Source = Literal["solve", "state", "derived", "path"]
"""Where a formula is evaluated: in the program that solves a load, in a second program for what is
asked of a solved state, from other quantities of a state wherever those are, or from a whole path.
"""

_SIZES = {
    "tendon": "t",
    "notch": "n",
    "body": "bodies",
    "row": "3",
    "axis": "3",
    "span": "spans",
    "contact": "contacts",
    "node": "nodes",
}
"""The size of every axis that a quantity may have."""


def axis_sizes(notches: int, tendons: int) -> dict[str, int]:
    """Return the sizes of the axes that follow from the numbers of notches and tendons."""
    return {"tendon": tendons, "notch": notches, "body": notches + 1, "row": 3, "axis": 3}


@dataclass(eq=False)
class Quantity:
    """One quantity of a solved state, and how it is written at the edges; decorates its formula.

    The name of the formula becomes the name of the quantity: the attribute of `EquilibriumPath` and
    `Equilibrium`. The docstring becomes its description. The argument of the formula is the state
    or the path.

    Attributes:
        source: Where its formula is evaluated.
        title: What an axis or a table calls it, without its unit; "" for what only the solver uses.
        symbol: The symbol, as mathtext.
        unit: The unit at the edges; "" for numbers without one. What is in "deg" is in rad inside.
        key: The key in a step of the JSON document; a dot goes one object deeper. "" if left out.
        column: The CSV column; `{tendon}`, `{notch}`, `{axis}` and `{span}` are filled in.
            "" where it has no column.
        per: What its entries stand for within one step, outermost first: "tendon", "notch",
            "body", "axis", "span", "contact", "row", "node". Empty for a single number.
        after: Name of the quantity that it follows in tables; "" for the first place, None for the
            last.
        in_world: Whether the formula's vectors or rotations, which are in the frame of the base,
            are turned into the world.
        optional: Tells which entries of a step a path has, by its robot and loads and never by its
            results; where it has none the quantity is left out of files. None where all have all.
        kind: What an entry is: `float`, `bool`, `int` or `str`.
        work_of: Names of the force and the length that it is the work of, if it is one; batches
            integrate them too.
        note: More sentences for the documentation of the Python property.
    """

    source: Source
    title: str = ""
    symbol: str = ""
    unit: str = ""
    _: KW_ONLY
    key: str = ""
    column: str = ""
    per: tuple[str, ...] = ()
    after: str | None = None
    in_world: bool = False
    optional: Callable[[Any], Any] | None = None
    kind: type = float
    work_of: tuple[str, ...] = ()
    note: str = ""

    def __call__(self, formula: _Formula) -> _Formula:
        """Register a formula as this quantity."""
        self.name, self.formula = formula.__name__, formula
        self.description = " ".join((formula.__doc__ or "").split())
        entries, names = list(REGISTERED.items()), ["", *REGISTERED]
        if self.name in names:
            raise ValueError(f"the quantity {self.name} is registered twice")
        place = len(entries) if self.after is None else names.index(self.after)
        entries.insert(place, (self.name, self))
        REGISTERED.clear()
        REGISTERED.update(entries)
        return formula

    def turned(self, values: Any, rotation: Any) -> Any:
        """Return values of it, or changes of them, turned by a rotation; numbers stay.

        Everything that returns results in the world uses it: paths, batches, derivatives, control.

        Args:
            values: Vectors, or rotation matrices, with any leading axes, or other values.
            rotation: Rotation matrix, such as `LoadPath.base_to_world`; None for the identity.
        """
        if rotation is None or not self.in_world:
            return values
        return rotation @ values if "row" in self.per else values @ rotation.T

    @property
    def scale(self) -> float:
        """The factor from the inside of the program to the edge (rad to deg)."""
        return DEGREES if self.unit == "deg" else 1.0

    @property
    def python_unit(self) -> str:
        """The unit inside Python: rad for what files have in degrees."""
        return "rad" if self.unit == "deg" else self.unit

    @property
    def shape(self) -> tuple[str, ...]:
        """The sizes of its axes within one step, by letter or number.

        n notches, t tendons, n + 1 bodies, and 3 for x, y, z.

        Example:
            >>> from notchflex.results.quantities import QUANTITIES
            >>> QUANTITIES["body_position"].shape
            ('bodies', '3')
        """
        return tuple(_SIZES[axis] for axis in self.per)

    @property
    def label(self) -> str:
        r"""The label of an axis: title, symbol and unit.

        Example:
            >>> from notchflex.results.quantities import QUANTITIES
            >>> QUANTITIES["total_angle"].label
            'total bending angle $\\theta$ [deg]'
        """
        parts = [self.title, f"${self.symbol}$" if self.symbol else ""]
        parts.append(f"[{self.unit}]" if self.unit else "")
        return " ".join(part for part in parts if part)

    @property
    def summary(self) -> str:
        """Title, unit and shape in one step, as the docstring of the property begins."""
        sizes = f", shape ({', '.join(self.shape)})" if self.per else ""
        unit = f", {self.python_unit}" if self.python_unit else ""
        return f"{self.title[:1].upper()}{self.title[1:]}{unit}{sizes}."

    @property
    def text(self) -> str:
        """Description and notes: what the documentation of the property says."""
        beyond = self.kind is float and {"span", "contact"} & set(self.per)
        last = "NaN beyond the end of a tendon." if beyond else ""
        return " ".join(part for part in (self.description, self.note, last) if part)

    def header(self, **indices: object) -> str:
        """Return the CSV column for the given indices.

        Args:
            **indices: `tendon`, `notch` (counted from 1), `axis` ("x", "y", "z") or `span`.
                `tendon=""` is written for the only tendon of a robot.

        Returns:
            The header, for example `notch_3_deg`.

        Example:
            >>> from notchflex.results.quantities import QUANTITIES
            >>> QUANTITIES["tension"].header(tendon="")
            'tendon_force_N'
            >>> QUANTITIES["tension"].header(tendon=2)
            'tendon_2_force_N'
        """
        if "tendon" in indices:
            indices["tendon"] = f"_{indices['tendon']}" if indices["tendon"] != "" else ""
        return self.column.format(**indices)


REGISTERED: dict[str, Quantity] = {}
"""Every quantity by its name, in the order of tables and files."""
