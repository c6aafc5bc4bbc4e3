"""Rows of a batch: robots of one form, solved by one compiled program in pieces."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from threadpoolctl import threadpool_limits

from lanewise import WIDTH
from notchflex._quantity import REGISTERED
from notchflex.analysis.outputs import (
    follow_row,
)
from notchflex.analysis.solve import prepare_for
from notchflex.analysis.varied.varied_chains import VariedChains, varied_chains
from notchflex.errors import InputError
from notchflex.loads import LoadPath
from notchflex.loads.command import make_commands, pad_commands
from notchflex.loads.validation import one_or_several, short_repr
from notchflex.robot import Robot
from notchflex.robot.value_names.varied import VariedRobots
from notchflex.solver.programs.prepare import PreparedChain, pad_prepared
from notchflex.solver.programs.pytree_layout import PytreeLayout
from notchflex.solver.programs.static_structure import StaticStructure

# Largest number of rows of a piece, by the number of rows.
_PIECE_SIZES = {0: 64, 512: 256, 8192: 2048}


@dataclass(frozen=True)
class BatchRobots:
    """The robots of a batch.

    Attributes:
        every: One for all rows, or one per row.
        varied: The same as one robot with varied numbers, where the robots need not be built.
    """

    every: Sequence[Robot]
    varied: VariedRobots | None = None

    @classmethod
    def of(cls, robots: Any) -> BatchRobots:
        """Convert the robots that a caller gives."""
        if isinstance(robots, VariedRobots):
            return cls(robots, robots)
        message = "a batch needs a notchflex.Robot, or some of them"
        every = one_or_several(robots, Robot, message)
        if not every or not all(isinstance(robot, Robot) for robot in every):
            raise InputError.WRONG_TYPE(f"{message}; got {short_repr(robots)}")
        return cls(every)

    @property
    def max_tendons(self) -> int:
        """Largest number of tendons of a robot."""
        unlike = self.every if self.varied is None else [self.varied.robot]
        return max(robot.number_of_tendons for robot in unlike)

    @property
    def threads(self) -> AbstractContextManager[Any]:
        """Context that limits the threads of matrix products while rows are solved.

        Every core has its own piece; a product that assembles varied robots must not use others.
        """
        return nullcontext() if self.varied is None else threadpool_limits(1)


@dataclass(frozen=True)
class BatchRows:
    """Rows of a batch whose robots run through one program.

    Attributes:
        rows: Indices of these rows in the batch.
        chains: A row per robot, or one for all.
        commands: A row per path, or one for all, then the steps.
        flexures: Number of flexures of each robot, by row, or one for all.
        layouts: Layouts of the chains and of one command, and names of the outputs.
    """

    rows: np.ndarray
    chains: Float[np.ndarray, "k chain"]
    commands: Float[np.ndarray, "k s command"]
    flexures: Int[np.ndarray, " k"]
    layouts: tuple[StaticStructure, PytreeLayout, tuple[str, ...]]

    def pieces(self, cores: int) -> Iterator[slice]:
        """Return the rows of each call of the program: equal pieces, balanced over the cores."""
        rows = len(self.rows)
        max_size = max(size for limit, size in _PIECE_SIZES.items() if rows >= limit)
        each = -(-rows // (max_size * cores))
        size = -(-rows // (each * cores * WIDTH)) * WIDTH
        return (slice(start, min(start + size, rows)) for start in range(0, rows, size))

    def packed(
        self, index: slice
    ) -> tuple[Float[np.ndarray, "*k chain"], Float[np.ndarray, "k s command"]]:
        """Return chains of a piece of the rows (one if shared), and their commands."""
        commands = self.commands[index]
        if len(self.commands) == 1:
            commands = np.repeat(self.commands, index.stop - index.start, axis=0)
        return self.chains[0] if len(self.chains) == 1 else self.chains[index], commands

    def run(self, index: slice, numbers: np.ndarray) -> dict[str, np.ndarray]:
        """Solve a piece of the rows."""
        chains, commands = self.packed(index)
        by_row = (chains.ndim == 2, True, False)
        outputs = follow_row.rows(by_row, chains, commands, numbers, *self.layouts)
        flexures = self.flexures[index] if len(self.flexures) > 1 else self.flexures
        return {name: _unpad(name, values, flexures) for name, values in outputs.items()}


@dataclass(frozen=True)
class VariedRows(BatchRows):
    """Rows whose robots differ by a few numbers: chains are computed piece by piece."""

    varied: VariedChains

    def packed(self, index: slice) -> tuple[np.ndarray, np.ndarray]:
        """Return chains and commands of a piece of the rows."""
        return self.varied.rows(index)


def varied_rows(varied: VariedChains, count: int, outputs: tuple[str, ...]) -> VariedRows:
    """Return the rows of robots whose chains are computed piece by piece."""
    layouts = (varied.structure, varied.command, outputs)
    flexures = np.array([varied.ready.chain.flexures])
    nothing = np.zeros((0, 0))
    return VariedRows(np.arange(count), nothing, nothing, flexures, layouts, varied)


def _unpad(name: str, values: np.ndarray, flexures: Int[np.ndarray, " rows"]) -> np.ndarray:
    """Blank the values of flexures or bodies that a robot lacks; rows and steps lead."""
    along = REGISTERED[name].per[:1]
    count = flexures + (along == ("body",))
    if along in (("notch",), ("body",)) and (count < values.shape[2]).any():
        beyond = np.arange(values.shape[2]) >= count[:, None]
        values[np.broadcast_to(beyond[:, None], values.shape[:3])] = missing_value(values)
    return values


def missing_value(values: np.ndarray) -> float:
    """Return the value for missing entries: NaN, or 0 for integers and flags."""
    return np.nan if values.dtype.kind == "f" else 0


def tables_of(
    robots: BatchRobots,
    joined: LoadPath,
    paths: int,
    count: int,
    outputs: tuple[str, ...],
    refinement: int,
) -> Sequence[BatchRows]:
    """Return rows of a batch by the layout of their robots, shorter ones padded to the longest."""
    steps = len(joined) // paths
    if robots.varied is not None and paths == 1:
        varied = varied_chains(robots.varied, joined, refinement)
        if varied is not None:
            return [varied_rows(varied, count, outputs)]
    # Modes for all of the loads, so that rows share a program.
    every = [prepare_for(robot, joined, None, refinement) for robot in robots.every]
    flexures = max(ready.chain.flexures for ready in every)
    edges = max(ready.chain.contacts.shape[1] for ready in every)
    by_stroke = not np.isnan(joined.stroke).all()
    groups: dict[Any, list[tuple[int, PreparedChain, np.ndarray]]] = {}
    for row, (robot, unpadded) in enumerate(zip(robots.every, every, strict=True)):
        part = joined if len(robots.every) == 1 or paths == 1 else joined.part(row * steps, steps)
        commands = pad_commands(make_commands(part, robot, unpadded.chain), flexures, by_stroke)
        ready = pad_prepared(unpadded, flexures, edges)
        layout = ready.command_layout(commands)
        packed = layout.pack(commands, leading=1).reshape(-1, steps, layout.size)
        groups.setdefault((ready.chain_layout, layout), []).append((row, ready, packed))
    tables = []
    for (chain_layout, layout), entries in groups.items():
        numbers, prepared, commands = zip(*entries, strict=True)
        rows = np.arange(count) if len(robots.every) == 1 else np.array(numbers)
        vectors = np.stack([ready.vector for ready in prepared])
        structure = StaticStructure.of(chain_layout, [ready.chain for ready in prepared], vectors)
        counts = np.array([every[number].chain.flexures for number in numbers])
        chains, loads = structure.pack(vectors), np.concatenate(commands)
        tables.append(BatchRows(rows, chains, loads, counts, (structure, layout, outputs)))
    return tables
