"""The table of quantities: names, symbols, units and texts of everything that a result holds.

Each is registered with its formula: in `solver/quantities.py` what the solver reports of a state,
here what follows along a path; see `notchflex._quantity`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, Self, TypeVar, overload

import numpy as np
from jaxtyping import Float, Int

from notchflex._quantity import DEGREES as DEGREES
from notchflex._quantity import REGISTERED, Quantity
from notchflex.solver.quantities import believable, has_chord

if TYPE_CHECKING:
    from notchflex.results.path import EquilibriumPath


# Quantities of a path that follow from what the solver returned, each beside its formula.

# Log ratios this close to their bound are on it.
_BOUND_TOLERANCE = 1e-9


@Quantity("path", "commanded tension", "T", "N", key="load.tension_N", per=("tendon",), after="")
def commanded_tension(path: EquilibriumPath) -> np.ndarray:
    """Tension commanded at the drive of a tendon; empty (NaN) where it is not commanded."""
    return path.load.tension


@Quantity("path", "commanded stroke", "u", "mm", key="load.stroke_mm", per=("tendon",),
          after="commanded_tension")  # fmt: skip
def commanded_stroke(path: EquilibriumPath) -> np.ndarray:
    """Way commanded of the drive of a tendon; empty (NaN) where it is not commanded."""
    return path.load.stroke


@Quantity("path", "temperature", r"\vartheta", "deg C", column="temperature_C",
          after="commanded_stroke", optional=lambda path: np.isfinite(path.temperature).any()
          )  # fmt: skip
def temperature(path: EquilibriumPath) -> np.ndarray:
    """Temperature of the robot as a load; empty (NaN) where it is that of the robot file."""
    return _of_load(path, "temperature")


@Quantity("path", "bend of the sheaths", r"\theta_\mathrm{s}", "deg", column="sheath_bend_deg",
          after="temperature", optional=lambda path: np.isfinite(path.sheath_bend).any()
          )  # fmt: skip
def sheath_bend(path: EquilibriumPath) -> np.ndarray:
    """Total bend of all sheaths as a load; empty (NaN) where it is that of the robot file."""
    return np.radians(_of_load(path, "sheath_bend_deg"))


def _of_load(path: EquilibriumPath, name: str) -> np.ndarray:
    """Return a number of the external load of every step; NaN where it is not given."""
    return np.array([getattr(load, name) for load in path.load.external], float)


@Quantity("path", "total chord angle", r"\psi", "deg", key="total_chord_angle_deg",
          column="total_chord_deg", after="chord_angle",
          optional=lambda path: has_chord(path.chain).all())  # fmt: skip
def total_chord_angle(path: EquilibriumPath) -> np.ndarray:
    """Sum of the chord angles, where every flexure has one."""
    return path.chord_angle.sum(axis=-1)


@Quantity("path", "dissipation", "D_i", "N mm", per=("tendon", "contact"), after="contact_bound",
          work_of=("span_tension", "contact_slid"),
          note="Integrated by the trapezoid rule from step to step, as is the tendon work, so the "
          "two balance with the stored energy as the steps get small. A few coarse steps across a "
          "reversal give a rough value, which may even decrease.")  # fmt: skip
def dissipation(path: EquilibriumPath) -> np.ndarray:
    """Work that a friction contact has turned to heat since the start of the path."""
    return _accumulated(path, *REGISTERED["dissipation"].work_of)


@Quantity("path", "dissipation of the material", "D_j", "N mm", per=("notch",),
          after="dissipation",
          note="Half the width of the hysteresis of every fibre times the change of its "
          "transformed strain, from step to step. Where the notch flattens, the loss of flattening "
          "is added by the trapezoid rule. Zero for materials without hysteresis."
          )  # fmt: skip
def material_dissipation(path: EquilibriumPath) -> np.ndarray:
    """Energy that the material of a notch has turned to heat since the start of the path."""
    chain, after = path.chain, path.run.solved.memory.material
    if isinstance(after, tuple):  # no memory
        return np.zeros((len(path), chain.flexures))
    before, after = _before_and_after(path, after, "material")
    per_length = np.asarray(chain.law.dissipated(chain.rods.section, before, after))
    loss = np.sum(per_length * chain.rods.length, -1)
    flat_before, flat_after = _before_and_after(
        path, path.solver_quantity("flattening"), "flattening"
    )
    shift, change = 0.5 * (flat_before + flat_after), flat_after - flat_before
    loss = loss + np.sum(shift[..., 0, :] * change[..., 1, :] - change[..., 2, :], axis=-1)
    return loss if path.each_from_rest else np.cumsum(loss, axis=0)


@Quantity("path", "friction front", "m", key="front.m", column="tendon{tendon}_front_m",
          per=("tendon",), after="material_dissipation", kind=int)  # fmt: skip
def front_contact(path: EquilibriumPath) -> np.ndarray:
    """Contact up to which the friction of a tendon has turned from loading to unloading.

    Contacts are counted from 1 at the base (Gao 2017, eq. 26); one more than there are where all
    have turned.
    """
    return path.front[0]


@Quantity("path", "friction at the front", r"\eta", key="front.eta",
          column="tendon{tendon}_front_eta", per=("tendon",), after="front_contact")  # fmt: skip
def front_eta(path: EquilibriumPath) -> np.ndarray:
    """Friction of that contact over its largest, from 1 (loading) to -1 (unloading)."""
    return path.front[1]


@Quantity("path", "tendon work", "W", "N mm", key="tendon_work_Nmm",
          column="tendon{tendon}_work_Nmm", per=("tendon",),
          work_of=("tension", "wire_stroke"))  # fmt: skip
def tendon_work(path: EquilibriumPath) -> np.ndarray:
    """Work done on a tendon at its drive since the start of the path, none within a backlash."""
    return _accumulated(path, *REGISTERED["tendon_work"].work_of)


@Quantity("path", "converged", key="converged", column="converged", kind=bool,
          note="A solved state beyond the limits of the friction law or of the strain modes "
          "counts as not converged.")  # fmt: skip
def converged(path: EquilibriumPath) -> np.ndarray:
    """True where the equilibrium was found."""
    return path.run.converged & believable(path.solver_quantity)


@Quantity("path", "reason", key="reason", column="reason", kind=str)
def reason(path: EquilibriumPath) -> list[str]:
    """Why the equilibrium was not found; empty where it was."""
    return [text for _, text in path.failures]


@Quantity("path", "code of the reason", key="reason_code", kind=str)
def reason_code(path: EquilibriumPath) -> list[str]:
    """Name of the `Failure` that stopped the solver; empty where the equilibrium was found."""
    return [failure.name if failure else "" for failure, _ in path.failures]


@Quantity("path", "stable", key="stable", column="stable", kind=bool)
def stable(path: EquilibriumPath) -> np.ndarray:
    """True where the equilibrium is stable with its sticking contacts held."""
    return path.run.stable(path.commands)


@Quantity("path", "smallest eigenvalue", r"\lambda_\mathrm{min}", "N mm",
          key="smallest_eigenvalue_Nmm")  # fmt: skip
def smallest_eigenvalue(path: EquilibriumPath) -> np.ndarray:
    """Smallest real part of an eigenvalue of the stiffness, sticking contacts held."""
    return path.stability[0]


@Quantity("path", "sign of the determinant")
def determinant_sign(path: EquilibriumPath) -> np.ndarray:
    """Sign of the determinant of that stiffness; +1 at every stable state, 0 without one answer.

    It is 0 where the strokes of inextensible tendons depend on each other and fix no tensions.
    """
    return path.stability[1]


@Quantity("path", "snap", per=("notch",), kind=int, after="determinant_sign",
          note="Found by the solver: on the way to this state the tension that holds the notch has "
          "passed an extremum. Where a stroke is commanded the way leads through the shapes "
          "between, and none is counted.")  # fmt: skip
def snap(path: EquilibriumPath) -> np.ndarray:
    """1 where a notch passed a limit point under tension and snapped shut, -1 open; 0 elsewhere."""
    under_tension = np.isnan(path.load.stroke).all(axis=1) & path.run.converged
    return np.where(under_tension[:, None], path.run.snapped, 0.0).astype(int)


@Quantity("path", "residual", "r", key="residual", column="residual")
def residual(path: EquilibriumPath) -> np.ndarray:
    """Largest scaled residual of the equations at the end of the iteration."""
    return path.run.residual


@Quantity("path", "iterations", key="iterations", column="iterations", kind=int)
def iterations(path: EquilibriumPath) -> np.ndarray:
    """Number of Newton iterations."""
    return path.run.iterations


def _accumulated(path: EquilibriumPath, force: str, length: str) -> np.ndarray:
    """Integrate a force over a length, from the state before the path on."""
    pairs = (_before_and_after(path, path.solver_quantity(name), name) for name in (force, length))
    work = work_of_steps(*pairs)
    return work if path.each_from_rest else np.cumsum(work, axis=0)


def work_of_steps(
    force: tuple[np.ndarray, np.ndarray], length: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Return the work of a force, before and after every step, by the trapezoid rule."""
    # A contact between two spans takes the drop of the tension from one to the other.
    mean, change = 0.5 * (force[0] + force[1]), length[1] - length[0]
    if mean.shape[-1] > change.shape[-1]:
        mean = mean[..., :-1] - mean[..., 1:]
    return mean * change


