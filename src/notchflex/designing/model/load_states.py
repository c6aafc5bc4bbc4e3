"""The states of a design as one load path, followed piece by piece from rest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from notchflex.designing.model.variables import LoadNumber
from notchflex.designing.specification.spec import DesignState
from notchflex.errors import InputError
from notchflex.loads import LoadPath
from notchflex.loads.external import ExternalLoad
from notchflex.robot.error_messages import nearest

PROBE = 1e-3
"""Force by which a compliance is found, to both sides, N."""

Direction = tuple[float, float, float]


@dataclass(frozen=True)
class Probe:
    """A small force at the tip after a state."""

    state: str
    direction: Direction
    side: int


@dataclass(frozen=True)
class StatePaths:
    """The states of a design, in pieces that each begin at rest.

    Attributes:
        states: The states by name.
        tendons: Number of tendons of the robot.
        pieces: What each piece goes through, in order: names of states, and at the end a probe.
    """

    states: Mapping[str, DesignState]
    tendons: int
    pieces: tuple[tuple[str | Probe, ...], ...]

    @property
    def step(self) -> dict[str | Probe, int]:
        """The step of every state and probe, from 0; of one in several pieces the first."""
        steps: dict[str | Probe, int] = {}
        last = -1
        for piece in self.pieces:
            for one in piece:
                last += 1 if isinstance(one, Probe) else self.states[one].steps
                steps.setdefault(one, last)
        return steps

    @property
    def lengths(self) -> list[int]:
        """Number of steps of every piece."""
        steps = (
            (1 if isinstance(one, Probe) else self.states[one].steps for one in piece)
            for piece in self.pieces
        )
        return [sum(one) for one in steps]

    @property
    def from_rest(self) -> Bool[np.ndarray, " s"]:
        """Which steps begin at rest."""
        lengths = self.lengths
        begins = np.zeros(sum(lengths), bool)
        begins[np.cumsum([0, *lengths[:-1]])] = True
        return begins

    def path(self, numbers: Mapping[LoadNumber, float]) -> LoadPath:
        """Return the whole path.

        Args:
            numbers: Tensions and strokes that are variables.
        """
        commands: list[np.ndarray] = []
        external: list[ExternalLoad] = []
        for piece in self.pieces:
            before = np.zeros((2, self.tendons))
            load = ExternalLoad()
            for one in piece:
                if isinstance(one, Probe):
                    force = np.array(load.tip_force) + one.side * PROBE * np.array(one.direction)
                    commands.append(before[None])
                    external.append(_external(self.states[one.state], tuple(force.tolist())))
                    continue
                state = self.states[one]
                after = self._commanded(state, numbers)
                # A slack tendon is pulled from 0 N; what changes from stroke to tension jumps.
                slack = np.isnan(before).all(axis=0) & np.array([[True], [False]])
                first = np.where(slack, 0.0, np.where(np.isnan(before), after, before))
                part = np.arange(1, state.steps + 1) / state.steps
                commands.append(first + part[:, None, None] * (after - first))
                load = _external(state, state.tip_force)
                external += [load] * state.steps
                before = after
        every = np.concatenate(commands)
        return LoadPath(every[:, 0], every[:, 1], external=tuple(external))

    def _commanded(
        self, state: DesignState, numbers: Mapping[LoadNumber, float]
    ) -> Float[np.ndarray, "2 t"]:
        """Tensions and strokes of a state, NaN where not commanded."""
        table = np.full((2, self.tendons), np.nan)
        for row, kind in enumerate(("tension", "stroke")):
            given = getattr(state, kind) or ()
            table[row, : len(given)] = given
        for one, value in numbers.items():
            if one.state == state.name:
                table[("tension", "stroke").index(one.kind), one.tendon] = value
        return table


def _external(state: DesignState, force: Sequence[float]) -> ExternalLoad:
    return ExternalLoad(
        tip_force=tuple(force), tip_moment=state.tip_moment, tip_mass=state.tip_mass
    )


def state_paths(
    states: Sequence[DesignState],
    tendons: int,
    used: Sequence[str],
    probes: Sequence[tuple[str, Direction]],
) -> StatePaths:
    """Lay out the states of a design.

    Args:
        states: The states.
        tendons: Number of tendons of the robot.
        used: Names of the states that anything is asked of.
        probes: States and directions of tip compliances.

    Raises:
        InputError: States of one name, an unknown state before another, or a circle of states.
    """
    table = {one.name: one for one in states}
    pieces: list[tuple[str | Probe, ...]] = []
    for state, direction in dict.fromkeys(probes):
        pieces += [(*history(table, state), Probe(state, direction, side)) for side in (1, -1)]
    for name in used:
        way = history(table, name)
        if not any(piece[: len(way)] == way for piece in pieces):
            # A longer piece serves the states on its way too.
            pieces = [piece for piece in pieces if piece != way[: len(piece)]]
            pieces.append(way)
    return StatePaths(table, tendons, tuple(pieces))


def check_states(states: Sequence[DesignState], tendons: int) -> None:
    """Raise if states contradict each other or the robot.

    Raises:
        InputError: Two states of one name, an unknown state before another, a circle, no load, or
            a load of a tendon that is not there.
    """
    table = {one.name: one for one in states}
    for number, one in enumerate(states, start=1):
        shown = f"`state[{number}]` ({one.name})"
        if table[one.name] is not one:
            raise InputError.CONFLICT(f"{shown}: another state has this name; rename one of them.")
        history(table, one.name)
        for kind in ("tension", "stroke"):
            given = getattr(one, kind) or ()
            if len(given) > tendons:
                raise InputError.WRONG_SHAPE(
                    f"{shown} gives a {kind} of {len(given)} tendons, but the robot has {tendons}."
                )
            finite = [value for value in given if value == value]
            if any(abs(value) > 1e6 for value in finite):
                raise InputError.OUT_OF_RANGE(f"{shown} has a {kind} beyond 1e6; give N and mm.")
            if kind == "tension" and any(value < 0.0 for value in finite):
                raise InputError.OUT_OF_RANGE(
                    f"{shown} has a tension below 0 N; a tendon only pulls."
                )
        StatePaths({one.name: one}, tendons, ((one.name,),)).path({})  # raises for both at once


def history(states: Mapping[str, DesignState], name: str) -> tuple[str, ...]:
    """Return the states from rest up to one.

    Raises:
        InputError: One of them does not exist, or they run in a circle.
    """
    way: list[str] = []
    before: str | None = name
    while before is not None:
        if before not in states:
            raise InputError.UNKNOWN_NAME(
                f"there is no state `{before}`{nearest(before, states)}; "
                f"there are {', '.join(states) or 'none'}."
            )
        if before in way:
            raise InputError.CONFLICT(
                f"the states {' and '.join(way)} come after each other in a circle; one of them "
                "must begin at rest, without `after`."
            )
        way.insert(0, before)
        before = states[before].after
    return tuple(way)
