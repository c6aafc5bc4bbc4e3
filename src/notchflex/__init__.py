"""Statics of tendon-driven notched-tube robots.

Units in Python are mm, N, MPa and rad; robot files are in mm, N, MPa and degrees.
Names are loaded when first used (PEP 562), so that importing the package costs nothing and does
not import JAX.  It switches JAX to 64-bit floats, also for its other users in the process.
"""

import os as _os
import sys as _sys

from notchflex._imports import loader as _loader

__version__ = "0.1.0"

# Here and not at the first use: a key of `jax.random` gives the same numbers before and after it.
_os.environ["JAX_ENABLE_X64"] = "1"
if "jax" in _sys.modules:
    _sys.modules["jax"].config.update("jax_enable_x64", True)

# Public name -> where it is exported. `__init__.pyi` lists the same names for type checkers.
_HOME = {
    name: home
    for home, names in {
        "notchflex.errors": (
            "ConvergenceError",
            "ErrorCode",
            "Failure",
            "InputError",
            "InputWarning",
            "RobotFileError",
        ),
        "notchflex.robot": (
            "ArcNotch",
            "Capstan",
            "Corner",
            "Drawing",
            "Fatigue",
            "Drive",
            "Frictionless",
            "Linear",
            "Nitinol",
            "TensileTest",
            "Robot",
            "RodGap",
            "StressStrain",
            "StripNotch",
            "Superelastic",
            "TableNotch",
            "Tendon",
            "Tube",
            "ULink",
            "json_schema",
            "load_robot",
            "save_robot",
        ),
        "notchflex._plot": ("plot",),
        "notchflex._ready": ("list_robots",),
        "notchflex.mechanics.section": ("Section",),
        "notchflex.mechanics.cuts": ("annular_sector", "annular_segment"),
        "notchflex.mechanics.flexure.elastica": (
            "Elastica",
            "elastica",
            "modulus_from_single_notch",
        ),
        "notchflex.loads": (
            "BodyForce",
            "Load",
            "LoadPath",
            "pull",
            "stroke_path",
        ),
        "notchflex.solver.newton": ("Settings",),
        "notchflex.results.io": (
            "read_path",
            "save_path",
        ),
        "notchflex.results.path": ("EquilibriumPath",),
        "notchflex.results.reading": ("read_table",),
        "notchflex.results.state": (
            "Equilibrium",
            "State",
        ),
        "notchflex.analysis": (
            "Band",
            "Bands",
            "Batch",
            "Closing",
            "ClosingStatus",
            "Differentiable",
            "Kink",
            "PathGradient",
            "SharedStroke",
            "Step",
            "Stepper",
            "TipResponse",
            "batch",
            "bodies_from_angles",
            "closing",
            "differentiable",
            "equal_stroke",
            "simulate",
            "simulate_batch",
            "solve",
            "solve_batch",
            "solve_each",
            "spool_path",
            "tip_from_angles",
            "tip_response",
            "uncertain",
        ),
        "notchflex.fit": (
            "Calibration",
            "Constant",
            "FrictionReadings",
            "FrictionRig",
            "LeastSquares",
            "Measurements",
            "Specimen",
            "SumOfDistances",
            "SumOfRobotErrors",
            "calibrate",
            "diagnose",
            "friction_rig",
            "leave_out",
            "next_measurement",
            "read_friction_rig",
            "read_measurements",
            "sample_posterior",
            "simulate_measurements",
            "update_specimen",
            "write_fitted",
            "write_measurements",
        ),
        "notchflex.designing": (
            "Design",
            "DesignFront",
            "DesignSpec",
            "design",
            "design_front",
        ),
        "notchflex.comparison": (
            "Comparison",
            "compare",
        ),
        "notchflex.sensing": (
            "SensedForce",
            "SensorNoise",
            "sense",
        ),
        "notchflex.photographs": (
            "Board",
            "MeasuredCut",
            "MeasuredPhotograph",
            "MeasuredPhotographs",
            "measure",
            "measure_cut",
        ),
        "notchflex.fatigue": (
            "StrainCycle",
            "strain_cycle",
        ),
        "notchflex.workspaces": (
            "Workspace",
            "workspace",
        ),
        "notchflex.control": (
            "ControlStatus",
            "Controller",
            "Following",
            "Limits",
            "Observer",
            "Reach",
            "TargetSearch",
            "Targets",
            "follow",
            "reach",
            "read_targets",
        ),
        "notchflex.tolerancing": (
            "AcceptanceLimit",
            "ToleranceAnalysis",
            "ToleranceSpec",
            "read_tolerance_spec",
            "tolerance_analysis",
        ),
        "notchflex.sweeping": (
            "Sweep",
            "SweepPlan",
            "read_plan",
            "read_sweep",
            "sweep",
        ),
        "notchflex.export": (
            "DeckOptions",
            "Exported",
            "PatternOptions",
            "SimulatorOptions",
            "SolidOptions",
            "export_robot",
        ),
        "notchflex.analysis.geometry": (
            "Geometry",
            "RobotShape",
        ),
    }.items()
    for name in names
}

# Old name -> the name that replaces it. They still work, with a warning, and are not listed.
_RENAMED = {"Path": "EquilibriumPath", "draw": "stroke_path"}

__all__ = [*sorted(_HOME), "__version__"]  # pyright: ignore[reportUnsupportedDunderAll]


_load = _loader(__name__, _HOME)


def __getattr__(name: str) -> object:
    """Import the home of a public name on first use and keep the name here."""
    if name in _RENAMED:
        from warnings import warn

        new = _RENAMED[name]
        warn(f"notchflex.{name} is now notchflex.{new}", DeprecationWarning, stacklevel=2)
        return __getattr__(new)
    return _load(name)


def __dir__() -> list[str]:
    """List the public names, loaded or not."""
    return sorted({"__doc__", "__file__", "__name__", "__path__", *__all__})
