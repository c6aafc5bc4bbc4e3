"""The plan of a sweep: the file, its checks and its schema."""

from notchflex.sweeping.plan.parts import SweepPlan
from notchflex.sweeping.plan.reading import read_plan

__all__ = ["SweepPlan", "read_plan"]
