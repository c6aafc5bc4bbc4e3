"""Summaries of loads and results: what `repr` and a notebook show of them.

Only quantities of the first compiled program are shown, so that a summary never compiles another.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from notchflex._summary import Summary, course, short, vector
from notchflex.results.quantities.registry import QUANTITIES

if TYPE_CHECKING:
    from notchflex.analysis import Batch, Closing
    from notchflex.loads import ExternalLoad, Load, LoadPath
    from notchflex.results.equilibrium import Equilibrium
    from notchflex.results.path import EquilibriumPath
    from notchflex.results.state import State

MOST = 4
"""Tendons, notches or outputs that have a line each; of more, the first."""

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
    good = np.asarray(path.converged)
    rows = list(_external_rows(path.load))
    for name, unit, values in (
        ("tension", "N", path.tension),
        ("stroke", "mm", path.stroke),
    ):
        rows += _by_tendon(name, unit, np.where(good[:, None], values, np.nan))
    angle = np.where(good, path.total_angle * _ANGLE.scale, np.nan)
    rows.append(("total angle", f"{course(angle, 1)} {_ANGLE.unit}"))
    tips = path.tip_position[good]
    if len(tips):
        ends = dict.fromkeys(
            vector(tips[step], 2)
            for step in (0, int(np.nanargmax(np.abs(path.total_angle[good]))), -1)
        )
        rows.append(("tip position", f"{' to '.join(ends)} mm"))
    rows.append(("converged", _converged(path)))
    steps = f"{len(path)} step{'s' * (len(path) != 1)}"
    from_rest = ", each from rest" if path.each_from_rest else ""
    return Summary(f"Path of {path.robot.name}, {steps}{from_rest}", rows, _HINT)


def load_path_summary(load: LoadPath) -> Summary:
    """Summarise a load path: what is commanded of every tendon, and the external loads."""
    rows: list[tuple[str, str]] = []
    for name, unit, values in (("tension", "N", load.tension), ("stroke", "mm", load.stroke)):
        rows += _by_tendon(name, unit, values, commanded=True)
    rows += _external_rows(load)
    if load.base_rotation.any():
        rows.append(("base rotation", f"{vector(load.base_rotation)} rad"))
    steps = f"{len(load)} step{'s' * (len(load) != 1)}"
    return Summary(f"Load path of {steps}", rows)


def batch_summary(batch: Batch) -> Summary:
    """Summarise a batch: its rows, and shape and range of every output."""
    rows: list[tuple[str, str]] = []
    count = 0
    for name, array in batch.items():
        count = len(array)
        quantity = QUANTITIES.get(name)
        unit = f" {quantity.python_unit}" if quantity and quantity.python_unit else ""
        shape = "×".join(map(str, array.shape))
        if array.dtype == bool:
            text = f"{int(array.sum())} of {array.size} true"
        elif np.isfinite(array).any():
            text = f"{short(float(np.nanmin(array)))} to {short(float(np.nanmax(array)))}{unit}"
        else:
            text = "no number"
        rows.append((name, f"{shape}, {text}"))
    title = f"Batch of {count} row{'s' * (count != 1)}"
    return Summary(title, rows, "[name] is the array of one output")


def state_summary(state: State) -> Summary:
    """Summarise a saved state: whose it is, and what its tendons carry."""
    point = state.solved.point
    rows = [
        ("tendon tension", f"{_few(np.asarray(point.base_tension))} N"),
        ("tendon stroke", f"{_few(np.asarray(state.solved.stroke))} mm"),
    ]
    hint = "simulate(..., from_state=...) continues from it; .save(file) writes it"
    return Summary(f"State of {state.robot}", rows, hint)


def closing_summary(closing: Closing) -> Summary:
    """Summarise when the notches close, each notch on a line."""
    rows = [
        (
            f"notch {notch + 1}",
            f"{short(float(angle) * _ANGLE.scale)} {_ANGLE.unit}, "
            + (f"{short(float(tension))} N" if tension == tension else "no tension found"),
        )
        for notch, (angle, tension) in enumerate(zip(closing.angle, closing.tension, strict=True))
    ]
    left = len(rows) - 3 * MOST
    hint = f"and {left} more notches" if left > 0 else ""
    return Summary("Closing of every notch", rows[: 3 * MOST], hint)


def load_words(load: Load) -> str:
    """Return a load in words: what is commanded of every tendon, and the external loads.

    Example:
        >>> from notchflex import Load
        >>> load_words(Load(tension=2.0, tip_force=(0.0, 0.1, 0.0)))
        'tension 2 N, tip force (0, 0.1, 0) N'
    """
    words: list[str] = []
    for name, unit in (("tension", "N"), ("stroke", "mm")):
        given = getattr(load, name)
        several = given if isinstance(given, (list, tuple)) else [given]
        for tendon, value in enumerate(several, start=1):
            if value is not None:
                which = f"tendon {tendon} " if len(several) > 1 else ""
                words.append(f"{which}{name} {short(value)} {unit}")
    words += external_words(load)
    return ", ".join(words) or "none"


def external_words(load: ExternalLoad) -> list[str]:
    """Return the external loads of one step, each in words."""
    words: list[str] = []
    for name, unit in (("tip_force", "N"), ("tip_moment", "N mm")):
        if any(getattr(load, name)):
            turning = " (following)" if load.following else ""
            words.append(f"{name.replace('_', ' ')} {vector(getattr(load, name))} {unit}{turning}")
    if load.tip_mass:
        words.append(f"tip mass {short(load.tip_mass)} g")
    if load.gravity is not None:
        words.append(f"gravity {vector(load.gravity)} m/s²")
    words += [f"force {vector(one.force)} N on body {one.body}" for one in load.body_forces]
    return words


def _external_rows(load: LoadPath) -> Iterator[tuple[str, str]]:
    different = [", ".join(external_words(one)) or "none" for one in load.different]
    if different == ["none"]:
        return
    more = f"; {len(different) - 1} other" if len(different) > 1 else ""
    yield ("external load", f"{different[0]}{more}")


def _by_tendon(
    name: str, unit: str, values: np.ndarray, *, commanded: bool = False
) -> Iterator[tuple[str, str]]:
    """Yield the course of every tendon; of many, the first that are not slack."""
    count = values.shape[1]
    there = [i for i in range(count) if np.isfinite(values[:, i]).any()]
    shown = there[: MOST - 2] if len(there) > MOST - 1 else there
    for index in shown:
        which = f" {index + 1}" if count > 1 else ""
        yield (f"tendon{which} {name}", f"{course(values[:, index])} {unit}")
    if len(there) > len(shown):
        yield (f"tendon {name}", f"and {len(there) - len(shown)} more tendons")
    if not there and not commanded:
        yield (f"tendon {name}", "none")


def _converged(path: EquilibriumPath) -> str:
    good = np.asarray(path.converged)
    if good.all():
        return "all steps"
    first = int(np.argmin(good))
    return f"{int(good.sum())} of {len(path)} steps; step {first + 1}: {path.reason[first]}"


def _few(values: np.ndarray, digits: int | None = None) -> str:
    """Return numbers one after the other, the first and the last of many."""
    texts = [
        short(float(value)) if digits is None else f"{round(float(value), digits) + 0.0:.{digits}f}"
        for value in values
    ]
    if len(texts) > 2 * MOST:
        texts = [*texts[:MOST], "…", *texts[-MOST:]]
    return ", ".join(texts)
