"""Solve a draw state by state, judge every state, and solve it again in other ways."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

import notchflex as nf

from .cycles import judge_cycle
from .draws import Draw, guise_of, with_neighbours
from .judge import CONTACTS, NUMBERS, not_finite, wrong

GUISES = ("turned", "mirrored", "enlarged", "rounding")
WAYS = (*GUISES, "one step", "batch", "file")
# What the same states may differ by, rad: without and with another way to them.
SAME, ANOTHER_WAY = 1e-7, 1e-6
SLOW = 10.0  # s for a path, once it is compiled


@dataclass
class Outcome:
    """What came of one state of a draw.

    Attributes:
        number: Of the draw.
        step: Of its path, from 0.
        seconds: How long the state took.
        reason: Why it was not solved; empty where it was.
        silent: What failed without being told.
        wrong: What does not hold of a solved state, or is another when solved in another way.
    """

    number: int
    step: int
    seconds: float = float("nan")
    reason: str = ""
    silent: list[str] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)


def follow(draw: Draw, near: bool = True) -> Iterator[tuple[Outcome, nf.EquilibriumPath | None]]:
    """Solve the loads of a draw one after the other, each from the last good state.

    Args:
        draw: The robot and its loads.
        near: Whether the last load is then held, changed a little twice, and taken again.
    """
    loads = with_neighbours(draw) if near else draw.loads
    state = before = None
    for step, load in enumerate(loads):
        outcome, path = Outcome(draw.number, step), None
        try:
            start = time.perf_counter()
            path = nf.simulate(draw.robot, load, from_state=state)
            outcome.seconds = time.perf_counter() - start
            outcome.reason, state = path.reason[0], path.state
            if path.converged[0]:
                outcome.silent = [] if not outcome.reason else ["converged, and a reason"]
                outcome.silent += not_finite(path[0])
                outcome.wrong = wrong(draw.robot, load, path, before)
            elif not outcome.reason:
                outcome.silent = ["not converged, and no reason"]
            outcome.wrong += _beyond_bounds(draw, path)
            is_near = path.converged[0] and step >= len(draw.loads)
            before = (load, path) if is_near else None
        except nf.InputError as error:
            outcome.reason = f"refused: {error}"
        except Exception as error:  # whatever it is, it is counted
            outcome.silent = [f"{type(error).__name__}: {error}"]
        yield outcome, path
        if path is None:
            return


def _beyond_bounds(draw: Draw, path: nf.EquilibriumPath) -> list[str]:
    """Whether a tension is beyond all bounds, of the last good state of a failure too."""
    tube, commanded = draw.robot.tube, np.nan_to_num(path.commanded_tension).max(initial=0.0)
    most = max(1e6 * draw.robot.material.elastic_modulus * tube.outer_radius**2, commanded)
    high = float(path.tension.max())
    return [f"a tension of {high:.1e} N, beyond all bounds"] if high > most else []


def compared(draw: Draw, paths: list[nf.EquilibriumPath], way: str | None = None) -> list[str]:
    """Tell in which other ways of solving a draw its states are others.

    Args:
        draw: The robot and its loads.
        paths: Its states, those near the last one at the end.
        way: One of WAYS; one by chance if None.
    """
    random = np.random.default_rng([draw.seed, draw.number, 5])
    way = way or str(random.choice(WAYS))
    robot, loads, last = draw.robot, list(draw.loads), len(draw.loads)
    there_and_back = [*loads, *loads[::-1]]
    whole = nf.simulate(robot, there_and_back)
    _ = whole.converged
    start = time.process_time()  # whatever else the machine does
    again = nf.simulate(robot, there_and_back)
    found = [] if np.array_equal(again.notch_angle, whole.notch_angle) else ["not repeatable"]
    seconds = time.process_time() - start
    found += [f"a path takes {seconds:.1f} s"] if seconds > SLOW else []
    found += [*_parted(paths[:last], whole), *judge_cycle(whole)]
    memory = getattr(robot.friction, "coefficient", 0.0)
    memory = memory or any(getattr(one, "unloading_stress", None) for one in robot.materials)
    memory = memory or any(one.sheath_friction or one.backlash for one in robot.tendon)
    held = paths[last - 1 :]
    if all(path.converged[0] for path in held):
        angle = [path.notch_angle[0] for path in held]
        off = np.abs(angle[1] - angle[0]).max()
        found += [f"a held load moves by {off:.1e} rad"] if off > 0.1 * SAME else []
        off = np.abs(angle[-1] - angle[0]).max()
        if off > SAME and not memory:
            found.append(f"a state without friction depends on its way by {off:.1e} rad")
    if way in GUISES:
        guise = guise_of(way, draw, random)
        other = nf.simulate(guise.draw.robot, [*guise.draw.loads, *guise.draw.loads[::-1]])
        found += _guised(way, whole, other, guise.mapped, guise.factor)
    elif way == "one step" and paths[last - 1].converged[0] and not memory:
        state = nf.solve(robot, loads[-1])
        off = np.abs(state.notch_angle - paths[last - 1].notch_angle[0]).max()
        if state.converged and off > ANOTHER_WAY:
            found.append(f"one step leads elsewhere by {off:.1e} rad (stable {state.stable})")
    elif way == "batch":
        found += _batch(robot, loads)
    elif way == "file":
        found += _read_back(robot, whole)
    return found


def _parted(paths: list[nf.EquilibriumPath], whole: nf.EquilibriumPath) -> list[str]:
    """Compare a path that was continued from state to state with one solved at once."""
    parts = [path.run.substeps[0] for path in paths]
    alike = _cut_alike(np.array(parts), whole.run.substeps[: len(paths)])
    for step, path in enumerate(paths):
        if path.converged[0] != whole.converged[step]:
            return [f"a continued path converges otherwise from step {step} on"]
        if not path.converged[0]:
            return []  # beyond it a path tries no step
        off = np.abs(path.notch_angle[0] - whole.notch_angle[step]).max()
        if step < alike and off > SAME:
            return [f"a continued path is another from step {step} on, by {off:.1e} rad"]
    return []


def _cut_alike(one: np.ndarray, other: np.ndarray) -> int:
    """Return how many steps two paths take alike, of the parts into which they cut every step.

    Rounding decides where a hard step is cut, and friction remembers the parts. Two are usual:
    where all tendons are slack, the loads from outside come first.
    """
    otherwise = (one != other) | (one > 2)
    return int(otherwise.argmax()) if otherwise.any() else len(one)


def _guised(
    way: str,
    path: nf.EquilibriumPath,
    other: nf.EquilibriumPath,
    mapped: np.ndarray,
    factor: float,
) -> list[str]:
    """Compare a path with that of a guise: the same physics, in other coordinates."""
    found, both = [], path.converged & other.converged
    both[_cut_alike(path.run.substeps, other.run.substeps) :] = False
    if (other.converged != path.converged).any():
        step = int((other.converged != path.converged).argmax())
        found.append(f"{way}: step {step} converges otherwise (factor {factor})")
    tip = np.abs(other.tip_position - factor * path.tip_position @ mapped.T)[both].max(initial=0.0)
    angle = np.abs(np.abs(other.notch_angle) - np.abs(path.notch_angle))[both].max(initial=0.0)
    off = max(tip / np.abs(other.body_position).max(initial=1e-300), angle)
    if off > ANOTHER_WAY:
        found.append(f"{way}: another state, by {off:.1e} (factor {factor})")
    return found


def _batch(robot: nf.Robot, loads: list[nf.Load]) -> list[str]:
    """Solve every load from rest, one by one and as a batch, and compare."""
    each = nf.solve_each(robot, loads)
    batch = nf.solve_batch(robot, loads, outputs=("notch_angle", "converged"), cores=1)
    if (each.converged != batch["converged"]).any():
        return ["a batch converges otherwise"]
    off = np.abs(each.notch_angle - batch["notch_angle"])[each.converged].max(initial=0.0)
    return [f"a batch has another state, by {off:.1e} rad"] if off > SAME else []


def _read_back(robot: nf.Robot, path: nf.EquilibriumPath) -> list[str]:
    """Write robot and path to files, read them back, and compare."""
    with tempfile.TemporaryDirectory() as folder:
        nf.save_path(path, f"{folder}/path.json")
        again = nf.read_path(f"{folder}/path.json")
        nf.save_robot(robot, f"{folder}/robot.toml")
        read = nf.load_robot(f"{folder}/robot.toml")
    names = [
        name
        for name in (*NUMBERS, *CONTACTS, "gap", "span_tension")
        if not np.array_equal(getattr(again, name), getattr(path, name), equal_nan=True)
    ]
    found = [f"a file has another {name}" for name in names]
    return found if read == robot else [*found, "a robot file has another robot"]
