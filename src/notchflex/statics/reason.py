"""Why a step of a path did not converge, in words for the person who gave the load."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from notchflex.statics.actuation import drawn_when_closed

if TYPE_CHECKING:  # for the type only: a path tells its reasons
    from notchflex.statics.path import EquilibriumPath

# A stroke is followed up to the last good state before the last notch closes, which leaves it
# open by less than this part of its height.
_NEARLY_CLOSED = 1e-3


def why_not(path: EquilibriumPath, step: int) -> str:
    """Why a step did not converge; empty where it did."""
    if path.converged[step]:
        return ""
    if not path.run.tried[step]:
        failed = int(np.argmin(path.converged))
        return f"not tried, because step {failed + 1} of the path did not converge"
    if path.run.converged[step] and not path.run.quantity("bend_possible")[step]:
        return (
            "a notch is bent by more than half a turn, so sharply that a fibre would have no "
            "length left, or too far about several axes at once; take smaller loads"
        )
    if path.run.converged[step] and path.run.quantity("friction_holds")[step]:
        return (
            "the strain modes miss the moment of the loads by "
            f"{100 * path.moment_error[step]:.0f} % of the largest: the robot is bent beyond "
            "what this model is for; take smaller loads, or a refinement of 1, 2 or 3"
        )
    if path.run.converged[step]:
        return (
            "a tendon turns so sharply at an edge that its friction would hold any pull "
            "(coefficient * tan(turning / 2) is 1 or more), where the friction law says nothing"
        )
    tension = ", ".join(f"{value:.4g}" for value in path.tension[step])
    drawn = ", ".join(f"{value:.4g}" for value in path.stroke[step])
    last = f"the last good state has tension {tension} N and stroke {drawn} mm"
    opening = np.asarray(path.chain.rods.length).sum(axis=-1)
    all_closed = (path.gap[step] < _NEARLY_CLOSED * opening).all()
    if (all_closed or _past_closing(path, step)) and not np.isnan(path.load.stroke[step]).all():
        return (
            "every notch closed: the robot can't shorten the tendon further, so this stroke "
            f"fixes no tension; {last}; command a smaller stroke, or a tension, or give the "
            "tendon a finite axial_stiffness"
        )
    part = 100.0 * float(path.run.reached[step])
    return (
        f"no equilibrium found beyond {part:.3g} % of the way from the state before "
        f"(imbalance {float(path.residual[step]):.2g}); {last}; take smaller steps, or the "
        "robot has no equilibrium there"
    )


def _past_closing(path: EquilibriumPath, step: int) -> bool:
    """Whether a stroke of a step is more than an inextensible tendon can lose."""
    reach = drawn_when_closed(path.chain)
    inextensible = np.isinf(np.asarray(path.chain.axial_stiffness))
    return bool((inextensible & (path.load.stroke[step] >= reach)).any())


__all__ = ["why_not"]
