"""Forces on a robot from its sensors, along a history with friction memory."""

from notchflex.sensing.readings import SensorNoise
from notchflex.sensing.sense import sense
from notchflex.sensing.sensed import SensedForce

__all__ = ["SensedForce", "SensorNoise", "sense"]
