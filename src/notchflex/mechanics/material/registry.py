"""From the description of a material to its section law.

A law lives in a file of its own in this folder and registers itself for its description; the
package imports every file of the folder, so no list is kept.
"""

from __future__ import annotations

from functools import singledispatch
from typing import Any

from notchflex.mechanics.material.section_law import SectionLaw


@singledispatch
def section_law(material: Any) -> SectionLaw:
    """Section law of a material of a robot file.

    Args:
        material: A material description, such as `notchflex.Linear(60000.0)`.

    Returns:
        The law, its constants as arrays (MPa).

    Raises:
        TypeError: There is no law for this kind of description.
    """
    raise TypeError(
        f"no section law is registered for a material of type {type(material).__name__}; "
        "add one to notchflex/material with @section_law.register"
    )
