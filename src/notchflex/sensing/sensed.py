"""The sensed forces along a history: intervals, contact, and unobservable directions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.stats import chi2

from notchflex._summary import Displayed, Summary
from notchflex.errors import ConvergenceError
from notchflex.results.path import EquilibriumPath
from notchflex.robot import Robot
from notchflex.sensing.observability import direction_in_words
from notchflex.sensing.search import BAD_FIT


@dataclass(frozen=True, eq=False, repr=False)
class SensedForce(Displayed):
    """Forces that fit the readings along a history; s readings, d components. Units N, mm.

    Rows from the first reading that did not converge on hold NaN.

    Attributes:
        robot: The robot.
        components: Names of the components, such as ("x", "z"), axes of the world.
        directions: Their unit vectors in the world, (d, 3).
        force: The force that fits best, (s, d); of averaged readings that of the mean, moved
            towards that of the reading by as much as noise does not explain.
        covariance: Its covariance by the noise of all readings up to it, to first order, N²,
            (s, d, d). Along a direction that changes hardly any reading the interval bounds it.
        low: Smallest component that fits the reading: noise and stuck friction together, (s, d);
            also where it was averaged with others, by its own noise.
        high: Largest component that fits, (s, d).
        limited: Whether the range of the search ends the interval, not the readings, (s, d).
        stuck: Whether friction widens the interval, (s, d): within it the tendons stick, and forces
            give the same readings.
        misfit: Sum of squares of the deviations of each reading, or of the mean that it went into,
            in units of its noise, (s,).
        read: How many numbers were compared in each reading, (s,).
        no_force: How much larger the misfit is, at least, where no force acts, (s,).
        hidden: Directions that are not observable at each reading, unit rows, s arrays (k, d).
        group: Which state of `path` every reading went into, counted from 0: readings that noise
            explains are averaged, (s,).
        place: Body on which the force acts; None for the tip.
        places: Misfit of the whole history with the force on each body that was tried.
        level: Part of all cases that an interval shall contain.
        largest: Range of the search, N.
        path: The states of the best history, up to the first that did not converge; None if that
            was the first.
        reason: Why the history ended before its last reading; "" where it did not.
    """

    robot: Robot
    components: tuple[str, ...]
    directions: Float[np.ndarray, "d 3"]
    force: Float[np.ndarray, "s d"]
    covariance: Float[np.ndarray, "s d d"]
    low: Float[np.ndarray, "s d"]
    high: Float[np.ndarray, "s d"]
    limited: Bool[np.ndarray, "s d"]
    stuck: Bool[np.ndarray, "s d"]
    misfit: Float[np.ndarray, " s"]
    read: Float[np.ndarray, " s"]
    no_force: Float[np.ndarray, " s"]
    hidden: tuple[Float[np.ndarray, "k d"], ...]
    group: Int[np.ndarray, " s"]
    place: int | None
    places: dict[int | None, float]
    level: float
    largest: float
    path: EquilibriumPath | None
    reason: str

    def __len__(self) -> int:
        """Number of readings."""
        return len(self.force)

    @property
    def converged(self) -> Bool[np.ndarray, " s"]:
        """Whether a force was found for each reading, (s,)."""
        return np.asarray(np.isfinite(self.force).all(axis=1))

    @property
    def unexplained(self) -> Bool[np.ndarray, " s"]:
        """Whether even the best force misses a reading by far more than noise does, (s,)."""
        return np.asarray(self.misfit > BAD_FIT * np.maximum(self.read, 1.0))

    @property
    def vector(self) -> Float[np.ndarray, "s 3"]:
        """The force as a vector in the world, N, (s, 3)."""
        return self.force @ self.directions

    @property
    def deviation(self) -> Float[np.ndarray, "s d"]:
        """Standard deviation of each component by the noise of the sensors, N, (s, d)."""
        return np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))

    @cached_property
    def contact_probability(self) -> Float[np.ndarray, " s"]:
        """Probability of readings that differ as much from those without force by noise, (s,).

        The least favourable history decides: while the tendon sticks, small forces are not
        reported as contact.
        """
        freedom = [len(self.components) - len(rows) for rows in self.hidden]
        return np.array(
            [
                chi2.sf(worse, one) if one > 0 and np.isfinite(worse) else 1.0
                for worse, one in zip(self.no_force, freedom, strict=True)
            ]
        )

    @property
    def contact(self) -> Bool[np.ndarray, " s"]:
        """Whether no force is refuted at the level of the intervals, (s,)."""
        return self.contact_probability < 1.0 - self.level

    @property
    def not_observable(self) -> list[str]:
        """Sentences on what the last reading leaves open."""
        last = int(self.converged.sum()) - 1
        if last < 0:
            return []
        sentences = [
            f"not observable: a force along {direction_in_words(self.components, row)} changes no "
            "reading by more than its noise"
            for row in self.hidden[last]
        ]
        for which, name in enumerate(self.components):
            low, high = self.low[last, which], self.high[last, which]
            unseen = (np.abs(self.hidden[last][:, which]) > 0.05).any()
            if self.limited[last, which] and not unseen:
                sentences.append(
                    f"the force along {name} may lie beyond the range of the search "
                    f"({self.largest:.3g} N)"
                )
            elif self.stuck[last, which] and not self.limited[last, which]:
                sentences.append(
                    f"the tendons stick: every force along {name} from {low:.3g} to {high:.3g} N "
                    "fits the readings"
                )
        others = self.other_places
        if others:
            bodies = ", ".join("the tip" if one is None else f"body {one}" for one in others)
            sentences.append(f"the place is not certain: a force on {bodies} fits as well")
        return sentences

    @property
    def other_places(self) -> list[int | None]:
        """Places other than the best one that the misfit does not refute at the level."""
        most = self.places.get(self.place, np.inf) + float(chi2.ppf(self.level, 1))
        return [one for one, misfit in self.places.items() if one != self.place and misfit <= most]

    def raise_if_failed(self) -> SensedForce:
        """Return the result itself if a force was found for every reading.

        Raises:
            ConvergenceError: One was not; the message says which and why.
        """
        if self.reason:
            raise ConvergenceError(self.reason)
        return self

    def _summary(self) -> Summary:
        where = "the tip" if self.place is None else f"body {self.place}"
        title = f"Force on {where} of {self.robot.name} from {len(self)} readings"
        last = int(self.converged.sum()) - 1
        rows: list[tuple[str, str]] = []
        for which, name in enumerate(self.components if last >= 0 else ()):
            low, high = self.low[last, which], self.high[last, which]
            rows.append(
                (f"{name} at the end", f"{self.force[last, which]:.4g} N ({low:.4g} to {high:.4g})")
            )
        if last >= 0:
            touched = "yes" if self.contact[last] else "not shown"
            rows.append(("contact", f"{touched}, p = {self.contact_probability[last]:.2g}"))
        if count := int(self.unexplained.sum()):
            rows.append(("not explained", f"{count} of {len(self)} readings, by any force"))
        rows += [("note", text) for text in self.not_observable]
        return Summary(title, rows, self.reason)
