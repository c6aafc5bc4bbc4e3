"""What is known of the numbers of a chain when its program is made, and is no part of its vector.

A linear step is mostly padded with zeros; so are the arrays of a rod, whose modes each bend, twist,
shear or stretch it. A program that knows where these zeros are leaves out what they would be
multiplied by. They belong to the form: a chain with other numbers in their place needs a program
of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Bool, Float, Int

from notchflex._jax import array_module, jax
from notchflex.mechanics.chain import Chain, structural
from notchflex.solver.programs.pytree_layout import Form, as_kind

# Numbers behind those of the vector, so that programs may read whole vectors up to its end.
_BEHIND = 8


class KnownForm:
    """How the numbers of a chain that are not known are laid out in a vector of floats.

    Known are zeros that a chain has at every flexure because of how it is made
    (`mechanics/chain/structure.py`), and whole numbers and flags that are the same at every
    flexure. Numbers of the rest lie flexure after flexure, as programs read them.

    Forms are kept, as `Form` keeps its own.

    Attributes:
        form: Form of the whole chain.
        size: Numbers in a vector.
    """

    _found: ClassVar[dict[Form, list[KnownForm]]] = {}

    def __init__(
        self, form: Form, flexures: int, known: Bool[np.ndarray, " chain"], numbers: np.ndarray
    ) -> None:
        """Take which numbers of a whole chain are known, and those numbers."""
        self.form, self._known, self._numbers = form, known, np.where(known, numbers, 0.0)
        rows = [_by_flexure(places, flexures) for places in form.places]
        order = np.concatenate([own.T.ravel() for own in rows])
        self._taken: Int[np.ndarray, " unknown"] = order[~known[order]]
        self._place = np.zeros(form.size, int)
        self._place[self._taken] = np.arange(len(self._taken))
        self.size = len(self._taken) + _BEHIND

    def __repr__(self) -> str:
        """Tell all of it: kept programs are found by this."""
        known = np.packbits(self._known).tobytes().hex()
        return f"KnownForm({self.form}, {known}, {self._numbers[self._known].tolist()})"

    @classmethod
    def of(
        cls, form: Form, chains: Sequence[Chain], numbers: Float[np.ndarray, "k chain"]
    ) -> KnownForm:
        """A form that serves for some chains: one that is there already, if any does.

        A new one beside others knows only what they know too: it serves for their chains as well,
        so that robots that differ a little soon share one.

        Args:
            form: Form of the whole chains.
            chains: The chains.
            numbers: The same packed whole.
        """
        found = cls._found.setdefault(form, [])
        fitting = [one for one in found if one._fits(numbers)]
        if not fitting:
            flexures = chains[0].flexures
            may_be = form.pack(structural(chains[0])) > 0.0
            known = may_be & _same(form, flexures, numbers)
            if found:
                known = cls._shared(form, found, known, numbers[0])
            fitting = [cls(form, flexures, known, numbers[0])]
            found += fitting
        return min(fitting, key=lambda one: one.size)

    @staticmethod
    def _shared(
        form: Form, found: list[KnownForm], known: Bool[np.ndarray, " chain"], numbers: np.ndarray
    ) -> Bool[np.ndarray, " chain"]:
        """What is known of a chain and by all forms that were found before."""
        for one in found:
            known = known & one._known & (one._numbers == numbers)
        for places, kind in zip(form.places, form.kinds, strict=True):
            if kind != "f":  # tables of whole numbers that differ do so in ever other places
                known[places] = known[places].all()
        return known

    def _fits(self, numbers: Float[np.ndarray, "k chain"]) -> bool:
        return bool((numbers[:, self._known] == self._numbers[self._known]).all())

    def pack(self, numbers: Any) -> Any:
        """Vectors of chains that are packed whole (NumPy's or JAX's), with leading axes."""
        xp = array_module(numbers)
        behind = np.zeros((*numbers.shape[:-1], _BEHIND))
        return xp.concatenate([numbers[..., self._taken], behind], axis=-1)

    def places_of(self, places: Int[np.ndarray, " m"]) -> Int[np.ndarray, " m"]:
        """Where a vector holds numbers of the whole chain; its last place, a 0, if known."""
        return np.where(self._known[places], self.size - 1, self._place[places])

    def unpack(self, vector: Any) -> Any:
        """The chain of a vector."""
        leaves = [self._leaf(vector, places) for places in self.form.places]
        kinds = self.form.kinds
        found = [as_kind(leaf, kind) for leaf, kind in zip(leaves, kinds, strict=True)]
        return jax.tree.unflatten(self.form.structure, found)

    def _leaf(self, vector: Any, places: Int[np.ndarray, ...]) -> Any:
        known, xp = self._known[places], array_module(vector)
        if known.all():
            return xp.asarray(self._numbers[places])
        own = xp.take(vector, self._place[places], mode="clip")  # all are inside
        return xp.where(known, self._numbers[places], own) if known.any() else own


def _same(
    form: Form, flexures: int, numbers: Float[np.ndarray, "k chain"]
) -> Bool[np.ndarray, " chain"]:
    """Which numbers are the same at every flexure of every chain; of floats, which are zero."""
    found = np.zeros(form.size, bool)
    for places, kind in zip(form.places, form.kinds, strict=True):
        rows = _by_flexure(places, flexures)
        own = numbers[:, rows]
        same = (own == own[:1, :1]).all(axis=(0, 1))
        found[rows] = same & (own[0, 0] == 0.0) if kind == "f" else same
    return found


def _by_flexure(places: np.ndarray, flexures: int) -> np.ndarray:
    """Places of an array with a row for every flexure or body where there is one, else one row."""
    along = places.ndim > 0 and len(places) in (flexures, flexures + 1)
    return places.reshape(len(places) if along else 1, -1)


__all__ = ["KnownForm"]
