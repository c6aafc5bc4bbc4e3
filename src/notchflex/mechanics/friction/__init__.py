"""Friction between tendon and tube: how far tension can fall over one contact."""

from notchflex._imports import import_all
from notchflex.mechanics.friction.corner import CornerLaw
from notchflex.mechanics.friction.registry import FrictionLaw, friction_law

import_all(__name__, __path__)

__all__ = ["CornerLaw", "FrictionLaw", "friction_law"]
