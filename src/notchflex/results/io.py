"""Paths to files and back: `save_path` writes JSON, NetCDF, Parquet or CSV, `read_path` reads."""

from __future__ import annotations

import base64
import contextlib
import io
import json
from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from importlib import import_module
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from notchflex import __version__
from notchflex._extras import need
from notchflex._quantity import REGISTERED, Quantity
from notchflex._replacing import replacing
from notchflex.errors import InputError
from notchflex.results.quantities import AXES, CONTACT_STATES, QUANTITIES
from notchflex.results.tables import path_columns, path_document, plain, write_json, write_path_csv

if TYPE_CHECKING:
    from xarray import Dataset

    from notchflex.results.path import EquilibriumPath, Recorded
    from notchflex.solver.programs.prepare import PreparedChain


READ_BACK = "read_back"
"""Key of a JSON document under which the exact numbers stand."""


def save_path(path: EquilibriumPath, file: str | FilePath) -> None:
    """Write a path to a file; by its suffix as JSON, NetCDF, Parquet or CSV.

    JSON, NetCDF and Parquet hold the whole path, and `read_path` makes an equal one of them. CSV
    holds the numbers of every step only, and `read_table` reads those.

    Args:
        path: Solved path.
        file: Where to; ends in .json, .nc, .parquet or .csv. It is written whole or not at all.

    Raises:
        InputError: Another suffix, a library that is not installed, or it cannot be written.

    Example:
        >>> import tempfile
        >>> from pathlib import Path
        >>> import notchflex as nf
        >>> path = nf.simulate(nf.load_robot("pacheco2021-a"), nf.pull(0.0, 1.0, steps=3))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     nf.save_path(path, Path(folder) / "loop.json")
        ...     again = nf.read_path(Path(folder) / "loop.json")
        >>> bool((again.notch_angle == path.notch_angle).all())
        True
    """
    match FilePath(file).suffix.lower():
        case ".json":
            write_json(file, whole_document(path))
        case ".nc":
            write_netcdf(file, path)
        case ".parquet":
            write_parquet(file, path)
        case ".csv":
            write_path_csv(file, path)
        case _:
            raise _unknown_suffix(file, "written")


def read_path(file: str | FilePath) -> EquilibriumPath:
    """Read a path back from a file; it equals the one that was written, its states too.

    Nothing is solved: every number is that of the file. A simulation continues from `.state` as
    from that of the path that was written.

    Args:
        file: A .json, .nc or .parquet that `notchflex simulate` or `save_path` wrote.

    Returns:
        The path.

    Raises:
        InputError: No such file, a table that holds no path, a file that was changed or damaged.

    Example:
        >>> import tempfile
        >>> from pathlib import Path
        >>> import notchflex as nf
        >>> wrist = nf.load_robot("pacheco2021-a")
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     nf.save_path(nf.simulate(wrist, nf.pull(0.0, 2.0, steps=3)), f"{folder}/pull.json")
        ...     pulled = nf.read_path(f"{folder}/pull.json")
        >>> round(float(nf.solve(wrist, nf.Load(1.0), from_state=pulled.state).total_angle), 3)
        1.412
    """
    suffix = FilePath(file).suffix.lower()
    if suffix == ".csv":
        raise InputError.FILE_FORMAT(
            f"{file}: a CSV holds the numbers of every step, but neither the robot nor the memory "
            "of its friction, so no path can be made of it. Read its numbers with "
            "notchflex.read_table, or write .json, .nc or .parquet."
        )
    if suffix not in (".json", ".nc", ".parquet"):
        raise _unknown_suffix(file, "read")
    if not FilePath(file).is_file():
        raise InputError.FILE_NOT_FOUND(f"there is no file {file}.")
    if suffix == ".json":
        return _from_json(file)
    return read_netcdf(file) if suffix == ".nc" else path_of(read_head(file), str(file))


def whole_document(path: EquilibriumPath) -> dict[str, Any]:
    """Return a path as the JSON document that can be read back: for people, and for `read_path`."""
    return {**path_document(path), READ_BACK: encoded(record_of(path))}


