"""The result of following targets: drives, states, the error of each target, documents."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from notchflex import Equilibrium, EquilibriumPath, Failure, Load, LoadPath, Robot, State, simulate
from notchflex._summary import vector
from notchflex.control.problem import Attempt, TargetSearch
from notchflex.control.targets import DIRECTION, Targets, unit_hint, units_of
from notchflex.search.least_squares import KEPT
from notchflex.support import (
    DEGREES,
    QUANTITIES,
    Displayed,
    Summary,
    short,
    whole_document,
)

PerTarget = Float[np.ndarray, " k"]


@dataclass(frozen=True, eq=False, repr=False)
class Following(Displayed):
    """Drives that meet targets one after the other; k targets, t tendons.

    Attributes:
        robot: The robot.
        targets: The targets.
        load: All loads in order, those of overshoots between targets included.
        step: Which of the loads meets each target, from 0, (k,).
        attempts: Where the search for each target ended.
        start: The state before the first; None for rest.
        misses: Entries of the robot less those of the targets, mm, N, rad, (k, m); NaN where free.
        search: Tolerances, within which a target counts as met.
    """

    robot: Robot
    targets: Targets
    load: LoadPath
    step: Int[np.ndarray, " k"]
    attempts: tuple[Attempt, ...]
    start: State | None
    misses: Float[np.ndarray, "k m"]
    search: TargetSearch

    def __len__(self) -> int:
        """Number of targets."""
        return len(self.targets)

    def __getitem__(self, target: int) -> Reach:
        """The result for one target, from 0."""
        if not -len(self) <= target < len(self):
            raise IndexError(f"target {target} of {len(self)} targets")
        return Reach(self, target % len(self))

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of each entry, "mm", "deg" (of angles and directions) or another, (m,)."""
        return units_of(self.targets)

    @property
    def tolerance(self) -> float:
        """Distance from the lengths of a target at which it counts as met, mm."""
        return self.search.near

    @property
    def angle_tolerance(self) -> float:
        """Angle from those of a target at which it counts as met, rad."""
        return self.search.near_angle

    @cached_property
    def path(self) -> EquilibriumPath:
        """All states in order, simulated anew from the loads; those of overshoots included."""
        refinement = 0 if self.start is None else self.start.refinement
        return simulate(self.robot, self.load, from_state=self.start, refinement=refinement)

    @property
    def reached(self) -> Bool[np.ndarray, " k"]:
        """Whether each target is met."""
        return np.array([failure is None for failure in self.failures])

    @cached_property
    def failures(self) -> list[Failure | None]:
        """Why each target is not met; None where it is, or is missed by less than the tolerances.

        Targets of other units than mm and deg are met as exactly as the search is told.
        """
        near = (self.error_mm <= self.tolerance) & (
            self.error_deg <= self.angle_tolerance * DEGREES
        )
        near &= {*self.units} <= {"mm", "deg"}
        return [
            None if is_near and attempt.excess <= KEPT else attempt.failure
            for attempt, is_near in zip(self.attempts, near, strict=True)
        ]

    @property
    def error_mm(self) -> PerTarget:
        """Distance from the lengths of each target, mm; 0 without any, NaN without equilibrium."""
        return self._distance("mm")

    @property
    def error_deg(self) -> PerTarget:
        """Root of the sum of squares of what the angles of each target miss, deg; 0 without."""
        return self._distance("deg") * DEGREES

    def _distance(self, unit: str) -> PerTarget:
        of_unit = self.misses[:, np.array(self.units) == unit]
        solved = [attempt.solved for attempt in self.attempts]
        return np.where(solved, np.sqrt(np.nansum(of_unit**2, axis=1)), np.nan)

    def missed(self, targets: int | slice) -> str:
        """Return the distance from a target, or the largest from some, in words with units."""
        return " and ".join(
            f"{short(float(np.max(scale * self._distance(unit)[targets])))} {unit}"
            for unit in dict.fromkeys(self.units)
            for scale in (DEGREES if unit == "deg" else 1.0,)
        )

    @property
    def error(self) -> PerTarget:
        """Weighted distance from each target (mm, N, rad), which the search makes small."""
        return np.array([one.error for one in self.attempts])

    @property
    def solves(self) -> Int[np.ndarray, " k"]:
        """Number of loads solved for each target."""
        return np.array([one.solves for one in self.attempts])

    @property
    def code(self) -> list[str]:
        """Name of the `Failure` for each target; empty where it is met."""
        return [failure.name if failure else "" for failure in self.failures]

    @property
    def reason(self) -> list[str]:
        """Why each target is not met; empty where it is."""
        return [self._reason(target) for target in range(len(self))]

    def _reason(self, target: int) -> str:
        failure = self.failures[target]
        if failure is None:
            return ""
        if failure is Failure.NO_EQUILIBRIUM:
            return self.path.reason[int(self.step[target])]
        hint, positions = "", self.targets.values.get("tip_position")
        if positions is not None and failure is not Failure.SEARCH_STOPPED:
            hint = unit_hint(self.robot, positions[target])
        return f"{failure.text.format(error=self.missed(target))}; {failure.remedy}{hint}"

    @cached_property
    def tension(self) -> Float[np.ndarray, "k t"]:
        """Tension of every tendon at each target, N."""
        return self.path.tension[self.step]

    @cached_property
    def stroke(self) -> Float[np.ndarray, "k t"]:
        """Length drawn out of every tendon at each target, mm."""
        return self.path.stroke[self.step]

    @cached_property
    def tip_position(self) -> Float[np.ndarray, "k 3"]:
        """Position of the tip at each target, mm."""
        return self.path.tip_position[self.step]

    @property
    def state(self) -> State:
        """The state after the last target, to continue from."""
        return self.path.state

    def _summary(self) -> Summary:
        met = int(self.reached.sum())
        rows = [
            ("targets", f"{len(self)}, {met} met"),
            ("largest error", self.missed(slice(None))),
            ("largest tension", f"{short(float(self.path.tension.max()))} N"),
            ("solves", f"{int(self.solves.sum())}"),
        ]
        if met < len(self):
            first = int(np.argmin(self.reached))
            rows.append((f"target {first + 1}", self.reason[first]))
        hint = "[target] is one result; also .tension, .stroke, .path, .state"
        return Summary(f"Targets followed by {self.robot.name}", rows, hint)


