"""Chains of many robots of one form: a program for each kind of notch, and one that joins them.

The rows of the first are notches, those of the second are robots. What the values of a robot decide
about the form of its arrays belongs to the key of a program, which also says of every row whether
its values decide alike.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Collection, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple, TypeVar

import numpy as np
from jaxtyping import Array, Bool, Float, Int

from notchflex._arrays import Decisions
from notchflex._jax import jax, jnp
from notchflex.mechanics.chain import (
    Chain,
    assemble,
    body_lengths,
    by_fibres,
    flexure,
    sites_of,
    tip_anchor,
)
from notchflex.mechanics.flexure import Site
from notchflex.mechanics.ring import Side
from notchflex.robot import Robot
from notchflex.robot.numbers import PartsForm, Place, parts_of, robot_of
from notchflex.solver.programs.compiled import Native, Packed
from notchflex.solver.programs.prepare import PreparedChain
from notchflex.solver.programs.static_structure import (
    PytreeLayout,
    StaticStructure,
    without_rounding,
)

T = TypeVar("T")


class _NotchForm(NamedTuple):
    """What the program of a kind of notch is compiled for.

    Attributes:
        parts: The form of a tube and a notch.
        sites: Number of places, with other rings beside it, where the notch is; 0 where its flexure
            does not depend on them.
        options: Level, refinement and whether there are fibres, as for `flexure`.
        decisions: What the values decide.
        structure: Layout of a flexure.
    """

    parts: PartsForm
    sites: int
    options: tuple[str, int, bool]
    decisions: tuple[bool, ...]
    structure: StaticStructure


@Native
def _flexures(numbers: Float[Array, " numbers"], form: _NotchForm) -> dict[str, Array]:
    """Build the flexures of a notch, one for each site."""
    # The numbers are those of the tube and the notch; then of each site lengths and boundaries of
    # the rings, Poisson's ratio, and the radius of a tendon that ends there.
    of_parts, of_sites = jnp.split(numbers, [len(form.parts.places)])
    tube, notch = form.parts.with_numbers(of_parts)

    def built(site: Site | None) -> tuple[Array, Array]:
        with _following(form.decisions) as decisions:
            tree = flexure(notch, site, tube, *form.options)
        return form.structure.pack(form.structure.form.pack(tree)), _all(decisions)

    def built_at(rings: Any) -> tuple[Array, Array]:
        proximal = Side(rings[2:5], rings[0])
        distal = Side(rings[5:8], rings[1], anchor=rings[9])
        return built(Site(proximal, distal, rings[8]))

    if form.sites:  # compiled as a loop, before which is done what sites share
        packed, alike = jax.lax.map(built_at, of_sites.reshape(form.sites, 10))
    else:
        packed, alike = built(None)
    return {"flexures": packed.ravel(), "alike": alike.all()}


@Native
def _flexures_along(
    numbers: Float[Array, " numbers"], change: Float[Array, " numbers"], form: _NotchForm
) -> dict[str, Array]:
    """Build the flexures of a notch, and differentiate them along a change of the numbers."""
    flexures = _differentiable(_flexures, form, "flexures")
    values, slopes, alike = jax.jvp(flexures, (numbers,), (change,), has_aux=True)
    return {"flexures": values, "slopes": slopes, "alike": alike}


class _JoinedForm(NamedTuple):
    """What a program that joins flexures is compiled for.

    Attributes:
        parts: The form of the robots' parts.
        flexures: Layouts of the distinct flexures.
        options: What the chain is for, as for `assemble`.
        decisions: What the values decide.
        structure: Layout of the chain.
    """

    parts: PartsForm
    flexures: tuple[StaticStructure, ...]
    options: tuple[tuple[str, Any], ...]
    decisions: tuple[bool, ...]
    structure: StaticStructure


@Native
def _joined(
    numbers: Float[Array, " numbers"], flexures: Float[Array, " packed"], form: _JoinedForm
) -> dict[str, Array]:
    """Assemble a chain from the numbers of its robot and from its flexures."""
    robot = robot_of(form.parts.with_numbers(numbers))
    ends = np.cumsum([structure.size for structure in form.flexures])
    parts = zip(form.flexures, jnp.split(flexures, ends[:-1]), strict=True)
    built = (structure.unpack(part) for structure, part in parts)
    with _following(form.decisions) as decisions:
        chain = assemble(robot, **dict(form.options), flexures=lambda *_: next(built))
    packed = form.structure.pack(PytreeLayout.of(chain).pack(chain))
    return {"chain": packed, "alike": _all(decisions)}


@Native
def _joined_along(
    numbers: Float[Array, " numbers"],
    flexures: Float[Array, " packed"],
    change: Float[Array, " numbers"],
    flexure_change: Float[Array, " packed"],
    form: _JoinedForm,
) -> dict[str, Array]:
    """Differentiate a chain along a change of the numbers of its robot and of its flexures."""
    primals, tangents = (numbers, flexures), (change, flexure_change)
    joined = _differentiable(_joined, form, "chain")
    _, slopes, alike = jax.jvp(joined, primals, tangents, has_aux=True)
    return {"slopes": slopes, "alike": alike}


@Native
def _joined_back(
    numbers: Float[Array, " numbers"],
    flexures: Float[Array, " packed"],
    weights: Float[Array, " chain"],
    form: _JoinedForm,
) -> dict[str, Array]:
    """Differentiate a weighted sum of a chain's numbers by those of its robot and its flexures."""
    joined = _differentiable(_joined, form, "chain")
    _, back, alike = jax.vjp(joined, numbers, flexures, has_aux=True)
    by_numbers, by_flexures = back(weights)
    return {"numbers": by_numbers, "flexures": by_flexures, "alike": alike}


