"""A path as a labelled data set of xarray, and what a NetCDF file holds beside it.

Every quantity stands under the name that it has in Python, in the units of Python, with its title
and unit. A NetCDF file that is read back holds the record of the path in a group of its own: the
states, and what belongs to the frame of a base that is turned.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex._extras import need
from notchflex._quantity import Quantity
from notchflex.errors import InputError
from notchflex.results.files.record import Record, path_of, record_of
from notchflex.results.quantities.registry import AXES, CONTACT_STATES, QUANTITIES

if TYPE_CHECKING:
    from xarray import Dataset

    from notchflex.results.path import EquilibriumPath

RECORD_GROUP = "read_back"
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
    return xarray.Dataset(
        variables,
        coords=_coordinates(path),
        attrs={
            "title": path.robot.name,
            "program": f"{record.facts['program']} {record.facts['version']}",
            "robot_file": record.facts["robot"],
        },
    )


def record_dataset(path: EquilibriumPath) -> Dataset:
    """Return the part of the record of a path that its quantities do not hold, as a data set.

    Raises:
        InputError: xarray is not installed.
    """
    need("xarray", "data", "to_xarray")
    import xarray

    record = record_of(path)
    variables = {
        name: (tuple(f"{name}_axis_{axis}" for axis in range(values.ndim)), values)
        for name, values in record.arrays.items()
        if name not in QUANTITIES
    }
    facts = {name: one for name, one in record.facts.items() if name != "robot"}
    return xarray.Dataset(variables, attrs={_FACTS: json.dumps(facts)})


def path_of_datasets(data: Dataset, record: Dataset | None, source: str) -> EquilibriumPath:
    """Return the path of what `dataset_of` and `record_dataset` made.

    Args:
        data: The quantities. Files of version 0.1.0 hold the record with them.
        record: The rest of the record, if the file has its group.
        source: Where they were read from, for messages.

    Raises:
        InputError: They hold no path, or lack something.
    """
    rest = data if record is None else record
    if "robot_file" not in data.attrs:
        raise InputError.FILE_FORMAT(
            f"{source} holds no path of notchflex; give a file that --nc or save_path wrote."
        )
    if "step" not in data.dims:
        raise InputError.FILE_FORMAT(
            f"{source} holds one state, not a path: the work done before it is not in it. "
            "Write the path that it belongs to, or the state alone with state.save."
        )
    if _FACTS not in rest.attrs:
        raise InputError.FILE_FORMAT(
            f"{source} holds the quantities of a path, but not the states between its steps, so "
            "no path can be made of it; write the path with notchflex.save_path."
        )
    try:
        facts = {**json.loads(rest.attrs[_FACTS]), "robot": data.attrs["robot_file"]}
    except (TypeError, ValueError):
        raise InputError.FILE_DAMAGED(
            f"{source} is damaged: its facts are no JSON; write it again."
        ) from None
    both = {**data.data_vars, **rest.data_vars}
    arrays = {str(name): np.asarray(values.to_numpy()) for name, values in both.items()}
    return path_of(Record(facts, arrays), source)


def _described(quantity: Quantity) -> dict[str, Any]:
    attributes: dict[str, Any] = {"long_name": quantity.title, "description": quantity.description}
    if quantity.unit:
        attributes["units"] = quantity.python_unit
    if quantity.name == "contact_state":
        attributes["flag_values"] = list(CONTACT_STATES)
        attributes["flag_meanings"] = " ".join(
            text.replace(" ", "_") for text in CONTACT_STATES.values()
        )
    return attributes


def _coordinates(path: EquilibriumPath) -> dict[str, Any]:
    tendons, notches = path.tension.shape[1], path.notch_angle.shape[1]
    return {
        "step": np.arange(1, len(path) + 1),
        "tendon": np.arange(1, tendons + 1),
        "notch": np.arange(1, notches + 1),
        "body": np.arange(notches + 1),
        "axis": list(AXES),
    }
