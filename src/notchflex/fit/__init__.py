"""Fitting constants to measurements, with error bars and tests; the friction rig."""

from notchflex.fit.assessment.diagnosis import diagnose as diagnose
from notchflex.fit.assessment.errors_of_parts import PartError as PartError
from notchflex.fit.assessment.errors_of_parts import errors_of_parts as errors_of_parts
from notchflex.fit.assessment.folds import PHOTOGRAPH as PHOTOGRAPH
from notchflex.fit.assessment.folds import Fold as Fold
from notchflex.fit.assessment.folds import LeftOut as LeftOut
from notchflex.fit.assessment.folds import leave_out as leave_out
from notchflex.fit.assessment.next_measurement import NextMeasurement as NextMeasurement
from notchflex.fit.assessment.next_measurement import next_measurement as next_measurement
from notchflex.fit.assessment.posterior import Posterior as Posterior
from notchflex.fit.assessment.posterior import sample_posterior as sample_posterior
from notchflex.fit.assessment.specimens import Specimen as Specimen
from notchflex.fit.assessment.specimens import update_specimen as update_specimen
from notchflex.fit.documents import calibration_document as calibration_document
from notchflex.fit.documents import left_out_document as left_out_document
from notchflex.fit.documents import next_measurement_document as next_measurement_document
from notchflex.fit.documents import posterior_document as posterior_document
from notchflex.fit.estimation.calibration import Calibration as Calibration
from notchflex.fit.estimation.fit import calibrate as calibrate
from notchflex.fit.estimation.intervals import Interval as Interval
from notchflex.fit.estimation.objective import LeastSquares as LeastSquares
from notchflex.fit.estimation.objective import SumOfDistances as SumOfDistances
from notchflex.fit.estimation.objective import SumOfRobotErrors as SumOfRobotErrors
from notchflex.fit.fitted_robots import write_fitted as write_fitted
from notchflex.fit.friction_rig.constancy import Constancy as Constancy
from notchflex.fit.friction_rig.constancy import constancy as constancy
from notchflex.fit.friction_rig.readings import FrictionReadings as FrictionReadings
from notchflex.fit.friction_rig.readings import read_friction_rig as read_friction_rig
from notchflex.fit.friction_rig.rig import FrictionRig as FrictionRig
from notchflex.fit.friction_rig.rig import friction_document as friction_document
from notchflex.fit.friction_rig.rig import friction_rig as friction_rig
from notchflex.fit.friction_rig.two_weights import (
    coefficient_from_weights as coefficient_from_weights,
)
from notchflex.fit.friction_rig.two_weights import weight_held as weight_held
from notchflex.fit.measurements.csv import read_measurements as read_measurements
from notchflex.fit.measurements.measurements import Measurements as Measurements
from notchflex.fit.measurements.repeats import repeats as repeats
from notchflex.fit.measurements.repeats import repeats_of_each as repeats_of_each
from notchflex.fit.measurements.simulated import simulate_measurements as simulate_measurements
from notchflex.fit.measurements.writing import write_measurements as write_measurements
from notchflex.fit.model.constant import Constant as Constant
from notchflex.fit.model.constants import Unknown as Unknown
