"""Paths to files and back: `save_path` writes JSON, NetCDF, Parquet or CSV, `read_path` reads."""

from __future__ import annotations

import base64
import contextlib
import io
import json
from collections.abc import Generator, Mapping, Sequence
from dataclasses import asdict
from importlib import import_module
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from notchflex import __version__
from notchflex._imports import need
from notchflex._jax import jax
from notchflex._quantity import REGISTERED, Quantity
from notchflex._replacing import AnyPath, replacing
from notchflex.errors import ErrorCode, InputError
from notchflex.results.quantities import AXES, CONTACT_STATES, QUANTITIES
from notchflex.results.state import leaves_of
from notchflex.results.tables import path_columns, path_document, plain, write_json, write_path_csv
from notchflex.results.writing import suffix_of

if TYPE_CHECKING:
    from xarray import Dataset

    from notchflex.results.path import EquilibriumPath, Recorded
    from notchflex.solver.residual import SolverState


READ_BACK = "read_back"
"""Key of a JSON document under which the exact numbers stand."""


def save_path(path: EquilibriumPath, file: AnyPath) -> None:
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


def read_path(file: AnyPath) -> EquilibriumPath:
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
    readers = {".json": _read_json, ".nc": _read_netcdf, ".parquet": _read_parquet}
    if suffix not in readers:
        raise _unknown_suffix(file, "read")
    if not FilePath(file).is_file():
        raise InputError.FILE_NOT_FOUND(f"there is no file {file}.")
    return readers[suffix](file)


def whole_document(path: EquilibriumPath) -> dict[str, Any]:
    """Return a path as the JSON document that can be read back: for people, and for `read_path`."""
    return {**path_document(path), READ_BACK: encoded(path)}


def _read_json(file: AnyPath) -> EquilibriumPath:
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
    path = _decoded(document[READ_BACK], file)
    if not _same_steps(path, document.get("steps")):
        raise InputError.FILE_DAMAGED(
            f"{file}: its steps are not those that its part {READ_BACK!r} holds, so one of them "
            "was changed; write the file again."
        )
    return path


def _same_steps(path: EquilibriumPath, steps: Any) -> bool:
    """Return whether the steps of a document are those of a path, but for those not tried."""
    # Version 0.1.0 wrote zeros for the shape of those. Reasons are worded anew.
    expected = plain(path_document(path))["steps"]
    if not isinstance(steps, list) or len(steps) != len(expected):
        return False
    return all(
        isinstance(written, dict)
        and step == {**written, "reason": step["reason"], "reason_code": step["reason_code"]}
        for step, written, tried in zip(expected, steps, path.run.tried, strict=True)
        if tried
    )


