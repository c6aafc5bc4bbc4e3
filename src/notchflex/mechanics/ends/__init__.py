"""Stiffness of a notch with the rings beside it: end compliance, flattening, torsion."""

from notchflex.mechanics.ends.effective_notch import NotchStiffness as NotchStiffness
from notchflex.mechanics.ends.effective_notch import notch_stiffness as notch_stiffness
from notchflex.mechanics.ends.effective_notch import validity as validity
from notchflex.mechanics.ends.ring import Side as Side
