"""Fitting constants to measurements, with error bars and tests; the friction rig."""

from notchflex.fit.calibrate import calibrate
from notchflex.fit.calibration import Calibration, Interval
from notchflex.fit.constants import SENSOR, Constant, Unknown
from notchflex.fit.diagnosis import (
    NO_PROBLEMS,
    PartError,
    branch_words,
    diagnose,
    edge,
    errors_of_parts,
    part_title,
)
from notchflex.fit.documents import (
    calibration_document,
    data_of,
    left_out_document,
    next_measurement_document,
    posterior_document,
    write_fitted,
)
from notchflex.fit.folds import (
    PHOTOGRAPH,
    Fold,
    LeftOut,
    Specimen,
    leave_out,
    update_specimen,
)
from notchflex.fit.friction_rig import (
    FrictionReadings,
    FrictionRig,
    coefficient_from_weights,
    constancy,
    friction_document,
    friction_rig,
    read_friction_rig,
    weight_held,
)
from notchflex.fit.measurements.csv import (
    deviation_header,
    headers,
    read_measurements,
    write_measurements,
)
from notchflex.fit.measurements.measurements import (
    MEASURED,
    OBSERVED,
    MeasuredRows,
    Measurements,
    simulate_measurements,
)
from notchflex.fit.measurements.repeats import repeats, repeats_of_each
from notchflex.fit.next_measurement import NextMeasurement, next_measurement
from notchflex.fit.objective import (
    Cost,
    FitObjective,
    LeastSquares,
    SumOfDistances,
    SumOfRobotErrors,
)
from notchflex.fit.posterior import Posterior, sample_posterior
from notchflex.fit.residuals import Residuals, misfit
from notchflex.fit.scattered import Constancy

__all__ = [
    "MEASURED",
    "NO_PROBLEMS",
    "OBSERVED",
    "PHOTOGRAPH",
    "SENSOR",
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
    "MeasuredRows",
    "Measurements",
    "NextMeasurement",
    "PartError",
    "Posterior",
    "Residuals",
    "Specimen",
    "SumOfDistances",
    "SumOfRobotErrors",
    "Unknown",
    "branch_words",
    "calibrate",
    "calibration_document",
    "coefficient_from_weights",
    "constancy",
    "data_of",
    "deviation_header",
    "diagnose",
    "edge",
    "errors_of_parts",
    "friction_document",
    "friction_rig",
    "headers",
    "leave_out",
    "left_out_document",
    "misfit",
    "next_measurement",
    "next_measurement_document",
    "part_title",
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
