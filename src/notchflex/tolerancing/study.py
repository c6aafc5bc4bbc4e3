"""Robots at levels of their tolerances, solved under all loads: the numbers that have limits."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from notchflex._quantity import REGISTERED
from notchflex.analysis.batch import simulate_batch
from notchflex.analysis.outputs import Batch
from notchflex.analysis.solve import simulate
from notchflex.analysis.uncertainty.draws import ToleranceSource, sources_of, values_at
from notchflex.errors import InputError
from notchflex.loads import LoadPath
from notchflex.pieces.codes import ACCEPTED, FAILED, INVALID, REJECTED
from notchflex.results.path import EquilibriumPath
from notchflex.robot import Robot
from notchflex.robot.tolerance import Tolerance
from notchflex.robot.value_names.varied import VariedRobots
from notchflex.solver.newton import Settings
from notchflex.tolerancing.criteria import Criterion, criteria_of
from notchflex.tolerancing.spec import ToleranceSpec

TAIL = 1e-6
"""What a normal distribution has beyond its end is drawn at the end: 1e-6 on either side, 4.8
standard deviations."""


class Outcomes(NamedTuple):
    """Outcomes of robots.

    Attributes:
        values: The numbers that have limits, (robots, criteria); NaN where there is no result.
        codes: What became of each robot, an index of `CODES`.
    """

    values: Float[np.ndarray, "robots criteria"]
    codes: Int[np.ndarray, " robots"]

    @property
    def accepted(self) -> Bool[np.ndarray, " robots"]:
        """Which robots meet all limits."""
        return self.codes == ACCEPTED


@dataclass(frozen=True, eq=False)
class Study:
    """A robot with tolerances under loads, and what its results must meet.

    Attributes:
        robot: The robot of the drawing.
        tolerances: What deviates.
        paths: The robot of the drawing under every load, by name.
        criteria: The numbers that have limits.
        settings: Tolerance and limits of the solver.
        refinement: More strain modes, as for `simulate`.
        cores: As for `simulate_batch`.
    """

    robot: Robot
    tolerances: tuple[Tolerance, ...]
    paths: Mapping[str, EquilibriumPath]
    criteria: Sequence[Criterion]
    settings: Settings | None = None
    refinement: int = 0
    cores: int | None = None

    @cached_property
    def exact(self) -> Robot:
        """The robot without tolerances."""
        return self.robot.replace(tolerance=None)

    @cached_property
    def sources(self) -> list[ToleranceSource]:
        """Independent sources of deviations."""
        return [one for one in sources_of(self.exact, self.tolerances) if np.ptp(_ends(one)) > 0.0]

    @cached_property
    def loads(self) -> dict[str, LoadPath]:
        """The loads that any limit is about, each up to the last step that has one."""
        last: dict[str, int] = {}
        for one in self.criteria:
            last[one.load] = max(last.get(one.load, 0), one.step + 1)
        return {name: self.paths[name].load.part(0, steps) for name, steps in last.items()}

    @cached_property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Between what the numbers of drawn robots lie, by name."""
        low, high = (self.drawn(np.full((1, len(self.sources)), level)) for level in (0.0, 1.0))
        return {name: (float(low[name][0]), float(high[name][0])) for name in low}

    def drawn(self, levels: Float[np.ndarray, "robots d"]) -> dict[str, Float[np.ndarray, " r"]]:
        """Return the numbers of robots by name, at levels of the sources; see `TAIL`."""
        return values_at(self.sources, np.clip(levels, TAIL, 1.0 - TAIL))

    def at_levels(
        self,
        levels: Float[np.ndarray, "robots d"],
        progress: Callable[[int, int], None] | None = None,
    ) -> Outcomes:
        """Solve robots at levels of the sources, each between 0 and 1."""
        return self.solved(self.drawn(levels), len(levels), progress)

    def solved(
        self,
        drawn: Mapping[str, Float[np.ndarray, " r"]],
        count: int,
        progress: Callable[[int, int], None] | None = None,
    ) -> Outcomes:
        """Solve robots with other numbers under all loads.

        Args:
            drawn: The numbers by name, one per robot.
            count: How many robots.
            progress: Called with the robots done and all of them.
        """
        values = np.full((count, len(self.criteria)), np.nan)
        every = VariedRobots(self.exact, drawn, self.ranges)
        valid = every.valid()
        robots, rows = every.take(valid), np.flatnonzero(valid)
        codes = np.where(valid, ACCEPTED, INVALID)
        for number, (name, load) in enumerate(self.loads.items()):
            if not len(rows):
                break
            own = [index for index, one in enumerate(self.criteria) if one.load == name]
            outputs = tuple(dict.fromkeys(self.criteria[index].quantity.name for index in own))
            part = _part_of(progress, number, len(self.loads))
            quantities = self.follow(robots, name, load, (*outputs, "converged"), part)
            converged, turn = quantities["converged"], self.paths[name].base_to_world
            turned = {
                name: quantities[name]
                if turn is None
                else REGISTERED[name].turned(quantities[name], turn)
                for name in outputs
            }
            for index in own:
                criterion = self.criteria[index]
                accepted = converged[:, criterion.step]
                values[rows, index] = np.where(
                    accepted, criterion.of(turned[criterion.quantity.name]), np.nan
                )
            failed = ~converged.all(axis=1)
            codes[rows[failed]] = FAILED
        codes[(codes == ACCEPTED) & ~self.within(values).all(axis=1)] = REJECTED
        return Outcomes(values, codes)

    def follow(
        self,
        robots: VariedRobots,
        name: str,
        load: LoadPath,
        outputs: tuple[str, ...],
        part: Callable[[int, int], None] | None,
    ) -> Batch:
        """Follow a load with all robots.

        Args:
            robots: The robots, all of them valid.
            name: Name of the load.
            load: The load.
            outputs: Names of the quantities.
            part: Called with the robots done and all of them.
        """
        del name
        return simulate_batch(
            robots, load, outputs=outputs, settings=self.settings,
            refinement=self.refinement, cores=self.cores, progress=part,
        )  # fmt: skip

    def within(self, values: Float[np.ndarray, "robots k"]) -> Bool[np.ndarray, "robots k"]:
        """Return which numbers lie within their limits; NaN does not."""
        lower, upper = (
            np.array([getattr(one, end) for one in self.criteria]) for end in ("lower", "upper")
        )
        return (values >= lower) & (values <= upper)