def _differentiable(program: Native, form: Any, name: str) -> Callable[..., tuple[Array, Array]]:
    """Return a function of numbers: a result of a program, and whether all decisions are alike."""

    def function(*numbers: Array) -> tuple[Array, Array]:
        results = program.function(*numbers, form)
        return results[name], results["alike"]

    return function


@contextmanager
def _following(decisions: tuple[bool, ...]) -> Generator[Decisions]:
    """Follow the decisions of an example while a program is traced."""
    with Decisions(decisions).deciding() as followed, jax.numpy_rank_promotion("allow"):
        yield followed


def _all(decisions: Decisions) -> Array:
    """Return whether all decisions are those of the example."""
    return jnp.stack([jnp.asarray(True), *map(jnp.asarray, decisions.alike)]).all()


class _Notches(NamedTuple):
    """Distinct notches of robots that are made by one program, each with its sites.

    Attributes:
        form: What the program is compiled for.
        columns: The numbers of each among those of the robot.
        first: First notch of the robot that each flexure stands for, from 0.
        boundaries: Shares of the boundaries of both rings of each, see `Side`.
        packed: The numbers of the flexures among those of all flexures.
    """

    form: _NotchForm
    columns: Int[np.ndarray, "m numbers"]
    first: Int[np.ndarray, "m sites"]
    boundaries: Float[np.ndarray, "m sites 6"]
    packed: Int[np.ndarray, "m packed"]


def _sparse(flexure: Any) -> StaticStructure:
    """Return the layout of a flexure without what is 0 in it, and without whole numbers."""
    layout = PytreeLayout.of(flexure)
    numbers = without_rounding(layout, np.array(layout.pack(flexure)))
    constant = numbers == 0.0
    for indices, kind in zip(layout.indices, layout.kinds, strict=True):
        constant[indices] |= kind != "f"
    return StaticStructure.shared(layout, 0, constant, numbers)


@contextmanager
def tracing_told() -> Generator[None]:
    """Warn of a part whose formulas JAX cannot trace; nothing else happens then."""
    try:
        yield
    except jax.errors.JAXTypeError as error:
        reason = str(error).partition("\n")[0]
        warnings.warn(
            "robots are assembled one by one, and slopes are differences, as JAX cannot trace the "
            f"formulas of a part: {reason} Write them with `xp` of notchflex._arrays",
            RuntimeWarning,
            stacklevel=4,
        )


@lru_cache(maxsize=32)
def _known(form: PartsForm, *loads: Any) -> list[AssembledRobots]:
    """Return the list of the programs that are known for a form; it begins empty."""
    return []


