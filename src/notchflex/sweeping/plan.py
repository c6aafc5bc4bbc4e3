"""The plan of a sweep: the tables of its file, their reading and their schema."""

from __future__ import annotations

import math
from dataclasses import KW_ONLY
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter, model_validator

from notchflex import Robot
from notchflex.specification import (
    LOAD_KEYS,
    LimitedQuantity,
    LoadTables,
    Varied,
    record,
    with_robot,
)
from notchflex.support import (
    AnyPath,
    Float,
    Int,
    ProblemError,
    schema_of,
)

_MAX_VALUES = 10_000_000
MAX_ROWS = 10**12
"""Rows of a sweep at most: a month of 32 cores, and four million files."""
_MAX_PIECES = 4_000_000
_MAX_POINTS = 10**11
"""Points at most: the way to the last one of a Sobol sequence takes minutes."""


@record()
class SweepVariable(Varied):
    """A number of the robot file that is varied.

    With `values`, or with `lower`, `upper` and `count`, it is one axis of a grid; with `lower` and
    `upper` alone it is sampled.

    Args:
        value: Path of the robot file, such as `notch.depth`.
        values: List of values.
        lower: Least value, in the unit of the robot file.
        upper: Greatest value.
        count: Number of values from `lower` to `upper`.
        spacing: "linear", or "log" for equal ratios.
    """

    values: Annotated[
        tuple[Float, ...] | None,
        Field(min_length=1, max_length=_MAX_VALUES),
    ] = None
    count: Annotated[Int | None, Field(ge=2, le=_MAX_VALUES)] = None
    spacing: Literal["linear", "log"] = "linear"

    @property
    def is_sampled(self) -> bool:
        """Whether its values are sampled, and not those of a grid."""
        return self.values is None and self.count is None

    @property
    def size(self) -> int:
        """Number of values on the grid."""
        return len(self.values) if self.values is not None else self.count or 1

    @model_validator(mode="after")
    def _one_form(self) -> SweepVariable:
        limits = [self.lower, self.upper]
        if self.values is not None:
            if limits != [None, None] or self.count is not None:
                text = "excludes `lower`, `upper` and `count`; give one or the other."
                raise ProblemError([("values", text)])
            if len(set(self.values)) != len(self.values):
                raise ProblemError([("values", "has a value twice; give each once.")])
        elif None in limits:
            text = "or `lower` and `upper` are needed; give one or the other."
            raise ProblemError([("values", text)])
        elif self.spacing == "log" and self.ends[0] <= 0.0:
            text = f'is {self.lower:g}; spacing = "log" needs values above 0.'
            raise ProblemError([("lower", text)])
        return self


@record()
class Sampling:
    """Sampling of variables without `count` or `values`.

    Args:
        method: "sobol" (scrambled) or "latin-hypercube".
        points: Number of points; each is combined with the whole grid of the other variables.
        seed: The same seed samples the same points.
    """

    method: Literal["sobol", "latin-hypercube"] = "sobol"
    points: Annotated[Int, Field(ge=1, le=_MAX_POINTS)]
    seed: Annotated[Int, Field(ge=0, le=2**63 - 1)] = 0


@record()
class SweepOutput:
    """Selection of what is written to files.

    Args:
        rows: Whether all rows are kept; if not, only those that `extremes` and `failures` keep.
        extremes: Of every kept quantity, so many rows with the smallest and as many with the
            largest values.
        failures: So many of the first rows without a result.
        bins: Number of bins of the histogram of every kept quantity; 0 for none.
        quantiles: Quantiles of every kept quantity, between 0 and 1.
    """

    rows: Annotated[bool, Field(strict=True)] = True
    extremes: Annotated[Int, Field(ge=0, le=10_000)] = 10
    failures: Annotated[Int, Field(ge=0, le=1_000_000)] = 100
    bins: Annotated[Int, Field(ge=0, le=1000)] = 50
    quantiles: Annotated[
        tuple[Annotated[Float, Field(ge=0.0, le=1.0)], ...],
        Field(max_length=1000),
    ] = (0.025, 0.25, 0.5, 0.75, 0.975)


