"""Writes src/notchflex/results/quantities/properties.py from the one table of quantities.

`python docs/make/quantity_properties.py`; a test compares the file with `module()`. Type checkers,
editors and Tab completion read written properties, so they are written out, and only by this.
"""

from __future__ import annotations

import textwrap
from pathlib import Path

from notchflex.results.quantities.quantity import Quantity
from notchflex.results.quantities.registry import QUANTITIES

FILE = Path(__file__).resolve().parents[2] / "src/notchflex/results/quantities/properties.py"
WIDTH = 100
HEAD = '''\
"""Typed properties for every quantity of a path and of an equilibrium.

Written by `docs/make/quantity_properties.py` from `results/quantities/registry.py`: change it there.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

'''
CLASSES = {
    "PathQuantities": (
        "Quantities of every step: s steps, n notches, t tendons, n + 1 bodies.",
        ("s",),
    ),
    "EquilibriumQuantities": (
        "Quantities of one equilibrium: n notches, t tendons, n + 1 bodies.",
        (),
    ),
}
ARRAYS = {float: "Float", bool: "Bool", int: "Int"}


def module() -> str:
    """Return the text of the module."""
    made = [_class(name, *about) for name, about in CLASSES.items()]
    names = ", ".join(f'"{name}"' for name in sorted(CLASSES))
    return HEAD + "\n" + "\n\n".join(made) + f"\n\n__all__ = [{names}]\n"


def _class(name: str, text: str, leading: tuple[str, ...]) -> str:
    getter = (
        "    def quantity(self, name: str) -> Any:\n"
        '        """Return a quantity by its name."""\n'
        "        raise NotImplementedError\n"
    )
    properties = [_property(quantity, leading) for quantity in QUANTITIES.values()]
    return f'class {name}:\n    """{text}"""\n\n' + "\n".join([getter, *properties])


def _property(quantity: Quantity, leading: tuple[str, ...]) -> str:
    shape = (*leading, *quantity.shape)
    unit = f", {quantity.python_unit}" if quantity.python_unit else ""
    sizes = f", shape ({', '.join(shape)}{',' * (len(shape) == 1)})" if shape else ""
    title = quantity.title[0].upper() + quantity.title[1:]
    text = " ".join(part for part in (quantity.description, quantity.note) if part)
    if {"span", "contact"} & set(quantity.per):
        text += " NaN beyond the end of a tendon." if quantity.kind is float else ""
    body = textwrap.fill(text, WIDTH - 8)
    lines = [
        "@property",
        f"def {quantity.name}(self) -> {_type(quantity, shape)}:",
        f'    """{title}{unit}{sizes}.',
        "",
        textwrap.indent(body, "    "),
        '    """',
        f'    return self.quantity("{quantity.name}")',
    ]
    return textwrap.indent("\n".join(lines), "    ") + "\n"


def _type(quantity: Quantity, shape: tuple[str, ...]) -> str:
    if not shape:
        return quantity.kind.__name__
    if quantity.kind is str:
        return "list[str]"
    sizes = " ".join(shape)
    # A single name would be taken for a variable that is not defined.
    named = f" {sizes}" if len(shape) == 1 else sizes
    return f'{ARRAYS[quantity.kind]}[np.ndarray, "{named}"]'


if __name__ == "__main__":
    FILE.write_text(module(), encoding="utf-8")
