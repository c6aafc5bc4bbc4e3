"""Sweeps: many robots under the same loads, in stored pieces, resumed after an interruption."""

from notchflex.sweeping.plan import SweepPlan, plan_schema, read_plan
from notchflex.sweeping.sweep import Estimate, Sweep, estimate, read_sweep, sweep

__all__ = ["Estimate", "Sweep", "SweepPlan"]
__all__ += ["estimate", "plan_schema", "read_plan", "read_sweep", "sweep"]
