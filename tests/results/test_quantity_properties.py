"""Typed properties: those of the table of quantities, with the shapes that they promise."""

import importlib.util
import re
from pathlib import Path
from typing import Any

import jaxtyping
import numpy as np
import pytest

import notchflex as nf
from notchflex.results.quantities import properties as quantity_properties
from notchflex.results.quantities.path_formulas import FORMULAS
from notchflex.results.quantities.registry import QUANTITIES
from notchflex.solver.derived.quantities import Quantities, Shape

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def path():
    robot = nf.load_robot("pacheco2021-a")
    return nf.simulate(robot, nf.pull(0.0, 1.0, steps=3))


def generator() -> Any:
    file = ROOT / "docs" / "make" / "quantity_properties.py"
    spec = importlib.util.spec_from_file_location("quantity_properties_generator", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_module_is_what_the_table_gives():
    written = Path(quantity_properties.__file__).read_text(encoding="utf-8")
    assert written == generator().module(), "run docs/make/quantity_properties.py"


def test_tab_finds_every_quantity(path):
    for thing in (path, path[0]):
        assert set(QUANTITIES) <= set(dir(thing))
        assert {"front", "plot", "robot", "load", "to_xarray"} <= set(dir(thing))


def test_unknown_names_are_refused(path):
    with pytest.raises(AttributeError, match="tip_positon"):
        _ = path[0].tip_positon
    with pytest.raises(AttributeError):
        _ = path[0].settings


def test_type_checkers_know_the_shapes():
    properties = vars(quantity_properties.EquilibriumQuantities)
    assert properties["tip_position"].fget.__annotations__["return"] == "Float[np.ndarray, ' 3']"
    assert properties["total_angle"].fget.__annotations__["return"] == "float"
    path_properties = vars(quantity_properties.PathQuantities)
    assert path_properties["reason"].fget.__annotations__["return"] == "list[str]"


@pytest.mark.parametrize("name", QUANTITIES)
def test_values_are_what_the_types_say(path, name):
    sizes = {"s": 3, "t": 1, "n": 5, "bodies": 6, "3": 3, "spans": 10, "contacts": 9}
    for thing, leading in ((path, ("s",)), (path[1], ())):
        value = getattr(thing, name)
        mixin = type(thing).__mro__[1]
        annotation = vars(mixin)[name].fget.__annotations__["return"]
        names = {one: getattr(jaxtyping, one) for one in ("Float", "Bool", "Int")}
        wanted = eval(annotation, {**names, "np": np})
        quantity = QUANTITIES[name]
        if annotation == "list[str]":
            assert len(value) == 3
            assert all(type(one) is str for one in value)
            continue
        assert isinstance(value, wanted)
        shape = tuple(sizes[one] for one in (*leading, *quantity.shape))
        assert np.shape(value) == shape
        if not leading and not shape:
            assert type(value) is quantity.kind


@pytest.mark.parametrize("fields", [Shape, Quantities])
def test_what_the_solver_reports_is_in_the_table_with_its_shape(fields):
    for name, annotation in fields.__annotations__.items():
        if name in ("friction_holds", "bend_possible"):  # parts of `converged`
            continue
        text = getattr(annotation, "__forward_arg__", str(annotation))
        kind, sizes = re.fullmatch(r"(\w+)\[Array, ['\"]\*s ?([^'\"]*)['\"]\]", text).groups()
        assert tuple(sizes.split()) == QUANTITIES[name].shape, name
        assert kind == {float: "Float", int: "Int", bool: "Bool"}[QUANTITIES[name].kind], name


def test_formulas_are_of_known_quantities():
    assert set(FORMULAS) <= {*QUANTITIES, "front"}


def test_a_state_as_plain_values(path, tmp_path):
    import json

    nf.save_path(path, tmp_path / "path.json")
    steps = json.loads((tmp_path / "path.json").read_text())["steps"]
    assert json.loads(json.dumps(path[1].to_dict())) == steps[1]
