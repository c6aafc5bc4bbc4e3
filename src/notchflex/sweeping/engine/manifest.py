"""The manifest of a sweep: all that its bytes depend on. Workers need nothing else."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from typing import Any

from notchflex import __version__
from notchflex.errors import InputError
from notchflex.robot import Robot
from notchflex.robot.robot import from_table, to_table
from notchflex.solver.programs.backend import backend, optimisation_level
from notchflex.sweeping.model import SweepModel
from notchflex.sweeping.plan.parts import SweepPlan
from notchflex.sweeping.plan.reading import plan_from_table, plan_table

FORMAT = 1
_PIECES = 16
"""A sweep is cut into about so many pieces, unless they would be too small or too large."""
_LEAST, _MOST = 2**12, 2**18
_MOST_SLOW = 2**12
"""Rows of a piece at most where robots are assembled one by one, which takes a thousand times as
long: a piece that is lost, or waited for, is then no longer either."""
_MOST_BYTES = 2**27
"""What the solver returns of one piece at most, so that a worker needs less than 1 GiB."""


def versions() -> dict[str, str]:
    """Return versions of what the bytes of a sweep depend on."""
    libraries = ("numpy", "scipy", "jax", "llvmlite", "polars")
    return {
        "notchflex": __version__,
        **{name: version(name) for name in libraries},
        "backend": backend(),
        "optimisation": str(optimisation_level()),
    }


@dataclass(frozen=True, eq=False)
class Manifest:
    """What a sweep is.

    Attributes:
        document: As it is in `sweep.json`, of plain values.
    """

    document: Mapping[str, Any]

    @classmethod
    def of(cls, plan: SweepPlan, robot: Robot, model: SweepModel) -> Manifest:
        """Make the manifest of a plan.

        Args:
            plan: The plan.
            robot: The robot that it names.
            model: The model of both.
        """
        size = plan.piece or _piece_rows(plan.rows, _row_bytes(model), model.one_by_one)
        table = plan_table(plan)
        document = {
            "program": "notchflex",
            "kind": "sweep",
            "format": FORMAT,
            "versions": versions(),
            "plan": {key: value for key, value in table.items() if key != "robot"},
            "robot": to_table(robot),
            "rows": plan.rows,
            "piece": size,
            "pieces": -(-plan.rows // size),
            "columns": list(model.columns),
        }
        return cls(json.loads(json.dumps(document)))

    @classmethod
    def read(cls, text: str, where: str) -> Manifest:
        """Read the text of `sweep.json`.

        Raises:
            InputError: It is no manifest of a sweep, or one of another format.
        """
        try:
            document = json.loads(text)
            kind, form = document["kind"], document["format"]
        except (ValueError, TypeError, KeyError):
            raise InputError.FILE_DAMAGED(
                f"{where} is no manifest of a sweep; remove its folder, or take another one."
            ) from None
        if kind != "sweep" or form != FORMAT:
            raise InputError.FILE_FORMAT(
                f"{where} is of format {form}, and this version reads {FORMAT}."
            )
        return cls(document)

    @cached_property
    def text(self) -> str:
        """The text of `sweep.json`."""
        return json.dumps(self.document, indent=1, ensure_ascii=False) + "\n"

    @cached_property
    def digest(self) -> str:
        """What every piece of the sweep is marked with."""
        return hashlib.sha256(self.text.encode()).hexdigest()

    @property
    def plan(self) -> SweepPlan:
        """The plan; its robot is only a name."""
        return plan_from_table({**self.document["plan"], "robot": self.document["robot"]["name"]})

    @property
    def robot(self) -> Robot:
        """The robot that is varied."""
        return from_table(self.document["robot"])

    @property
    def rows(self) -> int:
        """Rows of the whole sweep."""
        return self.document["rows"]

    @property
    def pieces(self) -> int:
        """Number of pieces."""
        return self.document["pieces"]

    def between(self, piece: int) -> tuple[int, int]:
        """Return the first row of a piece and the row behind its last one."""
        size = self.document["piece"]
        return piece * size, min((piece + 1) * size, self.rows)

    def check_versions(self, where: str) -> None:
        """Raise if this process would compute other bytes.

        Raises:
            InputError: The sweep was begun with another version of a library.
        """
        begun = self.document["versions"]
        for name, here in versions().items():
            if begun.get(name) != here:
                raise InputError.CONFLICT(
                    f"{where} was begun with {name} {begun.get(name)}, and here is {name} {here}, "
                    "which may give other digits; go on with the former, or take another folder."
                )

    def check_same(self, other: Manifest, where: str) -> None:
        """Raise if another sweep was begun in a folder.

        Args:
            other: The manifest in the folder.
            where: The folder.

        Raises:
            InputError: Versions, plan or robot are others; the message names the first difference.
        """
        other.check_versions(where)
        for key, mine in self.document.items():
            place = _difference(key, mine, other.document.get(key))
            if place:
                raise InputError.CONFLICT(
                    f"{where} holds another sweep: {place}; take another folder, or remove it."
                )


def _difference(place: str, mine: Any, theirs: Any) -> str:
    """Return the first difference in words, "" if there is none."""
    if mine == theirs:
        return ""
    if isinstance(mine, dict) and isinstance(theirs, dict):
        keys = dict.fromkeys([*mine, *theirs])
        found = (_difference(f"{place}.{key}", mine.get(key), theirs.get(key)) for key in keys)
        return next(one for one in found if one)
    if isinstance(mine, list) and isinstance(theirs, list) and len(mine) == len(theirs):
        pairs = zip(mine, theirs, strict=True)
        found = (_difference(f"{place}[{n}]", *pair) for n, pair in enumerate(pairs, start=1))
        return next(one for one in found if one)
    return f"`{place}` is {_shown(theirs)} there and {_shown(mine)} in the plan"


def _shown(value: Any) -> str:
    text = "not given" if value is None else json.dumps(value, ensure_ascii=False)
    return text if len(text) < 60 else f"{text[:57]}..."


def _row_bytes(model: SweepModel) -> int:
    """Return the bytes that the solver returns of one row."""
    sizes: dict[tuple[str, str], int] = {}
    for one in model.criteria:
        path = model.paths[one.load]
        values = path.quantity(one.quantity.name)[0]
        sizes[one.load, one.quantity.name] = len(model.loads[one.load]) * max(values.size, 1)
    return 8 * sum(sizes.values())


def _piece_rows(rows: int, row_bytes: int, slow: bool) -> int:
    """Return the rows of a piece, a power of two."""
    size = 2 ** math.ceil(math.log2(max(rows / _PIECES, 1)))
    most = 2 ** int(math.log2(max(_MOST_BYTES / row_bytes, 16)))
    return min(max(size, _LEAST), _MOST_SLOW if slow else _MOST, most)
