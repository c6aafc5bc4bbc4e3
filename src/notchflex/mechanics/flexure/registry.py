"""From the description of a notch to its rod.

A notch shape lives in a file of its own in this folder and registers itself for its description;
the package imports every file of the folder, so no list is kept.
"""

from __future__ import annotations

from functools import singledispatch
from typing import Any

from notchflex.mechanics.flexure.rod import Rod
from notchflex.robot import Tube


@singledispatch
def rod(notch: Any, tube: Tube, refinement: int = 0) -> Rod:
    """Rod of one notch.

    Args:
        notch: A notch description, such as `notchflex.ArcNotch(...)`.
        tube: The tube it is cut into.
        refinement: 0 has the modes that serve for usual loads; 1, 2 ... has more.

    Returns:
        The rod, in mm and rad.

    Raises:
        TypeError: There is no rod for this kind of description.
    """
    del tube, refinement
    raise TypeError(
        f"no rod is registered for a notch of type {type(notch).__name__}; "
        "add one to notchflex/flexure with @rod.register"
    )
