"""Sliders, number fields, lists and buttons of the page."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from notchflex.viewer.tasks import PAUSE, Task

if TYPE_CHECKING:
    from notchflex.viewer.viewer import Viewer

_FINE = 200  # steps of a slider from end to end
_JUMP = 0.03  # a larger part of the slider at once was typed or clicked, not dragged
_DIGITS = 3  # of the smallest step that a field shows, at least


class NumberField:
    """A field of viser (`handle`); `act` gets a typed number in the solver thread, after a pause.

    The event loop receives what a person sets, the solver thread shows the current value. A value
    from the page is therefore first queued and then noted as shown: `put`, which reads in the
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

    def _send(self, value: float, pause: float, now: Task | None = None) -> None:
        self._viewer.tasks.add(lambda: self._act(value), self._key, pause, now)
        self._shown = value

    def put(self, value: float) -> None:
        """Show a number, unless one from the page waits."""
        shown = self._shown
        if not self._viewer.tasks.has(self._key) and abs(shown - value) > 1e-9:
            self._handle.value = self._shown = float(value)

    def show(self, visible: bool) -> None:
        """Show or hide it."""
        self._handle.visible = visible


class Slider(NumberField):
    """A slider for one of the `Controls.numbers`, always in the unit of its label."""

    def __init__(
        self,
        viewer: Viewer,
        number: int,
        label: str,
        ends: tuple[float, float],
        act: Callable[[float], None],
    ) -> None:
        self._number, (low, high) = number, ends
        handle = viewer.server.gui.add_slider(label, low, high, (high - low) / _FINE, 0.0)
        super().__init__(viewer, handle, ("slider", label), act)
        self._divide()

    def _divide(self) -> None:
        """Set steps, and decimals that resolve them."""
        low, high = self._handle.min, self._handle.max
        self._handle.step = (high - low) / _FINE
        self._handle.precision = max(4, _DIGITS - math.floor(math.log10(high)))

    def _changed(self, value: float) -> None:
        low, high = float(self._handle.min), float(self._handle.max)
        before = self._shown
        if value == min(max(before, low), high) != before:
            self._shown = value
            return  # when it is left, the page itself resets what was typed beyond an end
        jump = abs(value - before) > _JUMP * (high - low)
        if not jump:
            self._send(value, 0.0)
        else:  # the robot holds at once, though the new value may still be typed
            self._send(value, PAUSE, lambda: self._viewer.targets.hold(self._number))

    def stretch(self, ends: tuple[float, float]) -> None:
        """Change its ends."""
        if (self._handle.min, self._handle.max) != ends:
            self._handle.min, self._handle.max = ends
            self._divide()

    def put(self, value: float) -> None:
        """Show a value within its ends, unless one from the page waits."""
        super().put(min(max(float(value), float(self._handle.min)), float(self._handle.max)))


class Dropdown:
    """A drop-down list; `act` is called with what a person selects, in the event loop."""

    def __init__(
        self, gui: Any, label: str, options: tuple[str, ...], act: Callable[[str], None],
        value: str | None = None, **more: Any,
    ) -> None:  # fmt: skip
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
