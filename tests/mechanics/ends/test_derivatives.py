"""The stiffness of a notch as a function of its numbers; the cache."""

from __future__ import annotations

import numpy as np
import pytest

from notchflex.mechanics.ends import notch_stiffness
from notchflex.mechanics.ring import Side

NUMBERS = np.array([0.81, 0.70, 1.4, 0.8, 0.33, 1.2, 1.0])


def stiffness(numbers, cut, boundaries):
    outer, inner, depth, height, nu, near, far = map(float, numbers)
    sides = Side(boundaries[0], near), Side(boundaries[1], far)
    return notch_stiffness(outer, inner, cut, depth, height, nu, *sides)


@pytest.mark.parametrize(
    ("cut", "boundaries"),
    [("on-axis", ("clamped", "between")), ("off-axis", ("between", "free"))],
)
def test_smooth_in_every_number(cut, boundaries, margin):
    """Slopes by differences of fourth order do not depend on the step: nothing is cut off."""

    def slope(k, part):
        step = part * NUMBERS[k] * np.eye(len(NUMBERS))[k]
        near, far = (
            np.array(stiffness(NUMBERS + s * step, cut, boundaries))
            - np.array(stiffness(NUMBERS - s * step, cut, boundaries))
            for s in (1, 2)
        )
        return (8 * near - far) / (12 * step[k])

    for k in range(len(NUMBERS)):
        scale = np.abs(stiffness(NUMBERS, cut, boundaries)) / NUMBERS[k]
        margin.within("two steps", (slope(k, 1e-4) - slope(k, 3e-4)) / scale, 1e-6)


def test_computed_once():
    first = stiffness((*NUMBERS[:6], 0.9), "on-axis", ("between", "free"))
    assert stiffness((*NUMBERS[:6], 0.9), "on-axis", ("between", "free")) is first
