"""The specification of a design: the tables of its file, their checks, reading and schema."""

from __future__ import annotations

import itertools
import os
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from notchflex import InputError, Robot
from notchflex.support import (
    Float,
    FloatOrInf,
    Int,
    ProblemError,
    Tolerances,
    part,
    quantity,
    read_specification,
    robot_named,
    schema_of,
    validated,
)

REFUSE = InputError.INVALID_SPECIFICATION

_LARGE = 1e9


def number(text: str, **limits: float) -> Any:
    """Describe a number whose unit is that of a quantity."""
    return Field(description=text, **({"ge": -_LARGE, "le": _LARGE} | limits))  # pyright: ignore


def check_order(lower: float, upper: float, otherwise: str) -> None:
    """Raise if a least value is not less than the greatest; `otherwise` says what else to do."""
    if not lower < upper:
        text = f"is {lower:g}, not less than `upper`, {upper:g}; exchange them, or {otherwise}."
        raise ProblemError([("lower", text)])


def _one_or_several(value: Any) -> Any:
    """Take a single entry as a list of one."""
    several = isinstance(value, Sequence) and not isinstance(value, str | bytes)
    return value if several or value is None else (value,)


Numbers = Annotated[tuple[Int, ...], BeforeValidator(_one_or_several)]
Commanded = Annotated[tuple[FloatOrInf, ...], BeforeValidator(_one_or_several)]
Vector = Annotated[tuple[Float, ...], Field(min_length=3, max_length=3)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]*$", max_length=40)]
WANTED = Field(
    ge=0.5, le=0.9999, description="part of the robots made within tolerances that must meet limits"
)


# A coordinate beyond is in another unit, mm.
_MAX_COORDINATE = 1e4


@part(kw_only=True, refuse=REFUSE)
class Measured:
    """A quantity of a robot at a state, or a value of the robot file.

    Args:
        quantity: Name of a quantity, or path of the robot file.
        state: The state.
        minus: Another state, whose value is subtracted: the width of a hysteresis.
        notch: Only these notches, from 1.
        tendon: Only these tendons, from 1.
        axis: Only this coordinate.
        direction: Direction of the tip compliance, in the world.
        take: How several numbers are made one.
    """

    quantity: Annotated[str, Field(description="name of a quantity, or path of the robot file")]
    state: Annotated[str | None, Field(description="name of a state")] = None
    minus: Annotated[str | None, Field(description="state whose value is subtracted")] = None
    notch: Annotated[Numbers | None, Field(description="only these notches, from 1")] = None
    tendon: Annotated[Numbers | None, Field(description="only these tendons, from 1")] = None
    axis: Annotated[
        Literal["x", "y", "z"] | None, Field(description='only this coordinate: "x", "y" or "z"')
    ] = None
    direction: Annotated[
        Vector | None, Field(description="direction of the tip compliance, three numbers")
    ] = None
    take: Annotated[
        Literal["each", "largest", "smallest", "sum", "mean", "range", "steps", "rms"] | None,
        Field(description='how several numbers are made one: "largest", "sum", "range", ...'),
    ] = None

    @model_validator(mode="after")
    def _two_states(self) -> Measured:
        if self.minus is not None and self.minus == self.state:
            raise ProblemError([("minus", "is the state itself; give another state.")])
        return self


@part(kw_only=True, refuse=REFUSE)
class DesignObjective(Measured):
    """An objective: a quantity to minimise, maximise or bring near a value.

    Args:
        goal: "minimise" or "maximise"; not with `target`.
        target: The value to come near to, by least squares.
        weight: Its weight beside other objectives, each in its own unit.
    """

    goal: Annotated[
        Literal["minimise", "maximise"] | None, Field(description='"minimise" or "maximise"')
    ] = None
    target: Annotated[Float | None, number("value to come near to")] = None
    weight: Annotated[Float, number("weight beside other objectives", ge=1e-9)] = 1.0

    @model_validator(mode="after")
    def _one_goal(self) -> DesignObjective:
        if (self.goal is None) == (self.target is None):
            text = 'is needed, or `target`, but not both; write goal = "minimise", for example.'
            raise ProblemError([("goal", text)])
        return self


