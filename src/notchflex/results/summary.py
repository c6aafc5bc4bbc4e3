"""Summaries of results for `repr` and notebooks.

They show only quantities of the first compiled program, so that a summary never compiles another.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from notchflex._summary import Summary, course, short, vector
from notchflex.loads.summary import MOST, external_rows, load_words, tendon_rows
from notchflex.results.quantities.registry import QUANTITIES

if TYPE_CHECKING:
    from notchflex.results.equilibrium import Equilibrium
    from notchflex.results.path import EquilibriumPath
    from notchflex.results.state import State

_ANGLE = QUANTITIES["total_angle"]
_HINT = "[step] is one state; also .plot(), .to_dataframe(), .to_xarray()"


def equilibrium_summary(state: Equilibrium) -> Summary:
    """Summarise one state: load, angle, tip, tendons, and whether it converged."""
    path = state.path
    of = f", step {state.step + 1} of {len(path)}" if len(path) > 1 else ""
    rows = [
        ("load", load_words(state.load)),
        ("total angle", f"{state.total_angle * _ANGLE.scale:.2f} {_ANGLE.unit}"),
        ("notch angles", f"{_few(state.notch_angle * _ANGLE.scale, 1)} {_ANGLE.unit}"),
        ("tip position", f"{vector(state.tip_position, 3)} mm"),
        ("tendon tension", f"{_few(state.tension)} N"),
        ("tendon stroke", f"{_few(state.stroke)} mm"),
    ]
    if not state.converged:
        rows.insert(1, ("not converged", state.reason))
        return Summary(f"Last good state of {path.robot.name}{of}", rows)
    return Summary(f"Equilibrium of {path.robot.name}{of}", [*rows, ("converged", "yes")])


def path_summary(path: EquilibriumPath) -> Summary:
    """Summarise a path: how load, angle and tip change along it, and whether it converged."""
    converged = np.asarray(path.converged)
    rows = list(external_rows(path.load))
    for name, unit, values in (
        ("tension", "N", path.tension),
        ("stroke", "mm", path.stroke),
    ):
        rows += tendon_rows(name, unit, np.where(converged[:, None], values, np.nan))
    angle = np.where(converged, path.total_angle * _ANGLE.scale, np.nan)
    rows.append(("total angle", f"{course(angle, 1)} {_ANGLE.unit}"))
    tips = path.tip_position[converged]
    if len(tips):
        ends = dict.fromkeys(
            vector(tips[step], 2)
            for step in (0, int(np.nanargmax(np.abs(path.total_angle[converged]))), -1)
        )
        rows.append(("tip position", f"{' to '.join(ends)} mm"))
    rows.append(("converged", _converged(path)))
    steps = f"{len(path)} step{'s' * (len(path) != 1)}"
    from_rest = ", each from rest" if path.each_from_rest else ""
    return Summary(f"Path of {path.robot.name}, {steps}{from_rest}", rows, _HINT)


def state_summary(state: State) -> Summary:
    """Summarise a saved state: its robot, and the tensions and strokes of its tendons."""
    point = state.solved.point
    rows = [
        ("tendon tension", f"{_few(np.asarray(point.base_tension))} N"),
        ("tendon stroke", f"{_few(np.asarray(state.solved.stroke))} mm"),
    ]
    hint = "simulate(..., from_state=...) continues from it; .save(file) writes it"
    return Summary(f"State of {state.robot}", rows, hint)


def _converged(path: EquilibriumPath) -> str:
    converged = np.asarray(path.converged)
    if converged.all():
        return "all steps"
    first = int(np.argmin(converged))
    return f"{int(converged.sum())} of {len(path)} steps; step {first + 1}: {path.reason[first]}"


def _few(values: np.ndarray, digits: int | None = None) -> str:
    """Format numbers as a list, of many the first and the last."""
    texts = [
        short(float(value)) if digits is None else f"{round(float(value), digits) + 0.0:.{digits}f}"
        for value in values
    ]
    if len(texts) > 2 * MOST:
        texts = [*texts[:MOST], "…", *texts[-MOST:]]
    return ", ".join(texts)
