"""Scale of photographs: from the robot itself, a number, or a board beside it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex.errors import InputError
from notchflex.photographs.board.layout import Board
from notchflex.photographs.board.sighting import Sighting, sight
from notchflex.photographs.chain.chain_table import Numbers
from notchflex.photographs.chain.view_prior import NO_PRIOR, ViewPrior
from notchflex.photographs.contrast import Contrast

_KNOWN = 0.003
"""How well a scale that is given as a number is known, as a part of it."""


@dataclass(frozen=True)
class Ruler:
    """Information about the scale of all photographs, beside the outer diameter of the robot.

    Attributes:
        scale: Pixels of the photographs per mm, at the robot; None if it is not given.
        board: Board beside the robot, in the plane in which it bends.
    """

    scale: float | None = None
    board: Board | None = None

    def __post_init__(self) -> None:
        """Check both.

        Raises:
            InputError: Both are given, or one is not a scale or not a board.
        """
        scale: Any = self.scale
        if scale is not None:
            if self.board is not None:
                raise InputError.CONFLICT("a board gives the scale too; leave out scale or board")
            if isinstance(scale, bool) or not isinstance(scale, (int, float, np.number)):
                raise InputError.WRONG_TYPE(f"scale must be a number of px/mm, not {scale!r}")
            if not 0.0 < scale < math.inf:
                raise InputError.OUT_OF_RANGE(f"scale must be above 0 px/mm, not {scale:g}")
        if self.board is not None:
            self.board.opencv_dictionary()

    def read(self, picture: NDArray[np.uint8], factor: float) -> RulerReading | str:
        """Read the scale from a photograph, (height, width, 3); return why the board is not found.

        Args:
            picture: The photograph.
            factor: By how much it was made smaller.
        """
        if self.scale is not None:
            return RulerReading(ViewPrior(self.scale * factor, _KNOWN))
        if self.board is None:
            return RulerReading()
        sighting = sight(picture, self.board)
        return sighting if isinstance(sighting, str) else RulerReading(board=sighting)


@dataclass(frozen=True)
class RulerReading:
    """What a ruler gives for one photograph: a prior of the view.

    Attributes:
        everywhere: Prior for the whole photograph.
        board: The board that is seen.
    """

    everywhere: ViewPrior = NO_PRIOR
    board: Sighting | None = None

    def prior(self, position: Numbers) -> ViewPrior:
        """Return the prior of the view of a robot at a position in the photograph, px."""
        return self.everywhere if self.board is None else self.board.prior(position)

    def hidden(self, contrast: Contrast) -> Contrast:
        """Return the contrast of the photograph without the board."""
        return contrast if self.board is None else self.board.hidden(contrast)


NO_RULER = Ruler()
