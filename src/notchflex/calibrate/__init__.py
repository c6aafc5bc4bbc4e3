"""From measurements to constants with error bars; honest tests; the friction rig."""

from notchflex.calibrate.calibration import Calibration
from notchflex.calibrate.constancy import Constancy, constancy
from notchflex.calibrate.constants import Constant, Unknown
from notchflex.calibrate.documents import (
    calibration_document,
    left_out_document,
    next_measurement_document,
    posterior_document,
)
from notchflex.calibrate.errors_of_parts import PartError, errors_of_parts
from notchflex.calibrate.fit import calibrate
from notchflex.calibrate.fitted_robots import write_fitted
from notchflex.calibrate.folds import Fold, LeftOut, leave_out
from notchflex.calibrate.friction_documents import friction_document
from notchflex.calibrate.friction_readings import FrictionReadings, read_friction_rig
from notchflex.calibrate.friction_rig import FrictionRig, friction_rig
from notchflex.calibrate.intervals import Interval
from notchflex.calibrate.measurements import Measurements
from notchflex.calibrate.measurements_csv import read_measurements
from notchflex.calibrate.measurements_writing import write_measurements
from notchflex.calibrate.next_measurement import NextMeasurement, next_measurement
from notchflex.calibrate.objective import LeastSquares, SumOfDistances, SumOfRobotErrors
from notchflex.calibrate.posterior import Posterior, posterior
from notchflex.calibrate.repeats import repeats, repeats_of_each
from notchflex.calibrate.synthetic import synthetic
from notchflex.calibrate.two_weights import coefficient_from_weights, weight_held
from notchflex.calibrate.verdict import verdict

__all__ = [
    "Calibration",
    "Constancy",
    "Constant",
    "Fold",
    "FrictionReadings",
    "FrictionRig",
    "Interval",
    "LeastSquares",
    "LeftOut",
    "Measurements",
    "NextMeasurement",
    "PartError",
    "Posterior",
    "SumOfDistances",
    "SumOfRobotErrors",
    "Unknown",
    "calibrate",
    "calibration_document",
    "coefficient_from_weights",
    "constancy",
    "errors_of_parts",
    "friction_document",
    "friction_rig",
    "leave_out",
    "left_out_document",
    "next_measurement",
    "next_measurement_document",
    "posterior",
    "posterior_document",
    "read_friction_rig",
    "read_measurements",
    "repeats",
    "repeats_of_each",
    "synthetic",
    "verdict",
    "weight_held",
    "write_fitted",
    "write_measurements",
]
