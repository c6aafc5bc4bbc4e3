"""Tendons: their way through the bodies, with lengths, turning angles and pulls."""

from notchflex.mechanics.tendon.crossing import Crossing, TendonGroup
from notchflex.mechanics.tendon.routing import Ground, Laid, route

__all__ = ["Crossing", "Ground", "Laid", "TendonGroup", "route"]
