"""From measurements to constants with error bars; honest tests; the friction rig."""

from notchflex.fit.assessment.diagnosis import diagnose
from notchflex.fit.assessment.errors_of_parts import PartError, errors_of_parts
from notchflex.fit.assessment.folds import Fold, LeftOut, leave_out
from notchflex.fit.assessment.next_measurement import NextMeasurement, next_measurement
from notchflex.fit.assessment.posterior import Posterior, sample_posterior
from notchflex.fit.documents import (
    calibration_document,
    left_out_document,
    next_measurement_document,
    posterior_document,
)
from notchflex.fit.estimation.calibration import Calibration
from notchflex.fit.estimation.fit import calibrate
from notchflex.fit.estimation.intervals import Interval
from notchflex.fit.estimation.objective import LeastSquares, SumOfDistances, SumOfRobotErrors
from notchflex.fit.fitted_robots import write_fitted
from notchflex.fit.friction_rig.constancy import Constancy, constancy
from notchflex.fit.friction_rig.readings import FrictionReadings, read_friction_rig
from notchflex.fit.friction_rig.rig import FrictionRig, friction_document, friction_rig
from notchflex.fit.friction_rig.two_weights import coefficient_from_weights, weight_held
from notchflex.fit.measurements.csv import read_measurements
from notchflex.fit.measurements.measurements import Measurements
from notchflex.fit.measurements.repeats import repeats, repeats_of_each
from notchflex.fit.measurements.simulated import simulate_measurements
from notchflex.fit.measurements.writing import write_measurements
from notchflex.fit.model.constants import Constant, Unknown

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
    "diagnose",
    "errors_of_parts",
    "friction_document",
    "friction_rig",
    "leave_out",
    "left_out_document",
    "next_measurement",
    "next_measurement_document",
    "posterior_document",
    "read_friction_rig",
    "read_measurements",
    "repeats",
    "repeats_of_each",
    "sample_posterior",
    "simulate_measurements",
    "weight_held",
    "write_fitted",
    "write_measurements",
]
