"""Sweeps: many robots under the same loads, in stored pieces, resumed after an interruption."""

from notchflex.sweeping.plan import SweepPlan, read_plan
from notchflex.sweeping.result import Sweep, read_sweep
from notchflex.sweeping.sweep import sweep

__all__ = ["Sweep", "SweepPlan", "read_plan", "read_sweep", "sweep"]