def _from_json(file: str | FilePath) -> EquilibriumPath:
    try:
        document = json.loads(FilePath(file).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as problem:
        reason = getattr(problem, "strerror", None) or f"it is not JSON ({problem})"
        raise InputError.FILE_UNREADABLE(f"{file} cannot be read: {reason}.") from None
    if not isinstance(document, dict) or READ_BACK not in document:
        raise InputError.FILE_FORMAT(
            f"{file} holds no path that can be read back; give a file that simulate --json or "
            "save_path wrote."
        )
    path = path_of(decoded(document[READ_BACK], str(file)), str(file))
    if not _same_steps(path, document.get("steps")):
        raise InputError.FILE_DAMAGED(
            f"{file}: its steps are not those that its part {READ_BACK!r} holds, so one of them "
            "was changed; write the file again."
        )
    return path


def _same_steps(path: EquilibriumPath, steps: Any) -> bool:
    """Whether the steps of a document are those of a path, but for steps that were not tried.

    Version 0.1.0 wrote zeros for the shape of those. Reasons are worded anew.
    """
    expected = plain(path_document(path))["steps"]
    if not isinstance(steps, list) or len(steps) != len(expected):
        return False
    return all(
        isinstance(other, dict)
        and one == {**other, "reason": one["reason"], "reason_code": one["reason_code"]}
        for one, other, tried in zip(expected, steps, np.asarray(path.run.tried), strict=True)
        if tried
    )


def _unknown_suffix(file: str | FilePath, done: str) -> InputError:
    suffix = FilePath(file).suffix.lower()
    got = f"the suffix {suffix}" if suffix else "no suffix"
    return InputError.FILE_FORMAT(
        f"{file}: got {got}; a path is {done} as .json, .nc, .parquet or .csv."
    )


# A path as plain arrays and facts, from which an equal path is made: what files carry.
#
# A record holds the results of the solver (states, memory, reported quantities) and its input
# (robot file, loads, settings). Reading it back solves nothing, so the numbers are those written,
# whatever the version or the machine that reads them.

FORMAT = "notchflex path 1"
IN_BASE = "_in_base"
"""Ends the name of an array in the frame of a base that is turned in the world."""

_STATE, _START = "state", "before."
_RUN = ("residual", "iterations", "converged", "tried", "reached")
_HELD = ("smallest_eigenvalue", "determinant_sign")
_ADDED = ("snapped", "overdrawn")


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

    from notchflex.results.path import BEFORE, FLATTENING, MATERIAL, REPORTED
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
    for name in _ADDED:
        yield name, getattr(run, name)
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

    from notchflex.results.path import FLATTENING, REPORTED, Recorded
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
    # Older files have neither, nor do those of robots that cannot snap need the first.
    missing = dict(zip(_ADDED, (np.zeros(notches), np.zeros(steps, int)), strict=True))
    run = {
        name: _of_shape(arrays["solver_converged" if name == "converged" else name], (steps,), name)
        for name in _RUN
    }
    added = {
        name: _of_shape(arrays.get(name, values), values.shape, name)
        for name, values in missing.items()
    }
    return Recorded(
        solved=tree_util.tree_unflatten(structure, state),
        reported=reported,
        first=_before_the_first(arrays, ready, reported[FLATTENING].shape[1:]),
        held=(arrays[_HELD[0]], arrays[_HELD[1]]),
        **run,
        **added,
    )


def _before_the_first(
    arrays: Mapping[str, NDArray[Any]], ready: PreparedChain, flattening: tuple[int, ...]
) -> dict[str, NDArray[Any]]:
    """Return quantities of the state before the first step; older files lack those of materials."""
    from notchflex.results.path import BEFORE, FLATTENING, MATERIAL

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


# A path as a data frame and as a Parquet table: the columns of the CSV, one row per step.
#
# The head of a Parquet table also holds the record that reads the path back.

LIBRARIES = ("polars", "pandas")
_KEY = "notchflex"


def dataframe_of(path: EquilibriumPath, library: str = "polars") -> Any:
    """Return a path as a data frame; see `EquilibriumPath.to_dataframe`."""
    return frame(path_columns(path), library)


def frame(columns: Mapping[str, Any], library: str) -> Any:
    """Return columns as a data frame of "polars" or "pandas"."""
    if library not in LIBRARIES:
        raise InputError.UNKNOWN_NAME(
            f"to_dataframe makes a table of polars or pandas; got {library!r}"
        )
    need(library, "data", f"to_dataframe({library!r})")  # xarray, of the same extra, needs pandas
    columns = {name: np.asarray(values) for name, values in columns.items()}
    if library == "polars":
        import polars

        return polars.DataFrame(columns, nan_to_null=True)
    return import_module("pandas").DataFrame(columns)


def write_parquet(target: str | FilePath, path: EquilibriumPath) -> None:
    """Write a path as a Parquet table, one row a step, units in the names of the columns.

    Raises:
        InputError: polars is not installed, or the file cannot be written.
    """
    need("polars", "data", "Parquet")
    table = dataframe_of(path)
    head = {_KEY: json.dumps(encoded(record_of(path)))}
    buffer = io.BytesIO()  # polars has errors of its own where a disk is full
    table.write_parquet(buffer, metadata=head)
    with replacing(target) as temporary:
        temporary.write_bytes(buffer.getbuffer())


def read_columns(file: str | FilePath) -> Mapping[str, Sequence[Any]]:
    """Return the columns of a Parquet table.

    Raises:
        InputError: polars is not installed, or the file is not a Parquet table.
    """
    with _reading(file) as polars:
        return polars.read_parquet(FilePath(file)).to_dict(as_series=False)


def read_head(file: str | FilePath) -> Record:
    """Return the record in the head of a Parquet table.

    Raises:
        InputError: polars is not installed, the file is not a Parquet table or has no record.
    """
    with _reading(file) as polars:
        head = polars.read_parquet_metadata(FilePath(file))
    if _KEY not in head:
        raise InputError.FILE_FORMAT(
            f"{file} has no path of notchflex in its head; give a file that --parquet or "
            "save_path wrote, or read its columns with notchflex.read_table."
        )
    try:
        document = json.loads(head[_KEY])
    except ValueError:
        raise InputError.FILE_DAMAGED(
            f"{file} is damaged: its head is not JSON; write it again."
        ) from None
    return decoded(document, str(file))


@contextlib.contextmanager
def _reading(file: str | FilePath) -> Generator[Any]:
    """Yield polars; what it raises for a file that it cannot read becomes an `InputError`."""
    need("polars", "data", "Parquet")
    import polars
    from polars.exceptions import PolarsError

    try:
        yield polars
    except FileNotFoundError:
        raise InputError.FILE_NOT_FOUND(f"there is no file {file}.") from None
    except (OSError, PolarsError) as problem:
        words = " ".join(str(problem).split())
        raise InputError.FILE_UNREADABLE(f"{file} cannot be read as Parquet: {words}.") from None


# A path as a labelled data set of xarray, and as a NetCDF file that can be read back.
#
# Every quantity stands under the name that it has in Python, in the units of Python, with its title
# and unit. A group of the file holds the rest of the record of the path: the states, and what
# belongs to the frame of a base that is turned.

_GROUP = "read_back"
"""Group of a NetCDF file that holds what `read_path` needs beside the quantities."""

_FACTS = "facts"


def dataset_of(path: EquilibriumPath) -> Dataset:
    """Return a path as a data set; for what it holds see `EquilibriumPath.to_xarray`.

    Raises:
        InputError: xarray is not installed.
    """
    need("xarray", "data", "to_xarray")
    import xarray

    record = record_of(path)
    variables: dict[str, Any] = {}
    for name, quantity in QUANTITIES.items():
        values = np.asarray(getattr(path, name))
        if values.dtype.kind == "U":
            values = values.astype(object)
        variables[name] = (("step", *quantity.per), values, _described(quantity))
    tendons, notches = path.tension.shape[1], path.notch_angle.shape[1]
    return xarray.Dataset(
        variables,
        coords={
            "step": np.arange(1, len(path) + 1),
            "tendon": np.arange(1, tendons + 1),
            "notch": np.arange(1, notches + 1),
            "body": np.arange(notches + 1),
            "axis": list(AXES),
        },
        attrs={
            "title": path.robot.name,
            "program": f"{record.facts['program']} {record.facts['version']}",
            "robot_file": record.facts["robot"],
        },
    )


def record_dataset(path: EquilibriumPath) -> Dataset:
    """Return the part of the record of a path that its quantities do not hold, as a data set."""
    import xarray

    record = record_of(path)
    variables = {
        name: (tuple(f"{name}_axis_{axis}" for axis in range(values.ndim)), values)
        for name, values in record.arrays.items()
        if name not in QUANTITIES
    }
    facts = {name: one for name, one in record.facts.items() if name != "robot"}
    return xarray.Dataset(variables, attrs={_FACTS: json.dumps(facts)})


def write_netcdf(target: str | FilePath, path: EquilibriumPath) -> None:
    """Write a path as NetCDF: what `to_xarray` has, and the rest of its record in a group.

    Raises:
        InputError: A library is not installed, or the file cannot be written.
    """
    _need_netcdf()
    data, record = dataset_of(path), record_dataset(path)
    write_groups(target, {None: data, _GROUP: record})


def write_groups(target: str | FilePath, groups: Mapping[str | None, Dataset]) -> None:
    """Write data sets as the groups of one NetCDF file, whole or not at all.

    The file is made in memory: HDF5 itself ends the process where a disk is full.

    Raises:
        InputError: The file cannot be written.
    """
    import h5netcdf
    from xarray.backends import H5NetCDFStore

    buffer = io.BytesIO()
    with h5netcdf.File(buffer, "w") as file:
        for group, data in groups.items():
            data.dump_to_store(H5NetCDFStore(file, group=group))
    with replacing(target) as temporary:
        temporary.write_bytes(buffer.getbuffer())


def read_netcdf(file: str | FilePath) -> EquilibriumPath:
    """Return the path of a file that `write_netcdf` wrote.

    Raises:
        InputError: A library is not installed, or the file holds no path or lacks something.
    """
    _need_netcdf()
    import h5py
    import xarray

    try:
        data = xarray.load_dataset(file, engine="h5netcdf")
        with h5py.File(file, "r") as opened:
            has_record = _GROUP in opened
        # Files of version 0.1.0 hold the record beside the quantities.
        group = {"group": _GROUP} if has_record else {}
        record = xarray.load_dataset(file, engine="h5netcdf", **group)
    except (OSError, ValueError, KeyError) as problem:
        words = " ".join(str(problem).split())
        raise InputError.FILE_UNREADABLE(f"{file} cannot be read as NetCDF: {words}.") from None
    if "robot_file" not in data.attrs:
        raise InputError.FILE_FORMAT(
            f"{file} holds no path of notchflex; give a file that --nc or save_path wrote."
        )
    if "step" not in data.dims:
        raise InputError.FILE_FORMAT(
            f"{file} holds one state, not a path: the work done before it is not in it. "
            "Write the path that it belongs to, or the state alone with state.save."
        )
    if _FACTS not in record.attrs:
        raise InputError.FILE_FORMAT(
            f"{file} holds the quantities of a path, but not the states between its steps, so "
            "no path can be made of it; write the path with notchflex.save_path."
        )
    try:
        facts = {**json.loads(record.attrs[_FACTS]), "robot": data.attrs["robot_file"]}
    except (TypeError, ValueError):
        raise InputError.FILE_DAMAGED(
            f"{file} is damaged: its facts are not JSON; write it again."
        ) from None
    both = {**data.data_vars, **record.data_vars}
    arrays = {str(name): np.asarray(values.to_numpy()) for name, values in both.items()}
    return path_of(Record(facts, arrays), str(file))


def _need_netcdf() -> None:
    for module in ("xarray", "h5netcdf", "h5py"):
        need(module, "data", "NetCDF")


def _described(quantity: Quantity) -> dict[str, Any]:
    attributes: dict[str, Any] = {"long_name": quantity.title, "description": quantity.description}
    if quantity.unit:
        attributes["units"] = quantity.python_unit
    if quantity.name == "contact_state":
        words = (text.replace(" ", "_") for text in CONTACT_STATES.values())
        attributes |= {"flag_values": list(CONTACT_STATES), "flag_meanings": " ".join(words)}
    return attributes
