"""A state that can be saved and continued from, and whether it belongs to a robot."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from operator import attrgetter
from typing import TYPE_CHECKING, Any, overload

import jax.tree_util as tree_util
import numpy as np
from jaxtyping import Float, Int

from notchflex._replacing import AnyPath, replacing
from notchflex._summary import MOST, Displayed, Summary, course, short, vector
from notchflex._values import ByValue
from notchflex.errors import ConvergenceError, InputError
from notchflex.loads import Load
from notchflex.loads.command import in_space
from notchflex.loads.load import short_repr
from notchflex.loads.load_path import external_rows, load_words, tendon_rows
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.flexure import LEVELS
from notchflex.results.quantities import QUANTITIES, EquilibriumQuantities
from notchflex.robot import Robot
from notchflex.robot.files import read_text
from notchflex.robot.part import fields_in
from notchflex.robot.reading import robot_from_text
from notchflex.robot.robot import to_table
from notchflex.robot.value_names import named_parts
from notchflex.solver.residual import SolverState, at_rest

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from xarray import Dataset

    from notchflex._plot import Picture
    from notchflex.analysis.geometry import RobotShape
    from notchflex.results.path import EquilibriumPath


_MAX_NAMED = 3


def differences(robot: Robot, other: Robot) -> list[str]:
    """List the values in which two robots differ, by their names in a robot file."""
    first, second = _values(robot), _values(other)
    changes: dict[tuple[str, Any, Any], list[str]] = {}
    for name in dict.fromkeys([*first, *second]):
        value, compared = first.get(name), second.get(name)
        if value != compared:
            changes.setdefault((_general(name), value, compared), []).append(name)
    changed: list[str] = []
    for (general, value, compared), names in changes.items():
        everywhere = len(names) == sum(_general(name) == general for name in first)
        shown = [general] if everywhere else names
        changed += [f"{name} = {_text(value)} instead of {_text(compared)}" for name in shown]
    return changed


def _values(robot: Robot) -> dict[str, Any]:
    """Return every value that has an effect on states by its name, notch by notch."""
    return {
        f"{named.name}.{key}": attrgetter(key)(named.part)
        for named in named_parts(robot.replace(notch=robot.notches))
        for key in fields_in(named.part)
        if named.section != "drawing" and "allowed_strain" not in key
    }


def _general(name: str) -> str:
    """Return the name that means a value of all notches or tendons."""
    section, _, key = name.partition(".")
    return f"{section.partition('[')[0]}.{key}"


def _text(value: Any) -> str:
    if value is None:
        return "none"
    return f"{value:g}" if isinstance(value, float) else str(value)


def robot_digest(robot: Robot) -> str:
    """Return 12 hexadecimal digits that depend on every value of a robot, its name included.

    Args:
        robot: The robot; comments and the order of keys in its file have no effect.

    Example:
        >>> from notchflex.robot import load_robot
        >>> wrist = load_robot("pacheco2021-a")
        >>> robot_digest(wrist) == robot_digest(wrist.with_value("notch.depth", 1.39))
        False
    """
    text = json.dumps(to_table(robot), sort_keys=True, ensure_ascii=False)
    return hashlib.sha256(text.encode()).hexdigest()[:12]


_FACTS = ("robot", "level", "loaded", "refinement")
_MODES, _TENSION = ".point.unknowns.modes", ".point.base_tension"
_LOADS = ".applied"
_MATERIAL = ".memory.material"
_FORMAT = "notchflex state 3"


@dataclass(frozen=True, repr=False, eq=False)
class State(ByValue, Displayed):
    """A solved state with the memory that the next load needs.

    Attributes:
        robot: Name of the robot it belongs to.
        arrays: Unknowns, base tensions (N), memory of contacts and material, stroke (mm) and
            loads, those as of space, by name.
        level: Loads that its chain was assembled for.
        loaded: Whether loads other than the tendons' act in it.
        refinement: Number of refinements of its modes beyond those for usual loads.
        description: The robot it belongs to; None if an older version wrote the file: nothing then
            shows whether the robot has changed since.
        source: The file that it was read from.
    """

    robot: str
    arrays: Mapping[str, np.ndarray]
    level: str
    loaded: bool
    refinement: int
    description: Robot | None = None
    source: str = ""

    def _value(self) -> Any:
        return (self.robot, self.arrays, self.level, self.loaded, self.refinement)

    def save(self, path: AnyPath) -> None:
        """Write the state to a JSON file.

        Args:
            path: The file; an existing one is replaced atomically.

        Raises:
            InputError: The file cannot be written.
        """
        content = {"format": _FORMAT} | {name: getattr(self, name) for name in _FACTS}
        content["arrays"] = {name: array.tolist() for name, array in self.arrays.items()}
        if self.description is not None:
            from notchflex.robot.writing import robot_text

            content["description"] = robot_text(self.description)
        with replacing(path) as temporary:
            temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")

    def _summary(self) -> Summary:
        tension, stroke = (_few(self.arrays[name]) for name in (_TENSION, ".stroke"))
        rows = [("tendon tension", f"{tension} N"), ("tendon stroke", f"{stroke} mm")]
        hint = "simulate(..., from_state=...) continues from it; .save(file) writes it"
        return Summary(f"State of {self.robot}", rows, hint)

    @property
    def follows(self) -> bool:
        """Whether any load in it turns with a body."""
        return bool(np.any(self.arrays.get(f"{_LOADS}.following", 0.0)))

    @classmethod
    def load(cls, path: AnyPath) -> State:
        """Read a state back; it is fitted to a robot when it is continued from.

        Args:
            path: A file written by `save`.

        Returns:
            The state.

        Raises:
            InputError: The file is missing, is not a state or is damaged.
        """
        if not str(path).strip():
            raise InputError.MISSING_VALUE(
                "the name of the state file is empty; give that of a saved state"
            )
        text = read_text(path, "state file")
        try:
            content = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise InputError.FILE_UNREADABLE(
                f"{path} cannot be read as a state: {error}; give a file written by --save-state"
            ) from None
        if not isinstance(content, dict) or content.get("format") != _FORMAT:
            raise InputError.FILE_FORMAT(
                f"{path} is not a notchflex state; give a file written by --save-state"
            )
        facts: dict[str, Any] = {name: content.get(name) for name in _FACTS}
        arrays: Any = content.get("arrays")
        robot = content.get("description")
        kinds = [type(fact) for fact in (*facts.values(), arrays)]
        if kinds != [str, str, bool, int, dict] or facts["level"] not in LEVELS:
            raise _damaged(path, "its robot, what loads it is for or its numbers are missing")
        if robot is not None:
            try:
                robot = robot_from_text(str(robot))
            except InputError:
                raise _damaged(path, "the description of its robot cannot be read") from None
        read: dict[str, np.ndarray] = {}
        for name, numbers in arrays.items():
            try:
                read[name] = np.asarray(numbers, float)
            except (TypeError, ValueError, OverflowError):
                raise _damaged(path, f"{name} is not a table of numbers") from None
            if not np.isfinite(read[name]).all():
                raise _damaged(path, f"{name} holds what is not a finite number")
        return cls(**facts, arrays=read, description=robot, source=str(path))

    def fitted(self, chain: Chain) -> SolverState:
        """Return the state for a chain, which may be assembled for more kinds of loads.

        Raises:
            InputError: It is damaged, or belongs to a robot of another make.
        """
        rest = _in_space(at_rest(chain), chain)
        leaves = leaves_of(rest)
        for name, leaf in leaves.items():
            if name not in self.arrays and not name.startswith(_LOADS):
                raise _damaged(self.source, f"{name} is missing")
            array = self.arrays.get(name, leaf)
            if name == _MODES and array.ndim == leaf.ndim and array.shape[-1] < leaf.shape[-1]:
                # The modes of every level are the first ones of the next.
                array = np.pad(array, ((0, 0), (0, leaf.shape[-1] - array.shape[-1])))
            if name == _MATERIAL and array.ndim == leaf.ndim:
                # A flexure has one node where it bends uniformly, as notches do under tendons
                # alone, and else a fixed number; those beyond, of weight 0, repeat its last one.
                array = array[:, np.minimum(np.arange(leaf.shape[1]), array.shape[1] - 1)]
            if array.shape != leaf.shape:
                holder = (
                    f"{self.source} holds a state of" if self.source else "the state belongs to"
                )
                raise InputError.STATE_OF_ANOTHER_ROBOT(
                    f"{holder} robot {self.robot!r} with other notches or tendons than this robot; "
                    "continue from a state of the same robot"
                )
            leaves[name] = array
        solved: SolverState = tree_util.tree_unflatten(
            tree_util.tree_structure(rest), leaves.values()
        )
        return _in_space(solved, chain, reduce=True)


def leaves_of(solved: SolverState) -> dict[str, np.ndarray]:
    """Return the arrays of a solved state by the names that they have in files."""
    # Files keep the names of their first version, whatever the fields of the solver are called.
    leaves, _ = tree_util.tree_flatten_with_path(solved)
    return {
        tree_util.keystr(key).replace("contact_force", "lip_force"): np.asarray(leaf)
        for key, leaf in leaves
    }


def _in_space(solved: SolverState, chain: Chain, *, reduce: bool = False) -> SolverState:
    """Return a state with its loads as those of space, or as those of its chain (`reduce`)."""
    if solved.applied is None or chain.frame is None:
        return solved
    return solved._replace(applied=in_space(solved.applied, chain.frame, reduce=reduce))


def _damaged(source: AnyPath, what: str) -> InputError:
    return InputError.FILE_DAMAGED(
        f"the state file {source} is damaged: {what}; save the state again"
    )


def check_robot(state: object, robot: Robot) -> None:
    """Raise if a state belongs to another robot; the message names the values that differ."""
    if not isinstance(state, State):
        raise InputError.WRONG_TYPE(
            "from_state must be a notchflex.State: the `state` of a result, or State.load(file); "
            f"got {short_repr(state)}"
        )
    if state.robot != robot.name:
        raise InputError.STATE_OF_ANOTHER_ROBOT(
            f"the state belongs to robot {state.robot!r}, this one is {robot.name!r}; "
            "continue from a state of the same robot"
        )
    differs = [] if state.description in (None, robot) else differences(robot, state.description)
    if differs:
        more = f" and {len(differs) - _MAX_NAMED} more" if len(differs) > _MAX_NAMED else ""
        holder = f"{state.source} holds" if state.source else "this is"
        raise InputError.STATE_OF_ANOTHER_ROBOT(
            f"{holder} a state of {robot.name!r} with other values: this robot has "
            f"{', '.join(differs[:_MAX_NAMED])}{more}. "
            "Continue with the values of the state, or start from rest."
        )


def state_of(robot: Robot, chain: Chain, solved: SolverState) -> State:
    """Return a solved state of a robot's chain as one to save or to continue from."""
    arrays = leaves_of(_in_space(solved, chain))
    return State(robot.name, arrays, chain.level, chain.loaded, chain.refinement, robot)


