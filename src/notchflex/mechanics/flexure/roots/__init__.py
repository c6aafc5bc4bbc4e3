"""Strips between slots with the walls that they turn into: their rods, and where these hold."""

from notchflex.mechanics.flexure.roots.rooted_strip import RootedStrip as RootedStrip
from notchflex.mechanics.flexure.roots.rooted_strip import round_strip as round_strip
from notchflex.mechanics.flexure.roots.rooted_strip import sharp_strip as sharp_strip
from notchflex.mechanics.flexure.roots.strip_rod import rooted_strip_rod as rooted_strip_rod
from notchflex.mechanics.flexure.roots.validity import CheckedRange as CheckedRange
from notchflex.mechanics.flexure.roots.validity import left_ranges as left_ranges
from notchflex.mechanics.flexure.roots.validity import wall_ranges as wall_ranges
