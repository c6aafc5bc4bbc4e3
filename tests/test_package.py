"""The package as a whole: its names, what it imports, and the JAX it stands on."""

import ast
import importlib
import importlib.metadata
import os
import subprocess
import sys
from pathlib import Path

import pytest

import notchflex as nf

FOLDER = Path(nf.__file__).parent

# fmt: off
NAMES = [
    "load_robot", "save_robot", "list_robots", "json_schema", "Robot", "Tube", "ArcNotch", "Tendon",
    "RodGap",
    "Drawing", "Drive", "Geometry", "RobotShape", "TableNotch", "TensileTest",
    "Linear", "Superelastic", "Nitinol", "StressStrain", "Frictionless", "Capstan", "Load",
    "LoadPath", "pull", "solve",
    "simulate", "Equilibrium", "EquilibriumPath", "State", "tip_from_angles", "equal_stroke",
    "closing", "annular_sector", "annular_segment", "Section", "InputError",
    "InputWarning", "RobotFileError",
    "plot", "stroke_path", "spool_path", "solve_each", "Batch", "solve_batch", "simulate_batch",
    "uncertain", "Bands", "Band",
    "Differentiable", "differentiable", "TipResponse", "tip_response", "Step", "Stepper", "batch",
    "PathGradient",
    "bodies_from_angles", "SharedStroke", "Closing", "ClosingStatus", "Kink",
    "ConvergenceError", "ErrorCode", "Failure", "Settings",
    "Board",
    "BodyForce", "save_path", "read_path", "read_table",
    "reach", "follow", "read_targets", "Reach", "Following", "Limits", "TargetSearch", "Targets",
    "Controller", "ControlStatus", "Observer",
    "StripNotch", "ULink", "Corner",
    "Elastica", "elastica", "modulus_from_single_notch",
    "FrictionReadings", "FrictionRig", "friction_rig", "read_friction_rig",
    "Measurements", "read_measurements", "write_measurements",
    "Calibration", "Constant", "LeastSquares", "SumOfDistances", "SumOfRobotErrors", "leave_out",
    "next_measurement", "sample_posterior", "simulate_measurements", "diagnose",
    "DeckOptions", "Exported", "PatternOptions", "SimulatorOptions",
    "SolidOptions", "export_robot",
    "write_fitted", "calibrate", "compare", "Comparison", "Specimen", "update_specimen",
    "MeasuredPhotograph", "MeasuredPhotographs", "measure", "measure_cut", "MeasuredCut",
    "SensedForce", "SensorNoise", "sense", "Workspace", "workspace",
    "Fatigue", "StrainCycle", "strain_cycle",
    "AcceptanceLimit", "ToleranceSpec", "ToleranceAnalysis", "tolerance_analysis",
    "read_tolerance_spec",
    "Sweep", "SweepPlan", "read_plan", "read_sweep", "sweep",
    "design", "Design", "DesignSpec", "design_front", "DesignFront",
]
# fmt: on


def python(code: str, **env: str) -> str:
    """Run code in a Python of its own and return what it prints."""
    clean = {k: v for k, v in os.environ.items() if not k.startswith("JAX_")}
    done = subprocess.run(
        [sys.executable, "-c", code], env=clean | env, capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


def test_names():
    assert set(nf.__all__) == {*NAMES, "__version__"}
    for name in NAMES:
        assert getattr(nf, name).__name__ == name
        assert name in dir(nf)
    with pytest.raises(AttributeError, match="nothing_like_it"):
        _ = nf.nothing_like_it


def test_only_public_names_are_listed():
    assert {name for name in dir(nf) if not name.startswith("__")} == set(NAMES)
    assert "import_module" not in vars(nf)


@pytest.mark.parametrize("first", ["jax, notchflex as nf", "notchflex as nf, jax"])
def test_jax_computes_alike_before_and_after_the_first_use(first):
    code = f"""
import {first}
before = jax.random.uniform(jax.random.key(0))
nf.solve(nf.load_robot("pacheco2021-a"), nf.Load(tension=0.1))
assert before == jax.random.uniform(jax.random.key(0))
print(before.dtype)
"""
    assert python(code) == "float64"


@pytest.mark.parametrize(("old", "new"), [("Path", "EquilibriumPath"), ("draw", "stroke_path")])
def test_old_names_still_work_with_a_warning(old, new):
    with pytest.warns(DeprecationWarning, match=f"notchflex.{old} is now notchflex.{new}"):
        found = getattr(nf, old)
    assert found is getattr(nf, new)
    assert old not in dir(nf)
    assert old not in nf.__all__


def test_type_checkers_see_the_same_names_from_the_same_places():
    stub = ast.parse((FOLDER / "__init__.pyi").read_text())
    imports = [node for node in stub.body if isinstance(node, ast.ImportFrom)]
    told = {alias.asname: node.module for node in imports for alias in node.names}
    assert set(told) == set(NAMES)
    for name, module in told.items():
        assert getattr(nf, name) is getattr(importlib.import_module(str(module)), name)
    assert all(alias.name == alias.asname for node in imports for alias in node.names)


def test_version():
    assert nf.__version__ == importlib.metadata.version("notchflex")
    citation = (Path(__file__).parents[1] / "CITATION.cff").read_text()
    assert f"version: {nf.__version__}\n" in citation


def processor_time(code: str) -> float:
    """Seconds of processor time that code takes, the best of three: the machine may be busy."""
    code = f"import time; start = time.process_time(); {code}; print(time.process_time() - start)"
    return min(float(python(code)) for _ in range(3))


def test_import_costs_nothing():
    assert processor_time("import notchflex") < 0.1
    code = "import notchflex, sys; print({'jax', 'numpy', 'pydantic'} & set(sys.modules))"
    assert python(code) == "set()"


def test_robots_are_quick_and_do_without_jax():
    use = (
        "import notchflex as nf; nf.json_schema(); nf.list_robots();"
        "nf.load_robot('york2015').with_value('notch[2].depth', 0.9)"
    )
    assert processor_time(use) < 0.5
    code = f"{use}; import sys; print({{'jax', 'jaxlib', 'numpy', 'scipy'}} & set(sys.modules))"
    assert python(code) == "set()"


def test_jax_adds_up_right():
    from notchflex.cli.verbs.installation import canary

    assert canary() == (268_435_456.0, 268_435_456.0)
