"""Loads and angles at which notches close, of one robot or of many that differ by a few numbers.

The overlap, contact force / stiffness - gap, rises with the tension and goes through zero where
the notch closes. Many notches are searched at once; a solve that does not converge gives NaN, and
costs a notch one trial, not its result.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, is_dataclass, replace
from enum import StrEnum
from operator import attrgetter
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from notchflex._jax import jax, jit, jnp
from notchflex._summary import Displayed, Summary, short
from notchflex.analysis.batch import BatchRows, BatchTable, LoadRows
from notchflex.analysis.forward_model import ForwardModel
from notchflex.analysis.slopes import changes, derivatives, load_change
from notchflex.analysis.tangent import Change
from notchflex.analysis.varied import FEW, VariedRobots
from notchflex.loads import LoadPath
from notchflex.loads.command import tension_commands
from notchflex.mechanics.chain import Chain, assemble, sites_of
from notchflex.mechanics.contact import closing_angles, free_angle
from notchflex.mechanics.flexure import rod_at
from notchflex.mechanics.material import FibreSection, Law, peak_strain, section_strain
from notchflex.results.path import EquilibriumPath
from notchflex.results.quantities import DEGREES, QUANTITIES
from notchflex.robot import Robot, TableNotch
from notchflex.robot.kinds import Notch
from notchflex.robot.part import fields_in, unit_of
from notchflex.robot.value_names import number_at
from notchflex.solver.newton import DEFAULT, Settings
from notchflex.solver.programs.compiled import number_of_cores
from notchflex.solver.programs.prepare import PreparedChain, prepare
from notchflex.solver.programs.run import run, solve_contacts

PerNotch = Float[np.ndarray, " n"]
"""A number of every notch."""

Which = Bool[np.ndarray, " m"]
"""Which of the notches that are searched."""

Searched = Float[np.ndarray, " m"]
"""Tensions or overlaps, one of each notch that is searched."""

Overlap = Callable[[Searched, Which], Searched]
"""From one tension per notch, and which notches are asked for, to their overlaps (mm).

