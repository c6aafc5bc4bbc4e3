"""Strips between slots with their roots in the walls: rods, and ranges of validity."""

from notchflex.mechanics.flexure.roots.rooted_strip import RootedStrip, round_strip, sharp_strip
from notchflex.mechanics.flexure.roots.strip_rod import rooted_strip_rod
from notchflex.mechanics.flexure.roots.validity import CheckedRange, left_ranges, wall_ranges

__all__ = [
    "CheckedRange",
    "RootedStrip",
    "left_ranges",
    "rooted_strip_rod",
    "round_strip",
    "sharp_strip",
    "wall_ranges",
]