class Reach(Displayed):
    """Drives that meet one target, and the state there.

    Example:
        >>> from notchflex import load_robot, reach
        >>> found = reach(load_robot("pacheco2021-a"), {"total_angle": 1.0}, approach="direct")
        >>> f"{found.tension[0]:.4f} N", found.code
        ('1.0601 N', '')
    """

    def __init__(self, following: Following, target: int) -> None:
        """Look at one target."""
        self.following, self.target = following, target

    @property
    def loads(self) -> list[Load]:
        """Commands: the load at the target, after that of an overshoot if any."""
        every, step = self.following, self.following.step
        first = 0 if self.target == 0 else int(step[self.target - 1]) + 1
        return [every.load[i] for i in range(first, int(step[self.target]) + 1)]

    @property
    def load(self) -> Load:
        """The load at the target."""
        return self.loads[-1]

    @property
    def reached(self) -> bool:
        """Whether the target is met."""
        return self.following.failures[self.target] is None

    @property
    def error(self) -> float:
        """Weighted distance from the target (mm, N, rad)."""
        return self.following.attempts[self.target].error

    @property
    def code(self) -> str:
        """Name of the `Failure`; empty where the target is met."""
        return self.following.code[self.target]

    @property
    def reason(self) -> str:
        """Why the target is not met; empty where it is."""
        return self.following.reason[self.target]

    @property
    def equilibrium(self) -> Equilibrium:
        """The solved state."""
        return self.following.path[int(self.following.step[self.target])]

    @property
    def tension(self) -> Float[np.ndarray, " t"]:
        """Tension of every tendon, N."""
        return self.following.tension[self.target]

    @property
    def stroke(self) -> Float[np.ndarray, " t"]:
        """Length drawn out of every tendon, mm."""
        return self.following.stroke[self.target]

    @property
    def tip_position(self) -> Float[np.ndarray, " 3"]:
        """Position of the tip, mm."""
        return self.following.tip_position[self.target]

    @property
    def state(self) -> State:
        """The state there, to continue from."""
        return self.equilibrium.state

    def _summary(self) -> Summary:
        loads: list[Any] = self.loads
        rows = [
            ("tension", f"{', '.join(short(float(one)) for one in self.tension)} N"),
            ("stroke", f"{', '.join(short(float(one)) for one in self.stroke)} mm"),
            ("tip position", f"{vector(self.tip_position, 3)} mm"),
            ("error", self.following.missed(self.target)),
            ("met", "yes" if self.reached else self.reason),
        ]
        if len(loads) > 1:
            rows.insert(0, ("overshoot", f"over {loads[0]!r}"))
        return Summary(f"Target of {self.following.robot.name}", rows)


def following_document(following: Following) -> dict[str, Any]:
    """Return the document of the path, with a list `targets` of the result for each target.

    Keys of a target: `target`, its values by quantity (units as those of the steps), `step` (of
    the path, from 0), `reached`, `error_mm` and `error_deg`, `reason`, `reason_code`
    and `solves`.
    """
    targets = [
        {
            "target": _in_file_units(following, index),
            "step": int(following.step[index]),
            "reached": bool(following.reached[index]),
            "error_mm": float(following.error_mm[index]),
            "error_deg": float(following.error_deg[index]),
            "reason": following.reason[index],
            "reason_code": following.code[index],
            "solves": int(following.solves[index]),
        }
        for index in range(len(following))
    ]
    return whole_document(following.path) | {"targets": targets}


def _in_file_units(following: Following, index: int) -> dict[str, Any]:
    """The target with the keys and units of the JSON document."""
    values: dict[str, Any] = {}
    for name, numbers in following.targets.values.items():
        key, scale = name, 1.0
        if name != DIRECTION:
            quantity = QUANTITIES[name]
            key, scale = quantity.key or name, quantity.scale
        values[key] = numbers[index] * scale
    return values


def following_columns(following: Following) -> dict[str, Sequence[Any]]:
    """Return the columns beside those of the path: which target each step is for, and its error.

    A step of an overshoot is for no target.
    """
    steps = len(following.path)
    columns: dict[str, list[Any]] = {
        name: [None] * steps for name in ("target", "error_mm", "error_deg", "target_code")
    }
    for index, step in enumerate(following.step):
        columns["target"][step] = index + 1
        columns["error_mm"][step] = float(following.error_mm[index])
        columns["error_deg"][step] = float(following.error_deg[index])
        columns["target_code"][step] = following.code[index]
    return dict(columns)
