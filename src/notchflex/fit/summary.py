"""Fits as text."""

from __future__ import annotations

from notchflex.fit.assessment.diagnosis import NO_PROBLEMS, diagnose, with_unit
from notchflex.fit.assessment.errors_of_parts import edge
from notchflex.fit.estimation.calibration import Calibration
from notchflex.fit.estimation.intervals import Interval


def summary(calibration: Calibration) -> str:
    """Return constants with intervals and units, root-mean-square errors and the diagnosis."""
    state = "converged" if calibration.converged else f"not converged: {calibration.reason}"
    lines = [f"{', '.join(calibration.given)}: {calibration.counted} numbers measured, {state}"]
    width = max(map(len, calibration.names))
    for name, value in calibration.values.items():
        unit, interval = calibration.units[name], calibration.intervals.get(name)
        ends = "" if interval is None else f"  95 %: {_ends(interval, unit)}"
        lines.append(f"  {name:<{width}}  {with_unit(value, unit)}{ends}")
    errors = [
        f"{edge(name)[0]} {error * edge(name)[2]:.3g} {edge(name)[1]}"
        for name, error in calibration.residuals.root_mean_squares().items()
    ]
    lines.append(f"  rms error: {', '.join(errors)}")
    return "\n".join([*lines, *(diagnose(calibration) or (NO_PROBLEMS,))])


def _ends(interval: Interval, unit: str) -> str:
    ends = ("open" if end is None else f"{end:.5g}" for end in (interval.lower, interval.upper))
    return f"{' to '.join(ends)} {unit}".strip()