def _before_and_after(
    path: EquilibriumPath, after: np.ndarray, name: str
) -> tuple[np.ndarray, np.ndarray]:
    """Return values before and after every step of a path."""
    first = path.run.before(name)[None]
    if path.each_from_rest:
        return np.broadcast_to(first, after.shape), after
    return np.concatenate([first, after[:-1]]), after


def friction_front(
    ratio: Float[np.ndarray, "s t contacts"], bound: Float[np.ndarray, "s t contacts"]
) -> tuple[Int[np.ndarray, "s t"], Float[np.ndarray, "s t"]]:
    """Return the contact that turns, and its friction over the largest (Gao 2017, eq. 26)."""
    exists = ~np.isnan(ratio)
    rubs = exists & (bound > 0.0)
    # A contact without friction (a law may lay it all on one edge of a gap) is passed over, and
    # one that hardly turns its tendon. Where none does more, all have gone the same way.
    counts = rubs & (bound > _BOUND_TOLERANCE)
    turned = (ratio < 0.0) & (ratio <= _BOUND_TOLERANCE - bound)
    let_go = np.nansum(ratio, axis=-1, keepdims=True) < 0.0
    nothing = ~counts.any(axis=-1, keepdims=True)
    waits = np.where(nothing, rubs & ~let_go, counts & ~turned)
    all_turned = np.where(rubs.any(axis=-1), exists.sum(axis=-1), 0)
    count = np.where(waits.any(axis=-1), waits.argmax(axis=-1), all_turned)
    at_front = np.minimum(count, ratio.shape[-1] - 1)[..., None]
    at_contact, largest = (
        np.take_along_axis(value, at_front, axis=-1)[..., 0] for value in (ratio, bound)
    )
    holds = waits.any(axis=-1)
    # Friction over its largest at a corner is (1 - rho)/(1 + rho) over the same at the bound.
    part = np.tanh(0.5 * at_contact) / np.tanh(0.5 * np.where(holds, largest, 1.0))
    return count + 1, np.where(holds, part, np.nan)


