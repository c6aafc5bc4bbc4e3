"""Numbers of the page on Gao et al. 2017: `python docs/papers/numbers_gao2017.py` rewrites it."""

from __future__ import annotations

import numpy as np
from page import main, table

import notchflex as nf

PAGE = "gao2017.md"
PULLED = 14  # steps of 1 N from 0 to 13 N, and as many back


def numbers() -> dict[str, str]:
    """Return every number of the page."""
    path = nf.simulate(nf.load_robot("gao2017"), nf.pull(0.0, 13.0, PULLED).release())
    return {**geometry(), **pulled(path.raise_if_failed())}


def geometry() -> dict[str, str]:
    """What follows from the estimated dimensions."""
    notch = nf.load_robot("gao2017").notches[0]
    r_c, l_s = notch.slot_radius, notch.strip_thickness
    end = 0.5 * (-r_c + np.sqrt(r_c**2 + 2.0 * np.pi * r_c * (r_c + l_s)))
    alpha = np.arctan((r_c + l_s) / end)
    pitch = 2.0 * r_c + l_s
    return {
        "d_e": f"{end:.4f}",
        "alpha": f"{np.degrees(alpha):.2f}",
        "pitch": f"{pitch:.2f}",
        "length": f"{28 * pitch:.1f}",
        "span": f"{notch.strip_length + 2.0 * (0.5 * end + r_c):.3f}",
        "shut": f"{np.degrees(2.0 * r_c / 2.995):.1f}",
    }


def pulled(path: nf.EquilibriumPath) -> dict[str, str]:
    """The free bending to 13 N and back."""
    top, down = path[PULLED - 1], range(PULLED, 2 * PULLED)
    tension, angle = top.span_tension[0], np.degrees(top.notch_angle)
    m, eta = path.front
    rows = []
    for step in down:
        all_turned = np.isnan(eta[step, 0])
        part = "all reversed" if all_turned else f"{eta[step, 0]:.3f}"
        front = "beyond the last" if all_turned else str(m[step, 0])
        rows.append(
            (
                f"{path.tension[step, 0]:.0f}",
                f"{abs(np.degrees(path.total_angle[step])):.2f}",
                front,
                part,
            )
        )
    total = np.degrees(path.total_angle)
    loop = total[PULLED:][::-1] - total[:PULLED]
    return {
        "tip": f"({-top.tip_position[0]:.3f}, {top.tip_position[2]:.3f})",
        "angle": f"{np.degrees(top.total_angle):.2f}",
        "ratio": f"{tension[0] / tension[-1]:.2f}",
        "first_joint": f"{angle[0]:.2f}",
        "last_joint": f"{angle[-1]:.2f}",
        "front": table(("N, unloading", "tip angle, deg", "front at contact m", "η"), rows),
        "loop": f"{loop.max():.1f}",
        "loop_at": f"{path.tension[int(np.argmax(loop)), 0]:.0f}",
        "left": f"{abs(total[-1]):.1f}",
    }


if __name__ == "__main__":
    main(PAGE, numbers)