@part(kw_only=True, refuse=REFUSE)
class DesignConstraint(Measured):
    """A constraint.

    Args:
        equal: The value it must have.
        lower: The least value.
        upper: The greatest value.
        order: Along the notches the value must fall ("tip-first": the tip closes first) or rise
            ("base-first").
        margin: By how much at least, from one notch to the next.
        wanted_yield: Part of the robots made within the tolerances that must meet it; without it
            the robot of the drawing must.
    """

    equal: Annotated[Float | None, number("value it must have")] = None
    lower: Annotated[Float | None, number("least value")] = None
    upper: Annotated[Float | None, number("greatest value")] = None
    order: Annotated[
        Literal["tip-first", "base-first"] | None,
        Field(description='"tip-first" or "base-first"'),
    ] = None
    margin: Annotated[Float, number("difference from notch to notch", ge=0.0)] = 0.0
    wanted_yield: Annotated[Float | None, WANTED] = None

    @model_validator(mode="after")
    def _asks_one_thing(self) -> DesignConstraint:
        limits = self.lower is not None or self.upper is not None
        if [self.equal is not None, limits, self.order is not None].count(True) != 1:
            text = "asks for nothing, or for too much; give `equal`, `lower` and/or `upper`, or "
            raise ProblemError([("", f"{text}`order`.")])
        if self.equal is not None and self.wanted_yield is not None:
            text = "is for limits: no robot with tolerances meets `equal`; give `lower` and `upper`"
            raise ProblemError([("wanted_yield", f"{text}.")])
        if self.lower is not None and self.upper is not None:
            check_order(self.lower, self.upper, "use `equal`")
        return self


@part(kw_only=True, refuse=REFUSE)
class TargetCurve:
    """A curve in the frame of the base that the tube axis must follow at a state.

    Args:
        name: `curve.NAME` is the quantity: distance of every point from the axis, mm; the last
            point is that of the tip.
        state: The state.
        points: Points, three numbers each, mm.
        curvature: Instead of points: pairs of arc length (mm, rising from 0) and curvature (1/mm,
            positive toward x) in the plane of x and z, straight lines between.
        within: Distance from the axis up to which a point counts as reached, mm.
    """

    name: Annotated[Name, Field(description="name of the curve")]
    state: Annotated[str, Field(description="name of a state")]
    points: Annotated[
        tuple[Vector, ...] | None, Field(min_length=2, max_length=1000, description="points, in mm")
    ] = None
    curvature: Annotated[
        tuple[Annotated[tuple[Float, ...], Field(min_length=2, max_length=2)], ...] | None,
        Field(min_length=2, max_length=1000, description="pairs of arc length and curvature"),
    ] = None
    within: Annotated[Float, quantity("mm", "distance up to which a point is reached", above=0)] = (
        0.2
    )

    @model_validator(mode="after")
    def _one_form(self) -> TargetCurve:
        if (self.points is None) == (self.curvature is None):
            raise ProblemError([("points", "or `curvature` is needed; give one of them.")])
        far = max((abs(x) for one in self.points or () for x in one), default=0.0)
        if far > _MAX_COORDINATE:
            text = f"has a coordinate of {far:g}; give mm, at most {_MAX_COORDINATE:g} mm."
            raise ProblemError([("points", text)])
        if self.curvature is not None:
            lengths = [one[0] for one in self.curvature]
            rises = all(a < b for a, b in itertools.pairwise(lengths))
            if lengths[0] != 0.0 or not rises:
                text = "must begin at an arc length of 0 mm, and rise from pair to pair."
                raise ProblemError([("curvature", text)])
        return self


