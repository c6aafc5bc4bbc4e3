"""Schedule the nodes of every block: which are needed, in which order, in which loop over lanes.

Rows longer than a vector are computed in loops over their lanes. Nodes that depend on each other
lane by lane share a loop; where lanes are combined (a sum over them, say) the loop must end first.
So every node has a stage, and within a stage straight code comes before the loops.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from lanewise.codegen.dependencies import (
    operand_nodes,
    parts,
    regions,
    returns_results,
    stored_nodes,
)
from lanewise.ir.control_flow import WIDTH, LoweredFunction
from lanewise.ir.graph import Block


@dataclass(eq=False)
class Stage:
    """Nodes that run one after the other.

    Attributes:
        straight: Straight code, regions included, in order.
        loops: Members of loops over lanes by their length and whether they are batched.
    """

    straight: list[int] = field(default_factory=list[int])
    loops: dict[tuple[int, bool], list[int]] = field(
        default_factory=dict[tuple[int, bool], list[int]]
    )


class Schedule:
    """Schedule a function.

    Args:
        function: The function.

    Attributes:
        needed: Nodes that results depend on.
        kept: Rows computed in a loop that are needed after it and so go to memory.
        stage: Stage of every scheduled node, and the loop over lanes it belongs to (None: none).
    """

    def __init__(self, function: LoweredFunction) -> None:
        """Schedule all blocks."""
        self.graph, self.function = function.graph, function
        self._parts = {node: parts(region) for node, region in regions(self.graph)}
        self._writer = {
            id(buffer): node for node, own in self._parts.items() for buffer in own.written()
        }
        self.needed = self._needed()
        self._members: dict[int, list[int]] = {}
        for node in sorted(self.needed):
            self._members.setdefault(id(self.graph.owner[node]), []).append(node)
        self._region_uses: dict[int, set[int]] = {}
        self._before: dict[int, list[int]] = {}
        self.kept: set[int] = set()
        self._stages: dict[int, list[Stage]] = {}
        self.stage: dict[int, tuple[int, Any]] = {}
        self._last_uses: dict[int, list[list[int]]] = {}
        self._escaping: set[int] | None = None
        self._schedule_block(self.graph.top)
        self._find_kept()

    def stages(self, block: Block) -> list[Stage]:
        """Return what runs in a block, in order."""
        return self._stages[id(block)]

    def varies(self, node: int) -> bool:
        """Return whether rows of a batch differ in a node."""
        return self.function.batched and self.graph.owner[node].depth > 0

    def is_looped(self, node: int) -> bool:
        """Return whether a node is computed in a loop over its lanes, or is as long as one."""
        return self.graph.lanes[node] > (1 if self.function.batched else WIDTH)

    def combines_lanes(self, node: int) -> bool:
        """Return whether a node reads other lanes than its own and so can't be in a loop."""
        return self.graph.op[node] in (
            "shuffle", "reduce", "prefix", "load", "constants", "region"
        )  # fmt: skip

    # Lifetimes

    def last_used(self, block: Block, stage: int) -> list[int]:
        """Return the rows of a block that are not needed after a stage."""
        uses = self._last_uses.get(id(block))
        if uses is None:
            uses = self._last_uses[id(block)] = self._find_last_uses(block)
        return uses[stage]

    def _find_last_uses(self, block: Block) -> list[list[int]]:
        """Return the rows in memory by the stage that needs them last."""
        graph, end = self.graph, len(self.stages(block))
        last: dict[int, int] = dict.fromkeys(self._escaping_nodes(), end)
        for node in reversed(self._members.get(id(block), [])):
            stage = self.stage[node][0]
            # A shuffled row may be an alias of the row it is taken from.
            until = max(stage, last.get(node, 0)) if graph.op[node] == "shuffle" else stage
            for one in self._direct_dependencies(node):
                if graph.owner[one] is block and graph.op[one] != "region":
                    last[one] = max(last.get(one, 0), until)
        uses: list[list[int]] = [[] for _ in range(end + 1)]
        for node, stage in last.items():
            if graph.owner[node] is block and self.is_looped(node):
                uses[stage].append(node)
        return uses

    def _escaping_nodes(self) -> set[int]:
        """Return the nodes that are stored when their block ends."""
        if self._escaping is None:
            self._escaping = set(stored_nodes(self.function.stores))
            for node, own in self._parts.items():
                within = self.graph.owner[node]
                used = (*own.stored_nodes(), *own.read_nodes())
                self._escaping.update(one for one in used if self.graph.owner[one] is not within)
        return self._escaping

    # Dependencies

    def writer(self, node: int) -> int | None:
        """Return the region whose results a buffer node reads; None if there is none."""
        region = self._writer.get(id(self.graph.args[node][0]))
        if region is None or self.graph.owner[region] is not self.graph.owner[node]:
            return None
        return region

    def _needed(self) -> set[int]:
        todo = [*stored_nodes(self.function.stores), *self.function.in_place]
        todo += [node for node, region in regions(self.graph) if returns_results(region)]
        needed: set[int] = set()
        while todo:
            node = todo.pop()
            if node in needed:
                continue
            needed.add(node)
            todo += operand_nodes(self.graph, node)
            if self.graph.op[node] == "buffer":
                writer = self.writer(node)
                todo += [] if writer is None else [writer]
            if self.graph.op[node] == "region":
                todo += [*self._parts[node].stored_nodes(), *self._parts[node].read_nodes()]
        return needed

    def region_uses(self, node: int) -> set[int]:
        """Return the nodes of enclosing blocks that a region uses."""
        if node not in self._region_uses:
            own, depth = self._parts[node], self.graph.owner[node].depth
            uses = {*own.stored_nodes(), *own.read_nodes()}
            for block in own.blocks:
                for one in self._members.get(id(block), []):
                    uses |= set(self._dependencies(one))
            self._region_uses[node] = {one for one in uses if self.graph.owner[one].depth <= depth}
        return self._region_uses[node]

    def _dependencies(self, node: int) -> list[int]:
        """Return what must run before a node."""
        if self.graph.op[node] == "region":
            return list(self.region_uses(node))
        if self.graph.op[node] == "buffer":
            writer = self.writer(node)
            return [] if writer is None else [writer]
        return list(operand_nodes(self.graph, node))

    def _direct_dependencies(self, node: int) -> list[int]:
        """Return what must run before a node, with writers in place of their buffers."""
        before = self._before.get(node)
        if before is None:
            before = self._before[node] = []
            for other in self._dependencies(node):
                before += self._dependencies(other) if self.graph.op[other] == "buffer" else [other]
        return before

    # Order

    def _schedule_block(self, block: Block) -> None:
        """Give every node of a block and of the blocks inside it a stage."""
        stages: list[Stage] = []
        graph = self.graph
        members = self._members.get(id(block), [])
        for node in members:
            if graph.op[node] in ("const", "constants", "buffer"):
                # Available as soon as the region that writes it has ended.
                before = [self.stage[o][0] for o in self._dependencies(node) if o in self.stage]
                self.stage[node] = (max(before, default=0), None)
                continue
            stage, loop = self.stage[node] = self._earliest(node)
            while len(stages) <= stage:
                stages.append(Stage())
            if loop is None:
                stages[stage].straight.append(node)
            else:
                stages[stage].loops.setdefault(loop, []).append(node)
        for stage in stages:
            stage.straight = self._cluster(stage.straight)
            for loop, nodes in stage.loops.items():
                stage.loops[loop] = self._cluster(nodes)
        self._stages[id(block)] = stages
        for node in members:
            if graph.op[node] == "region":
                for inner in self._parts[node].blocks:
                    self._schedule_block(inner)

    def _earliest(self, node: int) -> tuple[int, Any]:
        """Return the earliest stage of a node and its loop over lanes."""
        loop = (self.graph.lanes[node], self.varies(node))
        loop = loop if self.is_looped(node) and not self.combines_lanes(node) else None
        stage = 0
        for one in self._dependencies(node):
            if self.graph.owner[one] is self.graph.owner[node]:
                at, other = self.stage[one]
                stage = max(stage, at + (other is not None and other != loop))
        return stage, loop

    def _cluster(self, members: list[int]) -> list[int]:
        """Return the same nodes, each shortly before the node that needs it."""
        inside = set(members)
        used: set[int] = set()
        for node in members:
            used.update(one for one in self._direct_dependencies(node) if one in inside)
        ordered: list[int] = []
        done: set[int] = set()
        for root in members:
            todo = [] if root in used else [root]
            while todo:
                node = todo[-1]
                if node in done:
                    todo.pop()
                    continue
                missing = [
                    one
                    for one in sorted(self._direct_dependencies(node), reverse=True)
                    if one in inside and one not in done
                ]
                if missing:
                    todo += missing
                else:
                    done.add(todo.pop())
                    ordered.append(node)
        return ordered

    def _find_kept(self) -> None:
        """Find the rows that are needed outside their loop over lanes."""
        graph = self.graph
        for node in self.needed:
            if graph.op[node] == "region":
                uses = self.region_uses(node) | set(self._parts[node].stored_nodes())
            else:
                uses = operand_nodes(graph, node)
            for one in uses:
                if self.is_looped(one) and not self.combines_lanes(one):
                    same_block = graph.owner[one] is graph.owner[node]
                    if not same_block or self.stage[one] != self.stage.get(node):
                        self.kept.add(one)
        self.kept.update(one for one in stored_nodes(self.function.stores) if self.is_looped(one))
