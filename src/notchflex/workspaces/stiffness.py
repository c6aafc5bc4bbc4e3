"""Stiffness of the tip over a workspace, at some of its states."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from notchflex.analysis.derivatives.tip_response import tip_response
from notchflex.loads import LoadPath
from notchflex.workspaces.cloud import Workspace


def with_stiffness(explored: Workspace, count: int) -> Workspace:
    """Return a workspace with the stiffness of the tip at some of its states.

    They lie on the way up, spread over the voxels, and are loaded from rest again. Tendons keep
    their tension, contacts that slid go on sliding.

    Args:
        explored: The workspace.
        count: Number of states, at most as many as there are voxels with a state on the way up.

    Example:
        >>> import notchflex as nf
        >>> found = nf.workspace(nf.load_robot("pacheco2021-a"), states=512)
        >>> stiffness = with_stiffness(found, 3).stiffness
        >>> int(np.isfinite(stiffness).sum())
        3
    """
    rising = np.flatnonzero(explored.loading)
    first = np.unique(explored.voxels().of_state[rising], return_index=True)[1]
    even = np.unique(np.linspace(0, len(first) - 1, min(count, len(first))).round().astype(int))
    states = rising[first[even]]
    tension = explored.tension[states]
    load = LoadPath(tension, np.full_like(tension, np.nan), external=(explored.load,) * len(states))
    response = tip_response(explored.robot, load, each_from_rest=True)
    by_force = response.compliance[:, 3:, 3:]
    is_known = np.isfinite(by_force).all(axis=(1, 2)) & response.path.converged
    stiffness = np.full(len(explored), np.nan)
    stiffness[states[is_known]] = 1.0 / np.linalg.norm(by_force[is_known], ord=2, axis=(1, 2))
    return replace(explored, stiffness=stiffness)
