"""A quantity of a result: what it is called, what it is measured in, where it stands in files."""

from __future__ import annotations

from dataclasses import dataclass

_SIZES = {
    "tendon": "t",
    "notch": "n",
    "body": "bodies",
    "row": "3",
    "axis": "3",
    "span": "spans",
    "contact": "contacts",
}
"""The size of every axis that a quantity may have."""


@dataclass(frozen=True)
class Quantity:
    """One quantity of a solved state, and how it is written at the edges.

    Attributes:
        name: The attribute of `EquilibriumPath` and `Equilibrium` that holds it.
        title: What an axis or a table calls it, without its unit.
        symbol: The symbol, as mathtext.
        unit: The unit at the edges; "" for numbers without one.
        description: One sentence that says exactly what it is.
        key: The key in a step of the JSON document; a dot goes one object deeper. "" if left out.
        column: The CSV column; `{tendon}`, `{notch}`, `{axis}` and `{span}` are filled in.
            "" where it has no column.
        per: What its entries stand for within one step, outermost first: "tendon", "notch",
            "body", "axis", "span", "contact", "row". Empty for a single number.
        scale: The factor from the inside of the program to the edge (rad to deg).
        optional: Whether it is left out of files where no entry of a path holds a number.
        kind: What an entry is: `float`, `bool`, `int` or `str`.
        note: Sentences for the documentation of the Python property.
    """

    name: str
    title: str
    symbol: str
    unit: str
    description: str
    key: str
    column: str
    per: tuple[str, ...] = ()
    scale: float = 1.0
    optional: bool = False
    kind: type = float
    note: str = ""

    @property
    def python_unit(self) -> str:
        """The unit inside Python: rad for what files have in degrees."""
        return "rad" if self.unit == "deg" else self.unit

    @property
    def shape(self) -> tuple[str, ...]:
        """The sizes of its axes within one step, by letter or number.

        n notches, t tendons, n + 1 bodies, and 3 for x, y, z.

        Example:
            >>> from notchflex.results.quantities.registry import QUANTITIES
            >>> QUANTITIES["body_position"].shape
            ('bodies', '3')
        """
        return tuple(_SIZES[axis] for axis in self.per)

    @property
    def label(self) -> str:
        r"""The label of an axis: title, symbol and unit.

        Example:
            >>> from notchflex.results.quantities.registry import QUANTITIES
            >>> QUANTITIES["total_angle"].label
            'total bending angle $\\theta$ [deg]'
        """
        parts = [self.title, f"${self.symbol}$" if self.symbol else ""]
        parts.append(f"[{self.unit}]" if self.unit else "")
        return " ".join(part for part in parts if part)

    def header(self, **indices: object) -> str:
        """Return the CSV column for the given indices.

        Args:
            **indices: `tendon`, `notch` (counted from 1), `axis` ("x", "y", "z") or `span`.
                `tendon=""` is written for the only tendon of a robot.

        Returns:
            The header, for example `notch_3_deg`.

        Example:
            >>> from notchflex.results.quantities.registry import QUANTITIES
            >>> QUANTITIES["tension"].header(tendon="")
            'tendon_force_N'
            >>> QUANTITIES["tension"].header(tendon=2)
            'tendon_2_force_N'
        """
        if "tendon" in indices:
            indices["tendon"] = f"_{indices['tendon']}" if indices["tendon"] != "" else ""
        return self.column.format(**indices)
