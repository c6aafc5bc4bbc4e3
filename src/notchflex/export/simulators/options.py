"""Options of models for simulators."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SimulatorOptions:
    """Options of models for simulators of rigid bodies.

    Args:
        largest_tension: Largest tension of the range that the joints are fitted over, N. None for
            that of the load, or without a load for 1.1 times the tension that closes the last notch
            (the one that closes the first, where some notch never closes).
    """

    largest_tension: float | None = None
