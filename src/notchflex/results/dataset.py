"""A path as a labelled data set of xarray, and the path of such a data set.

Every quantity stands under the name that it has in Python, in the units of Python, with its title
and unit beside it. What a path needs besides to be read back (the states, and what the base turns)
stands with them.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex._extras import need
from notchflex.results.quantities import AXES, CONTACT_STATES, QUANTITIES
from notchflex.results.quantity import Quantity
from notchflex.results.record import IN_BASE, Record, path_of, record_of

if TYPE_CHECKING:
    from xarray import Dataset

    from notchflex.statics import Path

_FACTS = "facts"


def dataset_of(path: Path) -> Dataset:
    """Return a path as a data set; for what it holds see `Path.to_xarray`.

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
    for name, values in record.arrays.items():
        if name not in variables:
            variables[name] = (_dimensions(name, values), values)
    facts = dict(record.facts)
    return xarray.Dataset(
        variables,
        coords=_coordinates(path),
        attrs={
            "title": path.robot.name,
            "program": f"{facts['program']} {facts['version']}",
            "robot_file": facts["robot"],
            _FACTS: json.dumps({name: told for name, told in facts.items() if name != "robot"}),
        },
    )


def path_of_dataset(data: Dataset, source: str) -> Path:
    """Return the path of a data set that `dataset_of` made.

    Raises:
        InputError: It is none, or lacks something.
    """
    from notchflex.errors import InputError

    if _FACTS not in data.attrs or "robot_file" not in data.attrs:
        raise InputError(
            f"{source} holds no path of notchflex; give a file that --nc or save_path wrote."
        )
    if "step" not in data.dims:
        raise InputError(
            f"{source} holds one state, not a path: the work done before it is not in it. "
            "Write the path that it belongs to, or the state alone with state.save."
        )
    try:
        facts = {**json.loads(data.attrs[_FACTS]), "robot": data.attrs["robot_file"]}
    except (TypeError, ValueError):
        raise InputError(f"{source} is damaged: its facts are no JSON; write it again.") from None
    arrays = {str(name): np.asarray(values.to_numpy()) for name, values in data.items()}
    return path_of(Record(facts, arrays), source)


def _described(quantity: Quantity) -> dict[str, Any]:
    attributes: dict[str, Any] = {"long_name": quantity.title, "description": quantity.description}
    if quantity.unit:
        attributes["units"] = "rad" if quantity.unit == "deg" else quantity.unit
    if quantity.name == "contact_state":
        attributes["flag_values"] = list(CONTACT_STATES)
        attributes["flag_meanings"] = " ".join(
            text.replace(" ", "_") for text in CONTACT_STATES.values()
        )
    return attributes


def _dimensions(name: str, values: Any) -> tuple[str, ...]:
    """Names of the axes of an array that has no row in the table of quantities."""
    quantity = QUANTITIES.get(name.removesuffix(IN_BASE))
    if quantity is not None:
        return ("step", *quantity.per)
    if name.startswith("before."):
        return QUANTITIES[name.removeprefix("before.")].per
    return ("step", *(f"{name}_axis_{axis}" for axis in range(1, values.ndim)))


def _coordinates(path: Path) -> dict[str, Any]:
    tendons, notches = path.tension.shape[1], path.notch_angle.shape[1]
    return {
        "step": np.arange(1, len(path) + 1),
        "tendon": np.arange(1, tendons + 1),
        "notch": np.arange(1, notches + 1),
        "body": np.arange(notches + 1),
        "axis": list(AXES),
    }