# Typed properties for every quantity of a path and of an equilibrium.
#
# Their documentation and their values come from the registry (`notchflex._quantity`).

QUANTITIES = {name: quantity for name, quantity in REGISTERED.items() if quantity.title}
"""Every quantity of a solved state, by the attribute that holds it."""

_OfPath = TypeVar("_OfPath")
_OfState = TypeVar("_OfState")


class _Property(property, Generic[_OfPath, _OfState]):
    """A quantity as property: values of every step of a path, or the value of one equilibrium."""

    def __set_name__(self, owner: type, name: str) -> None:
        quantity = QUANTITIES[name]
        self._name, self.__doc__ = name, f"{quantity.summary}\n\n{quantity.text}"

    @overload
    def __get__(self, instance: None, owner: type) -> Self: ...
    @overload
    def __get__(self, instance: PathQuantities, owner: type) -> _OfPath: ...
    @overload
    def __get__(self, instance: EquilibriumQuantities, owner: type) -> _OfState: ...
    def __get__(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, instance: _Quantities | None, owner: type
    ) -> Any:
        return self if instance is None else instance.quantity(self._name)


class Number(_Property[np.ndarray, float]):
    """One number a step."""


class Flag(_Property[np.ndarray, bool]):
    """True or false at every step."""


class Count(_Property[np.ndarray, int]):
    """A whole number a step."""


class Text(_Property[list[str], str]):
    """A text a step."""


class Array(_Property[np.ndarray, np.ndarray]):
    """An array a step."""


