"""Names of values, such as `notch[2].depth`: reading and setting values by them."""

from notchflex.robot.value_names.paths import defaults_of
from notchflex.robot.value_names.reading import (
    Described,
    described_at,
    number_at,
    numbers_at,
    tolerance_problems,
)
from notchflex.robot.value_names.setting import Changed, parse_assignment, parse_value, set_values

__all__ = [
    "Changed",
    "Described",
    "defaults_of",
    "described_at",
    "number_at",
    "numbers_at",
    "parse_assignment",
    "parse_value",
    "set_values",
    "tolerance_problems",
]
