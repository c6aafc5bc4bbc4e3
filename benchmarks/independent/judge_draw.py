"""Solve one draw, check every state of it, and solve it again in other guises."""

from __future__ import annotations

import tempfile
import time
import traceback
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from build import enlarged, make_loads, make_robot, mirrored, turned
from checks import (
    EVERY,
    Finding,
    check_base,
    check_commands,
    check_energy,
    check_frames,
    check_friction,
    check_lengths,
    check_lips,
    check_numbers,
)
from generator import Case, Table, draw_case, tension_scale
from rods import check_rods
from shape import lies_flat

import notchflex as nf

NEAR = 1e-4  # of the size of loads: how far a neighbouring state is


@dataclass
class Verdict:
    """What came of one draw."""

    number: int
    marks: list[str]
    refused: str = ""
    error: str = ""
    states: int = 0
    converged: int = 0
    closed: int = 0
    stuck: int = 0
    slack: int = 0
    reasons: list[str] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    first_s: float = 0.0
    again_s: float = 0.0


def with_neighbours(case: Case, random: np.random.Generator) -> list[Table]:
    """Return the loads with the last one held, two near it, and the last one again."""
    last = case.loads[-1]
    loads = [*case.loads, last]
    near = last
    for _ in range(2):
        near = dict(near)
        for key in ("tension", "stroke"):
            told = [load[key] for load in case.loads]
            size = max((abs(x) for row in told for x in row if x is not None), default=0.0)
            shift = NEAR * size
            near[key] = [
                None if x is None else x + shift * random.uniform(0.3, 1) for x in near[key]
            ]
        for key in ("tip_force", "tip_moment"):
            if key in near:
                size = np.abs(near[key]).max()
                flat = np.asarray(near[key]) != 0  # what is planar stays so
                near[key] = near[key] + NEAR * size * flat * random.normal(size=3)
        if "body_forces" in near:
            near["body_forces"] = [
                one | {"force": one["force"] * (1 + NEAR * random.normal())}
                for one in near["body_forces"]
            ]
        loads.append(near)
    return [*loads, last]


def same(first: Any, second: Any, mapped: np.ndarray, factor: float = 1.0) -> float:
    """Return how far two paths are apart where both hold, as part of the length or in rad."""
    both = first.converged & second.converged
    off = second.tip_position[both] - factor * first.tip_position[both] @ mapped.T
    length = np.abs(second.body_position).max() + 1e-300
    angle = np.abs(np.abs(second.notch_angle) - np.abs(first.notch_angle))[both].max(initial=0.0)
    return max(float(np.abs(off).max(initial=0.0)) / length, float(angle))


def judge(seed: int, number: int) -> Verdict:
    """Return what came of a draw; nothing is raised."""
    case = draw_case(seed, number)
    verdict = Verdict(number, case.marks)
    try:
        _judge(case, np.random.default_rng([seed, number, 1]), verdict)
    except nf.InputError as error:
        verdict.refused = str(error)
    except Exception:  # whatever it is, it is a finding
        verdict.error = traceback.format_exc(limit=-6)
    return verdict


def _judge(case: Case, random: np.random.Generator, verdict: Verdict) -> None:
    robot = make_robot(case.robot)
    tables = with_neighbours(case, random)
    loads = make_loads(tables)
    began = time.perf_counter()
    try:
        path = nf.simulate(robot, loads)
    except nf.InputError as error:
        if "spoiled" not in " ".join(case.marks):
            verdict.marks.append("refused when solving")
        raise error
    verdict.first_s = time.perf_counter() - began
    began = time.perf_counter()
    again = nf.simulate(robot, loads)
    verdict.again_s = time.perf_counter() - began
    verdict.states, verdict.converged = len(path), int(path.converged.sum())
    good = path.converged
    verdict.closed = int(path.closed[good].any(axis=1).sum())
    stuck = (path.contact_state == 0) & (path.contact_bound > 1e-9)
    verdict.stuck = int(stuck[good].any(axis=(1, 2)).sum())
    verdict.slack = int((path.tension[good] <= 0).any(axis=1).sum())
    found = verdict.findings
    for step in range(len(path)):
        good, reason = bool(path.converged[step]), str(path.reason[step])
        if good:
            found += check_state(case.robot, path, tables, step)
            if reason:
                found.append(("converged with a reason", step, 0.0, reason))
        elif not reason:
            found.append(("not converged without a reason", step, 0.0, ""))
    verdict.reasons = [str(reason) for reason in dict.fromkeys(path.reason) if reason][:1]
    check_neighbours(case, tables, path, found)
    if np.abs(again.notch_angle - path.notch_angle).max(initial=0.0) > 0:
        found.append(
            ("not repeatable", 0, float(np.abs(again.notch_angle - path.notch_angle).max()), "")
        )
    if verdict.again_s > 10.0:
        found.append(("slow", 0, verdict.again_s, "s for the path"))
    ends = tension_scale(case.robot) * 1e7
    told = np.nan_to_num(path.commanded_tension).max(initial=0.0)
    wild = path.tension.max(axis=1) > max(ends, told)  # the last good state of a failure too
    if wild.any():
        step = int(wild.argmax())
        found.append(("tension beyond all bounds", step, float(path.tension[step].max()), ""))
    _continued(robot, loads, path, found)
    if verdict.converged:
        _guises(case, tables, path, random, found)


