"""Photographs of bent robots: the angle of every notch, with standard deviations."""

from notchflex.photographs.measure import measure
from notchflex.photographs.measured import MeasuredPhotograph, MeasuredPhotographs

__all__ = ["MeasuredPhotograph", "MeasuredPhotographs", "measure"]
