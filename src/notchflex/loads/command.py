"""From the loads that a person gives to what the solver demands."""

from __future__ import annotations

from typing import cast

import numpy as np
from jaxtyping import Array

from notchflex._jax import constant
from notchflex.loads.applied import applied
from notchflex.loads.command import Command
from notchflex.loads.load_path import LoadPath
from notchflex.mechanics.chain import Chain
from notchflex.robot import Robot


def command(load: LoadPath, robot: Robot, chain: Chain) -> Command:
    """The loads as the solver takes them; a tendon that is not commanded is pulled with 0 N."""
    no_stroke = np.isnan(load.stroke)
    drawn, value = None, np.where(np.isnan(load.tension), 0.0, load.tension)
    if not no_stroke.all():
        drawn, value = cast("Array", ~no_stroke), np.where(no_stroke, value, load.stroke)
    others = None
    if chain.loaded:
        others = applied(
            load,
            robot,
            np.asarray(chain.body_mass),
            np.asarray(chain.body_centre),
            np.asarray(chain.body_length),
            None if chain.frame is None else np.asarray(chain.frame),
        )
    return Command(constant(value), drawn, others)


__all__ = ["command"]