@record()
class SweepPlan:
    """Plan of a sweep.

    Args:
        robot: Name of a ready robot, or path of a robot file beside the plan.
        name: What tables and pictures call the sweep.
        refinement: More strain modes and fibres in every notch, as for `simulate`.
        piece: Rows of a piece, which is one file; chosen where not given.
        variable: What is varied.
        sampling: How variables without `count` or `values` are sampled.
        load: Loads by name; the keys are the options of `notchflex simulate`.
        keep: The quantities that are kept, and within which limits a robot is accepted, in mm, N,
            MPa and deg.
        output: What of all rows goes into files.
    """

    _: KW_ONLY
    robot: Annotated[str, Field(min_length=1)]
    name: Annotated[str, Field(min_length=1, max_length=200)] = "sweep"
    refinement: Annotated[Int, Field(ge=0, le=3)] = 0
    piece: Annotated[Int | None, Field(ge=16, le=2**22)] = None
    variable: Annotated[tuple[SweepVariable, ...], Field(min_length=1, max_length=500)]
    sampling: Sampling | None = None
    load: LoadTables
    keep: Annotated[
        tuple[LimitedQuantity, ...],
        Field(min_length=1, max_length=500),
    ]
    output: SweepOutput = SweepOutput()

    @property
    def grid(self) -> tuple[SweepVariable, ...]:
        """The variables of the grid, the last of which changes fastest."""
        return tuple(one for one in self.variable if not one.is_sampled)

    @property
    def sampled(self) -> tuple[SweepVariable, ...]:
        """The variables that are sampled."""
        return tuple(one for one in self.variable if one.is_sampled)

    @property
    def rows(self) -> int:
        """Number of rows: the grid times the points."""
        points = 1 if self.sampling is None else self.sampling.points
        return points * math.prod(one.size for one in self.grid)

    @model_validator(mode="after")
    def _fits(self) -> SweepPlan:
        if self.sampled and self.sampling is None:
            name = self.sampled[0].value
            text = f"is missing, but `{name}` has no `count`; write [sampling] with points = 1000, "
            raise ProblemError([("sampling", f"{text}or give it a count.")])
        if self.sampling is not None and not self.sampled:
            text = "samples nothing: every variable has `count` or `values`; leave one out."
            raise ProblemError([("sampling", text)])
        names = [one.value.strip() for one in self.variable]
        twice = [name for name in names if names.count(name) > 1]
        if twice:
            raise ProblemError([("variable", f"has `{twice[0]}` twice; vary it once.")])
        if self.rows > MAX_ROWS:
            raise ProblemError([("variable", f"makes {self.rows:.3g} rows; give at most 1e12.")])
        if self.piece is not None and self.rows / self.piece > _MAX_PIECES:
            text = f"is {self.piece}, which makes {self.rows / self.piece:.3g} files; give "
            raise ProblemError([("piece", f"{text}{-(-self.rows // _MAX_PIECES)} or more.")])
        return self


def read_plan(path: AnyPath) -> tuple[SweepPlan, Robot]:
    """Read a plan file and the robot that it names.

    Args:
        path: The TOML file, in mm, N, MPa and deg.

    Returns:
        What is swept, and the robot that is varied.

    Raises:
        InputError: The file or its robot cannot be read, or a value in it is not allowed.
    """
    return with_robot(path, SweepPlan, "plan file")


def plan_table(plan: SweepPlan) -> dict[str, Any]:
    """Return a plan as a plain table, which `made` reads back."""
    return TypeAdapter(SweepPlan).dump_python(plan, mode="json", exclude_none=True)


def plan_schema() -> dict[str, Any]:
    """Return the JSON Schema of a plan file (draft 2020-12).

    Example:
        >>> plan_schema()["required"]
        ['robot', 'variable', 'load', 'keep']
    """
    text = "Which numbers of a robot are varied, and what is kept, in mm, N, MPa and deg."
    schema = schema_of(SweepPlan, "notchflex plan file of a sweep", text)
    schema["properties"]["load"]["additionalProperties"] = {
        "type": "object",
        "properties": {key: {} for key in LOAD_KEYS},
        "additionalProperties": False,
    }
    return schema
