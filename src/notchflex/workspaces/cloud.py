"""The states of a workspace, its volumes and its maps."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float

from notchflex._extras import need
from notchflex._summary import Displayed, Summary, short
from notchflex.errors import InputError
from notchflex.loads.external import ExternalLoad
from notchflex.loads.validation import check_number
from notchflex.results.quantities.registry import AXES
from notchflex.robot import Robot
from notchflex.workspaces.limits import Limit
from notchflex.workspaces.shape import Hull, alpha_size, hull_of
from notchflex.workspaces.voxels import VoxelMap, voxel_map

if TYPE_CHECKING:
    from xarray import Dataset

_VOXELS = 32
"""Voxels along the longest side of a workspace."""

# Points of the alpha shape at most: one of each voxel, of voxels as fine as that allows.
_MAX_ALPHA = 30_000


@dataclass(frozen=True, eq=False, repr=False)
class Workspace(Displayed):
    """States that a robot reaches; n states, t tendons. Units mm, N, rad.

    Attributes:
        robot: The robot.
        limits: Limits that all states keep.
        load: External loads that act all the time.
        largest: Largest tension of every tendon, N, (t,).
        tried: How many states were solved.
        failed: How many of them did not converge, or were not tried after one that did not.
        beyond: How many converged and break a limit, or follow one that does.
        tension: Tensions, N, (n, t).
        tip: Tip positions in the world, mm, (n, 3).
        direction: Unit vectors along the tube at the tip, (n, 3).
        loading: Whether a state lies on the way up, (n,).
        strain: Largest strain of any fibre, (n,).
        angle: Total bending angle, rad, (n,).
        hysteresis: Distance of the tip from where it is at the same tensions on the other way, mm,
            (n,): the error of a controller that does not know the history. NaN where the limits
            leave one of the two out.
        stiffness: Force per displacement of the tip in the direction where it is smallest, N/mm,
            (n,); NaN where it was not computed.
    """

    robot: Robot
    limits: tuple[Limit, ...]
    load: ExternalLoad
    largest: Float[np.ndarray, " t"]
    tried: int
    failed: int
    beyond: int
    tension: Float[np.ndarray, "n t"]
    tip: Float[np.ndarray, "n 3"]
    direction: Float[np.ndarray, "n 3"]
    loading: Bool[np.ndarray, " n"]
    strain: Float[np.ndarray, " n"]
    angle: Float[np.ndarray, " n"]
    hysteresis: Float[np.ndarray, " n"]
    stiffness: Float[np.ndarray, " n"]

    def __len__(self) -> int:
        """Number of states."""
        return len(self.tip)

    @cached_property
    def hull(self) -> Hull:
        """The convex hull of the tip positions.

        Raises:
            InputError: No state is left.
        """
        return hull_of(self._some)

    @property
    def extent(self) -> Float[np.ndarray, "2 3"]:
        """Smallest and largest coordinates of the tip, mm, (2, 3)."""
        return np.stack([self._some.min(axis=0), self._some.max(axis=0)])

    @property
    def _some(self) -> Float[np.ndarray, "n 3"]:
        if not len(self):
            raise InputError.NO_DATA(
                "no state is left: none converged within the limits; give wider limits"
            )
        return self.tip

    def alpha_size(self, radius: float | None = None) -> float:
        """Return the volume (mm³) or area (mm²) of the alpha shape of the tip positions.

        Args:
            radius: Largest circumscribed radius of its simplices, mm: hollows wider than that are
                left out. Two voxels of the thinned cloud where not given.

        Raises:
            InputError: No state is left, or a radius that is not above 0.
        """
        if radius is not None and not 0.0 < check_number(radius, "radius", "mm") < np.inf:
            raise InputError.OUT_OF_RANGE(f"radius must be above 0 mm; got {radius:g}")
        size = self._voxel_size(2.0)
        while True:  # thinned to one point a voxel
            first = np.unique(np.floor(self._some / size), axis=0, return_index=True)[1]
            if len(first) <= _MAX_ALPHA:
                break
            size *= 1.25
        return alpha_size(self._some[first], 2.0 * size if radius is None else radius)

    def voxels(self, size: float | None = None) -> VoxelMap:
        """Return maps of dexterity, tension, strain, hysteresis and stiffness.

        Args:
            size: Edge of a voxel, mm; a 32nd of the longest side where not given.

        Raises:
            InputError: No state is left, or a size that is not above 0.
        """
        if size is None:
            size = self._voxel_size()
        elif not 0.0 < check_number(size, "size", "mm") < np.inf:
            raise InputError.OUT_OF_RANGE(f"the size of a voxel must be above 0 mm; got {size:g}")
        elif (np.ptp(self.extent, axis=0) / size).max() > 1e6:
            raise InputError.OUT_OF_RANGE(
                f"voxels of {size:g} mm are more than a million along a side; give a larger size"
            )
        values = {
            "tension": self.tension.max(axis=1),
            "strain": self.strain,
            "hysteresis": self.hysteresis,
            "stiffness": self.stiffness,
        }
        return voxel_map(self._some, self.direction, values, size)

    def _voxel_size(self, finer: float = 1.0) -> float:
        side = float(np.ptp(self.extent, axis=0).max())
        return max(side, 1e-6) / (_VOXELS * finer)

    def to_xarray(self) -> Dataset:
        """Return the states as a labelled data set, in mm, N and rad.

        Raises:
            InputError: xarray is not installed.
        """
        need("xarray", "data", "to_xarray")
        import xarray

        vector, each = ("state", "axis"), ("state",)
        states = {
            "tension": (("state", "tendon"), self.tension, "N", "tendon tension at the base"),
            "tip_position": (vector, self.tip, "mm", "position of the tip in the world"),
            "tip_direction": (vector, self.direction, "1", "along the tube at the tip"),
            "loading": (each, self.loading, "1", "whether the state lies on the way up"),
            "peak_strain": (each, self.strain, "1", "largest strain of any fibre"),
            "total_angle": (each, self.angle, "rad", "total bending angle"),
            "hysteresis": (each, self.hysteresis, "mm", "distance to the tip on the other way"),
            "stiffness": (each, self.stiffness, "N/mm", "of the tip where it is softest"),
        }
        return xarray.Dataset(
            {
                name: (axes, values, {"units": unit, "long_name": text})
                for name, (axes, values, unit, text) in states.items()
            },
            coords={"axis": list(AXES), "tendon": np.arange(self.tension.shape[1]) + 1},
            attrs={
                "robot": self.robot.name,
                "limits": "; ".join(one.text for one in self.limits),
                "largest_tension_N": self.largest,
            },
        )

    def _summary(self) -> Summary:
        title = f"Workspace of {self.robot.name}: {len(self)} states"
        rows = [("limits", one.text) for one in self.limits]
        rows.append(("left out", f"{self.failed} not converged, {self.beyond} beyond limits"))
        if len(self):
            low, high = self.extent
            for axis, a, b in zip(AXES, low, high, strict=True):
                rows.append((axis, f"{short(float(a))} to {short(float(b))} mm"))
            rows.append(("convex hull", f"{short(self.hull.size)} {self.hull.unit}"))
            if np.isfinite(self.hysteresis).any():
                most = float(np.nanmax(self.hysteresis))
                rows.append(("hysteresis", f"up to {short(most)} mm"))
        return Summary(
            title, rows, ".voxels() maps dexterity, tension, strain, hysteresis, stiffness"
        )
