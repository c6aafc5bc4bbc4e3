"""What a person wants to see of the scene."""

from dataclasses import dataclass


@dataclass
class Shown:
    """What a person wants to see."""

    tendons: bool = True
    contacts: bool = True
    frames: bool = True
    loads: bool = True
    see_through: bool = False
