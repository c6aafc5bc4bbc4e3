"""Options of decks of finite elements."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

from notchflex.errors import InputError

Mesh = Literal["coarse", "medium", "fine"]
_MESHES = {"coarse": (1, 3, 4, 3, 4), "medium": (1, 5, 6, 6, 8), "fine": (2, 8, 8, 10, 12)}


@dataclass(frozen=True)
class DeckOptions:
    """Options of a deck of finite elements.

    Args:
        wall: Elements through the wall.
        spine: Elements over half the arc that a notch leaves.
        opening: Elements over half the opening of a notch.
        notch: Elements along a notch.
        uncut: Elements along an uncut length.
        contact: Whether the faces of the notches may touch.
        tip_moment: A moment on the end of the tube, which it keeps plane, toward the notches, N mm.
    """

    wall: int = 1
    spine: int = 5
    opening: int = 6
    notch: int = 6
    uncut: int = 8
    contact: bool = True
    tip_moment: float = 0.0

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name in ("wall", "spine", "opening", "notch", "uncut"):
            value: Any = getattr(self, name)
            if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value <= 100:
                raise InputError.OUT_OF_RANGE(
                    f"{name} must be a whole number from 1 to 100; got {value!r}"
                )
        if not math.isfinite(self.tip_moment):
            raise InputError.NOT_FINITE(f"tip_moment must be finite; got {self.tip_moment}")

    @classmethod
    def of_mesh(cls, mesh: Mesh, **options: Any) -> DeckOptions:
        """Return the options with one of three meshes.

        Args:
            mesh: "coarse", "medium" or "fine".
            **options: Other options.

        Raises:
            InputError: No such mesh.
        """
        if mesh not in _MESHES:
            raise InputError.UNKNOWN_NAME(f"there is no mesh {mesh!r}; give {', '.join(_MESHES)}")
        names = ("wall", "spine", "opening", "notch", "uncut")
        return cls(**dict(zip(names, _MESHES[mesh], strict=True)), **options)