def _unknown_suffix(file: AnyPath, done: str) -> InputError:
    return InputError.FILE_FORMAT(
        f"{file}: got {suffix_of(file)}; a path is {done} as .json, .nc, .parquet or .csv."
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
_HELD = ("smallest_eigenvalue", "determinant_sign")
_RUN = {
    # A path counts more as not converged than the solver does.
    "solver_converged": "converged",
    **{
        name: name
        for name in ("residual", "iterations", "tried", "reached", "snapped", "overdrawn")
    },
}
"""Names of arrays in files to the attributes of a run."""


def facts_of(path: EquilibriumPath) -> dict[str, Any]:
    """Return the robot file as text, the external loads, how it was solved; plain values."""
    from notchflex.robot import robot_text

    chain = path.chain
    # The external loads: each different one, and which of them every step has.
    external = {
        "distinct": [asdict(load) for load in path.load.different],
        "step": path.load.which.tolist(),
    }
    return {
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
        "settings": asdict(path.settings),
        "external": json.dumps(external),
    }


def arrays_of(path: EquilibriumPath) -> dict[str, NDArray[Any]]:
    """Return all else that a path is made of by name, in mm, N, rad."""
    from notchflex.results.path import REPORTED

    run, turned = path.run, bool(path.load.base_rotation.any())
    arrays = {
        "commanded_tension": path.load.tension,
        "commanded_stroke": path.load.stroke,
        **{_key(name, turned): run.quantity(name) for name in REPORTED},
        **{name: getattr(run, attribute) for name, attribute in _RUN.items()},
        **dict(zip(_HELD, path.stability, strict=True)),
        **{_START + name: run.before(name) for name in _before(run.solved)},
        **{_STATE + name: leaf for name, leaf in leaves_of(run.solved).items()},
    }
    return {name: np.asarray(values) for name, values in arrays.items()}


def _before(state: SolverState) -> tuple[str, ...]:
    """Return what is needed of the state before the first: more of a material that remembers."""
    from notchflex.results.path import BEFORE, FLATTENING, MATERIAL

    return BEFORE if isinstance(state.memory.material, tuple) else (*BEFORE, MATERIAL, FLATTENING)


def encoded(path: EquilibriumPath) -> dict[str, Any]:
    """Return a path for JSON: numbers as their bytes, so that not one digit is lost."""
    arrays: dict[str, Any] = {}
    for name, values in arrays_of(path).items():
        array = np.ascontiguousarray(values).astype(values.dtype.newbyteorder("<"))
        code = base64.b64encode(array.tobytes()).decode("ascii")
        arrays[name] = {"type": array.dtype.str, "shape": list(array.shape), "base64": code}
    return {"facts": facts_of(path), "arrays": arrays}


def _decoded(document: Any, source: AnyPath) -> EquilibriumPath:
    """Return the path that `encoded` was given."""
    with _damage(source):
        arrays = {
            name: np.frombuffer(base64.b64decode(code["base64"]), np.dtype(code["type"]))
            .reshape(code["shape"])
            .copy()
            for name, code in document["arrays"].items()
        }
        return _path_of(document["facts"], arrays, source)


@contextlib.contextmanager
def _damage(source: AnyPath) -> Generator[None]:
    """Tell what prevents that a path is made of what a file holds."""
    try:
        yield
    except InputError as problem:
        if problem.code is ErrorCode.FILE_FORMAT:
            raise
        reason = str(problem)
    except KeyError as problem:
        reason = f"{problem.args[0]} is missing; write it again."
    except (AttributeError, TypeError, ValueError, IndexError) as problem:
        reason = f"it is damaged ({problem}); write it again."
    else:
        return
    raise InputError.FILE_DAMAGED(f"{source} cannot be read back: {reason}")


def _path_of(
    facts: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]], source: AnyPath
) -> EquilibriumPath:
    """Return the path of facts and arrays that were read from a file."""
    from notchflex.loads import BodyForce, ExternalLoad, LoadPath
    from notchflex.results.path import EquilibriumPath
    from notchflex.robot import robot_from_text
    from notchflex.solver.newton import Settings
    from notchflex.solver.programs.prepare import prepare

    if facts.get("format") != FORMAT:
        got = facts.get("format")
        raise InputError.FILE_FORMAT(
            f"{source} has the format {got!r}, not {FORMAT!r}: notchflex {__version__} cannot make "
            "a path of it; write it again with this version."
        )
    robot, loads = robot_from_text(facts["robot"]), json.loads(facts["external"])
    distinct = [
        ExternalLoad(
            **load | {"body_forces": [BodyForce(**force) for force in load["body_forces"]]}
        )
        for load in loads["distinct"]
    ]
    load = LoadPath(
        arrays["commanded_tension"],
        arrays["commanded_stroke"],
        np.array(facts["base_rotation_rad"]),
        tuple(distinct[number] for number in loads["step"]),
    )
    # Files of older versions have neither.
    notches, steps = robot.number_of_notches, len(load)
    added = {"snapped": np.zeros((steps, notches)), "overdrawn": np.zeros(steps, int)}
    form = {name: facts[name] for name in ("level", "loaded", "refinement", "flat")}
    ready = prepare(robot, **form)
    turned = bool(load.base_rotation.any())
    recorded = _recorded({**added, **arrays}, ready.rest, steps, turned)
    return EquilibriumPath(
        robot, load, ready, recorded, facts["each_from_rest"], Settings(**facts["settings"])
    )


