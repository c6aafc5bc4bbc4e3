"""A handle at the tip that can be dragged with the mouse."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

if TYPE_CHECKING:
    import viser

NAME = "/target"


class TipHandle:
    """Arrows at the tip, in the frame of the world.

    While a person drags the handle it stays where the mouse is; otherwise it is at the tip.

    Args:
        server: The server.
        size: Length of its arrows, mm.
        aim: Called in the event loop with each place of the handle (mm), and whether it is the
            last one of a drag.
    """

    def __init__(
        self, server: viser.ViserServer, size: float, aim: Callable[[np.ndarray, bool], None]
    ) -> None:
        self._dragged = False
        self._node = server.scene.add_transform_controls(
            NAME, scale=size, disable_rotations=True, depth_test=False, visible=False
        )

        @self._node.on_update
        async def _(event: Any) -> None:
            last = event.phase == "end"
            self._dragged = not last
            aim(np.array(event.target.position, float), last)

    def update(self, tip: Float[np.ndarray, " 3"], shown: bool) -> None:
        """Show or hide it, and move it to the tip unless it is dragged."""
        self.show(shown)
        if shown and not self._dragged and not np.array_equal(self._node.position, tip):
            self._node.position = tip

    def show(self, shown: bool) -> None:
        """Show or hide it."""
        if self._node.visible != shown:
            self._node.visible = shown

    def remove(self) -> None:
        """Remove it."""
        self._node.remove()
