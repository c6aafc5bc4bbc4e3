"""Strips between slots with their roots in the walls: rods, and ranges of validity."""

from notchflex.mechanics.flexure.roots.rooted_strip import RootedStrip as RootedStrip
from notchflex.mechanics.flexure.roots.rooted_strip import round_strip as round_strip
from notchflex.mechanics.flexure.roots.rooted_strip import sharp_strip as sharp_strip
from notchflex.mechanics.flexure.roots.strip_rod import rooted_strip_rod as rooted_strip_rod
from notchflex.mechanics.flexure.roots.validity import CheckedRange as CheckedRange
from notchflex.mechanics.flexure.roots.validity import left_ranges as left_ranges
from notchflex.mechanics.flexure.roots.validity import wall_ranges as wall_ranges
