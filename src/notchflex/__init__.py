"""Statics of tendon-driven notched-tube robots.

Units in Python are mm, N, MPa and rad; robot files are in mm, N, MPa and degrees.
Names are loaded when first used (PEP 562), so that importing the package costs nothing and does
not import JAX.  It switches JAX to 64-bit floats, also for its other users in the process.
"""

import os as _os
import sys as _sys

__version__ = "0.1.0"

# Here and not at the first use: a key of `jax.random` gives the same numbers before and after it.
_os.environ["JAX_ENABLE_X64"] = "1"
if "jax" in _sys.modules:
    _sys.modules["jax"].config.update("jax_enable_x64", True)

# Public name -> where it is exported. `__init__.pyi` lists the same names for type checkers.
_HOME = {
    **dict.fromkeys(
        (
            "ConvergenceError",
            "ErrorCode",
            "Failure",
            "InputError",
            "InputWarning",
            "RobotFileError",
        ),
        "notchflex.errors",
    ),
    **dict.fromkeys(
        (
            "ArcNotch",
            "Capstan",
            "Corner",
            "Drawing",
            "Frictionless",
            "Linear",
            "Nitinol",
            "Robot",
            "StressStrain",
            "StripNotch",
            "Superelastic",
            "Tendon",
            "Tube",
            "ULink",
            "json_schema",
            "list_robots",
            "load_robot",
            "save_robot",
        ),
        "notchflex.robot",
    ),
    "plot": "notchflex._plot",
    "Section": "notchflex.mechanics.section",
    **dict.fromkeys(("annular_sector", "annular_segment"), "notchflex.mechanics.cuts"),
    **dict.fromkeys(
        (
            "Elastica",
            "elastica",
            "modulus_from_single_notch",
        ),
        "notchflex.mechanics.flexure.elastica",
    ),
    **dict.fromkeys(
        (
            "BodyForce",
            "Load",
            "LoadPath",
            "pull",
            "stroke_path",
        ),
        "notchflex.loads",
    ),
    "Settings": "notchflex.solver.newton",
    **dict.fromkeys(
        (
            "Equilibrium",
            "EquilibriumPath",
            "State",
            "read_path",
            "read_table",
            "save_path",
        ),
        "notchflex.results",
    ),
    **dict.fromkeys(
        (
            "Band",
            "Bands",
            "Batch",
            "Closing",
            "ClosingStatus",
            "Differentiable",
            "Kink",
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
            "tip_from_angles",
            "tip_response",
            "uncertain",
        ),
        "notchflex.analysis",
    ),
    **dict.fromkeys(
        (
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
        "notchflex.fit",
    ),
    **dict.fromkeys(
        (
            "Design",
            "DesignFront",
            "DesignSpec",
            "design",
            "design_front",
        ),
        "notchflex.designing",
    ),
    **dict.fromkeys(
        (
            "Comparison",
            "compare",
        ),
        "notchflex.comparison",
    ),
    **dict.fromkeys(
        (
            "SensedForce",
            "SensorNoise",
            "sense",
        ),
        "notchflex.sensing",
    ),
    **dict.fromkeys(
        (
            "Board",
            "MeasuredCut",
            "MeasuredPhotograph",
            "MeasuredPhotographs",
            "measure",
            "measure_cut",
        ),
        "notchflex.photographs",
    ),
    **dict.fromkeys(
        (
            "Workspace",
            "workspace",
        ),
        "notchflex.workspaces",
    ),
    **dict.fromkeys(
        (
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
        "notchflex.control",
    ),
    **dict.fromkeys(
        (
            "AcceptanceLimit",
            "ToleranceAnalysis",
            "ToleranceSpec",
            "read_tolerance_spec",
            "tolerance_analysis",
        ),
        "notchflex.tolerancing",
    ),
    **dict.fromkeys(
        (
            "Sweep",
            "SweepPlan",
            "read_plan",
            "read_sweep",
            "sweep",
        ),
        "notchflex.sweeping",
    ),
    **dict.fromkeys(
        (
            "DeckOptions",
            "Exported",
            "PatternOptions",
            "SimulatorOptions",
            "SolidOptions",
            "export_robot",
        ),
        "notchflex.export",
    ),
}

# Old name -> the name that replaces it. They still work, with a warning, and are not listed.
_RENAMED = {"Path": "EquilibriumPath", "draw": "stroke_path"}

__all__ = [*sorted(_HOME), "__version__"]  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> object:
    """Import the home of a public name on first use and keep the name here."""
    from importlib import import_module

    if name in _RENAMED:
        from warnings import warn

        new = _RENAMED[name]
        warn(f"notchflex.{name} is now notchflex.{new}", DeprecationWarning, stacklevel=2)
        return __getattr__(new)
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names, loaded or not."""
    return sorted({"__doc__", "__file__", "__name__", "__path__", *__all__})
