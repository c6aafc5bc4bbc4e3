"""Sliders and number fields of the page."""

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


class _Control:
    """A control of the page; it calls `act` in the solver thread.

    The event loop receives what a person sets, the solver thread shows the current value. A value
    from the page is therefore first queued and then noted as shown: `_show`, which reads in the
    opposite order, cannot overwrite a number while it is being typed. viser's own `handle.value`
    changes earlier than that, so it is not compared.
    """

    def __init__(
        self, viewer: Viewer, handle: Any, key: tuple[str, str], act: Callable[[float], None]
    ) -> None:
        self._viewer, self._handle, self._key, self._act = viewer, handle, key, act
        self._shown = float(handle.value)

        @handle.on_update
        async def _(event: Any) -> None:
            if event.client is not None:
                self._changed(float(handle.value))

    def _changed(self, value: float) -> None:
        self._send(value, PAUSE)
        self._shown = value

    def _show(self, value: float) -> None:
        """Show a value, unless one from the page waits."""
        shown = self._shown
        if not self._viewer.tasks.has(self._key) and abs(shown - value) > 1e-9:
            self._handle.value = self._shown = value

    def _send(self, value: float, pause: float) -> None:
        self._viewer.tasks.add(lambda: self._act(value), self._key, pause)

    def show(self, visible: bool) -> None:
        """Show or hide it."""
        self._handle.visible = visible


class Slider(_Control):
    """A slider that shows the target of a number and sends new ones.

    It always belongs to the same number in the same unit, so what it sends is unambiguous.

    Args:
        viewer: The viewer.
        number: Index in `Controls.numbers`.
        label: Its label, with the unit.
        ends: Least and largest value.
        act: Called with the value by the solver thread.
    """

    def __init__(
        self,
        viewer: Viewer,
        number: int,
        label: str,
        ends: tuple[float, float],
        act: Callable[[float], None],
    ) -> None:
        """Add it at 0."""
        low, high = ends
        handle = viewer.server.gui.add_slider(label, low, high, (high - low) / _FINE, 0.0)
        handle.precision = _digits(high)
        self._number = number
        super().__init__(viewer, handle, ("slider", label), act)

    def _changed(self, value: float) -> None:
        low, high = float(self._handle.min), float(self._handle.max)
        before = self._shown
        if value == min(max(before, low), high) != before:
            self._shown = value
            return  # when it is left, the page itself resets what was typed beyond an end
        jump = abs(value - before) > _JUMP * (high - low)
        self._send(value, PAUSE if jump else 0.0)
        self._shown = value
        if jump:  # at once, though the new value may still be typed
            self._viewer.targets.hold(self._number)

    def stretch(self, ends: tuple[float, float]) -> None:
        """Change its ends."""
        low, high = ends
        if (self._handle.min, self._handle.max) != (low, high):
            self._handle.min, self._handle.max = low, high
            self._handle.step = (high - low) / _FINE
            self._handle.precision = _digits(high)

    def put(self, value: float) -> None:
        """Show a value within its ends, unless one from the page waits."""
        self._show(min(max(float(value), float(self._handle.min)), float(self._handle.max)))


class NumberField(_Control):
    """A number that is typed; it is sent after a pause of typing.

    Args:
        viewer: The viewer.
        key: Unique name of the field.
        label: Its label, with the unit.
        value: Its first value.
        act: Called with the value by the solver thread.
        options: More for viser's `add_number`.
    """

    def __init__(
        self,
        viewer: Viewer,
        key: str,
        label: str,
        value: float,
        act: Callable[[float], None],
        **options: Any,
    ) -> None:
        """Add it."""
        handle = viewer.server.gui.add_number(label, float(value), **options)
        super().__init__(viewer, handle, ("field", key), act)

    def put(self, value: float) -> None:
        """Show a number, unless a typed one waits."""
        self._show(float(value))


class Dropdown:
    """A drop-down list; `act` is called with what a person selects, in the event loop."""

    def __init__(
        self, gui: Any, label: str, options: tuple[str, ...], act: Callable[[str], None],
        value: str | None = None, **more: Any,
    ) -> None:  # fmt: skip
        """Add it."""
        self.handle = gui.add_dropdown(label, options, initial_value=value, **more)

        @self.handle.on_update
        async def _(event: Any) -> None:
            if event.client is not None:
                act(str(self.handle.value))

    def put(self, value: str) -> None:
        """Show a selection."""
        if self.handle.value != value:
            self.handle.value = value


def add_button(gui: Any, label: str, act: Callable[[Any], None], hint: str | None = None) -> None:
    """Add a button; `act` is called with the browser's handle, in the event loop."""

    @gui.add_button(label, hint=hint).on_click
    async def _(event: Any) -> None:
        act(event.client)


def _digits(end: float) -> int:
    """Return the decimals that resolve a slider to an end."""
    return max(4, _DIGITS - math.floor(math.log10(end)))
