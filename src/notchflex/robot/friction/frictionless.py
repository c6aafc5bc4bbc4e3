"""No friction."""

from dataclasses import KW_ONLY
from typing import Literal

from notchflex.robot.kinds import Friction
from notchflex.robot.part import part


@part
class Frictionless(Friction):
    """The tension is the same all along a tendon.

    Example:
        >>> Frictionless().kind
        'frictionless'
    """

    _: KW_ONLY
    kind: Literal["frictionless"] = "frictionless"
