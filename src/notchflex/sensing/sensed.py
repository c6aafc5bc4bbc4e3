"""The sensed forces along a history: intervals, contact, and what the readings leave open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.stats import chi2

from notchflex import ConvergenceError, EquilibriumPath, Robot
from notchflex.sensing.bounds import Bounds, Forces
from notchflex.sensing.history import LINEAR, OwnReading
from notchflex.sensing.model import SensingModel
from notchflex.sensing.search import BAD_FIT
from notchflex.support import Displayed, Summary

PerReading = Float[np.ndarray, " s"]
Said = Bool[np.ndarray, " s"]

# An interval this much wider than that of the noise alone is one that stuck friction leaves.
_STUCK = 1.5
# Components of a unit direction below this are not counted as part of it.
_PART = 0.05


@dataclass(frozen=True, eq=False)
class LeftOpen:
    """Unobservable directions of one reading.

    Attributes:
        covariance: Of the force by noise, to first order, N². Along a direction that hardly changes
            what is read, the interval bounds it; where nothing does, it is the range of the search.
        stuck: Components that friction hides within the interval, (d,).
        hidden: Directions that are not observable, unit rows, (k, d).
    """

    covariance: Float[np.ndarray, "d d"]
    stuck: Bool[np.ndarray, " d"]
    hidden: Float[np.ndarray, "k d"]

    @classmethod
    def of(cls, model: SensingModel, reading: OwnReading, ends: Bounds, level: float) -> LeftOpen:
        """Return what a reading leaves open.

        Around the best force a direction may change nothing for two reasons: the readings do not
        depend on it, or the tendons stick. Only the first leaves the interval without an end.
        """
        number, factor = reading.number, float(np.sqrt(chi2.ppf(level, 1)))
        half = 0.5 * (ends.high[number] - ends.low[number])
        # Directions as unit rows, the largest entry of each positive, and the standard deviation of
        # the force by noise along each: infinite where nothing that is read depends on it.
        slopes = reading.information
        _, values, rows = np.linalg.svd(slopes.reshape(-1, slopes.shape[1]))
        values = np.concatenate([values, np.zeros(len(rows) - len(values))])
        spreads = np.full(len(rows), np.inf)
        np.divide(1.0, values, out=spreads, where=values > 0.0)
        signs = np.sign(rows[np.arange(len(rows)), np.abs(rows).argmax(axis=1)])
        directions = rows * signs[:, None]
        far = spreads > LINEAR * model.largest
        keeps = np.eye(model.size) - directions[far].T @ directions[far]
        of_mean, more = keeps @ reading.gain, keeps @ reading.more
        noise, beyond = of_mean @ of_mean.T, more @ more.T
        stuck, hidden, open_ = np.zeros(model.size, bool), [], np.zeros_like(noise)
        for row, spread in zip(directions[far], spreads[far], strict=True):
            part = np.abs(row) > _PART
            interval = float(np.abs(row) @ half) / factor
            if spread > model.largest and (ends.limited[number] & part).any():
                width = model.largest
                hidden.append(row)
            elif spread > min(model.largest, _STUCK * interval):
                width = interval
                stuck |= part
            else:  # far, but by noise alone
                width = spread
            open_ += width**2 * np.outer(row, row)
        own = noise + beyond + open_
        wide = half > _STUCK * factor * np.sqrt(np.diagonal(own))
        rows = np.array(hidden).reshape(-1, model.size)
        # Where noise explains the distance from the mean, the estimate is the mean.
        covariance = noise + reading.part * beyond + open_
        return cls(covariance, stuck | (wide & ~ends.limited[number]), rows)


def direction_in_words(names: Sequence[str], direction: Float[np.ndarray, " d"]) -> str:
    """Describe a direction by its components.

    Example:
        >>> direction_in_words(("x", "z"), np.array([0.0, 1.0]))
        'z'
        >>> direction_in_words(("x", "z"), np.array([-0.6, 0.8]))
        '-0.60 x + 0.80 z'
    """
    parts = [(part, name) for part, name in zip(direction, names, strict=True) if abs(part) > _PART]
    if len(parts) == 1:
        return parts[0][1]
    text = " + ".join(f"{part:.2f} {name}" for part, name in parts)
    return text.replace("+ -", "- ")


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
    force: Forces
    covariance: Float[np.ndarray, "s d d"]
    low: Forces
    high: Forces
    limited: Bool[np.ndarray, "s d"]
    stuck: Bool[np.ndarray, "s d"]
    misfit: PerReading
    read: PerReading
    no_force: PerReading
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
    def converged(self) -> Said:
        """Whether a force was found for each reading, (s,)."""
        return np.asarray(np.isfinite(self.force).all(axis=1))

    @property
    def unexplained(self) -> Said:
        """Whether even the best force misses a reading by far more than noise does, (s,)."""
        return np.asarray(self.misfit > BAD_FIT * np.maximum(self.read, 1.0))

    @property
    def vector(self) -> Float[np.ndarray, "s 3"]:
        """The force as a vector in the world, N, (s, 3)."""
        return self.force @ self.directions

    @property
    def deviation(self) -> Forces:
        """Standard deviation of each component by the noise of the sensors, N, (s, d)."""
        return np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))

    @cached_property
    def contact_probability(self) -> PerReading:
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
    def contact(self) -> Said:
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
