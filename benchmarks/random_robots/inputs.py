"""Unusable values in robots and loads: each must be refused by `InputError`, or taken.

python benchmarks/robustness.py inputs
"""

from __future__ import annotations

import collections
import copy
import traceback
from typing import Any

import numpy as np

import notchflex as nf

from .robots import VARIANTS, make_loads, make_robot, tables_of

ODD: list[Any] = [0, -1, 1e-300, 1e300, -1e300, float("nan"), float("inf"), -float("inf"), True]
ODD += [None, "1", "", "arc", [], [1.0], {}, (0.0, 0.0), 2**70, 1e-9, 1e9, 0.5, np.float32(2), "é"]
ODD += [np.array(1.0), np.array([1.0, 2.0, 3.0]), np.nan, 1 + 2j, object, b"x", [np.nan] * 3]


def places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the paths of all values of nested tables."""
    found = [path] if path else []
    if isinstance(value, dict):
        for key in value:
            found += places(value[key], (*path, key))
    elif isinstance(value, list):
        for index, one in enumerate(value):
            found += places(one, (*path, index))
    return found


def mutate(random: np.random.Generator, table: Any) -> str:
    """Replace one or two values; return what was done."""
    told = []
    for _ in range(int(random.integers(1, 3))):
        spots = places(table)
        spot = spots[random.integers(len(spots))]
        inner = table
        for key in spot[:-1]:
            inner = inner[key]
        odd = ODD[random.integers(len(ODD))]
        if isinstance(inner, dict) and random.random() < 0.05:
            del inner[spot[-1]]
            told.append(f"{spot} left out")
        else:
            inner[spot[-1]] = odd
            told.append(f"{spot} = {odd!r}")
    return "; ".join(told)


def failed(seed: int, count: int) -> bool:
    """Mutate, tell, and return whether anything but an InputError was raised."""
    ended: collections.Counter[str] = collections.Counter()
    seen: dict[str, str] = {}
    for number in range(count):
        random = np.random.default_rng([seed, number, 3])
        robot, loads, _ = tables_of(seed, VARIANTS * number)
        tables = {"robot": robot, "loads": copy.deepcopy(loads[:2])}
        which = "robot" if random.random() < 0.6 else "loads"
        what = mutate(random, tables[which])
        try:
            robot = make_robot(tables["robot"])
            loads = make_loads(tables["loads"])
            _ = robot.number_of_notches, robot == robot, repr(robot), repr(loads)
            ended["taken"] += 1
        except nf.InputError:
            ended["refused"] += 1
        except Exception as error:  # whatever it is, it is a finding
            last = traceback.extract_tb(error.__traceback__)[-1]
            ours = "robots.py" in last.filename
            ours |= isinstance(error, TypeError) and "keyword" in str(error)
            kind = f"{type(error).__name__}: {error}"[:150]
            kind = "not for the library" if ours else kind
            ended["not for the library" if ours else "EXCEPTION"] += 1
            seen.setdefault(kind, f"{number} {last.filename}:{last.lineno} {what}")
    print(dict(ended))
    for kind, where in seen.items():
        print(kind, "|", where)
    return "EXCEPTION" in ended
