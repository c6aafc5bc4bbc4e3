"""Tendons: their way through the bodies, with lengths, turning angles and pulls."""

from notchflex.mechanics.tendon.crossing import Crossing, TendonGroup
from notchflex.mechanics.tendon.routing import RoutedTendons, RoutingContext, route

__all__ = ["Crossing", "RoutingContext", "RoutedTendons", "TendonGroup", "route"]