def check_state(robot: Table, path: Any, loads: list[Table], step: int) -> list[Finding]:
    """Return what is wrong with one converged state."""
    found = list(check_numbers(robot, path, step))
    found += check_frames(robot, path, step)
    found += check_lips(robot, path, step)
    found += check_commands(robot, path, loads[step], step)
    found += check_friction(robot, path, step)
    found += check_lengths(robot, path, step)
    found += check_base(robot, path, loads[step], step)
    if lies_flat(robot, loads):
        found += check_rods(robot, path, loads[step], step)
    return found


def check_neighbours(case: Case, tables: list[Table], path: Any, found: list[Finding]) -> None:
    """Check the states after the last load: held, two near it, and back."""
    count = len(case.loads)
    if not path.converged[count:].all():
        return
    off = np.abs(path.notch_angle[count] - path.notch_angle[count - 1]).max()
    if off > 1e-8:
        found.append(("held load moves", count, float(off), ""))
    for step in range(count + 1, len(path)):
        found += check_energy(case.robot, path, tables, step)
    if not case.robot["friction"].get("coefficient"):
        off = np.abs(path.notch_angle[-1] - path.notch_angle[count]).max()
        if off > 1e-7:
            found.append(("frictionless state depends on its way", len(path) - 1, float(off), ""))


def _continued(robot: nf.Robot, loads: list[nf.Load], path: Any, found: list[Finding]) -> None:
    """Stop in the middle, go on from the state, and compare."""
    middle = len(loads) // 2
    if not path.converged[: middle + 1].all():
        return
    first = nf.simulate(robot, loads[:middle])
    rest = nf.simulate(robot, loads[middle:], from_state=first.state)
    if (rest.converged != path.converged[middle:]).any():
        found.append(("continued path converges otherwise", middle, 0.0, ""))
    off = np.abs(rest.notch_angle - path.notch_angle[middle:]).max()
    if off > 1e-7:
        found.append(("continued path is another", middle, float(off), ""))


def _guises(
    case: Case, tables: list[Table], path: Any, random: np.random.Generator, found: list[Finding]
) -> None:
    """Solve the draw turned, mirrored or enlarged: the same physics."""
    which = random.choice(["turned", "mirrored", "enlarged", "one step", "batch", "file"])
    if which == "batch" and not case.first:
        which = "file"  # a batch is a program of its own, which takes long to compile
    if which == "file":
        found += read_back(case, path)
        return
    if which == "batch":
        found += in_a_batch(make_robot(case.robot), make_loads(tables))
        return
    if which == "one step":
        if case.robot["friction"].get("coefficient") or not path.converged.all():
            return
        state = nf.solve(make_robot(case.robot), make_loads(tables[-1:])[0])
        off = np.abs(state.notch_angle - path.notch_angle[-1]).max()
        if state.converged and off > 1e-6:
            stable = bool(path.stable[-1]), bool(state.stable)
            found.append(
                ("one step leads elsewhere", len(path) - 1, float(off), f"stable {stable}")
            )
        return
    factor, mapped = 1.0, np.eye(3)
    if which == "turned":
        robot, loads, mapped = turned(case.robot, tables, float(random.choice([90.0, 180.0, 37.0])))
    elif which == "mirrored":
        robot, loads, mapped = mirrored(case.robot, tables)
    else:
        factor = float(random.choice([0.1, 0.5, 3.0, 10.0]))
        robot, loads = enlarged(case.robot, tables, factor)
    other = nf.simulate(make_robot(robot), make_loads(loads))
    if (other.converged != path.converged).any():
        more = (
            f"{int(path.converged.sum())} and {int(other.converged.sum())} of {len(path)} converged"
        )
        found.append((f"{which}: converges otherwise", 0, 0.0, more + f" {other.reason[-1]}"))
    off = same(path, other, mapped, factor)
    # Rounding decides where a hard step is cut into parts, and friction remembers the parts.
    in_parts = max(path.run.substeps.max(), other.run.substeps.max()) > 1
    if off > 1e-6 and not in_parts:
        found.append((f"{which}: another state", 0, off, f"factor {factor}"))


def read_back(case: Case, path: Any) -> list[Finding]:
    """Write robot and path to files, read them back, and compare."""
    found: list[Finding] = []
    with tempfile.TemporaryDirectory() as folder:
        nf.save_path(path, f"{folder}/path.json")
        again = nf.read_path(f"{folder}/path.json")
        nf.save_robot(path.robot, f"{folder}/robot.toml")
        robot = nf.load_robot(f"{folder}/robot.toml")
    for name in EVERY:
        if not np.array_equal(getattr(again, name), getattr(path, name), equal_nan=True):
            found.append((f"file has another {name}", 0, 0.0, ""))
    if robot != make_robot(case.robot):
        found.append(("robot file has another robot", 0, 0.0, ""))
    return found


def in_a_batch(robot: nf.Robot, loads: list[nf.Load]) -> list[Finding]:
    """Solve every load from rest, one by one and as a batch, and compare."""
    each = nf.solve_each(robot, loads)
    batch = nf.solve_batch(robot, loads, outputs=("notch_angle", "converged"), cores=1)
    both = each.converged & batch["converged"]
    found: list[Finding] = []
    if (each.converged != batch["converged"]).any():
        more = f"{each.converged.astype(int)} {batch['converged'].astype(int)}"
        found.append(("batch converges otherwise", 0, 0.0, more))
    off = np.abs(each.notch_angle - batch["notch_angle"])[both].max(initial=0.0)
    if off > 1e-7:
        found.append(("batch has another state", 0, float(off), ""))
    return found
