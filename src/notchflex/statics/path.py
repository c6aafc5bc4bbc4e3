"""What a simulation returns: many states with memory."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, overload

import jax.tree_util as tree_util
import numpy as np

from notchflex._jax import constant
from notchflex.chain import Chain
from notchflex.motion import rotation_about
from notchflex.robot import Robot
from notchflex.statics.applied import out_of_frame
from notchflex.statics.command import command
from notchflex.statics.equilibrium import ConvergenceError, Equilibrium
from notchflex.statics.front import friction_front
from notchflex.statics.load import LoadPath
from notchflex.statics.newton import DEFAULT, Settings
from notchflex.statics.prepare import Prepared
from notchflex.statics.quantities import believable
from notchflex.statics.reason import why_not
from notchflex.statics.recorded import Recorded
from notchflex.statics.run import Run
from notchflex.statics.state import State
from notchflex.statics.stepping import Solved

if TYPE_CHECKING:
    from xarray import Dataset


@dataclass(frozen=True, eq=False)
class Path:
    """States along a path of loads. Units mm, N, N mm, rad; s steps, n notches, t tendons.

    Where a step did not converge its row holds the last good state (its `tension` and `stroke`
    are that state's, not the commanded ones), `converged` is false and `reason` says why; the
    steps after it were not tried and hold the same state.

    Attributes:
        robot: The robot.
        load: The loads.
        prepared: The robot as arrays.
        run: What the solver returned, as arrays, or what was read of it from a file.
        each_from_rest: Whether every state starts from the same one, not from its neighbour.
        settings: How hard the solver tried.
    """

    robot: Robot
    load: LoadPath
    prepared: Prepared
    run: Run | Recorded
    each_from_rest: bool = False
    settings: Settings = DEFAULT

    @property
    def chain(self) -> Chain:
        """The robot as arrays."""
        return self.prepared.chain

    def __len__(self) -> int:
        """Number of steps."""
        return len(self.load)

    @overload
    def __getitem__(self, step: int) -> Equilibrium: ...
    @overload
    def __getitem__(self, step: slice) -> list[Equilibrium]: ...
    def __getitem__(self, step: int | slice) -> Equilibrium | list[Equilibrium]:
        """One state, or some of them."""
        if isinstance(step, slice):
            return [Equilibrium(self, i) for i in range(*step.indices(len(self)))]
        if not -len(self) <= step < len(self):
            raise IndexError(f"step {step} of a path of {len(self)} steps")
        return Equilibrium(self, step % len(self))

    @property
    def commanded_tension(self) -> np.ndarray:
        """Commanded base tensions, N, (s, t); NaN where not commanded."""
        return self.load.tension

    @property
    def commanded_stroke(self) -> np.ndarray:
        """Commanded strokes, mm, (s, t); NaN where not commanded."""
        return self.load.stroke

    def _of(self, name: str) -> np.ndarray:
        return np.asarray(self.run.quantity(name))

    @property
    def tension(self) -> np.ndarray:
        """Tension of every tendon at the base, N, (s, t)."""
        return self._of("tension")

    @property
    def stroke(self) -> np.ndarray:
        """Tendon drawn out at the base since the free robot, mm, (s, t)."""
        return self._of("stroke")

    @property
    def notch_angle(self) -> np.ndarray:
        """Angle of every notch, base to tip, precurvature included, rad, (s, n)."""
        return self._of("notch_angle")

    @property
    def chord_angle(self) -> np.ndarray:
        """Angle by which the chord of every flexure has turned (Liu 2022), rad, (s, n).

        NaN where a flexure is none whose chord is of interest.
        """
        return self._of("chord_angle")

    @cached_property
    def total_chord_angle(self) -> np.ndarray:
        """Sum of the chord angles, the bending angle of Liu 2022, rad, (s,)."""
        return self.chord_angle.sum(axis=-1)

    @property
    def total_angle(self) -> np.ndarray:
        """Bending angle of the whole robot, rad, (s,).

        Where all notches bend in one plane, the sum of their angles, toward the first one's bend
        positive; otherwise the angle between the axes of base and tip.
        """
        return self._of("total_angle")

    @cached_property
    def _base(self) -> np.ndarray:
        return np.asarray(rotation_about(constant(self.load.base_rotation)))

    @cached_property
    def body_position(self) -> np.ndarray:
        """Origin of every body, base first, in the world, mm, (s, n + 1, 3)."""
        return self._of("body_position") @ self._base.T

    @cached_property
    def body_rotation(self) -> np.ndarray:
        """Rotation of every body in the world, (s, n + 1, 3, 3)."""
        return self._base @ self._of("body_rotation")

    @cached_property
    def tip_position(self) -> np.ndarray:
        """Tip on the tube axis in the world, the proximal end being the origin, mm, (s, 3)."""
        return self._of("tip_position") @ self._base.T

    @property
    def tip_rotation(self) -> np.ndarray:
        """Rotation of the tip in the world, (s, 3, 3)."""
        return self.body_rotation[..., -1, :, :]

    @property
    def span_tension(self) -> np.ndarray:
        """Tension along every tendon: proximal, gap 1, body 1, gap 2, ..., last gap, N.

        (s, t, spans): gaps and bodies that the tendon runs through, NaN beyond its end.
        """
        return self._of("span_tension")

    @property
    def notch_moment(self) -> np.ndarray:
        """Bending moment of every notch, N mm, (s, n)."""
        return self._of("notch_moment")

    @property
    def outer_strain(self) -> np.ndarray:
        """Strain of the outer fibre on the spine (Pacheco 2021, eq. 16), (s, n)."""
        return self._of("outer_strain")

    @property
    def peak_strain(self) -> np.ndarray:
        """Largest strain of any fibre, (s, n)."""
        return self._of("peak_strain")

    @property
    def gap(self) -> np.ndarray:
        """What is left of every notch's opening at its lips, mm, (s, n)."""
        return self._of("gap")

    @property
    def closed(self) -> np.ndarray:
        """Whether the lips of a notch touch, (s, n)."""
        # Of force and gap one is zero, but for rounding: the larger of them tells.
        return self.contact_force > self.gap * np.asarray(self.chain.lip_stiffness)

    @property
    def contact_force(self) -> np.ndarray:
        """Force between the lips of a closed notch, N, (s, n)."""
        return self._of("contact_force")

    @property
    def contact_log_ratio(self) -> np.ndarray:
        """ln(tension on the base side / on the tip side) at every contact, (s, t, contacts)."""
        return self._of("contact_log_ratio")

    @property
    def contact_slid(self) -> np.ndarray:
        """Tendon slid over every contact toward the base, mm, (s, t, contacts)."""
        return self._of("contact_slid")

    @property
    def contact_bound(self) -> np.ndarray:
        """Largest magnitude of the log ratio at every contact, (s, t, contacts)."""
        return self._of("contact_bound")

    @property
    def contact_turning(self) -> np.ndarray:
        """Angle by which the tendon turns at every contact, rad, (s, t, contacts)."""
        return self._of("contact_turning")

    @property
    def contact_state(self) -> np.ndarray:
        """0 sticks, +1 slips toward the base, -1 toward the tip, (s, t, contacts)."""
        return self._of("contact_state")

    @cached_property
    def front(self) -> tuple[np.ndarray, np.ndarray]:
        """How far a turn of the friction has come along every tendon, m and eta, (s, t) each.

        Gao 2017, eq. 26: the friction of contact i is that of letting go for i < m, eta times
        the largest for i = m, and that of pulling for i > m. Contacts are counted from 1 at the
        base; m is one more than there are when all have turned (eta is then NaN). A tendon that
        is pulled for the first time has m = 1 and eta = 1.
        """
        return friction_front(self.contact_log_ratio, self.contact_bound)

    @property
    def front_contact(self) -> np.ndarray:
        """Contact m of the friction front along every tendon, (s, t); see `front`."""
        return self.front[0]

    @property
    def front_eta(self) -> np.ndarray:
        """Friction eta of that contact over its largest, (s, t); NaN where all have turned."""
        return self.front[1]

    @property
    def base_force(self) -> np.ndarray:
        """Force of the holder on the tube's base in the world, N, (s, 3).

        It balances all loads and the pull of the drives, along the tube, on the tendons.
        """
        return self._of("base_force") @ self._base.T

    @property
    def base_moment(self) -> np.ndarray:
        """Moment of the holder about the proximal end in the world, N mm, (s, 3)."""
        return self._of("base_moment") @ self._base.T

    @property
    def moment_error(self) -> np.ndarray:
        """Largest |EI kappa - M| along any flexure over the largest |M|, (s,).

        How well the chosen strain modes meet the moment that the loads ask for.
        """
        return self._of("moment_error")

    @property
    def stored_energy(self) -> np.ndarray:
        """Energy stored in notches and tendons, N mm, (s,)."""
        return self._of("stored_energy")

    def _accumulated(self, force: str, length: str) -> np.ndarray:
        """Force integrated over length by the trapezoid rule, from the state before on."""
        pairs = []
        for name in (force, length):
            after, first = self._of(name), self.run.before(name)[None]
            earlier = np.broadcast_to(first, after.shape)
            if not self.each_from_rest:
                earlier = np.concatenate([first, after[:-1]])
            pairs.append((earlier, after))
        if force == "span_tension":  # what a contact takes is the drop from span to span
            pairs[0] = tuple(value[..., :-1] - value[..., 1:] for value in pairs[0])
        (force_before, force_after), (length_before, length_after) = pairs
        work = 0.5 * (force_before + force_after) * (length_after - length_before)
        return work if self.each_from_rest else np.cumsum(work, axis=0)

    @cached_property
    def tendon_work(self) -> np.ndarray:
        """Work done by every tendon's actuator since the start of the path, N mm, (s, t)."""
        return self._accumulated("tension", "stroke")

    @cached_property
    def dissipation(self) -> np.ndarray:
        """Work that every contact turned to heat since the start, N mm, (s, t, contacts).

        Taken by the trapezoid rule from step to step, as is the work of the tendons, so the two
        balance with the stored energy as the steps get small. Over a few coarse steps across a
        turn it is rough, and may even fall.
        """
        return self._accumulated("span_tension", "contact_slid")

    @property
    def converged(self) -> np.ndarray:
        """Whether a step was solved, within what friction law and strain modes hold for, (s,)."""
        solved = np.asarray(self.run.converged)
        told = (self._of(name) for name in ("friction_holds", "moment_error", "bend_possible"))
        return solved & believable(*told)

    @property
    def residual(self) -> np.ndarray:
        """Largest imbalance of the last attempt, scaled to an angle, (s,); NaN if not tried."""
        return np.asarray(self.run.residual)

    @property
    def iterations(self) -> np.ndarray:
        """Newton iterations, (s,)."""
        return np.asarray(self.run.iterations)

    @cached_property
    def reason(self) -> list[str]:
        """Why a step did not converge; empty where it did."""
        return [why_not(self, step) for step in range(len(self))]

    @cached_property
    def _stability(self) -> tuple[np.ndarray, np.ndarray]:
        value, sign = self.run.stability(command(self.load, self.robot, self.chain))
        return np.asarray(value), np.asarray(sign)

    @property
    def smallest_eigenvalue(self) -> np.ndarray:
        """Eigenvalue of the stiffness, tendons held where they stick, with the least real part.

        In N mm/rad for arc notches, (s,).
        """
        return self._stability[0]

    @property
    def determinant_sign(self) -> np.ndarray:
        """Sign of the determinant of that stiffness, (s,)."""
        return self._stability[1]

    @property
    def stable(self) -> np.ndarray:
        """Whether the state is a stable equilibrium, (s,)."""
        return (self.smallest_eigenvalue > 0.0) & (self.determinant_sign > 0.0)

    def state_at(self, step: int) -> State:
        """State after a step (or the last good one before it), to save or continue from."""
        solved: Solved = tree_util.tree_map(lambda leaf: np.asarray(leaf)[step], self.run.solved)
        chain = self.chain
        if solved.applied is not None and chain.frame is not None:
            solved = solved._replace(applied=out_of_frame(solved.applied, chain.frame))
        name = self.robot.name
        return State(name, solved, chain.level, chain.loaded, chain.refinement, self.robot)

    @property
    def state(self) -> State:
        """State after the last converged step."""
        return self.state_at(-1)

    def to_xarray(self) -> Dataset:
        """The whole path as a labelled data set: every quantity, with its name and unit.

        Its NetCDF file (`.to_netcdf`, or `notchflex.save_path`) is read back by
        `notchflex.read_path`. Units are those of Python: mm, N, rad.

        Raises:
            InputError: xarray is not installed.

        Example:
            >>> from notchflex import load_robot, pull, simulate
            >>> path = simulate(load_robot("pacheco2021-a"), pull(0.0, 1.0, steps=3))
            >>> path.to_xarray()["notch_angle"].dims
            ('step', 'notch')
        """
        from notchflex.results.dataset import dataset_of

        return dataset_of(self)

    def raise_if_failed(self) -> Path:
        """Itself, if every step converged.

        Raises:
            ConvergenceError: A step did not; the message says which and why.
        """
        if not self.converged.all():
            step = int(np.argmin(self.converged))
            raise ConvergenceError(f"step {step + 1} of {len(self)}: {self.reason[step]}")
        return self


__all__ = ["Path"]
