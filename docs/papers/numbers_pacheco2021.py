"""Numbers of the page on Pacheco et al. 2021.

`python docs/papers/numbers_pacheco2021.py` rewrites the page. The measured data carry no licence
and lie outside the repository (../shared/data beside it); without them their numbers stay.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from page import main, table

import notchflex as nf
from notchflex.comparison import Comparison

PAGE = "pacheco2021.md"
DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
WRISTS = "ABC"
TABLE_4 = {
    "A": "1.80 1.32 1.01 0.84 0.89",
    "B": "0.43 0.41 0.39 0.57 0.57",
    "C": "2.47 1.49 1.15 0.79",
}
FULL_SCALE = {"A": (150.0, "2.5"), "B": (90.0, "1.8"), "C": (150.0, "2.6")}
MODELS = {
    "full": ({}, "0.33"),
    "(i) linear with friction": (
        {"material.kind": "linear", "material.elastic_modulus": 7510.0}
        | {"friction.coefficient": 0.05},
        "0.92",
    ),
    "(ii) linear, frictionless": (
        {"material.kind": "linear", "material.elastic_modulus": 7510.0}
        | {"friction.kind": "frictionless"},
        "0.90",
    ),
}
MEASURED_NAMES = ("table4", "tips", "straight")


def robot(name: str, specimen: bool = False) -> nf.Robot:
    """Return a ready wrist: nominal, or the specimen that was measured."""
    return nf.load_robot(f"pacheco2021-{name.lower()}{'-specimen' if specimen else ''}")


def numbers() -> dict[str, str]:
    """Return the numbers that need no measurement."""
    sections, closing = [], []
    for depth in (1.36, 1.40, 1.45):
        both = [cut(0.81, 0.70, depth) for cut in (nf.annular_sector, nf.annular_segment)]
        moments = [float(one.second_moment_weak) for one in both]
        less = 100.0 * (1.0 - moments[1] / moments[0])
        sections.append((f"{depth:.2f}", *(f"{one:.6f}" for one in moments), f"{less:.0f} %"))
    for name in WRISTS:
        found = nf.closing(robot(name))
        order = np.argsort(found.tension, kind="stable") + 1
        closing.append(
            (
                name,
                ", ".join(f"{one:.3f}" for one in found.tension),
                ", ".join(map(str, order)),
                f"{np.degrees(found.angle.sum()):.2f}",
                ", ".join(f"{one:.4f}" for one in dict.fromkeys(np.round(found.outer_strain, 4))),
            )
        )
    at_one = nf.simulate(robot("C"), nf.pull(0.0, 3.0, steps=61)).raise_if_failed()[20]
    c = robot("C")
    limit = []
    for notch in c.notches:
        section = nf.annular_sector(0.81, 0.70, notch.depth)
        limit.append(0.028 * notch.height / float(section.edge_spine))
    return {
        "sections": table(("g, mm", "I sector, mm⁴", "I segment, mm⁴", "less by"), sections),
        "closing": table(
            ("wrist", "closing tensions, N", "order", "sum of angles, deg", "eq. 16 at closing"),
            closing,
        ),
        "c_at_one": ", ".join(f"{one:.2f}" for one in np.degrees(at_one.notch_angle)),
        "c_limit": ", ".join(f"{one:.2f}" for one in np.degrees(limit)),
    }


def measured_numbers() -> dict[str, str]:
    """Return the numbers that need the measurement; FileNotFoundError where it is absent."""
    rows, straight = [], []
    for name in WRISTS:
        found = _compared(robot(name, specimen=True), name)
        total = float(np.degrees(found.rmse_total))
        scale, percent = FULL_SCALE[name]
        notches = " ".join(f"{one:.2f}" for one in np.degrees(found.rmse_notches))
        share = f"{100.0 * total / scale:.1f}"
        rows.append((name, TABLE_4[name], notches, f"{total:.2f}", percent, share))
        nominal = _compared(robot(name), name)
        straight.append(f"{np.degrees(nominal.rmse_total):.1f}")
    tips = []
    for text, (values, printed) in MODELS.items():
        errors = [
            _compared(robot(name, specimen=True).with_values(values), name).tip_error
            for name in WRISTS
        ]
        pooled = np.sqrt(np.mean(np.concatenate(errors) ** 2))
        tips.append((text, printed, f"{pooled:.2f}"))
    head = ("wrist", "Table 4, deg", "here, deg", "total, deg", "printed, %", "here, %")
    return {
        "table4": table(head, rows),
        "tips": table(("model", "printed, mm", "here, mm"), tips),
        "straight": " / ".join(straight),
    }


def _compared(one: nf.Robot, name: str) -> Comparison:
    path = DATA / f"pacheco2021_wrist_{name}_measured.csv"
    if not path.is_file():
        raise FileNotFoundError(f"no measured data at {path}")
    return nf.compare(one, nf.read_measurements(path, one))


if __name__ == "__main__":
    main(PAGE, numbers, measured_numbers)
