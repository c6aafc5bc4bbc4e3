"""A small sweep that tests share, and what its files hold."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import notchflex as nf

TABLE: dict[str, Any] = {
    "robot": "pacheco2021-a",
    "piece": 32,
    "variable": [
        {"value": "notch.depth", "lower": 1.36, "upper": 1.42},
        {"value": "friction.coefficient", "values": [0.0, 0.1]},
    ],
    "sampling": {"points": 100, "seed": 4},
    "load": {"pulled": {"tension": "0:1:3"}},
    "keep": [{"quantity": "total_angle", "upper": 60.0}, {"quantity": "notch_angle", "notch": 2}],
    "output": {"extremes": 3},
}


def plan(**changes: Any) -> nf.SweepPlan:
    return nf.SweepPlan(**(TABLE | changes))


def digests(folder: Path) -> dict[str, str]:
    files = sorted(one for one in folder.rglob("*") if one.is_file())
    names = [str(one.relative_to(folder)) for one in files]
    sums = [hashlib.sha256(one.read_bytes()).hexdigest() for one in files]
    return dict(zip(names, sums, strict=True))
