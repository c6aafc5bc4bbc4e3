"""A path as a labelled data set of xarray, and as a NetCDF file that can be read back.

Every quantity stands under the name that it has in Python, in the units of Python, with its title
and unit. A group of the file holds the rest of the record of the path: the states, and what belongs
to the frame of a base that is turned.
"""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex._extras import need
from notchflex._quantity import Quantity
from notchflex._replacing import replacing
from notchflex.errors import InputError
from notchflex.results.files.record import Record, path_of, record_of
from notchflex.results.quantities.registry import AXES, CONTACT_STATES, QUANTITIES

if TYPE_CHECKING:
    from xarray import Dataset

    from notchflex.results.path import EquilibriumPath

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
