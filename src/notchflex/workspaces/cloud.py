"""The states of a workspace: their volumes and maps, two beside each other, and their files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import ConvexHull, Delaunay, KDTree

from notchflex import InputError, Robot
from notchflex.specification import LimitedQuantity
from notchflex.support import (
    AXES,
    DEGREES,
    Displayed,
    ExternalLoad,
    Summary,
    check_number,
    document_head,
    need,
    short,
    write_groups,
)

if TYPE_CHECKING:
    from xarray import Dataset


Points = Float[np.ndarray, "n 3"]
States = Float[np.ndarray, " n"]

# A cloud thinner than this part of its size is flat, or a curve.
_FLAT = 1e-6


@dataclass(frozen=True, eq=False)
class Hull:
    """The convex hull of points.

    Attributes:
        dimension: 3, 2 for points of a plane, 1 for points of a line, 0 for a single one.
        size: Volume (mm³), area (mm²) or length (mm), by the dimension.
        corners: Its corners, mm, (k, 3).
        faces: Triples of corners, counted from 0; none unless it has a volume, (f, 3).
        origin: A point of the cloud's middle, mm, (3,).
        axes: Unit vectors of the space that the cloud fills, (dimension, 3).
        equations: Outward normals of its sides in that space and their offsets, (s, dimension + 1).
    """

    dimension: int
    size: float
    corners: Float[np.ndarray, "k 3"]
    faces: Int[np.ndarray, "f 3"]
    origin: Float[np.ndarray, " 3"]
    axes: Float[np.ndarray, "dimension 3"]
    equations: Float[np.ndarray, "s n"]

    @property
    def unit(self) -> str:
        """Unit of its size."""
        return ("", "mm", "mm²", "mm³")[self.dimension]


def hull_of(points: Points) -> Hull:
    """Return the convex hull of points, mm."""
    origin, axes = _frame(points)
    flat = (points - origin) @ axes.T
    dimension, faces, equations = len(axes), np.zeros((0, 3), int), np.zeros((0, 0))
    if dimension < 2:  # a line, or a single point
        places = np.array([flat.argmin(), flat.argmax()] if dimension else [0])
        size = float(np.ptp(flat)) if dimension else 0.0
    else:
        hull = ConvexHull(flat)
        places, size, equations = hull.vertices, float(hull.volume), hull.equations
        if dimension == 3:
            number = np.zeros(len(points), int)
            number[places] = np.arange(len(places))
            faces = number[hull.simplices]
    return Hull(dimension, size, points[places], faces, origin, axes, equations)


def alpha_size(points: Points, radius: float) -> float:
    """Return volume (mm³) or area (mm²) of the alpha shape of points.

    It is the union of the simplices of their Delaunay triangulation whose circumscribed sphere is
    smaller than a radius: unlike the convex hull it leaves hollows out.

    Args:
        points: Points, mm.
        radius: Largest radius, mm.
    """
    origin, axes = _frame(points)
    if len(axes) < 2:
        return 0.0
    flat = (points - origin) @ axes.T
    simplices = flat[Delaunay(flat).simplices]
    edges = simplices[:, 1:] - simplices[:, :1]
    sizes = np.abs(np.linalg.det(edges)) / (2.0 if len(axes) == 2 else 6.0)
    is_regular = sizes > 1e-12 * sizes.max()
    half = 0.5 * (edges[is_regular] ** 2).sum(axis=2)
    centre = np.linalg.solve(edges[is_regular], half[..., None])[..., 0]
    small = np.linalg.norm(centre, axis=1) <= radius
    return float(sizes[is_regular][small].sum())


def inside(hull: Hull, points: Points, slack: float = 1e-3) -> Bool[np.ndarray, " n"]:
    """Return which points lie in a hull with a volume or an area.

    Args:
        hull: The hull.
        points: Points, mm.
        slack: How far outside a point may lie, as a part of the size of the hull: a hull of single
            states misses the outermost ones of a thin workspace.
    """
    if hull.dimension < 2:
        return np.zeros(len(points), bool)
    near = slack * float(np.ptp(hull.corners, axis=0).max())
    flat = (points - hull.origin) @ hull.axes.T
    off = points - hull.origin - flat @ hull.axes
    within = np.abs(off).max(axis=1) <= near
    for row in hull.equations:  # few, while the points are many
        within &= flat @ row[:-1] + row[-1] <= near
    return within


def _frame(
    points: Points,
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, "d 3"]]:
    """Return the middle of points and the axes along which they spread."""
    origin = points.mean(axis=0)
    spread = points - origin
    # Of many points the axes follow from their covariance.
    values, vectors = np.linalg.eigh(spread.T @ spread / len(points))
    deviation = np.sqrt(np.maximum(values[::-1], 0.0))
    dimension = int((deviation > _FLAT * max(float(deviation[0]), 1e-9)).sum())
    return origin, vectors[:, ::-1].T[:dimension]


DIRECTIONS = 96
"""Number of directions that the dexterity distinguishes, evenly on the sphere."""


@dataclass(frozen=True, eq=False)
class VoxelMap:
    """Values of a workspace by voxel, v voxels that hold a state.

    Attributes:
        size: Edge of a voxel, mm.
        centre: Centres, mm, (v, 3).
        states: States in each, (v,).
        dexterity: How many of `DIRECTIONS` directions the tip has in each, as a part, (v,).
        values: Means of the quantities of the states by name, and of "hysteresis" the largest,
            (v,) each; NaN where no state has it.
        of_state: Voxel of every state, (n,).
    """

    size: float
    centre: Float[np.ndarray, "v 3"]
    states: Int[np.ndarray, " v"]
    dexterity: Float[np.ndarray, " v"]
    values: Mapping[str, Float[np.ndarray, " v"]]
    of_state: Int[np.ndarray, " n"]

    def __len__(self) -> int:
        """Number of voxels."""
        return len(self.states)


def voxel_map(
    points: Points,
    directions: Points,
    values: Mapping[str, States],
    size: float,
) -> VoxelMap:
    """Sort states into voxels.

    Args:
        points: Tip positions, mm.
        directions: Unit vectors along the tube at the tip.
        values: Further values of every state, NaN where one has none.
        size: Edge of a voxel, mm.
    """
    cells = np.floor(points / size).astype(np.int64)
    occupied, of_state, states = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    of_state = of_state.reshape(-1)
    reached = np.unique(of_state * DIRECTIONS + nearest_directions(directions))
    dexterity = np.bincount(reached // DIRECTIONS) / DIRECTIONS
    maps: dict[str, np.ndarray] = {}
    for name, column in values.items():
        is_finite, count = np.isfinite(column), len(occupied)
        places, finite = of_state[is_finite], column[is_finite]
        if name == "hysteresis":
            maps[name] = np.full(count, np.nan)
            np.fmax.at(maps[name], places, finite)
        else:
            with np.errstate(invalid="ignore"):  # none of 0
                maps[name] = np.bincount(places, finite, count) / np.bincount(places, None, count)
    return VoxelMap(size, (occupied + 0.5) * size, states, dexterity, maps, of_state)


def sphere_directions() -> Float[np.ndarray, "directions 3"]:
    """Return the directions that the dexterity distinguishes, as unit vectors."""
    # notation: a Fibonacci sphere, points at equal steps of height turned by the golden angle
    number = np.arange(DIRECTIONS)
    z = 1.0 - (2.0 * number + 1.0) / DIRECTIONS
    turn = number * np.pi * (3.0 - np.sqrt(5.0))
    flat = np.sqrt(1.0 - z**2)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)


def nearest_directions(directions: Points) -> Int[np.ndarray, " n"]:
    """Return the nearest of the directions of the dexterity to unit vectors."""
    return np.asarray(KDTree(sphere_directions()).query(directions)[1])


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
    limits: tuple[LimitedQuantity, ...]
    load: ExternalLoad
    largest: Float[np.ndarray, " t"]
    tried: int
    failed: int
    beyond: int
    tension: Float[np.ndarray, "n t"]
    tip: Points
    direction: Points
    loading: Bool[np.ndarray, " n"]
    strain: States
    angle: States
    hysteresis: States
    stiffness: States

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
    def _some(self) -> Points:
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
        elif not 1e-6 * np.ptp(self.extent) < check_number(size, "size", "mm") < np.inf:
            raise InputError.OUT_OF_RANGE(
                f"a voxel must have a size above 0 mm, at most a million along a side; got {size:g}"
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


@dataclass(frozen=True)
class Overlap:
    """Overlap of two workspaces.

    Attributes:
        first: Label of the first.
        second: Label of the second.
        voxel: Edge of the common voxels, mm.
        both: Voxels in which both have a state.
        first_alone: Voxels in which only the first has one.
        second_alone: Voxels in which only the second has one.
        first_in_second: Part of the first's states inside the convex hull of the second.
        second_in_first: Part of the second's states inside the convex hull of the first.
    """

    first: str
    second: str
    voxel: float
    both: int
    first_alone: int
    second_alone: int
    first_in_second: float
    second_in_first: float


def overlaps(found: Mapping[str, Workspace]) -> list[Overlap]:
    """Compare every two of some workspaces on common voxels.

    Raises:
        InputError: One of them has no states.
    """
    if empty := [label for label, one in found.items() if not len(one)]:
        raise InputError.NO_DATA(f"{empty[0]}: no state is left within the limits")
    compared: list[Overlap] = []
    for (first, a), (second, b) in combinations(found.items(), 2):
        size = max(float(np.ptp(one.extent, axis=0).max()) for one in (a, b)) / _VOXELS
        cells = (np.unique(np.floor(one.tip / size), axis=0).tolist() for one in (a, b))
        in_a, in_b = (set(map(tuple, each)) for each in cells)
        overlap = Overlap(
            first,
            second,
            size,
            both=len(in_a & in_b),
            first_alone=len(in_a - in_b),
            second_alone=len(in_b - in_a),
            first_in_second=float(inside(b.hull, a.tip).mean()),
            second_in_first=float(inside(a.hull, b.tip).mean()),
        )
        compared.append(overlap)
    return compared


_PARTS = {"p5": 0.05, "p50": 0.5, "p95": 0.95, "largest": 1.0}


def workspace_document(explored: Workspace) -> dict[str, Any]:
    """Return what was found as a document of plain values, at the units of files."""
    document: dict[str, Any] = {
        **document_head(explored.robot),
        "limits": [one.text for one in explored.limits],
        "largest_tension_N": explored.largest,
        "states": {
            "solved": explored.tried,
            "kept": len(explored),
            "not_converged": explored.failed,
            "beyond_limits": explored.beyond,
        },
    }
    if not len(explored):
        return document
    hull, voxels = explored.hull, explored.voxels()
    low, high = explored.extent
    return document | {
        "extent_mm": {axis: [low[i], high[i]] for i, axis in enumerate(AXES)},
        "convex_hull": {"dimension": hull.dimension, "size": hull.size, "unit": hull.unit},
        "alpha_shape": {"size": explored.alpha_size(), "unit": hull.unit},
        "total_angle_deg": _spread(explored.angle * DEGREES),
        "peak_strain": _spread(explored.strain),
        "tension_N": _spread(explored.tension.max(axis=1)),
        "hysteresis_mm": _spread(explored.hysteresis),
        "softest_stiffness_N_mm": _spread(explored.stiffness),
        "voxels": {
            "edge_mm": voxels.size,
            "count": len(voxels),
            "dexterity_mean": float(voxels.dexterity.mean()),
            "dexterity_largest": float(voxels.dexterity.max()),
        },
    }


def _spread(values: np.ndarray) -> dict[str, float | None]:
    finite = values[np.isfinite(values)]
    parts = np.quantile(finite, list(_PARTS.values())).tolist() if len(finite) else [None] * 4
    return dict(zip(_PARTS, parts, strict=True))


def save_netcdf(workspaces: Mapping[str, Workspace], target: str) -> None:
    """Write the states as NetCDF, each robot a group where there are several; whole or not at all.

    Raises:
        InputError: A package is missing, or the file cannot be written.
    """
    for module in ("xarray", "h5netcdf", "h5py"):
        need(module, "data", "--nc")
    several = len(workspaces) > 1
    groups = {
        label.replace("/", "-") if several else None: explored.to_xarray()
        for label, explored in workspaces.items()
    }
    write_groups(target, groups)
