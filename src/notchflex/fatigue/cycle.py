"""Mean and amplitude of the strain all along the sections of the notches of a robot."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from notchflex import Equilibrium, EquilibriumPath, Fatigue, InputError, Robot, simulate
from notchflex.support import (
    PLACES,
    Displayed,
    SectionStrain,
    Summary,
    document_head,
    edge_strain,
    limit_line,
    short,
    short_repr,
)

_REPEATS = 1e-9  # strains repeat to this
_MOST_LOOPS = 50

Points = Float[np.ndarray, "n nodes points"]


@dataclass(frozen=True, eq=False, repr=False)
class StrainCycle(Displayed):
    """Strain cycle of n notches, at points on the boundary of their sections.

    Attributes:
        robot: The robot.
        limit: The limit line that the cycle is compared with.
        mean: Mean strain at every point of every node of every notch, (n, nodes, points).
        amplitude: Its amplitude there, half the range.
        margin: Amplitude that the line allows less this one; NaN where the line is not known.
        corner_factor: Factor on the strain at the corners of the cut of every notch, (n,).
        temperatures: Temperatures of notches in all states, each once, deg C; those not known are
            left out.
        loops: How often the path was followed until its strains repeated; 0 for states.
        reason: Why the strains do not hold: a step that did not converge, or loops that still
            differ; empty where they do.
    """

    robot: Robot
    limit: Fatigue
    mean: Points
    amplitude: Points
    margin: Points
    corner_factor: Float[np.ndarray, " n"]
    temperatures: tuple[float, ...]
    loops: int
    reason: str

    @cached_property
    def worst(self) -> Int[np.ndarray, "n 2"]:
        """Node and point of every notch with the smallest margin.

        Where the line is not known at some point of a notch, that with the largest amplitude.
        """
        known = np.isfinite(self.margin).all(axis=(1, 2), keepdims=True)
        least = np.where(known, self.margin, -self.amplitude).reshape(len(self.mean), -1)
        place = np.nan_to_num(least, nan=0.0).argmin(axis=1)
        return np.stack(np.unravel_index(place, self.mean.shape[1:]), axis=1)

    @property
    def smallest_margin(self) -> Float[np.ndarray, " n"]:
        """Smallest margin of every notch; NaN where the line is not known at all its points."""
        return self.margin.min(axis=(1, 2))

    def to_table(self) -> dict[str, list[Any]]:
        """Return the worst point of every notch: place, mean, amplitude and margin, in percent."""
        rows = (np.arange(len(self.worst)), *self.worst.T)
        values = self.mean[rows], self.amplitude[rows], self.smallest_margin
        names = (f"{name}_%" for name in ("mean", "amplitude", "margin"))
        numbers = {n: (100.0 * v).tolist() for n, v in zip(names, values, strict=True)}
        points = zip(self.robot.notches, self.worst[:, 1].tolist(), strict=True)
        places = ["surface" if notch.is_round else str(PLACES[point]) for notch, point in points]
        return {"notch": [*range(1, len(places) + 1)], "at": places, **numbers}

    def warnings(self) -> list[str]:
        """Return a sentence for all that the margins do not hold, and what they leave out."""
        facts, notches = self.limit.facts, self.robot.notches
        warnings = [f"the strains do not hold: {self.reason}."] if self.reason else []
        unknown = ~np.isfinite(self.mean).all(axis=(1, 2))
        if unknown.any() and not self.reason:
            numbers = ", ".join(map(str, np.flatnonzero(unknown) + 1))
            warnings.append(
                f"notches without a known strain, such as of a table, have no margin: {numbers}."
            )
        known = np.isfinite(self.mean) & np.isfinite(self.corner_factor)[:, None, None]
        if not facts:
            warnings.append('there is no limit line; give one, such as fatigue.line = "cao2020".')
        elif (known & np.isnan(self.margin)).any():
            low, high = (100.0 * end for end in (facts["mean"][0], facts["mean"][-1]))
            warnings.append(
                f"the limit line is known for mean strains of {low:g} to {high:g} % only; a notch "
                "with a point beyond them has no margin."
            )
        cornered = not all(notch.is_round for notch in notches)
        if cornered and self.limit.corner_factor is None and self.limit.corner_radius is None:
            warnings.append(
                "the concentration of strain at the corners of the cuts is left out; give "
                "fatigue.corner_radius, or fatigue.corner_factor (K_t)."
            )
        if not np.isfinite(self.corner_factor).all():
            warnings.append(
                "notches without a known factor of their corners have no margin: it is known for "
                'cuts "on-axis" 0.68 to 0.92 outer diameters deep, rings from 0.2 and radii from '
                "0.006 to 0.1; give fatigue.corner_factor (K_t) instead."
            )
        others = [
            str(number)
            for number, (notch, mean) in enumerate(zip(notches, self.mean, strict=True), start=1)
            if not hasattr(notch.made_of(self.robot.material), "plateaus")
            and not np.isnan(mean).all()
        ]
        if self.limit.line and others:
            warnings.append(
                f"{self.limit.line} was measured on superelastic nitinol; the material of notch "
                f"{', '.join(others)} is another one."
            )
        at, used = facts.get("temperature"), " and ".join(map("{:g}".format, self.temperatures))
        if at is not None and {*self.temperatures} - {at}:
            warnings.append(f"the robot is at {used} deg C, and the limit line is for {at:g}.")
        return warnings

    def _summary(self) -> Summary:
        table = self.to_table()
        rows = [("limit line", ", ".join(line_words(self.limit)) or "none")]
        for number, at, *values in zip(*table.values(), strict=True):
            mean, amplitude, margin = map(short, values)
            text = f"mean {mean} %, amplitude {amplitude} %, margin {margin} % at the {at}"
            rows.append((f"notch {number}", text))
        rows += [("", sentence) for sentence in self.warnings()]
        return Summary(f"Strain cycle of {self.robot.name}", rows, "nf.plot(...) draws all points")


def line_words(limit: Fatigue) -> list[str]:
    """Return what is known of a limit line, each in words."""
    facts, words = limit.facts, [limit.line] if limit.line else []
    forms: dict[str, Callable[[Any], str]] = {
        "cycles": "{:.3g} cycles".format,
        "reliability": lambda part: f"{100.0 * part:g} % survive",
        "temperature": "{:g} deg C".format,
        "surface": str,
        "source": str,
    }
    known = (form(facts[key]) for key, form in forms.items() if facts.get(key) is not None)
    return [*words, *known]


def strain_cycle(
    states: EquilibriumPath | Iterable[Equilibrium], *, limit: Fatigue | None = None
) -> StrainCycle:
    """Find mean and amplitude of the strain at the notches, between states or along a path.

    A path is a loop: it is followed again from its last state until its strains repeat
    (shakedown), and the extremes of the last loop count. States count as they are. The strains are
    those of `peak_strain`: bending both ways and stretch, without shear and without what rises at
    the corners of the cut. Nothing tells how many cycles a robot survives.

    Args:
        states: A solved path, or two or more solved states of one robot.
        limit: The limit line; that of the robot where not given.

    Returns:
        The cycle, and its margins below the line.

    Raises:
        InputError: Fewer than two states or steps, or states of several robots or refinements.

    Example:
        >>> from notchflex import load_robot, pull, simulate
        >>> robot = load_robot("pacheco2021-a-true").with_value("fatigue.line", "cao2020")
        >>> cycle = strain_cycle(simulate(robot, pull(0.0, 0.4, steps=3).release()))
        >>> cycle.loops, bool((cycle.smallest_margin > 0.0).all())
        (2, True)
    """
    if isinstance(states, EquilibriumPath):
        if len(states) < 2:
            raise InputError.NO_DATA(
                "one state is no cycle, as its strain has no amplitude; give a path of two or more "
                "steps, such as 0,0.5"
            )
        path, loops, reason = _settled(states)
        paths = [path]
    else:
        several: list[Any] = list(states)
        if len(several) < 2 or not all(isinstance(state, Equilibrium) for state in several):
            raise InputError.WRONG_TYPE(
                f"a strain cycle needs a path, or two solved states; got {short_repr(states)}"
            )
        paths, loops, reason = [state.path[state.step : state.step + 1] for state in several], 0, ""
    robot = paths[0].robot
    refined = paths[0].chain.refinement
    if any((path.robot, path.chain.refinement) != (robot, refined) for path in paths):
        raise InputError.CONFLICT(
            "the states of a strain cycle belong to different robots, or differ in refinement"
        )
    found = [_strains(path) for path in paths]
    # A notch has one node where it bends uniformly, and else those of the others.
    nodes = np.arange(max(strains.shape[2] for strains in found))
    strains = np.concatenate([each[:, :, np.minimum(nodes, each.shape[2] - 1)] for each in found])
    low, high = strains.min(axis=0), strains.max(axis=0)
    mean, amplitude = 0.5 * (low + high), 0.5 * (high - low)
    chosen = robot.fatigue if limit is None else limit
    line = limit_line(chosen, robot)
    factor = np.ones(len(mean)) if line is None else np.asarray(line.corner_factor)
    margin: Any = np.full_like(mean, np.nan) if line is None else line.margin(mean, amplitude)
    used: Any = (
        getattr(material, "used_at", None) if load.temperature is None else load.temperature
        for path in paths for load in path.load.different for material in robot.materials[1:]
    )  # fmt: skip
    temperatures = tuple(sorted({*used} - {None}))
    failed = [reason for path in paths for reason in path.reason if reason]
    reason = (*failed, reason)[0]
    return StrainCycle(robot, chosen, mean, amplitude, margin, factor, temperatures, loops, reason)


def _settled(path: EquilibriumPath) -> tuple[EquilibriumPath, int, str]:
    """Follow a path until its strains repeat; return the last loop, their number, a reason."""
    loops, change = 1, np.inf
    while change > _REPEATS and loops < _MOST_LOOPS:
        if path.each_from_rest or not path.converged.all():
            return path, loops, ""
        before, start, refinement = _strains(path), path.state, path.chain.refinement
        path = simulate(
            path.robot, path.load, from_state=start, settings=path.settings, refinement=refinement
        )
        loops, change = loops + 1, np.abs(_strains(path) - before).max()
    still = f"they still change by {change:.2g} after {loops} loops" if change > _REPEATS else ""
    return path, loops, still


def _strains(path: EquilibriumPath) -> Float[np.ndarray, "s n nodes points"]:
    """Return the strains of every step; NaN where it did not converge."""
    sections = np.moveaxis(path.solver_quantity("notch_strain"), -1, 0)
    strains = edge_strain(SectionStrain(*sections), path.chain.rods.section)
    return np.where(path.converged[:, None, None, None], strains, np.nan)


def cycle_columns(cycle: StrainCycle) -> dict[str, Any]:
    """Return the columns of a table of all points: notch, node and point from 1, and strains."""
    places = np.indices(cycle.mean.shape).reshape(3, -1) + 1
    names = "mean", "amplitude", "margin"
    return dict(zip(("notch", "node", "point"), places, strict=True)) | {
        name: getattr(cycle, name).ravel() for name in names
    }


def cycle_document(cycle: StrainCycle) -> dict[str, Any]:
    """Return the JSON document of a cycle."""
    columns = cycle.to_table()
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    return {
        **document_head(cycle.robot),
        "limit": cycle.limit.facts,
        "corner_factors": cycle.corner_factor.tolist(),
        "loops": cycle.loops,
        "reason": cycle.reason,
        "notches": rows,
        "warnings": cycle.warnings(),
    }
