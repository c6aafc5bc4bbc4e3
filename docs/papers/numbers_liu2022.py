"""Numbers of the page on Liu et al. 2022: `python docs/papers/numbers_liu2022.py` rewrites it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from page import main, table

import notchflex as nf

PAGE = "liu2022.md"
BENT = np.radians(58.0)  # where the paper's test ends
STEPS = 24  # of every path, so that one program serves all of a reading
READINGS = {
    "gap": ("straight", "along the gap (default)"),
    "dead": ("straight-dead", "dead"),
    "follower": ("straight-follower", "follower"),
}


def robot(mu: float, reading: str = "gap", small: bool = False, **values: object) -> nf.Robot:
    """Return the ready robot in a reading, with the paper's friction."""
    changed = {"friction.coefficient": mu, "friction.turning": "chord", **values}
    changed["tendon[*].path"] = READINGS[reading][0]
    if small:
        changed["notch[*].deflection"] = "small"
    return nf.load_robot("liu2022").with_values(changed)


def pulled(one: nf.Robot, forces: ArrayLike) -> nf.EquilibriumPath:
    """Pull the first cable through forces, N."""
    loads = [nf.Load(tension=float(force)) for force in np.asarray(forces)]
    return nf.simulate(one, loads).raise_if_failed()


def force_for_bent(one: nf.Robot, high: float = 12.0) -> float:
    """Return the force at which the chord angles sum up to 58 deg, to about 1e-6 N."""
    low = 0.0
    while high - low > 0.05:
        forces = np.linspace(low, high, STEPS)
        total = pulled(one, forces).total_chord_angle
        above = int(np.searchsorted(total, BENT))
        low, high = float(forces[above - 1]), float(forces[above])
    forces = np.linspace(low, high, STEPS)
    return float(np.interp(BENT, pulled(one, forces).total_chord_angle, forces))


def rmse(one: nf.Robot, other: nf.Robot, last: float) -> float:
    """Return the RMSE of the sum of chord angles at 20 even forces up to the last, deg."""
    forces = last / 20 * np.arange(1, STEPS + 1)
    totals = [pulled(model, forces).total_chord_angle[:20] for model in (one, other)]
    return float(np.degrees(np.sqrt(np.mean((totals[0] - totals[1]) ** 2))))


def numbers() -> dict[str, str]:
    """Return every number of the page."""
    return {**forces(), **errors(), **one_strip(), **limits()}


def forces() -> dict[str, str]:
    """Forces that bend the robot by 58 deg."""
    rows = [
        (text, f"{force_for_bent(robot(0.0, name)):.4f}") for name, (_, text) in READINGS.items()
    ]
    widths = {
        "D - d = 4 mm (default)": (4.0, 12.0),
        "the compliance of an annulus, 5.222 mm": (5.222, 24.0),
        "D = 10 mm": (10.0, 48.0),
    }
    by_width = [
        (text, f"{width * 1.5**3 / 12:.4f}", f"{force_for_bent(_wide(width), high):.2f}")
        for text, (width, high) in widths.items()
    ]
    ours = robot(0.2)
    end = force_for_bent(ours)
    bent = pulled(ours, np.linspace(end / STEPS, end, STEPS))[-1]
    tension = bent.span_tension[0]
    ready = pulled(
        robot(0.2, **{"friction.turning": "slope"}), np.linspace(end / STEPS, end, STEPS)
    )
    return {
        "readings": table(("pull on the strip", "N for 58°, no friction"), rows),
        "free58": rows[0][1],
        "rubbed58": f"{end:.4f}",
        "widths": table(("width of both walls", "I, mm⁴", "N for 58°, μ 0.15"), by_width),
        "slope58": f"{np.degrees(bent.total_angle):.1f}",
        "by_slope": f"{np.degrees(ready.total_chord_angle[-1]):.2f}",
        "last_part": f"{tension[13] / tension[0]:.3f}",
        "first_deg": f"{np.degrees(bent.chord_angle[0]):.2f}",
        "last_deg": f"{np.degrees(bent.chord_angle[-1]):.2f}",
    }


def _wide(width: float) -> nf.Robot:
    return robot(0.15, **{"notch[*].wall_width": width})


def errors() -> dict[str, str]:
    """Differences between models, beside the errors that the paper prints."""
    rows = []
    for mu in (0.1, 0.15, 0.2, 0.3):
        full = robot(mu)
        end = force_for_bent(full)
        rows.append((mu, f"{rmse(robot(mu, 'dead', small=True), full, end):.1f}"))
    return {
        "frictionless": f"{rmse(robot(0.0), robot(0.2315), 9.396):.2f}",
        "small": table(("μ", "small against large deflection, RMSE, deg"), rows),
    }


def one_strip() -> dict[str, str]:
    """A single strip, in closed form, where its chord has turned by a seventh of 58 deg."""
    stiffness, length, wanted = 1000.406 * 1.125, 8.0, BENT / 7

    def chord(force: float) -> float:
        return float(nf.elastica(force, length, stiffness).chord_angle)

    low, high = 0.0, 20.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if chord(middle) < wanted else (low, middle)
    linear = np.arctan(low * length**2 / (3.0 * stiffness))
    slope = low * length**2 / (2.0 * stiffness)
    return {
        "seventh": f"{np.degrees(wanted):.1f}",
        "seventh_small": f"{np.degrees(linear - wanted):.2f}",
        "seventh_slope": f"{np.degrees(7.0 * slope) - 58.0:.0f}",
        "stiffness": f"{stiffness:.3f}",
        "tube": f"{np.pi * (10.0**4 - 6.0**4) / 64:.0f}",
    }


def limits() -> dict[str, str]:
    """What happens up to 40 N, far beyond the paper's test."""
    far = np.linspace(0.0, 40.0, STEPS + 1)[1:]
    along, dead = pulled(robot(0.0), far), pulled(robot(0.0, "dead"), far)
    shut = int(np.argmax(dead.closed[:, 0]))
    return {
        "open_gap": f"{along.gap[-1].min():.2f}",
        "shut_from": f"{far[shut - 1]:.1f}",
        "shut_to": f"{far[shut]:.1f}",
        "shut_force": f"{dead.contact_force[-1, 0]:.1f}",
    }


if __name__ == "__main__":
    main(PAGE, numbers)