NaN where the solve did not converge. What it gives of the other notches is not read.
"""


class ClosingStatus(StrEnum):
    """Whether a notch closes under its tendon, pulled alone from rest.

    Attributes:
        CLOSES: "closes": the tension is known.
        NEVER: "never": the largest tension tried leaves it open.
        NOT_FOUND: "not found": the solver did not converge at the tensions in question.
    """

    CLOSES = "closes"
    NEVER = "never"
    NOT_FOUND = "not found"


# A notch that stays open after the first guess was doubled so often never closes.
_DOUBLINGS = 6
# Trials between a tension that leaves a notch open and one where the solver fails.
_TRIALS = 12
PRECISION = 1e-11
"""Relative precision of a tension."""

# A notch that snaps shut has no root but a jump, next to which the solver need not converge.
_AT_SNAP = 1e-3
# Enough to bisect every fifth time, which is what a jump takes.
_ROUNDS = 200


def closing_tensions(
    overlap: Overlap, guess: Searched, precision: float = PRECISION
) -> tuple[Searched, np.ndarray]:
    """Find the tension that closes each notch, N, NaN where none was found; and its status."""
    low, high, failed = _bracket(overlap, guess)
    bracketed = np.isfinite(high)
    tension, precise = find_roots(overlap, low, np.where(bracketed, high, low), precision)
    closes = bracketed & precise
    return np.where(closes, tension, np.nan), statuses(closes, ~bracketed & ~failed)


def statuses(closes: Which, never: Which) -> np.ndarray:
    """Return a `ClosingStatus` for every notch: where neither holds, it was not found."""
    status = np.full(len(closes), ClosingStatus.NOT_FOUND, dtype=object)
    status[closes], status[never] = ClosingStatus.CLOSES, ClosingStatus.NEVER
    return status


def _bracket(overlap: Overlap, guess: Searched) -> tuple[Searched, Searched, Which]:
    """A tension that leaves each notch open, one that closes it (NaN: none), and failures met."""
    low, high = np.zeros_like(guess), np.full_like(guess, np.nan)
    failing = np.full_like(guess, np.nan)  # smallest tension above `low` that failed
    trial = guess
    for number in range(1 + _DOUBLINGS + _TRIALS):
        doubling = number <= _DOUBLINGS
        searched = np.isnan(high) & (doubling | np.isfinite(failing))
        if not searched.any():
            break
        value = overlap(trial, searched)
        high = np.where(searched & (value > 0.0), trial, high)
        low = np.where(searched & (value <= 0.0), trial, low)
        failing = np.where(searched & np.isnan(value), np.fmin(failing, trial), failing)
        failing = np.where(failing > low, failing, np.nan)
        # Beyond the largest tension there is nothing to try, but before the first that failed.
        trial = 2.0 * trial if number < _DOUBLINGS else 0.5 * (low + np.fmax(low, failing))
    return low, high, np.isfinite(failing)


def find_roots(
    overlap: Overlap,
    low: Searched,
    high: Searched,
    precision: float = PRECISION,
) -> tuple[Searched, Which]:
    """Find roots by false position, bisecting where that stalls, and whether each is precise."""
    # `low` leaves a notch open, `high` closes it; both are the same for one that is not searched.
    # After a failed solve the next trials are elsewhere in the bracket, ever closer to its low end.
    # `scipy.optimize.elementwise.find_root` gives a notch up at its first NaN. Of 9 ready robots it
    # solves 2221 states for the same roots, this one 1274 (wrist A: 281 and 67; York: 242 and 433).
    searched = low < high
    at_low, at_high = overlap(low, searched), overlap(high, searched)
    width, misses = high - low, np.zeros(low.shape, int)
    side, slow = np.zeros(low.shape, int), np.zeros(low.shape, int)
    for _ in range(_ROUNDS):
        open_still = (high - low > precision * high) & (misses < _TRIALS)
        if not open_still.any():
            break
        with np.errstate(divide="ignore", invalid="ignore"):
            part = at_low / (at_low - at_high)
        part = np.where((slow > 3) | ~((part > 0.0) & (part < 1.0)), 0.5, part)
        part = np.where(misses > 0, 0.6**misses, part)
        trial = low + part * (high - low)
        value = np.where(open_still, overlap(trial, open_still), np.nan)
        up, down = value > 0.0, value <= 0.0
        # The end that stays a second time counts less, by what the other one has changed: a slope
        # that differs beyond the root does not keep it from being reached (Anderson, Björck).
        with np.errstate(divide="ignore", invalid="ignore"):
            less_low, less_high = 1.0 - value / at_high, 1.0 - value / at_low
        less_low, less_high = (np.where(m > 0.0, m, 0.5) for m in (less_low, less_high))
        high, at_high = np.where(up, trial, high), np.where(up, value, at_high)
        low, at_low = np.where(down, trial, low), np.where(down, value, at_low)
        at_low = np.where(up & (side > 0), less_low * at_low, at_low)
        at_high = np.where(down & (side < 0), less_high * at_high, at_high)
        side = np.where(up, 1, np.where(down, -1, side))
        misses = np.where(up | down, 0, misses + open_still)
        slow = np.where(high - low > 0.5 * width, slow + 1, 0)
        width = high - low
    reached = np.where(misses >= _TRIALS, _AT_SNAP, precision)
    return 0.5 * (low + high), high - low <= reached * high


_ANGLE = QUANTITIES["total_angle"]
_MAX_ROWS = 12
# So much below its closing tension a notch is taken to be open, relative.
_BELOW = 1e-9
# Number of steps of the first pull, and its end over the tension that would close the softest notch
# if it were linear and alone; notches that do not close by then are reported as never closing.
_STEPS, _BEYOND_LINEAR = 40, 2.0


@dataclass(frozen=True, repr=False)
class Closing(Displayed):
    """Closing of every notch, base to tip.

    Attributes:
        robot: The robot.
        angle: Notch angle at which its edges touch, precurvature included, rad.
        tension: Base tension that closes it, N, loading from rest; NaN where none was found.
        status: A `ClosingStatus`: "closes"; "never", no tension up to 64 times the one that
            would close a linear notch alone (twice that of the softest for slots); or "not found",
            the solver did not converge at the tensions in question.
        tendon: The tendon pulled for it, counted from 1: the one with the longest lever.
        outer_strain: Strain of the outer fibre on the spine when closed (Pacheco 2021, eq. 16).
        peak_strain: Largest strain of any fibre when closed.
    """

    robot: Robot
    angle: PerNotch
    tension: PerNotch
    status: np.ndarray
    tendon: np.ndarray
    outer_strain: PerNotch
    peak_strain: PerNotch

    def jacobian(self, names: str | Sequence[str]) -> dict[str, Float[np.ndarray, "n k"]]:
        """Differentiate closing tensions and angles by numbers of the robot.

        Args:
            names: Numbers of the robot file, as for `Robot.with_value`, in the units of the file.

        Returns:
            "tension" (N) and "angle" (rad) per unit of each number, notches by numbers; NaN for
            notches without a tension that closes them.

        Raises:
            InputError: There is no such number.

        Example:
            >>> from notchflex import load_robot
            >>> slopes = closing(load_robot("pacheco2021-a")).jacobian(["notch.height"])
            >>> print(f"{slopes['tension'][0, 0]:.2f} N/mm")
            0.14 N/mm
        """
        names = (names,) if isinstance(names, str) else tuple(names)
        for name in names:
            number_at(self.robot, name)
        if not np.isfinite(self.tension).any():
            return dict.fromkeys(
                ("tension", "angle"), np.full((len(self.tension), len(names)), np.nan)
            )
        tension, angle = self.along(lambda path: changes(path, names))
        return {"tension": tension, "angle": angle}

    def along(
        self, directions: Callable[[EquilibriumPath], Sequence[Change]]
    ) -> tuple[Float[np.ndarray, "n v"], Float[np.ndarray, "n v"]]:
        """Differentiate closing tensions (N) and angles (rad) along changes of the robot.

        Args:
            directions: Gives the changes for a path of the robot just before its notches close.
        """
        closes = np.flatnonzero(np.isfinite(self.tension))
        rows = np.arange(len(closes))
        unit = np.eye(self.robot.number_of_tendons)[self.tendon[closes] - 1]
        load = LoadPath((1.0 - _BELOW) * self.tension[closes, None] * unit)
        path = ForwardModel(self.robot, load, from_rest=True).solve(self.robot, load)
        along = [*directions(path), Change(load_change(path, LoadPath(load.tension + unit)), None)]
        by = derivatives(path, along, ("gap", "notch_angle"))
        gap, angle = (by[name][:, rows, closes].T for name in ("gap", "notch_angle"))
        slopes = np.full((2, len(self.tension), len(along) - 1), np.nan)
        slopes[0, closes] = -gap[:, :-1] / gap[:, -1:]
        slopes[1, closes] = angle[:, :-1] + angle[:, -1:] * slopes[0, closes]
        return slopes[0], slopes[1]

    def _summary(self) -> Summary:
        rows = [
            (
                f"notch {notch + 1}",
                f"{short(float(angle) * _ANGLE.scale)} {_ANGLE.unit}, "
                + (f"{short(float(tension))} N" if tension == tension else "no tension found"),
            )
            for notch, (angle, tension) in enumerate(zip(self.angle, self.tension, strict=True))
        ]
        left = len(rows) - _MAX_ROWS
        hint = f"and {left} more notches" if left > 0 else ""
        return Summary("Closing of every notch", rows[:_MAX_ROWS], hint)


def closing(robot: Robot) -> Closing:
    """Find the angle, tension and strain at which every notch closes.

    The tension is found on the solver itself, with friction and all other notches: the root of
    contact force / stiffness - gap, which rises through zero where a notch closes.

    Args:
        robot: The robot.

    Returns:
        The closing of every notch.

    Example:
        >>> from notchflex import load_robot
        >>> table = closing(load_robot("pacheco2021-a"))
        >>> print(f"{np.degrees(table.angle[0]):.2f} deg, {table.tension[0]:.3f} N")
        30.63 deg, 1.615 N
    """
    chain = assemble(robot, flat=False)
    rods = chain.rods
    closing_angle, free = np.asarray(closing_angles(rods)), free_angle(rods)
    height = np.asarray(rods.length.sum(-1))
    section = rods.section
    arm = moment_arms(chain)
    tendon, longest = arm.argmax(axis=1), arm.max(axis=1)
    has_spine = np.isfinite(closing_angle)
    ready, (tension, contact_angle) = prepare(robot), np.full((2, len(height)), np.nan)
    status = np.full(len(height), ClosingStatus.NEVER, object)
    if not any(pair.acts_on_bodies for pair in chain.contact_pairs):
        closes = np.flatnonzero((longest > 0.0) & (closing_angle > 0.0) & has_spine)
        if len(closes):
            stiffness = np.asarray(ready.chain.stiffness)[closes, 0]
            linear = stiffness * closing_angle[closes] / longest[closes]
            tension[closes], status[closes] = _tensions(ready, tendon, closes, linear)
    else:
        # A backbone has no edges that meet.
        meets = sum((pair.has_contact.sum(axis=-1) for pair in chain.contact_pairs), 0.0 * longest)
        for number in np.unique(tendon):
            # It is pulled in steps from rest, which brackets the tension where an edge touches.
            pulled = np.flatnonzero((tendon == number) & (longest > 0.0) & (meets > 0.0))
            if len(pulled):
                tension[pulled], contact_angle[pulled], status[pulled] = _by_one_tendon(
                    ready, int(number), pulled
                )
    elastic = np.where(has_spine, closing_angle / height, np.nan)
    first = jax.tree.map(lambda leaf: leaf[:, 0], section)
    outer, peak = _strains(chain.law, first, elastic, chain.law.rest(first))
    return Closing(
        robot=robot,
        angle=np.where(has_spine, closing_angle + free, contact_angle),
        tension=tension,
        status=status,
        tendon=tendon + 1,
        outer_strain=np.asarray(outer),
        peak_strain=np.asarray(peak),
    )


@jit
def _strains(law: Law, sections: FibreSection, curvature: Any, memory: Any) -> Any:
    """Return the strain of the outer fibre and the largest one, of sections that are bent."""
    bending = jnp.where(jnp.arange(6) == 1, curvature[:, None], 0.0)
    strain = jax.vmap(section_strain, (law.axis, 0, 0, 0))(law, bending, sections, memory)
    outer = strain.stretch + strain.curvature * sections.edge_spine
    return outer, peak_strain(strain, sections)


def moment_arms(chain: Chain) -> Float[np.ndarray, "n t"]:
    """Return the arm of every tendon about each neutral axis at rest, mm; 0 where none runs."""
    # Positive where the tendon bends the notch toward its direction; needs a chain of `flat=False`.
    entry_x = np.einsum("nba,tb->nta", chain.notch_frame, chain.tendon_entry)[..., 0]
    spine = np.where(np.asarray(chain.rods.has_closure) > 0.0, chain.rods.end_offset[:, 0], 0.0)
    arm = np.zeros((chain.flexures, chain.tendons))
    for group in chain.groups:
        tendons = list(group.numbers)
        arm[:, tendons] = np.asarray(group.present) * (entry_x[:, tendons] + spine[:, None])
    return arm


def _tensions(
    ready: PreparedChain, tendon: np.ndarray, notches: np.ndarray, guess: Searched
) -> tuple[Searched, np.ndarray]:
    """Find the base tension that closes some notches against their spines, and its status."""
    chain = ready.chain
    stiffness = np.asarray(chain.contact_stiffness)
    # As many rows as notches, whichever are searched: one compiled program.
    searched, rows = np.resize(notches, chain.flexures), np.arange(chain.flexures)

    def overlap(tension: Searched, _: Which) -> np.ndarray:
        value = np.zeros((chain.flexures, chain.tendons))
        value[rows, tendon[searched]] = np.resize(tension, chain.flexures)
        force, gap, converged = solve_contacts(
            ready, tension_commands(value, chain), ready.rest, Settings()
        )
        overlap = force[rows, searched] / stiffness[searched] - gap[rows, searched]
        return np.where(converged, overlap, np.nan)[: len(notches)]

    return closing_tensions(overlap, guess)


def _by_one_tendon(
    ready: PreparedChain, tendon: int, notches: np.ndarray
) -> tuple[Searched, Searched, np.ndarray]:
    """Find them for some notches, pulling one tendon."""
    free, _ = _pull(ready, tendon, np.zeros(1))
    reach = -free[0, notches]  # the gap at rest: an edge so far from closing
    # Tendon and edges are about as far from the axis.
    linear = np.asarray(ready.chain.contact_stiffness)[notches] * reach
    steps = np.linspace(0.0, _BEYOND_LINEAR * linear.max(), _STEPS + 1)
    overlap, _ = _pull(ready, tendon, steps)
    touching = overlap[:, notches] > 0.0
    closes = touching.any(axis=0)
    after = np.maximum(touching.argmax(axis=0), 1)

    def evaluate(tension: Searched) -> tuple[np.ndarray, np.ndarray]:
        """Compute overlap and angle of every notch, each at its own tension, on one path."""
        order = np.argsort(tension)
        back = np.argsort(order)
        overlap, angle = _pull(ready, tendon, tension[order])
        return overlap[back, notches], angle[back, notches]

    low, high = (np.where(closes, steps[step], steps[-1]) for step in (after - 1, after))
    tension, precise = find_roots(lambda tension, _: evaluate(tension)[0], low, high)
    _, angle = evaluate(tension)
    closed = closes & precise & np.isfinite(angle)
    failed = ~np.isfinite(overlap[:, notches]).all(axis=0)
    status = statuses(closed, np.asarray(~closes & ~failed))
    return np.where(closed, tension, np.nan), np.where(closed, angle, np.nan), status


def _pull(
    ready: PreparedChain, tendon: int, tensions: Float[np.ndarray, " s"]
) -> tuple[Float[np.ndarray, "s n"], Float[np.ndarray, "s n"]]:
    """Compute every notch's overlap (contact force / stiffness - gap, mm) and angle (rad)."""
    value = np.zeros((len(tensions), ready.chain.tendons))
    value[:, tendon] = tensions
    states = run(
        ready, tension_commands(value, ready.chain), ready.rest, Settings(), each_from_start=False
    )
    stiffness = np.asarray(ready.chain.contact_stiffness)
    overlap = states.quantity("contact_force") / stiffness - states.quantity("gap")
    converged = states.converged[:, None]
    angle = states.quantity("notch_angle")
    return np.where(converged, overlap, np.nan), np.where(converged, angle, np.nan)