@part(kw_only=True, refuse=REFUSE)
class DesignVariable:
    """A number that the search may choose.

    Args:
        value: Path of the robot file, such as `notch.depth`, or `state.NAME.tension[1]`.
        lower: Least value allowed, in the unit of the robot file.
        upper: Greatest value allowed.
        along: For a value of the notches: "all" have the same, "each" has its own, or "polynomial"
            along the tube.
        degree: Degree of the polynomial; 1 if not given.
    """

    value: Annotated[str, Field(description="path of the robot file, or state.NAME.tension[1]")]
    lower: Annotated[Float, number("least value allowed")]
    upper: Annotated[Float, number("greatest value allowed")]
    along: Annotated[
        Literal["all", "each", "polynomial"],
        Field(description='"all" notches have the same value, "each" its own, or "polynomial"'),
    ] = "all"
    degree: Annotated[
        Int | None, Field(ge=1, le=6, description="degree of the polynomial; 1 if not given")
    ] = None

    @model_validator(mode="after")
    def _in_order(self) -> DesignVariable:
        check_order(self.lower, self.upper, "set the value in the robot file")
        if self.degree is not None and self.along != "polynomial":
            text = f'is for along = "polynomial", and along is "{self.along}"; change one of them.'
            raise ProblemError([("degree", text)])
        return self


@part(kw_only=True, refuse=REFUSE)
class Stock:
    """Sizes that can be bought: several values that change together.

    Args:
        values: Paths of the robot file.
        sizes: A list of sizes, each with one number for every path.
    """

    values: Annotated[
        tuple[str, ...], Field(min_length=1, max_length=20, description="paths of the robot file")
    ]
    sizes: Annotated[
        tuple[tuple[Float, ...], ...],
        Field(min_length=1, max_length=100, description="sizes, each with a number for every path"),
    ]

    @model_validator(mode="after")
    def _complete(self) -> Stock:
        wrong = [one for one in self.sizes if len(one) != len(self.values)]
        if wrong:
            text = f"has a size of {len(wrong[0])} numbers for {len(self.values)} values; give "
            raise ProblemError([("sizes", f"{text}{len(self.values)} numbers for every size.")])
        return self


@part(kw_only=True, refuse=REFUSE)
class DesignState:
    """A load under which quantities of the robot are asked.

    Args:
        name: What objectives and constraints call it.
        tension: Tension of the first tendon, or of each, N; `nan` where not commanded.
        stroke: Stroke of the first tendon, or of each, mm; `nan` where not commanded.
        after: The state that comes before, with its friction; from rest where not given.
        steps: Number of equal steps from the state before.
        tip_force: Force at the tip, N.
        tip_moment: Moment at the tip, N mm.
        tip_mass: Mass that hangs at the tip, g.
    """

    name: Annotated[Name, Field(description="name of the state")]
    tension: Annotated[
        Commanded | None, Field(description="tension of the first tendon, or of each, in N")
    ] = None
    stroke: Annotated[
        Commanded | None, Field(description="stroke of the first tendon, or of each, in mm")
    ] = None
    after: Annotated[str | None, Field(description="the state that comes before")] = None
    steps: Annotated[Int, Field(ge=1, le=200, description="steps from the state before")] = 5
    tip_force: Annotated[Vector, Field(description="force at the tip, three numbers in N")] = (
        0.0,
        0.0,
        0.0,
    )
    tip_moment: Annotated[Vector, Field(description="moment at the tip, three numbers in N mm")] = (
        0.0,
        0.0,
        0.0,
    )
    tip_mass: Annotated[Float, number("mass at the tip, in g", ge=0.0, le=1e6)] = 0.0


@part(kw_only=True, refuse=REFUSE)
class SearchOptions:
    """Effort of the search.

    Args:
        starts: Number of starts, of which the robot as it is is one.
        candidates: Number of robots from which the other starts are taken.
        seed: Seed of the random numbers.
        iterations: Most iterations of each search.
    """

    starts: Annotated[Int, Field(ge=1, le=1000, description="number of starts")] = 6
    candidates: Annotated[
        Int, Field(ge=1, le=100_000, description="robots from which starts are taken")
    ] = 64
    seed: Annotated[Int, Field(ge=0, le=2**31, description="seed of the random numbers")] = 0
    iterations: Annotated[Int, Field(ge=1, le=10_000, description="most iterations")] = 150


