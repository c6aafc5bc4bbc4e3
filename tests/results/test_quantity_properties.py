"""Typed properties: those of the table of quantities, with the shapes that they promise."""

import importlib.util
import inspect
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import notchflex as nf
from notchflex.results import quantities as quantity_properties
from notchflex.results.quantities import QUANTITIES

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


def test_results_cannot_be_set(path):
    with pytest.raises(AttributeError, match="total_angle"):
        path[0].total_angle = 0.0


def test_help_has_unit_shape_and_text():
    text = inspect.getdoc(nf.Equilibrium.tip_position)
    assert text.startswith("Tip position, mm, shape (3).\n\nPosition of the tip")
    assert "NaN beyond the end of a tendon." in nf.EquilibriumPath.span_tension.__doc__


@pytest.mark.parametrize("name", QUANTITIES)
def test_values_are_what_the_registry_says(path, name):
    sizes = {"t": 1, "n": 5, "bodies": 6, "3": 3, "spans": 10, "contacts": 9}
    quantity = QUANTITIES[name]
    shape = tuple(sizes[one] for one in quantity.shape)
    if quantity.kind is str:
        assert [type(one) for one in getattr(path, name)] == [str] * 3
        assert type(getattr(path[1], name)) is str
        return
    values, value = getattr(path, name), getattr(path[1], name)
    assert values.shape == (3, *shape)
    assert values.dtype.kind == {float: "f", bool: "b", int: "i"}[quantity.kind]
    assert np.shape(value) == shape
    if not shape:
        assert type(value) is quantity.kind


TIP_HEIGHT = """@Quantity(
    "state", "tip height", "h", "mm", key="tip_height_mm", column="tip_height_mm"
)
def tip_height(state: SolvedState) -> Array:
    \"\"\"Height of the tip above the base.\"\"\"
    return state.quantity("tip_position")[2]


"""
CHECK = """
import notchflex as nf
wrist, load = nf.load_robot("pacheco2021-a"), nf.pull(0.0, 1.0, steps=3)
path = nf.simulate(wrist, load)
height = path.tip_position[:, 2]
assert (path.tip_height == height).all() and type(path[1].tip_height) is float
assert path[1].to_dict()["tip_height_mm"] == height[1]
assert path.to_dataframe()["tip_height_mm"][2] == height[2]
assert path.to_xarray()["tip_height"].attrs["units"] == "mm"
nf.save_path(path, "path.parquet")
assert (nf.read_path("path.parquet").tip_height == height).all()
found = nf.solve_batch(wrist, load, outputs=["tip_height", "tip_position"])
assert (found["tip_height"] == found["tip_position"][:, 2]).all()
import jax
bend = nf.differentiable(wrist, load, ["tension"], outputs=["tip_height", "tip_position"])
slopes = jax.jacobian(bend)(bend.start)
by_tension = slopes["tip_height"]["tension"]
assert (by_tension == slopes["tip_position"]["tension"][:, 2]).all() and by_tension[2, 2, 0] < 0.0
"""


@pytest.mark.nightly
def test_a_new_quantity_is_one_registration(tmp_path):
    """In a copy of the package, with nothing but the formula added and the script run."""
    shutil.copytree(ROOT / "src", tmp_path / "src", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(ROOT / "docs" / "make", tmp_path / "docs" / "make")
    file = tmp_path / "src" / "notchflex" / "solver" / "quantities.py"
    text = file.read_text(encoding="utf-8")
    file.write_text(f"{text}\n\n{TIP_HEIGHT}", encoding="utf-8")
    environment = dict(os.environ, PYTHONPATH=str(tmp_path / "src"))
    for arguments in (["docs/make/quantity_properties.py"], ["-c", CHECK]):
        done = subprocess.run(
            [sys.executable, *arguments],
            capture_output=True,
            text=True,
            check=False,
            cwd=tmp_path,
            env=environment,
        )
        assert done.returncode == 0, done.stderr


def test_a_state_as_plain_values(path, tmp_path):
    import json

    nf.save_path(path, tmp_path / "path.json")
    steps = json.loads((tmp_path / "path.json").read_text())["steps"]
    assert json.loads(json.dumps(path[1].to_dict())) == steps[1]
