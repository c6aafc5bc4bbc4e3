"""Closed forms that solids are compared with."""

import math

import notchflex as nf


def volume_of_windows(robot, length):
    """The volume of a tube of a length with windows [mm3]."""
    tube = robot.tube
    ring = math.pi * (tube.outer_radius**2 - tube.inner_radius**2)
    make = {"on-axis": nf.annular_sector, "off-axis": nf.annular_segment}
    lost = 0.0
    for notch in robot.notches:
        depth = notch.section_depth(tube)
        left = make[notch.cut](tube.outer_radius, tube.inner_radius, depth).area
        lost += notch.height * (ring - float(left))
    return ring * length - lost
