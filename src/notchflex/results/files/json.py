"""Results as one JSON document: keys and units from the table of quantities, never a NaN."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex import __version__
from notchflex._quantity import Quantity
from notchflex.results.files.writing import write_text
from notchflex.results.quantities.registry import CONTACT_STATES, QUANTITIES, holds, spans_of, units
from notchflex.robot import Robot
from notchflex.robot.robot import to_table

if TYPE_CHECKING:
    from pathlib import Path as FilePath

    from notchflex.results.path import EquilibriumPath

# Quantities of contacts are gathered contact by contact.
CONTACTS = tuple(q for q in QUANTITIES.values() if q.key and q.per == ("tendon", "contact"))
PLAIN = tuple(q for q in QUANTITIES.values() if q.key and q not in CONTACTS)

# External loads are input, not results: they are not registered as quantities.
_LOAD_KEYS = {
    "tip_force": ("tip_force_N", "N"),
    "tip_moment": ("tip_moment_Nmm", "N mm"),
    "tip_point": ("tip_point_mm", "mm"),
    "tip_mass": ("tip_mass_g", "g"),
    "gravity": ("gravity_m_s2", "m/s^2"),
    "force": ("body_forces.force_N", "N"),
    "moment": ("body_forces.moment_Nmm", "N mm"),
    "point": ("body_forces.point_mm", "mm"),
}
LOAD_UNITS = {f"load.{key}": unit for key, unit in _LOAD_KEYS.values()}


def path_document(path: EquilibriumPath) -> dict[str, Any]:
    """Return a path as a document of plain lists, numbers, strings and None.

    Args:
        path: Solved path, S steps.

    Returns:
        `name`, `version`, `robot` (its whole description), `units` (JSON key to unit),
        `converged`, `reason`, `reason_code` (name of a `Failure`) and `steps`, a list of S
        objects. None stands where there is no number. Angles in deg, lengths in mm, forces in N.
        Where external loads act in any step, `load` holds those of every step.
    """
    external = _external(path)
    failed = next((step for step, good in enumerate(path.converged) if not good), None)
    steps = [_step(path, index, external) for index in range(len(path))]
    return {
        **document_head(path.robot),
        "units": units() | (LOAD_UNITS if external else {}),
        "converged": failed is None,
        "reason": "" if failed is None else str(path.reason[failed]),
        "reason_code": "" if failed is None else str(path.reason_code[failed]),
        "steps": steps,
    }


def step_document(path: EquilibriumPath, index: int) -> dict[str, Any]:
    """Return one step (from 0) of the document of a path, of plain values."""
    return plain(_step(path, index, _external(path)))


def document_head(robot: Robot) -> dict[str, Any]:
    """Return the head that every document has: the robot's name and description, the version."""
    return {
        "name": robot.name,
        "program": "notchflex",
        "version": __version__,
        "robot": plain(to_table(robot)),
    }


def json_text(document: Any) -> str:
    r"""Return a document as JSON text that ends with a newline.

    Args:
        document: Nested dicts and lists; numpy arrays and numbers are allowed.

    Returns:
        Strict JSON: NaN becomes null.

    Example:
        >>> json_text({"angle_deg": [1.5, float("nan")]})
        '{"angle_deg": [1.5, null]}\n'
    """
    return json.dumps(plain(document), ensure_ascii=False, allow_nan=False) + "\n"


def write_json(target: str | FilePath, document: Any) -> None:
    """Write a document to a file, whole or not at all, or to standard output for `-`.

    Raises:
        InputError: The file cannot be written.
    """
    write_text(target, json_text(document))


def plain(value: Any) -> Any:
    """Return a value as JSON knows it: arrays as lists, NaN as None, infinity as "inf".

    Infinity only stands in robot descriptions (an inextensible tendon); as a string it is read
    back as a number by the robot models.
    """
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, (np.ndarray, np.generic)):
        return plain(value.tolist())
    if isinstance(value, float):
        if math.isnan(value):
            return None
        if math.isinf(value):
            return "inf" if value > 0 else "-inf"
    return value


def _step(path: EquilibriumPath, index: int, external: list[dict[str, Any]]) -> dict[str, Any]:
    step: dict[str, Any] = {"step": index + 1}
    for quantity in PLAIN:
        if holds(path, quantity):
            holder = step
            *outer, last = quantity.key.split(".")
            for key in outer:
                holder = holder.setdefault(key, {})
            holder[last] = _value(path, quantity, index)
    if external:
        step.setdefault("load", {}).update(external[index])
    step["contacts"] = [_contacts(path, tendon, index) for tendon in range(path.tension.shape[1])]
    return step


def _external(path: EquilibriumPath) -> list[dict[str, Any]]:
    """External loads of every step; nothing at all where no step has any."""
    if all(one.is_nothing for one in path.load.external):
        return []
    return [_with_units(asdict(one)) for one in path.load.external]


def _with_units(values: dict[str, Any]) -> dict[str, Any]:
    forces = values.pop("body_forces", None)
    named = {
        _LOAD_KEYS.get(name, (name,))[0].rpartition(".")[2]: value for name, value in values.items()
    }
    if forces is not None:
        named["body_forces"] = [_with_units(one) for one in forces]
    return named


def _value(path: EquilibriumPath, quantity: Quantity, index: int) -> Any:
    value = getattr(path, quantity.name)[index]
    if quantity.per == ("tendon", "span"):
        return [row[: spans_of(path, tendon)] for tendon, row in enumerate(value)]
    if quantity.scale != 1.0:
        return np.asarray(value) * quantity.scale
    return value.item() if isinstance(value, np.generic) else value


def _contacts(path: EquilibriumPath, tendon: int, index: int) -> list[dict[str, Any]]:
    count = spans_of(path, tendon) - 1
    columns = {
        q.key.split(".")[1]: getattr(path, q.name)[index, tendon, :count] * q.scale
        for q in CONTACTS
        if holds(path, q)
    }
    columns["state"] = [CONTACT_STATES[int(state)] for state in columns["state"]]
    return [{key: column[contact] for key, column in columns.items()} for contact in range(count)]