def _first_alike(
    robot: Robot,
    chain: Chain,
    varied: Collection[Place],
    work: Callable[[AssembledRobots, np.ndarray], T | None],
) -> T | None:
    """Return what programs make of a robot: of those for its form the first that decide alike."""
    form = PartsForm.of(parts_of(robot), varied)
    numbers = form.numbers_of(form.parts)
    known = _known(form, *chain.options.values())
    with tracing_told():
        for programs in known:
            if (result := work(programs, numbers)) is not None:
                return result
        programs = AssembledRobots.of(robot, chain, varied)
        if (result := work(programs, numbers)) is not None:
            known.append(programs)
        return result
    return None


def assembled_chain(robot: Robot, like: Chain) -> PreparedChain | None:
    """Assemble the chain of a robot by programs; None where no program has its form."""

    def chain_of(programs: AssembledRobots, numbers: np.ndarray) -> PreparedChain | None:
        chains, alike = programs.chains(numbers[None])
        return programs.prepared(chains[0]) if alike[0] else None

    return _first_alike(robot, like, (), chain_of)


def chain_slopes(
    robot: Robot,
    chain: Chain,
    varied: Collection[Place],
    changes: Callable[[PartsForm], np.ndarray],
) -> Float[np.ndarray, "k chain"] | None:
    """Differentiate the chain of a robot along k changes of its numbers; None if untraced."""

    def slopes_of(programs: AssembledRobots, numbers: np.ndarray) -> np.ndarray | None:
        along = changes(programs.form)
        slopes, alike = programs.along(np.tile(numbers, (len(along), 1)), along)
        return programs.joined.structure.expand(slopes) if alike.all() else None

    return _first_alike(robot, chain, varied, slopes_of)


def chain_gradient(
    robot: Robot,
    chain: Chain,
    varied: Collection[Place],
    weights: Float[np.ndarray, " chain"],
    changes: Callable[[PartsForm], Float[np.ndarray, "k numbers"]],
) -> Float[np.ndarray, " k"] | None:
    """Differentiate a weighted sum of the numbers of a chain; see `chain_slopes`."""

    def gradient_of(programs: AssembledRobots, numbers: np.ndarray) -> np.ndarray | None:
        packed = programs.joined.structure.pack(weights)
        gradient, alike = programs.gradient(numbers[None], packed[None], changes(programs.form))
        return gradient[0] if alike[0] else None

    return _first_alike(robot, chain, varied, gradient_of)


# Robots of one piece; more would not fit the cache.
_ROWS = 128
# Size of imaginary parts that stand for slopes.
_SMALL = 1e-100