# First tension, relative to that of the robot that is varied.
_FIRST = 1.05
# Relative precision of a tension: limits are compared to 1e-6.
_PRECISION = 1e-9
_OUTPUTS = ("contact_force", "gap", "converged")


def closing_tensions_of(
    robot: Robot, values: Mapping[str, Float[np.ndarray, " robots"]]
) -> Float[np.ndarray, "robots n"]:
    """Find the tensions (N) that close the notches of many robots, as `closing` does for one."""
    nominal = closing(robot)
    chain = assemble(robot, flat=False)
    closing_angle = np.asarray(closing_angles(chain.rods))
    unit = np.eye(chain.tendons)[nominal.tendon - 1]
    robots = VariedRobots.of(robot, values)
    tension = np.full((len(robots), chain.flexures), np.nan)
    valid = np.setdiff1d(np.arange(len(robots)), [*robots.errors])
    chains = None
    if np.isfinite(closing_angle).all() and len(valid) > FEW:  # not edges of rigid pieces
        chains = next(robots.forms(valid)).chains(0, 0)
    if chains is None:  # few robots
        for number in valid.tolist():
            tension[number] = closing(robots[number]).tension
        return tension
    longest = moment_arms(chain).max(axis=1)
    notches = np.flatnonzero((longest > 0.0) & (closing_angle > 0.0))
    with np.errstate(divide="ignore"):
        linear = np.asarray(chain.stiffness)[:, 0] * closing_angle / longest
    guess = np.where(np.isfinite(nominal.tension), _FIRST * nominal.tension, linear)[notches]
    # The root does not depend on the stiffness: that of one robot serves for all.
    stiffness = np.asarray(chain.contact_stiffness)[notches]
    table, alike = chains.packed(valid)
    packed_chains = replace(chains, packed=lambda numbers: (table[numbers], alike[numbers]))
    valid_robots = VariedRobots.of(
        robot, {name: numbers[valid] for name, numbers in values.items()}
    )

    def overlap(
        tension: Float[np.ndarray, " rows"], mask: Bool[np.ndarray, " rows"]
    ) -> Float[np.ndarray, " rows"]:
        """Compute contact force / stiffness - gap of the masked rows: robots by notches."""
        places = np.flatnonzero(mask)
        numbers, notch = np.divmod(places, len(notches))
        load, trials = LoadPath(tension[places, None] * unit[notch]), np.arange(len(places))
        rows = BatchRows(valid_robots, LoadRows(load, 1), numbers, trials, _OUTPUTS, DEFAULT, 0)
        solved = rows.solved(number_of_cores(), [BatchTable(rows, trials, packed_chains, 0)])
        force, gap = (solved[name][trials, 0, notches[notch]] for name in ("contact_force", "gap"))
        overlaps = np.full(len(tension), np.nan)
        overlaps[places] = force / stiffness[notch] - gap
        return overlaps

    if len(notches):
        roots, _ = closing_tensions(overlap, np.tile(guess, len(valid)), _PRECISION)
        tension[np.ix_(valid, notches)] = roots.reshape(len(valid), -1)
    return tension


