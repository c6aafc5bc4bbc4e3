"""Tendons: their way through the bodies, with lengths, turning angles and pulls."""

from notchflex.tendon.crossing import Crossing, TendonGroup
from notchflex.tendon.routing import Ground, Laid, route

__all__ = ["Crossing", "Ground", "Laid", "TendonGroup", "route"]
