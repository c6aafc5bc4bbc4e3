"""A study that is solved in pieces: what a row gives does not depend on the other rows."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float

from notchflex.analysis.batch import Batch, simulate_batch, simulate_varied
from notchflex.analysis.varied.varied_chains import VariedChains, varied_chains
from notchflex.loads import LoadPath
from notchflex.robot.value_names.varied import VariedRobots
from notchflex.tolerancing.study import Outcomes, Study

SAMPLE = 4096
"""Rows that polynomials of chains are made and checked with, from all over the study."""

_EACH = 1024
"""Largest number of separately assembled robots at a time: a chain takes much memory."""

_PIECES = 16
"""Approximate number of pieces of a study, unless they would be too small or too large."""
_MIN_ROWS, _MAX_ROWS = 2**12, 2**18
_MAX_SLOW_ROWS = 2**12
"""Rows of a piece at most where robots are assembled one by one, which takes a thousand times as
long: a piece that is lost, or waited for, is then no longer either."""
_MAX_BYTES = 2**27
"""What the solver returns of one piece at most, so that a worker needs less than 1 GiB."""


@dataclass(frozen=True, eq=False)
class PieceStudy(Study):
    """A study whose polynomials of chains come from a sample that is always the same.

    Attributes:
        sample: Numbers of some rows from all over the study, by name.
    """

    sample: Mapping[str, Float[np.ndarray, " k"]] = dataclasses.field(
        default_factory=dict[str, np.ndarray]
    )

    @cached_property
    def chains(self) -> dict[str, VariedChains | None]:
        """Chains of varied robots under every load; None where each is assembled separately."""
        robots = VariedRobots(self.exact, self.sample, self.ranges)
        if not robots.valid().all():
            return dict.fromkeys(self.loads)
        return {
            name: varied_chains(robots, load, self.refinement, reuse=False)
            for name, load in self.loads.items()
        }

    @property
    def one_by_one(self) -> bool:
        """Whether robots are assembled one by one, under any load."""
        return None in self.chains.values()

    @property
    def row_bytes(self) -> int:
        """Bytes that the solver returns of one row."""
        sizes: dict[tuple[str, str], int] = {}
        for one in self.criteria:
            values = self.paths[one.load].quantity(one.quantity.name)[0]
            sizes[one.load, one.quantity.name] = len(self.loads[one.load]) * max(values.size, 1)
        return 8 * sum(sizes.values())

    def follow(
        self, robots: VariedRobots, name: str, load: LoadPath, outputs: tuple[str, ...], part: Any
    ) -> Batch:
        """Follow a load with all robots, in the calling thread."""
        del part
        chains = self.chains[name]
        options: dict[str, Any] = {"outputs": outputs, "settings": self.settings}
        if chains is not None and chains.polynomial.covers(robots.table):
            return simulate_varied(dataclasses.replace(chains, numbers=robots.table), **options)
        parts = [
            simulate_batch(
                list(robots[start : start + _EACH]),
                load, refinement=self.refinement, cores=1, **options,
            )
            for start in range(0, len(robots), _EACH)
        ]  # fmt: skip
        return Batch({key: np.concatenate([one[key] for one in parts]) for key in parts[0]})

    def at(self, numbers: Mapping[str, Float[np.ndarray, " k"]]) -> Outcomes:
        """Solve robots: numbers in the units of files, NaN where there is no result."""
        count = len(next(iter(numbers.values())))
        outcomes = self.solved(numbers, count)
        scale = np.array([one.quantity.scale for one in self.criteria])
        return Outcomes(outcomes.values * scale, outcomes.codes)


def piece_rows(rows: int, study: PieceStudy) -> int:
    """Return the rows of a piece, a power of two.

    Args:
        rows: Rows of the study.
        study: The study.
    """
    size = 2 ** math.ceil(math.log2(max(rows / _PIECES, 1)))
    most = 2 ** int(math.log2(max(_MAX_BYTES / study.row_bytes, 16)))
    return min(max(size, _MIN_ROWS), _MAX_SLOW_ROWS if study.one_by_one else _MAX_ROWS, most)
