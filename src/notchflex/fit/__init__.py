"""Fitting constants to measurements, with error bars and tests; the friction rig."""

from notchflex.fit.assessment.diagnosis import diagnose
from notchflex.fit.assessment.errors_of_parts import PartError, errors_of_parts
from notchflex.fit.assessment.folds import (
    PHOTOGRAPH,
    Fold,
    LeftOut,
    Specimen,
    leave_out,
    update_specimen,
)
from notchflex.fit.assessment.next_measurement import NextMeasurement, next_measurement
from notchflex.fit.assessment.posterior import Posterior, sample_posterior
from notchflex.fit.documents import (
    calibration_document,
    left_out_document,
    next_measurement_document,
    posterior_document,
    write_fitted,
)
from notchflex.fit.estimation.calibration import Calibration
from notchflex.fit.estimation.fit import calibrate
from notchflex.fit.estimation.intervals import Cost, Interval
from notchflex.fit.estimation.objective import (
    FitObjective,
    LeastSquares,
    SumOfDistances,
    SumOfRobotErrors,
)
from notchflex.fit.friction_rig.readings import FrictionReadings, read_friction_rig
from notchflex.fit.friction_rig.rig import FrictionRig, friction_document, friction_rig
from notchflex.fit.friction_rig.scattered import Constancy, constancy
from notchflex.fit.friction_rig.two_weights import coefficient_from_weights, weight_held
from notchflex.fit.measurements.csv import read_measurements, write_measurements
from notchflex.fit.measurements.measurements import Measurements
from notchflex.fit.measurements.repeats import repeats, repeats_of_each
from notchflex.fit.measurements.simulated import simulate_measurements
from notchflex.fit.model.constants import Constant, Unknown
from notchflex.fit.model.residuals import Residuals

__all__ = [
    "PHOTOGRAPH",
    "Calibration",
    "Constancy",
    "Constant",
    "Cost",
    "FitObjective",
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
    "Residuals",
    "Specimen",
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
    "update_specimen",
    "weight_held",
    "write_fitted",
    "write_measurements",
]