def _recorded(
    arrays: Mapping[str, NDArray[Any]], rest: SolverState, steps: int, turned: bool
) -> Recorded:
    """Return what the solver found, of the shapes that robot and loads ask for."""
    from notchflex.results.path import REPORTED, Recorded

    expected = {_STATE + name: np.shape(leaf) for name, leaf in leaves_of(rest).items()}
    for name, values in arrays.items():
        shape = (steps, *expected.get(name, values.shape[1:]))
        if values.shape != shape and not name.startswith(_START):
            raise InputError.FILE_DAMAGED(
                f"{name} has the shape {values.shape}, and this robot and its loads ask for "
                f"{shape}."
            )
    smallest, sign = (arrays[name] for name in _HELD)
    return Recorded(
        solved=jax.tree.unflatten(jax.tree.structure(rest), [arrays[name] for name in expected]),
        reported={name: arrays[_key(name, turned)] for name in REPORTED},
        first={name: arrays[_START + name] for name in _before(rest)},
        held=(smallest, sign),
        **{attribute: arrays[name] for name, attribute in _RUN.items()},
    )


def _key(name: str, turned: bool) -> str:
    """Return the name of an array of the solver, whose vectors are in the frame of the base."""
    return f"{name}{IN_BASE}" if turned and REGISTERED[name].in_world else name


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


def write_parquet(target: AnyPath, path: EquilibriumPath) -> None:
    """Write a path as a Parquet table, one row a step, units in the names of the columns.

    Raises:
        InputError: polars is not installed, or the file cannot be written.
    """
    need("polars", "data", "Parquet")
    table = dataframe_of(path)
    head = {_KEY: json.dumps(encoded(path))}
    buffer = io.BytesIO()  # polars has errors of its own where a disk is full
    table.write_parquet(buffer, metadata=head)
    with replacing(target) as temporary:
        temporary.write_bytes(buffer.getbuffer())


def read_columns(file: AnyPath) -> Mapping[str, Sequence[Any]]:
    """Return the columns of a Parquet table."""
    with _reading(file) as polars:
        return polars.read_parquet(FilePath(file)).to_dict(as_series=False)


def _read_parquet(file: AnyPath) -> EquilibriumPath:
    """Return the path in the head of a Parquet table."""
    with _reading(file) as polars:
        head = polars.read_parquet_metadata(FilePath(file))
    if _KEY not in head:
        raise InputError.FILE_FORMAT(
            f"{file} has no path of notchflex in its head; give a file that --parquet or "
            "save_path wrote, or read its columns with notchflex.read_table."
        )
    with _damage(file):
        document = json.loads(head[_KEY])
    return _decoded(document, file)


@contextlib.contextmanager
def _reading(file: AnyPath) -> Generator[Any]:
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
    """Return a path as a data set; for what it holds see `EquilibriumPath.to_xarray`."""
    need("xarray", "data", "to_xarray")
    import xarray

    from notchflex.robot import robot_text

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
            "program": f"notchflex {__version__}",
            "robot_file": robot_text(path.robot),
        },
    )


def write_netcdf(target: AnyPath, path: EquilibriumPath) -> None:
    """Write a path as NetCDF: what `to_xarray` has, and the rest of its record in a group.

    Raises:
        InputError: A library is not installed, or the file cannot be written.
    """
    _need_netcdf()
    import xarray

    rest = {
        name: (tuple(f"{name}_axis_{axis}" for axis in range(values.ndim)), values)
        for name, values in arrays_of(path).items()
        if name not in QUANTITIES
    }
    facts = {name: fact for name, fact in facts_of(path).items() if name != "robot"}
    group = xarray.Dataset(rest, attrs={_FACTS: json.dumps(facts)})
    write_groups(target, {None: dataset_of(path), _GROUP: group})


def write_groups(target: AnyPath, groups: Mapping[str | None, Dataset]) -> None:
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


def _read_netcdf(file: AnyPath) -> EquilibriumPath:
    """Return the path of a file that `write_netcdf` wrote."""
    _need_netcdf()
    import xarray

    try:
        data = xarray.load_dataset(file, engine="h5netcdf")
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
    rest = data  # files of version 0.1.0 hold all in one group
    with contextlib.suppress(OSError):
        rest = xarray.load_dataset(file, engine="h5netcdf", group=_GROUP)
    if _FACTS not in rest.attrs:
        raise InputError.FILE_FORMAT(
            f"{file} holds the quantities of a path, but not the states between its steps, so "
            "no path can be made of it; write the path with notchflex.save_path."
        )
    with _damage(file):
        facts = {**json.loads(rest.attrs[_FACTS]), "robot": data.attrs["robot_file"]}
        variables = {**data.data_vars, **rest.data_vars}
        arrays = {str(name): np.asarray(array.to_numpy()) for name, array in variables.items()}
        return _path_of(facts, arrays, file)


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
