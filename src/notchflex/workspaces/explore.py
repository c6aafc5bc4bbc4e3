"""Explores a workspace: rays of tension in batches, piece by piece.

A ray is a ratio of tensions that rises from 0 to a peak and falls again, so that every tension
is there while loading and while unloading. Of the tendons that end at one body two neighbours are
pulled at a time: what more would add is pressed together, not moved.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from notchflex import (
    InputError,
    LoadPath,
    Robot,
    Settings,
    closing,
    simulate,
    simulate_batch,
    tip_response,
)
from notchflex.pieces import (
    Manifest,
    PieceFolder,
    PieceTask,
    heads,
    piece_file,
    sobol_points,
)
from notchflex.specification import (
    Criterion,
    LimitedQuantity,
    check_quantity,
    coded,
    known_numbers,
    made,
    placed,
    whole,
)
from notchflex.support import (
    AnyPath,
    ExternalLoad,
    check_is_robot,
    check_number,
    short_repr,
    to_table,
)
from notchflex.workspaces.cloud import Workspace, hull_of, nearest_directions

if TYPE_CHECKING:
    from polars import DataFrame

_LEVELS = 16
"""Levels of tension on each way of a ray."""
_STATES = 2 * _LEVELS
"""States of a ray."""
_FIRST_LEVELS = 12
"""Levels of the first pull, that finds how far limits allow each ray to be pulled."""
_HALVINGS = 5
"""How often the step between the last level within the limits and the next is halved."""
_SETTINGS = Settings(tolerance=1e-9)
"""Far below what a picture or a volume shows, and a third quicker than the usual tolerance."""
_PIECE = 4096
"""Rays of a piece: its states and their quantities are in memory at a time."""
_SAMPLE = 256
"""Rays that find how large the workspace is."""
_FINE = 64
"""Voxels along the longest side where states are thinned, twice as many as maps have."""

_Columns = dict[str, Any]
"""States as columns: arrays by the names of the attributes of `Workspace`."""
_Counts = Int[np.ndarray, " 3"]
"""How many states are kept, break a limit or follow one that does, and did not converge."""
_SHAPES = ("tension", "tip", "direction")
"""Columns that hold several numbers of a state, which have columns of their own in files."""


def largest_tensions(robot: Robot, tension: ArrayLike | None) -> Float[np.ndarray, " t"]:
    """Return the largest tension of every tendon, N; by default that which closes all notches.

    Raises:
        InputError: Not one number or one per tendon, not above 0, or none is given and no tension
            closes the notches.
    """
    tendons = robot.number_of_tendons
    if tension is None:
        closed = np.asarray(closing(robot).tension)
        closed = closed[np.isfinite(closed)]
        if not len(closed):
            raise InputError.MISSING_VALUE(
                f"no tension closes a notch of {robot.name}, so that nothing says how far to "
                "pull; give the largest tension"
            )
        return np.full(tendons, closed.max())
    values = LoadPath([np.atleast_1d(tension)]).tension[0]  # pyright: ignore[reportArgumentType]
    if len(values) not in (1, tendons):
        raise InputError.WRONG_SHAPE(
            f"tension must be one number or {tendons}, one per tendon; got {short_repr(tension)}"
        )
    if not np.isfinite(values).all():  # NaN is slack in a load, no largest tension
        raise InputError.NOT_FINITE(f"tension must be finite, N; got {short_repr(tension)}")
    if (values < 0.0).any() or not values.any():
        raise InputError.OUT_OF_RANGE(
            f"a tendon only pulls: give a largest tension above 0 N; got {short_repr(tension)}"
        )
    return np.broadcast_to(values, tendons).copy()


def limits_of(given: Mapping[str, object] | None) -> tuple[LimitedQuantity, ...]:
    """Check limits.

    Args:
        given: By name of a quantity its largest value, or its smallest and largest as a pair with
            None for none.

    Raises:
        InputError: No such quantity, a bound that is not a number, or bounds that are reversed.
    """
    if given is not None and not isinstance(given, Mapping):  # pyright: ignore
        raise InputError.WRONG_TYPE(
            'limits are given by quantity, such as {"peak_strain": 0.08, "gap": (0.0, None)}; '
            f"got {short_repr(given)}"
        )
    return tuple(_limit(name, bounds) for name, bounds in (given or {}).items())


def _limit(name: str, bounds: Any) -> LimitedQuantity:
    with placed(f"the limit of {name}"):
        pair = bounds if isinstance(bounds, tuple | list) else (None, bounds)
        ends = [None if end in (math.inf, -math.inf) else end for end in pair]
        if len(ends) != 2 or ends == [None, None]:
            raise InputError.WRONG_SHAPE(
                f"give its largest value, or the smallest and the largest; got {short_repr(bounds)}"
            )
        keys = ("quantity", "lower", "upper")
        limit = made(LimitedQuantity, dict(zip(keys, (name, *ends), strict=True)), coded)
        check_quantity(limit)
    return limit


def in_python(given: Mapping[str, object]) -> dict[str, tuple[float | None, float | None]]:
    """Return limits in the units of files (deg) in those inside Python (rad)."""
    limits = (limit.in_python for limit in limits_of(given))
    return {limit.quantity: (limit.lower, limit.upper) for limit in limits}


def rays(
    robot: Robot,
    largest: Float[np.ndarray, " t"],
    levels: int,
    pretension: float,
    points: Callable[[int], Float[np.ndarray, "r d"]],
) -> Float[np.ndarray, "r s t"]:
    """Return tensions along rays: a number of levels up to a peak, and the same levels down.

    Half of the rays reach the largest tensions, the others a part of them: unloading begins at many
    peaks. Directions, peaks and levels are points of a sequence of low discrepancy.

    Args:
        robot: The robot.
        largest: Largest tension of every tendon, N.
        levels: Levels of tension on each way.
        pretension: Tension that every tendon has at least, N.
        points: Returns points of the sequence, of so many numbers each between 0 and 1.
    """
    # The tendons that are pulled, by the body where they end, in order around the tube.
    by_end: dict[int, list[int]] = {}
    for number in np.flatnonzero(largest > 0.0).tolist():
        end = robot.tendon[number].end_body or robot.number_of_notches
        by_end.setdefault(end, []).append(number)
    turn = [tendon.direction_deg % 360.0 for tendon in robot.tendon]
    groups = [sorted(group, key=turn.__getitem__) for group in by_end.values()]
    drawn = points(2 * len(groups) + 2)
    # Rays side by side take as many iterations as the hardest of them: similar ones together.
    drawn = drawn[np.argsort(drawn[:, 0], kind="stable")]
    directions = np.zeros((len(drawn), robot.number_of_tendons))
    for number, group in enumerate(groups):
        # Neighbours at places from 0 to 1 around the tube are pulled, the more tense of two by 1.
        place, share = drawn[:, 2 * number], drawn[:, 2 * number + 1]
        part, row, order = np.zeros_like(directions), np.arange(len(drawn)), np.array(group)
        pairs = 1 if len(group) == 2 else len(group)
        pair = np.minimum((place * pairs).astype(int), pairs - 1)
        angle = 0.5 * np.pi * (place * pairs - pair)
        part[row, order[pair]] = np.cos(angle)
        if len(group) > 1:
            part[row, order[(pair + 1) % len(group)]] = np.sin(angle)
        part /= part.max(axis=1, keepdims=True)
        directions += part * share[:, None] if len(groups) > 1 else part
    directions /= directions.max(axis=1, keepdims=True)
    peak = np.where(np.arange(len(drawn)) % 2 == 0, 1.0, np.sqrt(drawn[:, -2]))
    steps = (np.arange(levels) + drawn[:, -1:]) / levels
    steps[:, -1] = 1.0
    up = peak[:, None] * steps
    ways = np.concatenate([up, up[:, ::-1]], axis=1)
    return np.maximum(ways[:, :, None] * directions[:, None] * largest, pretension)


def _under(load: ExternalLoad, tension: Float[np.ndarray, "s t"]) -> LoadPath:
    """Return a path of valid tensions under a load that acts all the time."""
    turn = np.array(getattr(load, "base_rotation", (0.0, 0.0, 0.0)))
    external = (load.external,) * len(tension)
    return LoadPath.of_valid(tension, np.full(tension.shape, np.nan), turn, external)


@dataclass(frozen=True, eq=False)
class WorkspaceTask(PieceTask):
    """States of a robot along rays of tension, in pieces; arguments as for `workspace`.

    Attributes:
        number: Number of rays.
    """

    robot: Robot
    limits: tuple[LimitedQuantity, ...]
    load: ExternalLoad
    largest: Float[np.ndarray, " t"]
    number: int
    pretension: float
    seed: int
    cores: int | None

    @cached_property
    def manifest(self) -> Manifest:
        """All that the bytes of pieces depend on."""
        return Manifest.of(
            "workspace",
            _STATES * self.number,
            _STATES * min(_PIECE, self.number),
            robot=to_table(self.robot.replace(tolerance=None)),
            limits=[[limit.quantity, *limit.ends] for limit in self.limits],
            load=self.load,
            largest=self.largest,
            pretension=self.pretension,
            seed=self.seed,
        )

    @cached_property
    def criteria(self) -> list[Criterion]:
        """The numbers that limits are about.

        Raises:
            InputError: The robot has none of a quantity, or it is not known without tensions.
        """
        slack, criteria = np.zeros((1, len(self.largest))), list[Criterion]()
        for limit in self.limits:
            path = simulate(self.robot, _under(self.load, slack))
            with placed(f"the limit of {limit.quantity}"):
                criteria += known_numbers(limit, {"": path})
        return criteria

    @cached_property
    def voxel(self) -> float:
        """Edge of a voxel, mm, from a few rays."""
        tips = self.states(0, _SAMPLE, _SAMPLE)[0]["tip"]
        side = float(np.ptp(tips, axis=0).max()) if len(tips) else 1.0
        return max(side, 1e-6) / _FINE

    def states(self, start: int, stop: int, total: int | None = None) -> tuple[_Columns, _Counts]:
        """Solve the rays from `start` to `stop` (not included) of a sequence.

        Returns:
            The states that are kept, and counts.
        """

        def points(dimension: int) -> Float[np.ndarray, "r d"]:
            return sobol_points(dimension, self.seed, start, stop, total or self.number)

        tension = rays(self.robot, self.largest, _LEVELS, self.pretension, points)
        if self.limits:  # the part of each ray that they allow, by a pull in few levels
            part = np.linspace(0.0, 1.0, _FIRST_LEVELS + 1)
            peak = tension[:, tension.shape[1] // 2]
            within = self._solved(part[1:, None] * peak[:, None])[1]
            last = np.logical_and.accumulate(within, axis=1).sum(axis=1)
            low, high = part[last], part[np.minimum(last + 1, _FIRST_LEVELS)]
            for _ in range(_HALVINGS):  # rays as a batch
                middle = 0.5 * (low + high)
                steps = np.stack([low, middle], axis=1)[:, :, None] * peak[:, None]
                fits = self._solved(steps)[1][:, 1]
                low, high = np.where(fits, middle, low), np.where(fits, high, middle)
            tension = tension * low[:, None, None]
        names = ["tip_position", "tip_rotation", "peak_strain", "total_angle"]
        outputs, within = self._solved(tension, names)
        # What follows a state beyond a limit has a history that the limit forbids.
        keeps = np.logical_and.accumulate(within, axis=1)
        converged, tip = np.asarray(outputs["converged"], bool), outputs["tip_position"]
        # The same tensions stand at mirrored places of the way up and down.
        apart = np.linalg.norm(tip - tip[:, ::-1], axis=2)
        columns = {
            "tension": tension,
            "tip": tip,
            "direction": outputs["tip_rotation"][..., 2],
            "loading": np.broadcast_to(np.arange(_STATES) < _LEVELS, keeps.shape),
            "strain": np.fmax.reduce(np.abs(outputs["peak_strain"]), axis=2),
            "angle": outputs["total_angle"],
            "hysteresis": np.where(keeps[:, ::-1], apart, np.nan),
        }
        counts = [keeps.sum(), (converged & ~keeps).sum(), (~converged).sum()]
        return {name: values[keeps] for name, values in columns.items()}, np.array(counts)

    def _solved(
        self, tension: Float[np.ndarray, "r s t"], names: Iterable[str] = ()
    ) -> tuple[Mapping[str, np.ndarray], np.ndarray]:
        """Return quantities of states, and which of them converge and keep all limits."""
        outputs = simulate_batch(
            self.robot,
            [_under(self.load, ray) for ray in tension],
            outputs=[*names, "converged", *(one.quantity.name for one in self.criteria)],
            settings=_SETTINGS,
            cores=self.cores,
        )
        within = np.asarray(outputs["converged"], bool)
        for one in self.criteria:
            values = outputs[one.quantity.name][(..., *one.index)]
            within = within & (one.lower <= values) & (values <= one.upper)
        return outputs, within

    def piece(self, number: int) -> tuple[DataFrame, dict[str, Any]]:
        """Solve the rays of one piece, and thin their states."""
        import polars

        start, stop = (row // _STATES for row in self.manifest.between(number))
        columns, counts = self.states(start, stop)
        tips, weights = columns["tip"], [1.0, np.pi, np.e]  # equal points have equal sums
        corners = hull_of(tips).corners if len(tips) else tips
        columns["corner"] = np.isin((tips * weights).sum(axis=1), (corners * weights).sum(axis=1))
        columns = _thinned(columns, self.voxel)
        for name in _SHAPES:
            vectors = columns.pop(name)
            for place, values in enumerate(vectors.T, start=1):
                columns[f"{name}_{place}"] = np.ascontiguousarray(values)
        return polars.DataFrame(columns), {"codes": [*counts.tolist(), 0]}


def _joined(pieces: Sequence[_Columns]) -> _Columns:
    return {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[-1]}


def _thinned(columns: _Columns, size: float) -> _Columns:
    """Thin states by voxels of a size, mm.

    Of the states whose tips lie in the same voxel, point the same way (one of the directions of the
    dexterity) and are both loaded or both unloaded, that with the largest hysteresis is kept.
    Corners of the convex hull of each piece are kept too, so that the hull is that of all states.
    """
    cells = np.floor(columns["tip"] / size).astype(np.int64)
    direction = nearest_directions(columns["direction"])
    key = np.column_stack([cells, direction, columns["loading"]])
    order = np.argsort(-np.nan_to_num(columns["hysteresis"], nan=-1.0), kind="stable")
    kept = order[np.unique(key[order], axis=0, return_index=True)[1]]
    kept = np.union1d(kept, np.flatnonzero(columns["corner"]))
    return {name: values[kept] for name, values in columns.items()}


def _explored_in_pieces(
    task: WorkspaceTask, folder: PieceFolder, cores: int | None, progress: Progress
) -> tuple[_Columns, _Counts]:
    """Solve rays in pieces, and join the states that are kept; returns as `states` of the task."""
    import polars

    assert task.voxel  # all threads need it

    def report(done: int, total: int, *_: int) -> None:
        progress(done // _STATES, total // _STATES)

    folder.run(task, cores=cores, progress=report)
    counts, joined = np.zeros(3, int), dict[str, Any]()
    for head in heads(folder.directory, task.manifest, range(task.manifest.pieces)):
        counts += head["codes"][:3]
        frame = polars.read_parquet(piece_file(folder.directory, head["piece"]))
        columns: _Columns = {
            name: frame.select(f"^{name}_\\d+$").to_numpy()
            if name in _SHAPES
            else frame[name].to_numpy()
            for name in (*_SHAPES, "loading", "strain", "angle", "hysteresis", "corner")
        }
        joined = _thinned(_joined([joined, columns] if joined else [columns]), task.voxel)
    del joined["corner"]
    return joined, counts


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
    if not count or not len(rising):
        return explored
    first = np.unique(explored.voxels().of_state[rising], return_index=True)[1]
    even = np.unique(np.linspace(0, len(first) - 1, min(count, len(first))).round().astype(int))
    states = rising[first[even]]
    load = _under(explored.load, explored.tension[states])
    response = tip_response(explored.robot, load, each_from_rest=True)
    by_force = response.compliance[:, 3:, 3:]
    is_known = np.isfinite(by_force).all(axis=(1, 2)) & response.path.converged
    stiffness = np.full(len(explored), np.nan)
    stiffness[states[is_known]] = 1.0 / np.linalg.norm(by_force[is_known], ord=2, axis=(1, 2))
    return replace(explored, stiffness=stiffness)


Progress = Callable[[int, int], None]

_MAX_STATES, _MAX_IN_PIECES = 20_000_000, 20_000_000_000
"""States in memory at most, and in pieces."""

_MAX_STIFFNESS = 5000


def workspace(
    robot: Robot,
    *,
    limits: Mapping[str, object] | None = None,
    tension: ArrayLike | None = None,
    states: int = 100_000,
    pretension: float = 0.0,
    load: ExternalLoad | None = None,
    stiffness: int = 0,
    seed: int = 0,
    cores: int | None = None,
    progress: Progress | None = None,
    folder: PieceFolder | AnyPath | None = None,
) -> Workspace:
    """Explore where the tip of a robot can go, during loading and unloading.

    Args:
        robot: The robot.
        limits: By name of a quantity its largest value, or a pair of the smallest and the largest
            (None for none), in mm, N and rad: `{"peak_strain": 0.04, "gap": (0.05, None)}`. A
            tendon is not pulled further than they allow.
        tension: Largest tension of the tendons, N, one number or one per tendon; by default that
            which closes all notches.
        states: How many states are solved.
        pretension: Tension that every tendon has at least, N.
        load: External loads that act all the time.
        stiffness: At how many states the stiffness of the tip is computed, about 10 ms each.
        seed: Of the sequence that draws the rays.
        cores: How many cores to use; all where not given.
        progress: Called with the rays done and the rays of the whole.
        folder: Explore in pieces, which this folder keeps: for more states than fit into memory, by
            many processes (`PieceFolder`), resumed by the same call. Of states whose tips lie
            in the same small voxel and point the same way, one is kept.

    Returns:
        The states that converged and keep the limits, with volumes and maps.

    Raises:
        InputError: An unknown quantity, reversed limits, too many states, no core, or no tension is
            given and none closes the notches.

    Example:
        >>> import notchflex as nf
        >>> found = nf.workspace(nf.load_robot("pacheco2021-a"), states=512)
        >>> found.hull.unit, bool(found.hysteresis[0] >= 0.0)
        ('mm²', True)
    """
    checked = limits_of(limits)
    largest = largest_tensions(check_is_robot(robot), tension)
    whole(states, "states", _STATES, _MAX_STATES if folder is None else _MAX_IN_PIECES)
    if not 0.0 <= check_number(pretension, "pretension") < largest.max():
        raise InputError.OUT_OF_RANGE(
            "pretension must be 0 N or more and below the largest tension, "
            f"{largest.max():g} N; got {pretension:g}"
        )
    whole(stiffness, "stiffness", 0, _MAX_STIFFNESS)
    whole(seed, "seed", 0, 2**63 - 1)
    load = ExternalLoad() if load is None else load
    if not isinstance(load, ExternalLoad):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError.WRONG_TYPE(
            f"load must be a notchflex.Load with external loads; got {short_repr(load)}"
        )
    number = -(-states // _STATES)
    report: Progress = progress or (lambda done, total: None)
    task = WorkspaceTask(robot, checked, load, largest, number, pretension, seed, cores)
    assert task.criteria or not checked  # all threads need them
    if folder is None:
        pieces: list[tuple[_Columns, _Counts]] = []
        for start in range(0, number, _PIECE):
            stop = min(start + _PIECE, number)
            pieces.append(task.states(start, stop))
            report(stop, number)
        columns = _joined([piece for piece, _ in pieces])
        counts = np.sum([counts for _, counts in pieces], axis=0)
    else:
        task = replace(task, cores=1)
        columns, counts = _explored_in_pieces(task, PieceFolder.of(folder), cores, report)
    kept, beyond, failed = counts.tolist()
    tried, unknown = kept + beyond + failed, np.full(len(columns["tip"]), np.nan)
    explored = Workspace(
        robot, checked, load, largest, tried, failed, beyond, **columns, stiffness=unknown
    )
    return with_stiffness(explored, stiffness)
