"""In which order statements run: what is needed at all, and what goes through one loop over lanes.

Rows longer than a vector are computed in loops over their lanes. Statements that need each other
lane by lane share a loop; where lanes are mixed (a sum over them, say) the loop must be over first.
So every statement has a stage, and within a stage straight code comes before the loops.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import singledispatch
from typing import Any

import numpy as np

from lanewise.ir.control_flow import WIDTH, Choice, Loop, Program, Put, Rows, Steps
from lanewise.ir.graph import LANE_BITS, Block, Graph, Memory


@dataclass(eq=False)
class Stage:
    """Statements that run one after the other.

    Attributes:
        straight: Straight code, loops and conditions of the program, in order.
        loops: Loops over lanes by their length, and whether rows of a batch differ in them.
    """

    straight: list[int] = field(default_factory=list[int])
    loops: dict[tuple[int, bool], list[int]] = field(
        default_factory=dict[tuple[int, bool], list[int]]
    )


def sources(graph: Graph, number: int) -> Iterable[int]:
    """Statements that one is made of."""
    op, args = graph.op[number], graph.args[number]
    if op in ("const", "lanes", "memory", "item"):
        return ()
    if op == "take":
        return {one >> LANE_BITS for one in args}
    if op == "load":
        return args[:1]
    if op in ("reduce", "along"):
        return args[1:2]
    return args


def _of(puts: Iterable[Put]) -> Iterable[int]:
    for put in puts:
        yield from (int(one) for one in np.unique(put.table >> LANE_BITS))


@singledispatch
def parts(item: Any) -> tuple[list[Block], list[Put], list[int]]:
    """Blocks of an item, what it writes, and entries that it looks at."""
    raise TypeError(item)


@parts.register
def _(item: Loop) -> tuple[list[Block], list[Put], list[int]]:
    return [item.test, item.body], [*item.before, *item.after], [item.going]


@parts.register
def _(item: Steps) -> tuple[list[Block], list[Put], list[int]]:
    return [item.body], [*item.before, *item.after], item.tables


@parts.register
def _(item: Choice) -> tuple[list[Block], list[Put], list[int]]:
    puts = [put for _, own in item.branches for put in own]
    return [block for block, _ in item.branches], puts, [item.which]


@parts.register
def _(item: Rows) -> tuple[list[Block], list[Put], list[int]]:
    return [item.body], item.put, []


class Order:
    """The order of a program.

    Args:
        program: The program.
    """

    def __init__(self, program: Program) -> None:
        """Find out what is needed, and when."""
        self.graph, self.program = program.graph, program
        self._writer = self._writers()
        self.needed = self._needed()
        self._own: dict[int, list[int]] = {}
        for number in sorted(self.needed):
            self._own.setdefault(id(self.graph.owner[number]), []).append(number)
        self._uses: dict[int, set[int]] = {}
        self.kept: set[int] = set()
        self._stages: dict[int, list[Stage]] = {}
        self.place: dict[int, tuple[int, Any]] = {}
        self._over: dict[int, list[list[int]]] = {}
        self._handed: set[int] | None = None
        self._in_block(self.graph.top)
        self._find_kept()

    def stages(self, block: Block) -> list[Stage]:
        """What runs in a block, in order."""
        return self._stages[id(block)]

    def over(self, block: Block, stage: int) -> list[int]:
        """Rows of a block that nothing needs after a stage."""
        found = self._over.get(id(block))
        if found is None:
            found = self._over[id(block)] = self._last_used(block)
        return found[stage]

    def _last_used(self, block: Block) -> list[list[int]]:
        """Rows in memory that are needed for the last time, by stage."""
        own = self._own.get(id(block), [])
        last: dict[int, int] = dict.fromkeys(self._handed_on(), len(self.stages(block)))
        for number in reversed(own):
            stage = self.place[number][0]
            # A row that is taken from another may be seen where that is.
            until = max(stage, last.get(number, 0)) if self.graph.op[number] == "take" else stage
            for one in self._closely(number):
                if self.graph.owner[one] is block and self.graph.op[one] != "item":
                    last[one] = max(last.get(one, 0), until)
        found: list[list[int]] = [[] for _ in range(len(self.stages(block)) + 1)]
        for number, stage in last.items():
            if self.graph.owner[number] is block and self.looped(number):
                found[stage].append(number)
        return found

    def _handed_on(self) -> set[int]:
        """Statements that are written to memory when the block they are in is over."""
        if self._handed is None:
            self._handed = set(_of(self.program.put))
            for number, item in self._items():
                _, puts, looked = parts(item)
                handed = (*_of(puts), *(one >> LANE_BITS for one in looked))
                within = self.graph.owner[number]
                self._handed.update(one for one in handed if self.graph.owner[one] is not within)
        return self._handed

    def varies(self, number: int) -> bool:
        """Whether rows of a batch differ in it."""
        return self.program.rows and self.graph.owner[number].depth > 0

    def looped(self, number: int) -> bool:
        """Whether it is computed in a loop over its lanes."""
        return int(self.graph.length[number]) > (1 if self.program.rows else WIDTH)

    def mixes(self, number: int) -> bool:
        """Whether it goes across lanes, or from place to place in memory, and is no loop."""
        return self.graph.op[number] in ("take", "reduce", "along", "load", "lanes", "item")

    def _items(self) -> Iterable[tuple[int, Any]]:
        for number, op in enumerate(self.graph.op):
            if op == "item":
                yield number, self.graph.args[number][0]

    def _writers(self) -> dict[int, int]:
        """The item that writes to memory, by that memory."""
        found: dict[int, int] = {}
        for number, item in self._items():
            for memory in _written(item):
                found[id(memory)] = number
        return found

    def writer(self, number: int) -> int | None:
        """The item whose result a statement of memory looks at."""
        memory: Memory = self.graph.args[number][0]
        item = self._writer.get(id(memory))
        if item is None or self.graph.owner[item] is not self.graph.owner[number]:
            return None
        return item

    def _needed(self) -> set[int]:
        todo = [*_of(self.program.put), *self.program.written]
        todo += [number for number, item in self._items() if _writes_results(item)]
        found: set[int] = set()
        while todo:
            number = todo.pop()
            if number in found:
                continue
            found.add(number)
            todo += sources(self.graph, number)
            op = self.graph.op[number]
            if op == "memory":
                writer = self.writer(number)
                todo += [] if writer is None else [writer]
            if op == "item":
                _, puts, looked = parts(self.graph.args[number][0])
                todo += _of(puts)
                todo += [one >> LANE_BITS for one in looked]
        return found

    def uses(self, number: int) -> set[int]:
        """Statements of blocks around an item that it uses."""
        if number in self._uses:
            return self._uses[number]
        item, depth = self.graph.args[number][0], self.graph.owner[number].depth
        blocks, puts, looked = parts(item)
        found = set(_of(puts)) | {one >> LANE_BITS for one in looked}
        for block in blocks:
            for one in self._own.get(id(block), []):
                found |= self.uses(one) if self.graph.op[one] == "item" else set(self._before(one))
        self._uses[number] = {one for one in found if self.graph.owner[one].depth <= depth}
        return self._uses[number]

    def _before(self, number: int) -> list[int]:
        """What must have run before a statement."""
        if self.graph.op[number] == "item":
            return list(self.uses(number))
        if self.graph.op[number] == "memory":
            writer = self.writer(number)
            return [] if writer is None else [writer]
        return list(sources(self.graph, number))

    def _in_block(self, block: Block) -> None:
        """Give every statement of a block and of those in it a stage."""
        stages: list[Stage] = []
        graph = self.graph
        own = self._own.get(id(block), [])
        for number in own:
            if graph.op[number] in ("const", "lanes", "memory"):
                # Known or in memory: there as soon as what wrote it is over.
                before = [self.place[one][0] for one in self._before(number) if one in self.place]
                self.place[number] = (max(before, default=0), None)
                continue
            group = (int(graph.length[number]), self.varies(number))
            group = group if self.looped(number) and not self.mixes(number) else None
            stage = 0
            for one in self._before(number):
                if graph.owner[one] is not block:
                    continue
                at, other = self.place[one]
                stage = max(stage, at + (other is not None and other != group))
            self.place[number] = (stage, group)
            while len(stages) <= stage:
                stages.append(Stage())
            if group is None:
                stages[stage].straight.append(number)
            else:
                stages[stage].loops.setdefault(group, []).append(number)
        for stage in stages:
            stage.straight = self._close_together(stage.straight)
            for group, members in stage.loops.items():
                stage.loops[group] = self._close_together(members)
        self._stages[id(block)] = stages
        for number in own:
            if graph.op[number] == "item":
                for inner in parts(graph.args[number][0])[0]:
                    self._in_block(inner)

    def _close_together(self, members: list[int]) -> list[int]:
        """The same statements, each soon before what it is needed for."""
        inside = set(members)
        used: set[int] = set()
        for number in members:
            used.update(one for one in self._closely(number) if one in inside)
        ordered: list[int] = []
        done: set[int] = set()
        for root in members:
            if root in used:
                continue
            todo = [root]
            while todo:
                number = todo[-1]
                if number in done:
                    todo.pop()
                    continue
                missing = [
                    one
                    for one in sorted(self._closely(number), reverse=True)
                    if one in inside and one not in done
                ]
                if missing:
                    todo += missing
                else:
                    done.add(todo.pop())
                    ordered.append(number)
        return ordered

    def _closely(self, number: int) -> list[int]:
        """What must have run before a statement, seen through memory."""
        found: list[int] = []
        for one in self._before(number):
            if self.graph.op[one] == "memory":
                writer = self.writer(one)
                found += [] if writer is None else [writer]
            else:
                found.append(one)
        return found

    def _find_kept(self) -> None:
        """Rows that are needed after their loop, and so must be put in memory."""
        graph = self.graph
        for number in self.needed:
            if graph.op[number] == "item":
                _, puts, _ = parts(graph.args[number][0])
                users = self.uses(number) | set(_of(puts))
            else:
                users = sources(graph, number)
            for one in users:
                if not self.looped(one) or self.mixes(one):
                    continue
                if graph.owner[one] is not graph.owner[number] or self.place[one] != self.place.get(
                    number
                ):
                    self.kept.add(one)
        for one in _of(self.program.put):
            if self.looped(one):
                self.kept.add(one)


def _writes_results(item: Any) -> bool:
    """Whether an item writes what the program returns, row by row."""
    return isinstance(item, Rows) or (isinstance(item, Steps) and item.count is None)


def _written(item: Any) -> list[Memory]:
    """Memory that holds what an item hands on."""
    _, puts, _ = parts(item)
    found = [put.memory for put in puts]
    found += [put.memory.number for put in puts if put.memory.place == "step"]
    return found
