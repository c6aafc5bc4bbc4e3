"""A fit on a few lines of text, for a session or a notebook."""

from __future__ import annotations

from typing import TYPE_CHECKING

from notchflex.fit.assessment.diagnosis import NO_PROBLEMS, diagnose, with_unit
from notchflex.fit.assessment.errors_of_parts import edge
from notchflex.fit.assessment.folds import root_mean_squares
from notchflex.fit.estimation.intervals import Interval

if TYPE_CHECKING:
    from notchflex.fit.estimation.calibration import Calibration


def summary(found: Calibration) -> str:
    """Return constants with intervals and units, root-mean-square errors and the diagnosis."""
    state = "converged" if found.converged else f"not converged: {found.reason}"
    lines = [f"{', '.join(found.given)}: {found.counted} numbers measured, {state}"]
    width = max(map(len, found.names))
    for name, value in found.values.items():
        unit, interval = found.units[name], found.intervals.get(name)
        ends = "" if interval is None else f"  95 %: {_ends(interval, unit)}"
        lines.append(f"  {name:<{width}}  {with_unit(value, unit)}{ends}")
    errors = ((edge(name), error) for name, error in root_mean_squares(found.residuals).items())
    said = (f"{title} {error * scale:.3g} {unit}" for (title, unit, scale), error in errors)
    lines.append(f"  rms error: {', '.join(said)}")
    return "\n".join([*lines, *(diagnose(found) or (NO_PROBLEMS,))])


def _ends(interval: Interval, unit: str) -> str:
    if not interval.is_closed:
        ends = ("open" if end is None else f"{end:.5g}" for end in (interval.lower, interval.upper))
        return f"{' to '.join(ends)} {unit}".strip()
    return f"{interval.lower:.5g} to {with_unit(interval.upper or 0.0, unit)}"


__all__ = ["summary"]