# One state of a path.


@dataclass(frozen=True, repr=False, eq=False)
class Equilibrium(EquilibriumQuantities, Displayed):
    """One state of a path: every quantity of `EquilibriumPath`, without the axis of steps.

    Attributes:
        path: The path that it is a state of.
        step: Which step of the path it is, counted from 0.

    Example:
        >>> from notchflex import Load, load_robot, solve
        >>> solve(load_robot("pacheco2021-a"), Load(tension=1.0))
        Equilibrium of Pacheco 2021, wrist A
          load            tension 1 N
          total angle     51.50 deg
          notch angles    11.2, 10.4, 10.2, 9.9, 9.7 deg
          tip position    (4.513, 0.000, 7.879) mm
          tendon tension  1 N
          tendon stroke   1.246 mm
          converged       yes
    """

    path: EquilibriumPath
    step: int

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.path.robot

    @property
    def load(self) -> Load:
        """The load of this step."""
        return self.path.load[self.step]

    def quantity(self, name: str) -> Any:
        """Return a quantity by its name: a number, or an array without the axis of steps.

        Args:
            name: Name of a property, such as "notch_angle".
        """
        value = self.path.quantity(name)[self.step]
        return value.item() if isinstance(value, np.generic) else value

    @property
    def front(self) -> tuple[Int[np.ndarray, " t"], Float[np.ndarray, " t"]]:
        """Friction front along every tendon, m and eta; see `EquilibriumPath.front`."""
        return self.front_contact, self.front_eta

    @property
    def state(self) -> State:
        """This state, to save or continue from."""
        return self.path.state_at(self.step)

    @property
    def shape(self) -> RobotShape:
        """Where bodies, flexures, tendons and points of the axis are, in the world."""
        from notchflex.analysis.geometry import shape_of

        return shape_of(self)

    def to_dict(self) -> dict[str, Any]:
        """Return this state as plain values: a step of the JSON document of its path.

        Returns:
            Values by the JSON keys, whose names end with the unit; angles in deg.

        Example:
            >>> from notchflex import Load, load_robot, solve
            >>> step = solve(load_robot("pacheco2021-a"), Load(tension=1.0)).to_dict()
            >>> step["load"], round(step["total_angle_deg"], 1)
            ({'tension_N': [1.0], 'stroke_mm': [None]}, 51.5)
        """
        from notchflex.results.tables import step_document

        return step_document(self.path, self.step)

    def to_xarray(self) -> Dataset:
        """Convert the state to a labelled data set, as `EquilibriumPath.to_xarray` at this step."""
        return self.path.to_xarray().isel(step=self.step)

    @overload
    def plot(self) -> Picture: ...
    @overload
    def plot(self, *, ax: Axes) -> Axes: ...
    def plot(self, *, ax: Axes | None = None) -> Picture | Axes:
        """Draw this state; see `notchflex.plot`.

        Args:
            ax: Axes of matplotlib to draw the bent robot into.

        Returns:
            The picture of robot, notch angles and tensions, which a notebook shows; the axes if
            some were given.
        """
        from notchflex._plot import plot

        return plot(self, ax=ax)

    def raise_if_failed(self) -> Equilibrium:
        """Return itself, if it converged.

        Raises:
            ConvergenceError: It did not; the message says why.
        """
        if not self.converged:
            raise ConvergenceError(self.reason, self.path.failures[self.step][0])
        return self

    def _summary(self) -> Summary:
        name, steps = self.robot.name, len(self.path)
        of = f", step {self.step + 1} of {steps}" if steps > 1 else ""
        rows = [
            ("load", load_words(self.load)),
            ("total angle", f"{self.total_angle * _ANGLE.scale:.2f} {_ANGLE.unit}"),
            ("notch angles", f"{_few(self.notch_angle * _ANGLE.scale, 1)} {_ANGLE.unit}"),
            ("tip position", f"{vector(self.tip_position, 3)} mm"),
            ("tendon tension", f"{_few(self.tension)} N"),
            ("tendon stroke", f"{_few(self.stroke)} mm"),
        ]
        if not self.converged:
            rows.insert(1, ("not converged", self.reason))
            return Summary(f"Last good state of {name}{of}", rows)
        return Summary(f"Equilibrium of {name}{of}", [*rows, ("converged", "yes")])


