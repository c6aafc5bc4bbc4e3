"""A slider for one of the numbers that load the robot, with the field beside it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from notchflex.viewer.tasks import PAUSE

if TYPE_CHECKING:
    from notchflex.viewer.viewer import Viewer

_FINE = 200  # steps of a slider from end to end
_JUMP = 0.03  # a larger part of the slider at once was typed or clicked, not dragged
_DIGITS = 3  # of the smallest step that a field shows, at least


class Slider:
    """A slider that shows where the robot goes, and sends it elsewhere.

    It always stands for the same number in the same unit, so what it sends cannot be mistaken.

    Args:
        viewer: What it acts on.
        number: Place in `Controls.numbers`.
        label: Its text, with the unit.
        ends: Least and largest value.
        moved: Called with the value by the thread that solves.
    """

    def __init__(
        self,
        viewer: Viewer,
        number: int,
        label: str,
        ends: tuple[float, float],
        moved: Callable[[float], None],
    ) -> None:
        """Add it at 0."""
        self._viewer, self._key = viewer, ("slider", label)
        low, high = ends
        self._handle = viewer.server.gui.add_slider(label, low, high, (high - low) / _FINE, 0.0)
        self._handle.precision = _digits(high)
        self._heard = 0.0  # the value before

        @self._handle.on_update
        async def _(event: Any) -> None:
            if event.client is None:
                return
            value = float(self._handle.value)
            low, high = float(self._handle.min), float(self._handle.max)
            before, self._heard = self._heard, value
            if value == min(max(before, low), high) != before:
                return  # the page itself puts back, when it is left, what was typed beyond an end
            jump = abs(value - before) > _JUMP * (high - low)
            if jump:  # at once, though the new value may still be typed
                viewer.way.hold(number)
            viewer.tasks.add(lambda: moved(value), self._key, PAUSE if jump else 0.0)

    def show(self, visible: bool) -> None:
        """Show it on the page or not."""
        self._handle.visible = visible

    def stretch(self, ends: tuple[float, float]) -> None:
        """Let it go to other ends."""
        low, high = ends
        if (self._handle.min, self._handle.max) != (low, high):
            self._handle.min, self._handle.max = low, high
            self._handle.step = (high - low) / _FINE
            self._handle.precision = _digits(high)

    def put(self, value: float) -> None:
        """Put it where the robot goes, but not while a value that it sent waits to be obeyed."""
        if self._viewer.tasks.has(self._key):
            return
        value = min(max(float(value), float(self._handle.min)), float(self._handle.max))
        self._heard = value
        if abs(float(self._handle.value) - value) > 1e-9:
            self._handle.value = value


class Field:
    """A number that is typed; it is obeyed when typing pauses.

    Args:
        viewer: What it acts on.
        key: What tells it from all other fields.
        label: Its text, with the unit.
        value: What it shows first.
        typed: Called with the value by the thread that solves.
        options: More for viser's `add_number`.
    """

    def __init__(
        self,
        viewer: Viewer,
        key: str,
        label: str,
        value: float,
        typed: Callable[[float], None],
        **options: Any,
    ) -> None:
        """Add it."""
        self._viewer, self._key = viewer, ("field", key)
        self._handle = viewer.server.gui.add_number(label, float(value), **options)

        @self._handle.on_update
        async def _(event: Any) -> None:
            if event.client is not None:
                value = float(self._handle.value)
                viewer.tasks.add(lambda: typed(value), self._key, PAUSE)

    def show(self, visible: bool) -> None:
        """Show it on the page or not."""
        self._handle.visible = visible

    def put(self, value: float) -> None:
        """Show another number, unless one that was typed waits to be obeyed."""
        if not self._viewer.tasks.has(self._key) and self._handle.value != value:
            self._handle.value = float(value)


def _digits(end: float) -> int:
    """Decimals that resolve a slider to an end."""
    return max(4, _DIGITS - math.floor(math.log10(end)))


__all__ = ["Field", "Slider"]
