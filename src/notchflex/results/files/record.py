"""A path as plain arrays and facts, from which an equal path is made: what files carry.

A record holds the results of the solver (states, memory, reported quantities) and its input (robot
file, loads, settings). Reading it back solves nothing, so the numbers are those written, whatever
the version or the machine that reads them.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from notchflex import __version__
from notchflex._quantity import REGISTERED
from notchflex.errors import InputError

if TYPE_CHECKING:
    from notchflex.results.path import EquilibriumPath
    from notchflex.results.recorded import Recorded
    from notchflex.solver.programs.prepare import PreparedChain

FORMAT = "notchflex path 1"
IN_BASE = "_in_base"
"""Ends the name of an array in the frame of a base that is turned in the world."""

_STATE, _START = "state", "before."
_RUN = ("residual", "iterations", "converged", "tried", "reached")
_HELD = ("smallest_eigenvalue", "determinant_sign")
_SNAPPED = "snapped"


@dataclass(frozen=True)
class Record:
    """What a path is made of.

    Attributes:
        facts: The robot file as text, the external loads, how it was solved; plain values.
        arrays: Everything else by name, in mm, N, rad.
    """

    facts: Mapping[str, Any]
    arrays: Mapping[str, NDArray[Any]]


def record_of(path: EquilibriumPath) -> Record:
    """Return the record of a path."""
    from notchflex.robot import robot_text

    chain = path.chain
    # The external loads: each different one, and which of them every step has.
    external = {
        "distinct": [asdict(one) for one in path.load.different],
        "step": path.load.which.tolist(),
    }
    facts = {
        "format": FORMAT,
        "program": "notchflex",
        "version": __version__,
        "robot": robot_text(path.robot),
        "level": chain.level,
        "loaded": chain.loaded,
        "refinement": chain.refinement,
        "flat": chain.frame is not None,
        "each_from_rest": path.each_from_rest,
        "base_rotation_rad": path.load.base_rotation.tolist(),
        "settings": {one.name: getattr(path.settings, one.name) for one in fields(path.settings)},
        "external": json.dumps(external),
    }
    return Record(facts, dict(_arrays_of(path)))


def path_of(record: Record, source: str) -> EquilibriumPath:
    """Return the path of a record.

    Args:
        record: As `record_of` returns it.
        source: Where it was read from, for messages.

    Raises:
        InputError: Something is missing or does not fit.
    """
    if record.facts.get("format") != FORMAT:
        got = record.facts.get("format")
        raise InputError.FILE_FORMAT(
            f"{source} has the format {got!r}, not {FORMAT!r}: notchflex {__version__} cannot make "
            "a path of it; write it again with this version."
        )
    try:
        return _path_of(record)
    except InputError as problem:
        raise InputError.FILE_DAMAGED(f"{source} cannot be read back: {problem}") from None
    except KeyError as problem:
        raise InputError.FILE_DAMAGED(
            f"{source} cannot be read back: {problem.args[0]} is missing; write it again."
        ) from None
    except (TypeError, ValueError, IndexError) as problem:
        raise InputError.FILE_DAMAGED(
            f"{source} cannot be read back: it is damaged ({problem}); write it again."
        ) from None


def encoded(record: Record) -> dict[str, Any]:
    """Return a record for JSON: numbers as their bytes, so that not one digit is lost."""
    arrays: dict[str, Any] = {}
    for name, values in record.arrays.items():
        array = np.ascontiguousarray(values).astype(values.dtype.newbyteorder("<"))
        code = base64.b64encode(array.tobytes()).decode("ascii")
        arrays[name] = {"type": array.dtype.str, "shape": list(array.shape), "base64": code}
    return {"facts": dict(record.facts), "arrays": arrays}


def decoded(document: Any, source: str) -> Record:
    """Return the record of what `encoded` returned.

    Raises:
        InputError: It is damaged.
    """
    try:
        arrays = {
            str(name): np.frombuffer(base64.b64decode(one["base64"]), np.dtype(one["type"]))
            .reshape(one["shape"])
            .copy()
            for name, one in document["arrays"].items()
        }
        return Record(dict(document["facts"]), arrays)
    except (AttributeError, KeyError, TypeError, ValueError) as problem:
        raise InputError.FILE_DAMAGED(
            f"{source} cannot be read back: what it holds for that is damaged ({problem}); "
            "write it again."
        ) from None


def _loads_from(text: str) -> tuple[Any, ...]:
    from notchflex.loads import BodyForce, ExternalLoad

    loads = json.loads(text)
    distinct = [
        ExternalLoad(**one | {"body_forces": [BodyForce(**force) for force in one["body_forces"]]})
        for one in loads["distinct"]
    ]
    return tuple(distinct[number] for number in loads["step"])


def _arrays_of(path: EquilibriumPath) -> Iterator[tuple[str, NDArray[Any]]]:
    import jax.tree_util as tree_util

    from notchflex.results.recorded import BEFORE, FLATTENING, MATERIAL, REPORTED
    from notchflex.results.state import leaf_name

    run = path.run
    turned = bool(path.load.base_rotation.any())
    yield "commanded_tension", path.load.tension
    yield "commanded_stroke", path.load.stroke
    for name in REPORTED:
        yield _key(name, turned), np.asarray(run.quantity(name))
    for name in _RUN:
        # A path counts more as not converged than the solver does.
        yield ("solver_converged" if name == "converged" else name), np.asarray(getattr(run, name))
    yield _HELD[0], path.smallest_eigenvalue
    yield _HELD[1], path.determinant_sign
    yield _SNAPPED, run.snapped
    for name in BEFORE:
        yield _START + name, run.before(name)
    if not isinstance(run.solved.memory.material, tuple):
        yield _START + MATERIAL, run.before(MATERIAL)
        yield _START + FLATTENING, run.before(FLATTENING)
    for key, leaf in tree_util.tree_flatten_with_path(run.solved)[0]:
        yield _STATE + leaf_name(key), np.asarray(leaf)


def _path_of(record: Record) -> EquilibriumPath:
    from notchflex.loads import LoadPath
    from notchflex.results.path import EquilibriumPath
    from notchflex.robot import robot_from_text
    from notchflex.solver.newton import Settings
    from notchflex.solver.programs.prepare import prepare

    facts, arrays = record.facts, record.arrays
    robot = robot_from_text(facts["robot"])
    load = LoadPath(
        arrays["commanded_tension"],
        arrays["commanded_stroke"],
        np.array(facts["base_rotation_rad"]),
        _loads_from(facts["external"]),
    )
    ready = prepare(
        robot,
        facts["level"],
        loaded=facts["loaded"],
        refinement=facts["refinement"],
        flat=facts["flat"],
    )
    recorded = _recorded(arrays, ready, len(load), bool(load.base_rotation.any()))
    return EquilibriumPath(
        robot, load, ready, recorded, facts["each_from_rest"], Settings(**facts["settings"])
    )


def _recorded(
    arrays: Mapping[str, NDArray[Any]], ready: PreparedChain, steps: int, turned: bool
) -> Recorded:
    """Return what the solver found, of the shapes that robot and loads ask for."""
    import jax.tree_util as tree_util

    from notchflex.results.recorded import FLATTENING, REPORTED, Recorded
    from notchflex.results.state import leaf_name

    leaves, structure = tree_util.tree_flatten_with_path(ready.rest)
    state: list[NDArray[Any]] = []
    for key, leaf in leaves:
        name = _STATE + leaf_name(key)
        state.append(_of_shape(arrays[name], (steps, *np.shape(leaf)), name))
    notches = (steps, ready.chain.flexures)
    # Older files do not count the loss of flattening.
    unflattened = np.zeros((*notches, 3, 1))
    reported = {
        name: arrays.get(name, unflattened) if name == FLATTENING else arrays[_key(name, turned)]
        for name in REPORTED
    }
    for name, values in reported.items():
        _of_shape(values, (steps, *values.shape[1:]), name)
    run = {
        name: _of_shape(arrays["solver_converged" if name == "converged" else name], (steps,), name)
        for name in _RUN
    }
    # Older files do not have it, nor do those of robots that cannot snap need it.
    snapped = _of_shape(arrays.get(_SNAPPED, np.zeros(notches)), notches, _SNAPPED)
    return Recorded(
        solved=tree_util.tree_unflatten(structure, state),
        reported=reported,
        first=_before_the_first(arrays, ready, reported[FLATTENING].shape[1:]),
        held=(arrays[_HELD[0]], arrays[_HELD[1]]),
        snapped=snapped,
        **run,
    )


def _before_the_first(
    arrays: Mapping[str, NDArray[Any]], ready: PreparedChain, flattening: tuple[int, ...]
) -> dict[str, NDArray[Any]]:
    """Return quantities of the state before the first step; older files lack those of materials."""
    from notchflex.results.recorded import BEFORE, FLATTENING, MATERIAL

    first = {name: arrays[_START + name] for name in BEFORE}
    at_rest = ready.rest.memory.material
    if not isinstance(at_rest, tuple):
        none = {MATERIAL: np.asarray(at_rest), FLATTENING: np.zeros(flattening)}
        for name, missing in none.items():
            key = _START + name
            first[name] = _of_shape(arrays.get(key, missing), missing.shape, key)
    return first


def _key(name: str, turned: bool) -> str:
    """Return the name of an array of the solver, whose vectors are in the frame of the base."""
    return f"{name}{IN_BASE}" if turned and REGISTERED[name].in_world else name


def _of_shape(array: NDArray[Any], shape: tuple[int, ...], name: str) -> NDArray[Any]:
    if array.shape != shape:
        raise InputError.FILE_DAMAGED(
            f"{name} has the shape {array.shape}, and this robot and its loads ask for {shape}."
        )
    return array