# Summaries of results for `repr` and notebooks.
#
# They show only quantities of the first compiled program, so that a summary never compiles another.

_ANGLE = QUANTITIES["total_angle"]
_HINT = "[step] is one state; also .plot(), .to_dataframe(), .to_xarray()"


def path_summary(path: EquilibriumPath) -> Summary:
    """Summarise a path: how load, angle and tip change along it, and whether it converged."""
    converged = path.converged
    rows = list(external_rows(path.load))
    for name, unit, values in (
        ("tension", "N", path.tension),
        ("stroke", "mm", path.stroke),
    ):
        rows += tendon_rows(name, unit, np.where(converged[:, None], values, np.nan))
    angle = np.where(converged, path.total_angle * _ANGLE.scale, np.nan)
    rows.append(("total angle", f"{course(angle, 1)} {_ANGLE.unit}"))
    tips = path.tip_position[converged]
    if len(tips):
        ends = dict.fromkeys(
            vector(tips[step], 2)
            for step in (0, int(np.nanargmax(np.abs(path.total_angle[converged]))), -1)
        )
        rows.append(("tip position", f"{' to '.join(ends)} mm"))
    rows.append(("converged", _converged(path)))
    steps = f"{len(path)} step{'s' * (len(path) != 1)}"
    from_rest = ", each from rest" if path.each_from_rest else ""
    return Summary(f"Path of {path.robot.name}, {steps}{from_rest}", rows, _HINT)


def _converged(path: EquilibriumPath) -> str:
    if path.converged.all():
        return "all steps"
    first = int(np.argmin(path.converged))
    return (
        f"{int(path.converged.sum())} of {len(path)} steps; step {first + 1}: {path.reason[first]}"
    )


def _few(values: np.ndarray, digits: int | None = None) -> str:
    """Format numbers as a list, of many the first and the last."""
    texts = [short(float(value), digits) for value in values]
    if len(texts) > 2 * MOST:
        texts = [*texts[:MOST], "…", *texts[-MOST:]]
    return ", ".join(texts)
