"""What a program is made of beside statements: loops, conditions, and what they write to memory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lanewise.ir.graph import Block, Graph, Memory, Table

WIDTH = 8
"""Lanes that are computed at once."""


@dataclass(eq=False)
class Put:
    """Entries to be written to memory.

    Attributes:
        table: Entries, flat.
        memory: Where to.
        places: Which of its numbers they become.
    """

    table: Table
    memory: Memory
    places: np.ndarray


@dataclass(eq=False)
class Loop:
    """A `while` loop.

    Attributes:
        before: What is carried into it.
        test: The block that says whether to go on.
        going: Its entry for that.
        body: The block that is repeated.
        after: What it carries on.
        rows: Whether every row of a batch goes on or stops by itself.
    """

    before: list[Put]
    test: Block
    going: int
    body: Block
    after: list[Put]
    rows: bool


@dataclass(eq=False)
class Steps:
    """A loop along tables.

    Attributes:
        before: What is carried into it, and tables that are put in memory first.
        count: How many steps; None where the number is known only when the program is called.
        reverse: Whether from the last on.
        along: Memory of the present step, a part of that of its table.
        tables: Entries of tables that lie in memory before the loop.
        body: The block that is repeated.
        after: What it carries on, and what it adds to its tables.
    """

    before: list[Put]
    count: int | None
    reverse: bool
    along: list[Memory]
    tables: list[int]
    body: Block
    after: list[Put]


@dataclass(eq=False)
class Choice:
    """Blocks of which one is run.

    Attributes:
        which: Entry of its number.
        branches: The blocks, and what each hands on.
        rows: Whether rows of a batch may choose differently.
    """

    which: int
    branches: list[tuple[Block, list[Put]]]
    rows: bool


@dataclass(eq=False)
class Rows:
    """Rows of a batch, as many at once as there are lanes.

    Attributes:
        given: By number of the table that is given, memory of the present rows.
        body: What is done with them.
        put: What it hands on.
        out: Memory that this is put in, for each table handed on.
    """

    given: dict[int, Memory]
    body: Block
    put: list[Put]
    out: list[Memory]


@dataclass(eq=False)
class Program:
    """A program read whole.

    Attributes:
        graph: Its statements.
        put: What the outermost block writes to what is handed on.
        written: Statements of memory that is handed on as it is.
        sizes: Numbers handed on, by output; of a row where there are rows.
        rows: Whether it is a batch.
    """

    graph: Graph
    put: list[Put]
    written: list[int]
    sizes: list[int]
    rows: bool


__all__ = ["WIDTH", "Choice", "Loop", "Program", "Put", "Rows", "Steps"]