@part(kw_only=True, refuse=REFUSE)
class RobustOptions:
    """Yield of robots within tolerances.

    Args:
        wanted_yield: Part of the robots that must meet all limits. Without it, and where no
            constraint has one of its own, the yield is made as great as possible, instead of the
            objectives.
        draws: About how many robots the yield is counted of.
        seed: Seed of the draws.
    """

    wanted_yield: Annotated[Float | None, WANTED] = None
    draws: Annotated[Int, Field(ge=100, le=1_000_000, description="robots that are drawn")] = 4000
    seed: Annotated[Int, Field(ge=0, le=2**31, description="seed of the draws")] = 0


@part(refuse=REFUSE, kw_only=True)
class DesignSpec:
    """Specification of a design.

    Args:
        robot: Name of a ready robot, or path of a robot file, beside the design file.
        name: What tables and pictures call the design.
        number_of_notches: Numbers of equal notches to try; as in the robot where not given.
        variable: The variables.
        stock: Sizes that can be bought.
        state: The states.
        objective: The objectives; none means the smallest change of the robot.
        constraint: The constraints.
        curve: The curves to be followed.
        search: How hard the search tries.
        tolerance: Within what robots are made, as in a robot file; where not given, the tolerances
            of the robot, and assumed ones.
        robust: How robots made within the tolerances are to meet the limits.
    """

    _: KW_ONLY
    robot: Annotated[str, Field(min_length=1, description="ready robot, or robot file")]
    name: Annotated[str, Field(min_length=1, max_length=200, description="name of the design")] = (
        "design"
    )
    number_of_notches: Annotated[
        Numbers, Field(max_length=100, description="numbers of notches to try")
    ] = ()
    variable: Annotated[
        tuple[DesignVariable, ...], Field(max_length=500, description="numbers to be chosen")
    ] = ()
    stock: Annotated[tuple[Stock, ...], Field(max_length=5, description="sizes to be bought")] = ()
    state: Annotated[tuple[DesignState, ...], Field(max_length=100, description="loads")] = ()
    objective: Annotated[
        tuple[DesignObjective, ...], Field(max_length=50, description="what is to be small")
    ] = ()
    constraint: Annotated[
        tuple[DesignConstraint, ...], Field(max_length=500, description="what must hold")
    ] = ()
    curve: Annotated[tuple[TargetCurve, ...], Field(max_length=20, description="curves")] = ()
    search: Annotated[SearchOptions, Field(description="how hard the search tries")] = (
        SearchOptions()
    )
    tolerance: Annotated[Tolerances, Field(description="how far values may lie from these")] = ()
    robust: Annotated[
        RobustOptions | None, Field(description="what robots made within the tolerances must meet")
    ] = None

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


def read_design(path: str | os.PathLike[str]) -> tuple[DesignSpec, Robot]:
    """Read a design file and the robot that it names.

    Args:
        path: The TOML file, in mm, N, MPa and deg.

    Returns:
        What is asked, and the robot to begin with.

    Raises:
        InputError: The file or its robot cannot be read, or a value in it is not allowed.
    """
    spec = read_specification(path, "design file", spec_from_table)
    return spec, robot_named(spec.robot, Path(path).parent)


def spec_from_table(table: Mapping[str, Any]) -> DesignSpec:
    """Make a specification from the plain table of a design file.

    Raises:
        InputError: A key is missing, not known, or its value is not allowed.

    Example:
        >>> wish = {"quantity": "notch.height", "goal": "minimise"}
        >>> height = {"value": "notch.height", "lower": 0.3, "upper": 1.0}
        >>> table = {"robot": "pacheco2021-a", "variable": [height], "objective": [wish]}
        >>> spec_from_table(table).variable[0].along
        'all'
    """
    return validated(DesignSpec, table)


def design_schema() -> dict[str, Any]:
    """Return the JSON Schema of a design file (draft 2020-12).

    Example:
        >>> design_schema()["required"]
        ['robot']
    """
    text = "What a robot must do and what may be chosen for it, in mm, N, MPa and deg."
    return schema_of(DesignSpec, "notchflex design file", text)
