"""The specification of a design: the tables of its file, their checks, reading and schema."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import KW_ONLY
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from notchflex import Robot
from notchflex.specification import (
    Between,
    Measured,
    OldWords,
    Varied,
    as_list,
    record,
    with_robot,
)
from notchflex.support import (
    AnyPath,
    Float,
    FloatOrInf,
    Int,
    ProblemError,
    Tolerances,
    schema_of,
)

Commanded = Annotated[tuple[FloatOrInf, ...] | None, BeforeValidator(as_list)]
Vector = Annotated[tuple[Float, ...], Field(min_length=3, max_length=3)]
Pair = Annotated[tuple[Float, ...], Field(min_length=2, max_length=2)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]*$", max_length=40)]
Take = Literal["each", "largest", "smallest", "sum", "mean", "range", "steps", "rms"]
Seed = Annotated[Int, Field(ge=0, le=2**31)]
WantedYield = Annotated[Float | None, Field(ge=0.5, le=0.9999)]

_NONE = (0.0, 0.0, 0.0)

# A coordinate beyond is in another unit, mm.
_MAX_COORDINATE = 1e4


@record(kw_only=False)
class DesignQuantity(Measured):
    """Entries of a quantity under a load, or of a value of the robot file.

    Args:
        quantity: Name of a quantity, or path of the robot file.
        minus: Another load, under which the value is subtracted: the width of a hysteresis.
        direction: Direction of the tip compliance, in the world.
        take: How several numbers are made one.
    """

    _: KW_ONLY
    minus: str | None = None
    direction: Vector | None = None
    take: Take | None = None

    @model_validator(mode="after")
    def _can_be(self) -> DesignQuantity:
        if self.minus is not None and self.minus == self.load:
            raise ProblemError([("minus", "is the load itself; give another one.")])
        if self.direction is not None and not 1e-9 < math.hypot(*self.direction) < 1e9:
            raise ProblemError([("direction", "must be a vector that is not zero.")])
        return self


@record()
class DesignObjective(DesignQuantity):
    """An objective: a quantity to minimise, maximise or bring near a value.

    Args:
        goal: "minimise" or "maximise"; not with `target`.
        target: The value to come near to, by least squares.
        weight: Its weight beside other objectives, each in its own unit.
    """

    goal: Literal["minimise", "maximise"] | None = None
    target: Float | None = None
    weight: Annotated[Float, Field(ge=1e-9, le=1e9)] = 1.0

    @model_validator(mode="after")
    def _one_goal(self) -> DesignObjective:
        if (self.goal is None) == (self.target is None):
            text = 'is needed, or `target`, but not both; write goal = "minimise", for example.'
            raise ProblemError([("goal", text)])
        return self


@record()
class DesignConstraint(Between, DesignQuantity):
    """A constraint.

    Args:
        lower: The least value.
        upper: The greatest value.
        equal: The value it must have.
        order: Along the notches the value must fall ("tip-first": the tip closes first) or rise
            ("base-first").
        margin: By how much at least, from one notch to the next.
        wanted_yield: Part of the robots made within the tolerances that must meet it; without it
            the robot of the drawing must.
    """

    equal: Float | None = None
    order: Literal["tip-first", "base-first"] | None = None
    margin: Annotated[Float, Field(ge=0.0)] = 0.0
    wanted_yield: WantedYield = None

    @model_validator(mode="after")
    def _asks_one_thing(self) -> DesignConstraint:
        limits = self.lower is not None or self.upper is not None
        if [self.equal is not None, limits, self.order is not None].count(True) != 1:
            text = "asks for nothing, or for too much; give `equal`, `lower` and/or `upper`, or "
            raise ProblemError([("", f"{text}`order`.")])
        if self.equal is not None and self.wanted_yield is not None:
            text = "is for limits: no robot with tolerances meets `equal`; give `lower` and `upper`"
            raise ProblemError([("wanted_yield", f"{text}.")])
        return self


@record()
class TargetCurve(OldWords):
    """A curve in the frame of the base that the tube axis must follow under a load.

    Args:
        name: Name of the curve; `curve.NAME` is the quantity: distance of every point from the
            axis, mm; the last point is that of the tip.
        load: The load.
        points: Points, three numbers each, mm.
        curvature: Instead of points: pairs of arc length (mm, rising from 0) and curvature (1/mm,
            positive toward x) in the plane of x and z, straight lines between.
        within: Distance from the axis up to which a point counts as reached, mm.
    """

    name: Name
    load: str
    points: Annotated[tuple[Vector, ...] | None, Field(min_length=2, max_length=1000)] = None
    curvature: Annotated[
        tuple[Pair, ...] | None,
        Field(min_length=2, max_length=1000),
    ] = None
    within: Annotated[Float, Field(gt=0.0, le=1e6)] = 0.2

    @model_validator(mode="after")
    def _one_form(self) -> TargetCurve:
        if (self.points is None) == (self.curvature is None):
            raise ProblemError([("points", "or `curvature` is needed; give one of them.")])
        far = max(map(abs, itertools.chain(*self.points or ())), default=0.0)
        if far > _MAX_COORDINATE:
            text = f"has a coordinate of {far:g}; give mm, at most {_MAX_COORDINATE:g} mm."
            raise ProblemError([("points", text)])
        lengths = [length for length, _ in self.curvature or ((0.0, 0.0),)]
        if lengths[0] != 0.0 or any(a >= b for a, b in itertools.pairwise(lengths)):
            text = "must begin at an arc length of 0 mm, and rise from pair to pair."
            raise ProblemError([("curvature", text)])
        return self


@record()
class DesignVariable(Varied):
    """A number that the search may choose.

    Args:
        value: Path of the robot file, such as `notch.depth`, or `load.NAME.tension[1]`.
        lower: Least value allowed, in the unit of the robot file.
        upper: Greatest value allowed.
        along: For a value of the notches: "all" have the same, "each" has its own, or "polynomial"
            along the tube.
        degree: Degree of the polynomial; 1 if not given.
    """

    lower: Float = Field()  # pyright: ignore[reportGeneralTypeIssues]
    upper: Float = Field()  # pyright: ignore[reportGeneralTypeIssues]
    along: Literal["all", "each", "polynomial"] = "all"
    degree: Annotated[Int | None, Field(ge=1, le=6)] = None

    @property
    def is_load(self) -> bool:
        """Whether it is a number of a load; `state` is the old word."""
        return self.value.startswith(("load.", "state."))

    @model_validator(mode="after")
    def _of_a_polynomial(self) -> DesignVariable:
        if self.degree is not None and self.along != "polynomial":
            text = f'is for along = "polynomial", and along is "{self.along}"; change one of them.'
            raise ProblemError([("degree", text)])
        return self


@record()
class Stock:
    """Sizes that can be bought: several values that change together.

    Args:
        values: Paths of the robot file.
        sizes: List of sizes, each with one number for every path.
    """

    values: Annotated[tuple[str, ...], Field(min_length=1, max_length=20)]
    sizes: Annotated[
        tuple[tuple[Float, ...], ...],
        Field(min_length=1, max_length=100),
    ]

    @model_validator(mode="after")
    def _complete(self) -> Stock:
        wrong = [one for one in self.sizes if len(one) != len(self.values)]
        if wrong:
            text = f"has a size of {len(wrong[0])} numbers for {len(self.values)} values; give "
            raise ProblemError([("sizes", f"{text}{len(self.values)} numbers for every size.")])
        return self


@record()
class DesignState:
    """A load under which quantities of the robot are asked.

    Args:
        name: Name by which objectives and constraints call it.
        tension: Tension of the first tendon, or of each, N; `nan` where not commanded.
        stroke: Stroke of the first tendon, or of each, mm; `nan` where not commanded.
        after: The load that comes before, with its friction; from rest where not given.
        steps: Number of equal steps from the load before.
        tip_force: Force at the tip, N.
        tip_moment: Moment at the tip, N mm.
        tip_mass: Mass that hangs at the tip, g.
        temperature: Temperature of the robot, deg C; that of its file where not given.
        sheath_bend_deg: Total angle by which all sheaths are bent, deg; as in the robot's file
            where not given.
    """

    name: Name
    tension: Commanded = None
    stroke: Commanded = None
    after: str | None = None
    steps: Annotated[Int, Field(ge=1, le=200)] = 5
    tip_force: Vector = _NONE
    tip_moment: Vector = _NONE
    tip_mass: Annotated[Float, Field(ge=0.0, le=1e6)] = 0.0
    temperature: Float | None = None
    sheath_bend_deg: Annotated[Float | None, Field(ge=0.0, le=3600.0)] = None


def _by_name(given: Any) -> Any:
    """Take tables by their names as a list of tables with names."""
    if not isinstance(given, Mapping):
        return given
    return tuple(
        {**table, "name": name} if isinstance(table, Mapping) else table
        for name, table in given.items()
    )


@record()
class SearchOptions:
    """Effort of the search.

    Args:
        starts: Number of starts, of which the robot as it is is one.
        candidates: Number of robots from which the other starts are taken.
        seed: Seed of the random numbers.
        iterations: Most iterations of each search.
    """

    starts: Annotated[Int, Field(ge=1, le=1000)] = 6
    candidates: Annotated[Int, Field(ge=1, le=100_000)] = 64
    seed: Seed = 0
    iterations: Annotated[Int, Field(ge=1, le=10_000)] = 150


@record()
class RobustOptions:
    """Yield of robots within tolerances.

    Args:
        wanted_yield: Part of the robots that must meet all limits. Without it, and where no
            constraint has one of its own, the yield is made as great as possible, instead of the
            objectives.
        draws: About how many robots the yield is counted of.
        seed: Seed of the draws.
    """

    wanted_yield: WantedYield = None
    draws: Annotated[Int, Field(ge=100, le=1_000_000)] = 4000
    seed: Seed = 0


@record()
class DesignSpec(OldWords):
    """Specification of a design.

    Args:
        robot: Name of a ready robot, or path of a robot file, beside the design file.
        name: What tables and pictures call the design.
        number_of_notches: Numbers of equal notches to try; as in the robot where not given.
        variable: The variables.
        stock: Sizes that can be bought.
        load: Loads by name.
        objective: The objectives; none means the smallest change of the robot.
        constraint: The constraints.
        curve: The curves to be followed.
        search: How hard the search tries.
        tolerance: Within what robots are made, as in a robot file; where not given, the tolerances
            of the robot, and assumed ones.
        robust: How robots made within the tolerances are to meet the limits.
    """

    _: KW_ONLY
    robot: Annotated[str, Field(min_length=1)]
    name: Annotated[str, Field(min_length=1, max_length=200)] = "design"
    number_of_notches: Annotated[
        tuple[Int, ...],
        BeforeValidator(as_list),
        Field(max_length=100),
    ] = ()
    variable: Annotated[tuple[DesignVariable, ...], Field(max_length=500)] = ()
    stock: Annotated[tuple[Stock, ...], Field(max_length=5)] = ()
    load: Annotated[
        tuple[DesignState, ...],
        BeforeValidator(_by_name),
        Field(max_length=100),
    ] = ()
    objective: Annotated[tuple[DesignObjective, ...], Field(max_length=50)] = ()
    constraint: Annotated[tuple[DesignConstraint, ...], Field(max_length=500)] = ()
    curve: Annotated[tuple[TargetCurve, ...], Field(max_length=20)] = ()
    search: SearchOptions = SearchOptions()
    tolerance: Tolerances = ()
    robust: RobustOptions | None = None

    @property
    def is_robust(self) -> bool:
        """Whether tolerances count."""
        return self.robust is not None or any(one.wanted_yield for one in self.constraint)

    @model_validator(mode="after")
    def _something(self) -> DesignSpec:
        if not (self.variable or self.stock or self.number_of_notches):
            raise ProblemError([("variable", "is missing; give at least one [[variable]] table.")])
        if not (self.objective or self.constraint or self.curve):
            text = "is missing, and so are [[constraint]] and [[curve]]; give at least one of them."
            raise ProblemError([("objective", text)])
        return self


def read_design(path: AnyPath) -> tuple[DesignSpec, Robot]:
    """Read a design file and the robot that it names.

    Args:
        path: The TOML file, in mm, N, MPa and deg.

    Returns:
        What is asked, and the robot to begin with.

    Raises:
        InputError: The file or its robot cannot be read, or a value in it is not allowed.
    """
    return with_robot(path, DesignSpec, "design file")


def design_schema() -> dict[str, Any]:
    """Return the JSON Schema of a design file (draft 2020-12).

    Example:
        >>> design_schema()["required"]
        ['robot']
    """
    text = "What a robot must do and what may be chosen for it, in mm, N, MPa and deg."
    schema = schema_of(DesignSpec, "notchflex design file", text)
    load = schema["$defs"]["DesignState"]
    del load["properties"]["name"], load["required"]
    schema["properties"]["load"] = {
        "type": "object",
        "additionalProperties": {"$ref": "#/$defs/DesignState"},
    }
    return schema