@dataclass(frozen=True, eq=False)
class AssembledRobots:
    """Programs that make chains from the numbers of robots.

    Attributes:
        form: The form of the robots' parts.
        notches: Their distinct notches, by their programs.
        joined: What the program that joins their flexures is compiled for.
        example: A chain of this form.
    """

    form: PartsForm
    notches: tuple[_Notches, ...]
    joined: _JoinedForm
    example: PreparedChain

    @classmethod
    def of(cls, robot: Robot, chain: Chain, varied: Collection[Place] = ()) -> AssembledRobots:
        """Find the programs for robots of one form."""
        # What their values decide, and which numbers of their arrays are 0, is that of a robot with
        # slightly other numbers: equal numbers or an exact 0 of one robot mean nothing.
        form = PartsForm.of(parts_of(robot), varied)
        numbers = form.numbers_of(form.parts)
        shift = 1e-3 * np.random.default_rng(0).uniform(0.5, 1.0, len(numbers))
        numbers = numbers + shift * np.where(numbers == 0.0, 1.0, numbers)
        example = robot_of(form.with_numbers(numbers.tolist()))
        sites = sites_of(example)
        first = dict[tuple[int, int], int]()  # of each distinct pair of a notch and its rings
        for number, (notch, site) in enumerate(zip(example.notches, sites, strict=True)):
            first.setdefault((id(notch), id(site)), number)
        # The parts of notches come behind the single ones.
        behind = next(k for k, part in enumerate(form.parts) if part is robot.notch[0])
        repeats = [group.repeat for group in robot.notch]
        part_of = behind + np.repeat(np.arange(len(repeats)), repeats)
        options = chain.level, chain.refinement, by_fibres(robot)
        made, trees = dict[tuple[int, _NotchForm], list[int]](), dict[int, Any]()
        for number in first.values():
            notch, site = example.notches[number], sites[number]
            places = {0: 0, int(part_of[number]): 1}
            zeros = [(places[part], key) for part, key in varied if part in places]
            with Decisions().deciding() as decisions:
                trees[number] = flexure(notch, site, example.tube, *options)
            parts, decided = PartsForm.of((example.tube, notch), zeros), tuple(decisions.made)
            sited = int(site is not None)
            alike = _NotchForm(parts, sited, options, decided, _sparse(trees[number]))
            made.setdefault((id(notch), alike), []).append(number)
        made_flexures = iter(trees.values())
        with Decisions().deciding() as decisions:
            joined = assemble(example, **chain.options, flexures=lambda *_: next(made_flexures))
        layouts = tuple(map(_sparse, trees.values()))
        prepared = PreparedChain(joined)
        made_for = _JoinedForm(
            form,
            layouts,
            tuple(chain.options.items()),
            tuple(decisions.made),
            prepared.static_structure,
        )
        ends = np.cumsum([0, *(layout.size for layout in layouts)]).tolist()
        packed = dict(zip(first.values(), map(np.arange, ends, ends[1:]), strict=True))
        groups = dict[_NotchForm, list[Any]]()
        for (_, alike), numbers in made.items():
            part = int(part_of[numbers[0]])
            columns = [k for k, (place, _) in enumerate(form.places) if place in (0, part)]
            shares = [
                [side.shares for side in site[:2]] if site else np.zeros((2, 3))
                for site in map(sites.__getitem__, numbers)
            ]
            where = np.concatenate([packed[number] for number in numbers])
            entry = columns, numbers, np.reshape(shares, (-1, 6)), where
            sited = alike._replace(sites=alike.sites * len(numbers))
            groups.setdefault(sited, []).append(entry)
        notches = [
            _Notches(sited, *map(np.array, zip(*entries, strict=True)))
            for sited, entries in groups.items()
        ]
        return cls(form, tuple(notches), made_for, prepared)

    def prepared(self, chain: Float[np.ndarray, " chain"]) -> PreparedChain:
        """Return a chain as `chains` makes it, prepared for repeated solves."""
        structure = self.joined.structure
        return self.example.with_numbers(structure.expand(chain, constants=True))

    @classmethod
    def tried(cls, robot: Robot, chain: Chain, varied: Collection[Place]) -> AssembledRobots | None:
        """Return programs as `of` does; None where JAX cannot trace the formulas of a part."""
        with tracing_told():
            programs = cls.of(robot, chain, varied)
            programs.chains(programs.form.numbers_of(programs.form.parts)[None])
            return programs
        return None

    def chains(
        self, numbers: Float[np.ndarray, "robots numbers"]
    ) -> tuple[Float[np.ndarray, "robots chain"], Bool[np.ndarray, " robots"]]:
        """Assemble packed chains; the flags tell which have the form of the example."""
        starts = range(0, len(numbers), _ROWS)
        pieces = [self._piece(numbers[start : start + _ROWS]) for start in starts]
        chains, alike = zip(*pieces, strict=True)
        return np.concatenate(chains), np.concatenate(alike)

    def _piece(self, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        made = self._of_notches(numbers, _built)
        joined = _joined.rows(*map(_table, (numbers, made["flexures"])), self.joined)
        return joined["chain"], made["alike"] & joined["alike"]

    def along(
        self, numbers: Float[np.ndarray, "k numbers"], changes: Float[np.ndarray, "k numbers"]
    ) -> tuple[Float[np.ndarray, "k chain"], Bool[np.ndarray, " k"]]:
        """Differentiate packed chains along changes of the numbers; flags as of `chains`."""
        # Lengths of rings are sums of numbers: imaginary parts pass them as slopes do. The first
        # row is without a change, as notches that a change does not touch.
        rows = np.concatenate([numbers[:1] + 0j, numbers + 1j * _SMALL * changes])
        made = self._of_notches(rows, _differentiated)
        tables = np.real(rows), made["flexures"], np.imag(rows) / _SMALL, made["slopes"]
        joined = _joined_along.rows(*map(_table, tables), self.joined)
        return joined["slopes"][1:], (made["alike"] & joined["alike"])[1:]

    def gradient(
        self,
        numbers: Float[np.ndarray, "robots numbers"],
        weights: Float[np.ndarray, "robots chain"],
        changes: Float[np.ndarray, "k numbers"],
    ) -> tuple[Float[np.ndarray, "robots k"], Bool[np.ndarray, " robots"]]:
        """Differentiate weighted sums of packed chains along k changes; flags as of `chains`."""
        made = self._of_notches(numbers, _built)
        tables = map(_table, (numbers, made["flexures"], weights))
        back = _joined_back.rows(*tables, self.joined)
        gradient = np.einsum("rn,kn->rk", back["numbers"], changes).ravel()
        moved = np.repeat(numbers, len(changes), axis=0)
        moved = moved + 1j * _SMALL * np.tile(changes, (len(numbers), 1))
        for notches in self.notches:
            table = self._numbers_of(moved, notches)
            row, notch = np.nonzero(np.imag(table).any(axis=-1))
            if len(row):
                slopes = _differentiated(table[row, notch], notches.form)["slopes"]
                which = (row // len(changes))[:, None], notches.packed[notch]
                np.add.at(gradient, row, (slopes * back["flexures"][which]).sum(axis=-1))
        return gradient.reshape(len(numbers), -1), made["alike"] & back["alike"]

    def _of_notches(
        self, numbers: np.ndarray, program: Callable[[np.ndarray, _NotchForm], dict[str, Any]]
    ) -> dict[str, np.ndarray]:
        """Return what a program makes of the notches of every robot, side by side."""
        # Notches that are equal to those of the first robot are made once.
        count, size = len(numbers), sum(layout.size for layout in self.joined.flexures)
        made: dict[str, Any] = {"alike": np.ones(count, bool)}
        for notches in self.notches:
            table = self._numbers_of(numbers, notches)
            others = (table != table[:1]).any(axis=-1)
            results = program(np.concatenate([table[0], table[others]]), notches.form)
            first = np.arange(len(notches.columns))
            after = others.cumsum().reshape(others.shape) + len(first) - 1
            index = np.where(others, after, first)
            made["alike"] &= results.pop("alike")[index].all(axis=1)
            for name, values in results.items():
                table = made.setdefault(name, np.empty((count, size)))
                table[:, notches.packed] = values[index]
        return made

    def _numbers_of(self, numbers: np.ndarray, notches: _Notches) -> np.ndarray:
        """Return the numbers of every notch and its rings, robots and notches as leading axes."""
        of_parts = numbers[:, notches.columns]
        rings = np.zeros((len(numbers), *notches.first.shape, 10), of_parts.dtype)
        if notches.form.sites:
            robot = robot_of(self.form.with_numbers(numbers.T))
            lengths = np.asarray(body_lengths(robot.tube, robot.notches)).T
            rings[..., :2] = lengths[..., notches.first[..., None] + np.arange(2)]
            rings[..., 2:8] = notches.boundaries
            ratios = np.broadcast_arrays(*(each.poisson_ratio for each in robot.materials[1:]))
            rings[..., 8] = np.reshape(ratios, (len(ratios), -1)).T[:, notches.first]
            is_free = notches.boundaries[..., 5]
            rings[..., 9] = is_free * np.reshape(tip_anchor(robot), (-1, 1, 1))
        return np.concatenate([of_parts, rings.reshape(*of_parts.shape[:2], -1)], axis=-1)


def _table(numbers: np.ndarray) -> Packed:
    return Packed(numbers, None, True)


def _built(numbers: np.ndarray, form: _NotchForm) -> dict[str, np.ndarray]:
    """Build flexures."""
    return _flexures.rows(_table(numbers), form)


def _differentiated(numbers: np.ndarray, form: _NotchForm) -> dict[str, np.ndarray]:
    """Build flexures, and differentiate them along the imaginary parts of their numbers."""
    return _flexures_along.rows(_table(np.real(numbers)), _table(np.imag(numbers) / _SMALL), form)
