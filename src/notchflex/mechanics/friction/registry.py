"""Friction laws and their registry: limits of the tension ratio over a contact.

Each law is a file in this folder that registers itself for its description; the package imports
every file of the folder.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import singledispatch
from typing import Any, ClassVar

from jaxtyping import Array, Bool, Float

from notchflex._jax import jnp
from notchflex._pytree import Pytree
from notchflex.mechanics.registration import unregistered

MIN_TENSION_RATIO = 1e-12
"""Smallest tension, as a fraction of a constant loss; below its loss a contact holds 1e12 to 1."""

_MIN_LOSS = 1e-100  # N; keeps the formulas finite where the loss is zero


class FrictionLaw(Pytree, ABC):
    """Friction of a tendon at the two edges of a gap.

    At a sliding contact the higher tension is exp(bound) times the lower one plus the constant
    loss; a contact sticks anywhere between the two directions of sliding. A law states `bounds`
    and, where it has a loss in N, `constant_loss`.

    Attributes:
        remembers: Whether a solved state depends on the one before.
    """

    remembers: ClassVar[bool] = True

    @abstractmethod
    def bounds(
        self, exit_turning: Float[Array, "*t"], entry_turning: Float[Array, "*t"]
    ) -> tuple[Float[Array, "*t"], Float[Array, "*t"]]:
        """Return the largest |ln(base-side tension / tip-side tension)| at both edges.

        Args:
            exit_turning: Angle by which the tendon turns where it leaves the proximal body, rad.
            entry_turning: Angle by which it turns where it enters the distal body, rad.

        Returns:
            The bound at the exit edge and at the entry edge, each >= 0.
        """

    def constant_loss(
        self, exit_turning: Float[Array, "*t"], entry_turning: Float[Array, "*t"]
    ) -> tuple[Float[Array, "*t"], Float[Array, "*t"]] | None:
        """State the tension that sliding costs beside the ratio of `bounds`, N.

        With a loss proportional to the turning, tensions are undetermined where a tendon is
        released to 0 N: release it to a small tension.

        Args:
            exit_turning: As for `bounds`.
            entry_turning: As for `bounds`.

        Returns:
            The loss at the exit edge and at the entry edge, each >= 0; None where there is none.
        """
        del exit_turning, entry_turning

    def minimum_tension(
        self,
        tension: Float[Array, " t"],
        exit_turning: Float[Array, "n t"],
        entry_turning: Float[Array, "n t"],
    ) -> Float[Array, " t"]:
        """Bound base tensions from below where contacts have a constant loss, N.

        Tension that friction locks in beyond a released tendon has no finite ratio to 0 N: released
        tendons count as having 1e-12 of the largest loss.

        Args:
            tension: Base tensions, N.
            exit_turning: As for `bounds`, at all gaps.
            entry_turning: As for `bounds`, at all gaps.
        """
        losses = self.constant_loss(exit_turning, entry_turning)
        if losses is None:
            return tension
        return jnp.maximum(tension, MIN_TENSION_RATIO * jnp.max(jnp.maximum(*losses), axis=0))

    def limits(
        self,
        exit_turning: Float[Array, "*t"],
        entry_turning: Float[Array, "*t"],
        tension: tuple[Float[Array, "*t"], Float[Array, "*t"]],
        log_ratio: Float[Array, "*t 2"],
    ) -> Float[Array, "*t 2"]:
        """Compute the largest |ln(tension ratio)| at both edges, constant losses included.

        With the tension T on the base side and T' on the tip side the limit of loading,
        T = e^b T' + F, is ln(T/T') = b - ln(1 - F/T), and that of unloading, T' = e^b T + F, is
        ln(T'/T) = ln(e^b + F/T). Where T <= F the contact holds a ratio of 1e12.

        Args:
            exit_turning: As for `bounds`.
            entry_turning: As for `bounds`.
            tension: Tension on the base side of the exit edge and of the entry edge, N.
            log_ratio: ln(T/T') there; its sign is the direction in which the contact would slide.

        Returns:
            The limits, as last axis the edges.
        """
        ratio = jnp.stack(self.bounds(exit_turning, entry_turning), axis=-1)
        losses = self.constant_loss(exit_turning, entry_turning)
        if losses is None:
            return ratio
        loss, before = jnp.stack(losses, axis=-1), jnp.stack(tension, axis=-1)
        relative_loss = loss / jnp.maximum(before, MIN_TENSION_RATIO * jnp.maximum(loss, _MIN_LOSS))
        loading = ratio - jnp.log(jnp.maximum(1.0 - relative_loss, MIN_TENSION_RATIO))
        unloading = jnp.log(jnp.exp(ratio) + relative_loss)
        return jnp.where(log_ratio >= 0.0, loading, unloading)

    def valid(
        self, exit_turning: Float[Array, "*t"], entry_turning: Float[Array, "*t"]
    ) -> Bool[Array, "*t"]:
        """Return where the law is valid; elsewhere `bounds` is finite but meaningless.

        Args:
            exit_turning: As for `bounds`.
            entry_turning: As for `bounds`.
        """
        return jnp.ones_like(exit_turning + entry_turning, dtype=bool)


@singledispatch
def friction_law(friction: Any) -> FrictionLaw:
    """Return the friction law of a description.

    Args:
        friction: A friction description, such as `notchflex.Capstan(0.13)`.

    Returns:
        The law, its constants as arrays.

    Raises:
        TypeError: There is no law for this kind of description.
    """
    raise unregistered("friction law", friction, "friction", "friction_law")