def study_of(
    robot: Robot,
    spec: ToleranceSpec,
    tolerances: tuple[Tolerance, ...],
    settings: Settings | None,
    refinement: int,
    cores: int | None = None,
) -> Study:
    """Make the study of a robot; the other arguments are those of `Study`.

    Args:
        robot: The robot of the drawing.
        spec: Loads and limits.
        tolerances: What deviates.
        settings: Tolerance and limits of the solver.
        refinement: More strain modes.
        cores: How many cores to use.

    Raises:
        InputError: The robot of the drawing does not converge under a load.
    """
    paths: dict[str, EquilibriumPath] = {}
    for name, load in spec.loads.items():
        paths[name] = simulate(robot, load, settings=settings, refinement=refinement)
        if not paths[name].converged.all():
            step = int(np.argmin(paths[name].converged))
            raise InputError.NOT_CONVERGED(
                f"load {name}: the robot of the drawing has no result at step {step + 1}: "
                f"{paths[name].reason[step]}."
            )
    criteria = tuple(criteria_of(spec, paths))
    return Study(robot, tolerances, paths, criteria, settings, refinement, cores)


def _ends(source: ToleranceSource) -> list[float]:
    """Return values of a source that differ where its tolerance is not zero."""
    first = next(iter(source.nominal))
    return [source.values(level)[first] for level in (0.25, 0.75)]


def _part_of(
    progress: Callable[[int, int], None] | None, number: int, parts: int
) -> Callable[[int, int], None] | None:
    """Return the progress of one of several batches as part of all."""
    if progress is None:
        return None
    return lambda done, count: progress(number * count + done, parts * count)
