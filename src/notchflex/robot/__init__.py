"""The robot as a person describes it: tube, notches, tendons, material, friction.

Robot files are TOML in mm, N, MPa and degrees.  Nothing here imports JAX.
"""

from typing import TYPE_CHECKING, Any

from notchflex._ready import list_robots
from notchflex.robot.cuts import Opening
from notchflex.robot.fatigue import Fatigue
from notchflex.robot.friction.capstan import Capstan
from notchflex.robot.friction.corner import Corner
from notchflex.robot.friction.frictionless import Frictionless
from notchflex.robot.kinds import Friction, Material, Notch, Tendon, Tube, kinds_of, openings_along
from notchflex.robot.materials.linear import Linear
from notchflex.robot.materials.nitinol import Nitinol, TensileTest
from notchflex.robot.materials.stress_strain import StressStrain
from notchflex.robot.materials.superelastic import Superelastic
from notchflex.robot.notches.arc import ArcNotch
from notchflex.robot.notches.rod import RodGap
from notchflex.robot.notches.strip import StripNotch
from notchflex.robot.notches.table import TableNotch
from notchflex.robot.notches.u_link import ULink
from notchflex.robot.reading import load_robot, robot_from_text
from notchflex.robot.robot import (
    Drawing,
    Drive,
    Robot,
    from_table,
    json_schema,
    set_values,
    to_table,
)
from notchflex.robot.value_names import parse_assignment

if TYPE_CHECKING:
    from notchflex.robot.writing import robot_text, save_robot

__all__ = [
    "ArcNotch",
    "Capstan",
    "Corner",
    "Drawing",
    "Drive",
    "Fatigue",
    "Friction",
    "Frictionless",
    "Linear",
    "Material",
    "Nitinol",
    "Notch",
    "Opening",
    "Robot",
    "RodGap",
    "StressStrain",
    "StripNotch",
    "Superelastic",
    "TableNotch",
    "Tendon",
    "TensileTest",
    "Tube",
    "ULink",
    "from_table",
    "json_schema",
    "kinds_of",
    "list_robots",
    "load_robot",
    "openings_along",
    "parse_assignment",
    "robot_from_text",
    "robot_text",
    "save_robot",
    "set_values",
    "to_table",
]


def __getattr__(name: str) -> Any:
    """Load the writing of robot files on first use, and find kinds of parts that are not listed."""
    if name in {"robot_text", "save_robot"}:
        from notchflex.robot import writing

        return getattr(writing, name)
    for base in (Notch, Material, Friction) if name[:1].isupper() else ():
        for kind in kinds_of(base).values():
            if kind.__name__ == name:
                return kind
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
