"""Stiffness of the tip over a workspace, at some of its states."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from notchflex.analysis.derivatives.tip_response import tip_response
from notchflex.errors import InputError
from notchflex.loads import LoadPath
from notchflex.loads.validation import check_integer
from notchflex.workspaces.cloud import Workspace

_MOST = 5000


def tip_stiffness(
    found: Workspace, count: int = 200
) -> tuple[Int[np.ndarray, " k"], Float[np.ndarray, " k"]]:
    """Return how stiff the tip is against a force in its softest direction.

    At some states on the way up, spread over the voxels, loaded from rest again. Tendons keep their
    tension, contacts that slid go on sliding.

    Args:
        found: The workspace.
        count: Number of states, at most as many as there are voxels with a state on the way up.

    Returns:
        Which states, and the force per displacement in the direction where it is smallest, N/mm;
        NaN where the response is not known.

    Raises:
        InputError: A number of states that is not from 1 to 5000.

    Example:
        >>> import notchflex as nf
        >>> found = nf.workspace(nf.load_robot("pacheco2021-a"), states=512)
        >>> states, stiffness = tip_stiffness(found, 3)
        >>> bool((stiffness > 0.0).all())
        True
    """
    if not 1 <= check_integer(count, "count") <= _MOST:
        raise InputError.OUT_OF_RANGE(f"count must be from 1 to {_MOST}; got {count}")
    rising = np.flatnonzero(found.loading)
    first = np.unique(found.voxels().of_state[rising], return_index=True)[1]
    even = np.unique(np.linspace(0, len(first) - 1, min(count, len(first))).round().astype(int))
    states = rising[first[even]]
    tension = found.tension[states]
    load = LoadPath(tension, np.full_like(tension, np.nan), external=(found.load,) * len(states))
    response = tip_response(found.robot, load, each_from_rest=True)
    by_force = response.compliance[:, 3:, 3:]
    good = np.isfinite(by_force).all(axis=(1, 2)) & response.path.converged
    stiffness = np.full(len(states), np.nan)
    stiffness[good] = 1.0 / np.linalg.norm(by_force[good], ord=2, axis=(1, 2))
    return states, stiffness