# Geometry, section and closing of every notch, one row each.


def notch_table(robot: Robot, closing_table: Closing | None = None) -> list[dict[str, Any]]:
    """Return geometry, section and closing of every notch as a row, units in the names."""
    table = closing(robot) if closing_table is None else closing_table
    arms = moment_arms(assemble(robot, flat=False))
    placed = list(zip(robot.notches, sites_of(robot), strict=True))
    described: dict[Any, dict[str, Any]] = {}
    for notch, site in dict.fromkeys(placed):
        described[notch, site] = values = named_values(notch)
        if isinstance(notch, TableNotch):  # of no section
            continue
        tube = notch.tube or robot.tube
        rod = rod_at(site, notch, tube)
        section = rod.section
        weakest = int(np.argmin(section.second_moment_weak))
        values["area_mm2"] = float(section.area[weakest])
        values["second_moment_mm4"] = float(section.second_moment_weak[weakest])
        if float(rod.has_closure) > 0.0:  # opposite a spine; from the tube axis toward it
            values["centroid_mm"] = tube.outer_radius - float(section.edge_spine[weakest])
    return [
        {
            "notch": index + 1,
            **described[placed_notch],
            # Of every tendon, positive where it bends the notch toward itself, 0 where none runs.
            "moment_arm_mm": arms[index].tolist(),
            "closing_angle_deg": float(table.angle[index]) * DEGREES,
            # The tendon with the longest arm, from 1; its tension, pulled from rest.
            "closing_tendon": int(table.tendon[index]),
            "closing_tension_N": float(table.tension[index]),
            "closing_status": str(table.status[index]),
            "closing_outer_strain": float(table.outer_strain[index]),
            "closing_peak_strain": float(table.peak_strain[index]),
        }
        for index, placed_notch in enumerate(placed)
    ]


def named_values(notch: Notch) -> dict[str, Any]:
    """Return the values of a notch as in a robot file, their units in their names."""
    values: dict[str, Any] = {}
    for name, field in fields_in(notch).items():
        unit, value = unit_of(field), attrgetter(name)(notch)
        with_unit = f"{name}_{unit}" if unit and not name.endswith(f"_{unit}") else name
        if not is_dataclass(value):  # its values follow
            values[with_unit] = value
    del values["repeat"]
    return values