class _Quantities:
    """Axes are those of one state; those of a path have the steps before them."""

    def quantity(self, name: str) -> Any:
        """Return a quantity by its name."""
        raise NotImplementedError

    # Written by docs/make/quantity_properties.py:
    commanded_tension = Array()
    """Commanded tension, N, shape (t)."""
    commanded_stroke = Array()
    """Commanded stroke, mm, shape (t)."""
    temperature = Number()
    """Temperature, deg C."""
    sheath_bend = Number()
    """Bend of the sheaths, rad."""
    tension = Array()
    """Tendon tension, N, shape (t)."""
    stroke = Array()
    """Tendon stroke, mm, shape (t)."""
    base_tension = Array()
    """Tendon tension at the base, N, shape (t)."""
    base_stroke = Array()
    """Tendon stroke at the base, mm, shape (t)."""
    notch_angle = Array()
    """Notch angle, rad, shape (n)."""
    edge_angle = Array()
    """Edge angle, rad, shape (n)."""
    chord_angle = Array()
    """Chord angle, rad, shape (n)."""
    total_chord_angle = Number()
    """Total chord angle, rad."""
    total_angle = Number()
    """Total bending angle, rad."""
    tip_axis_angle = Number()
    """Angle between the axes of base and tip, rad."""
    tip_position = Array()
    """Tip position, mm, shape (3)."""
    tip_rotation = Array()
    """Tip rotation, shape (3, 3)."""
    body_position = Array()
    """Body position, mm, shape (bodies, 3)."""
    body_rotation = Array()
    """Body rotation, shape (bodies, 3, 3)."""
    span_tension = Array()
    """Span tension, N, shape (t, spans)."""
    notch_moment = Array()
    """Notch moment, N mm, shape (n)."""
    outer_strain = Array()
    """Outer strain, shape (n)."""
    peak_strain = Array()
    """Peak strain, shape (n)."""
    fatigue_margin = Array()
    """Margin of fatigue, shape (n)."""
    gap = Array()
    """Notch gap, mm, shape (n)."""
    closed = Array()
    """Closed, shape (n)."""
    contact_force = Array()
    """Contact force, N, shape (n)."""
    contact_log_ratio = Array()
    """Tension ratio over a contact, shape (t, contacts)."""
    contact_slid = Array()
    """Slid length, mm, shape (t, contacts)."""
    contact_turning = Array()
    """Turning at a contact, rad, shape (t, contacts)."""
    contact_state = Array()
    """State of a contact, shape (t, contacts)."""
    contact_bound = Array()
    """Largest tension ratio over a contact, shape (t, contacts)."""
    dissipation = Array()
    """Dissipation, N mm, shape (t, contacts)."""
    material_dissipation = Array()
    """Dissipation of the material, N mm, shape (n)."""
    front_contact = Array()
    """Friction front, shape (t)."""
    front_eta = Array()
    """Friction at the front, shape (t)."""
    base_force = Array()
    """Base force, N, shape (3)."""
    base_moment = Array()
    """Base moment, N mm, shape (3)."""
    moment_error = Number()
    """Moment error."""
    stored_energy = Number()
    """Stored energy, N mm."""
    tendon_work = Array()
    """Tendon work, N mm, shape (t)."""
    converged = Flag()
    """Converged."""
    reason = Text()
    """Reason."""
    reason_code = Text()
    """Code of the reason."""
    stable = Flag()
    """Stable."""
    smallest_eigenvalue = Number()
    """Smallest eigenvalue, N mm."""
    determinant_sign = Number()
    """Sign of the determinant."""
    snap = Array()
    """Snap, shape (n)."""
    residual = Number()
    """Residual."""
    iterations = Count()
    """Iterations."""


class PathQuantities(_Quantities):
    """Quantities of every step, as leading axis: n notches, t tendons, n + 1 bodies."""


class EquilibriumQuantities(_Quantities):
    """Quantities of one equilibrium: n notches, t tendons, n + 1 bodies."""


AXES = ("x", "y", "z")

CONTACT_STATES = {0: "stick", 1: "slip toward base", -1: "slip toward tip"}
"""What the numbers of `contact_state` mean. Loading makes a tendon slip toward the base."""


def span_names(count: int) -> list[str]:
    """Return the names of the spans of a tendon, base to tip: proximal, gap_1, body_1, gap_2."""
    names = ["proximal"]
    for index in range(1, count):
        names.append(f"gap_{(index + 1) // 2}" if index % 2 else f"body_{index // 2}")
    return names


def units() -> dict[str, str]:
    """Return the unit of every JSON key that has one, for the head of a document."""
    return {q.key: q.unit for q in QUANTITIES.values() if q.key and q.unit}


def holds(path: EquilibriumPath, quantity: Quantity) -> bool:
    """Return whether robot and loads of a path have any entry of a quantity."""
    known = getattr(path, quantity.name, None) is not None
    return known and (quantity.optional is None or bool(np.any(quantity.optional(path))))


def entries_there(path: EquilibriumPath, quantity: Quantity) -> np.ndarray:
    """Return which entries of a step a path has; no load gives the others a number."""
    spans = np.asarray(path.chain.contacts) >= 0
    ends: dict[tuple[str, ...], Any] = {("span",): spans, ("contact",): spans[:, 1:]}
    whole = True if quantity.optional is None else quantity.optional(path)
    there = ends.get(quantity.per[1:], whole)
    return np.broadcast_to(there, np.shape(path.quantity(quantity.name))[1:])


def spans_of(path: EquilibriumPath, tendon: int) -> int:
    """Return how many spans a tendon (counted from 0) has: two for each body that it runs through.

    Contacts lie between the spans, so there is one fewer of them.
    """
    # A tendon has a span before every edge that it meets; -1 only fills the table up.
    return int((np.asarray(path.chain.contacts)[tendon] >= 0).sum())
