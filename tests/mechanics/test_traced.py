"""The assembly of a robot as JAX traces it: the arrays of plain numbers, and exact slopes."""

from __future__ import annotations

import math

import jax
import numpy as np
import pytest

import notchflex as nf
from notchflex._arrays import Decisions
from notchflex.mechanics.chain import assemble
from notchflex.robot.part import unchecked

NITINOL = {"kind": "nitinol", "elastic_modulus": 36e3, "plateau_stress": 350.0,
           "plateau_modulus": 6e3}  # fmt: skip
LONG = pytest.mark.nightly
SPACE = {"level": "space", "loaded": True, "flat": False}


def robots():
    """Robots of every kind of notch, by name; those with rings take XLA minutes to compile."""
    wrist, links, strips = map(nf.load_robot, ("pacheco2021-a", "gao2017", "liu2022"))
    return {
        "wrist": wrist,
        "off-axis": wrist.with_value("notch.cut", "off-axis"),
        "nitinol": wrist.replace(material=NITINOL),
        "two axes": nf.load_robot("two-axis-wrist"),
        "links": links,
        "strips": strips,
        "elastic links": links.with_value("notch.ends", "elastic"),
        "elastic strips": strips.with_value("notch.ends", "elastic"),
    }


def parts_of(robot):
    """Parts with numbers, and their finite numbers but directions, which are of the structure."""
    parts = [robot.tube, robot.material, robot.friction, *robot.notch, *robot.tendon]
    numbers = [
        (index, key)
        for index, part in enumerate(parts)
        for key, value in vars(part).items()
        if type(value) is float and math.isfinite(value) and key != "direction_deg"
    ]
    return parts, numbers


def assembly(robot, **options):
    """The chain of a robot, its numbers, and the chain as a function of other numbers."""
    parts, numbers = parts_of(robot)

    def with_numbers(values):
        changed = list(parts)
        for (index, key), value in zip(numbers, values, strict=True):
            changed[index] = unchecked(changed[index], **{key: value})
        notches = 3 + len(robot.notch)
        return unchecked(
            robot, tube=changed[0], material=changed[1], friction=changed[2],
            notch=tuple(changed[3:notches]), tendon=tuple(changed[notches:]),
        )  # fmt: skip

    values = np.array([vars(parts[index])[key] for index, key in numbers])
    with Decisions().deciding() as example:
        chain = assemble(with_numbers(values.tolist()), **options)

    def traced(values):
        with Decisions(tuple(example.made)).deciding() as decisions:
            made = assemble(with_numbers(values), **options)
        return made, decisions.alike

    return chain, values, traced


def finite(chain):
    """All numbers of a chain, 0 for infinite ones; whole numbers have no slopes."""
    leaves = [np.asarray(leaf) for leaf in jax.tree.leaves(chain)]
    leaves = [np.zeros(leaf.shape) if leaf.dtype.kind == "V" else leaf for leaf in leaves]
    return [np.where(np.isinf(leaf), 0.0, leaf) for leaf in leaves]


CASES = [
    ("wrist", {}),
    ("strips", {}),
    ("nitinol", {}),
    *(
        pytest.param(name, SPACE, marks=LONG)
        for name in ("off-axis", "two axes", "links", "elastic links", "elastic strips")
    ),
]


@pytest.mark.parametrize(("name", "options"), CASES)
def test_arrays_and_slopes(name, options, margin):
    chain, values, traced = assembly(robots()[name], **options)
    direction = np.random.default_rng(0).uniform(-1.0, 1.0, len(values)) * np.abs(values)
    with jax.numpy_rank_promotion("allow"):
        both = jax.jit(lambda at: jax.jvp(lambda one: traced(one)[0], (at,), (direction,)))
        made, slope = both(values)
        alike = jax.jit(lambda at: traced(at)[1])(values)
        shifts = (2e-4, -2e-4, 1e-4, -1e-4)
        moved = [finite(both(values + shift * direction)[0]) for shift in shifts]
    assert all(map(bool, alike))
    errors = []
    for plain, own, along, *others in zip(*map(finite, (chain, made, slope)), *moved, strict=True):
        far, behind_far, near, behind = others
        # Central differences, of which two cancel the error of third derivatives.
        difference = (4.0 * (near - behind) / 2e-4 - (far - behind_far) / 4e-4) / 3.0
        size = np.max(np.abs(plain), initial=1e-300)
        # Arrays that are zero but for rounding have no slopes.
        largest = max(np.max(np.abs(difference), initial=0.0), 1e-3 * size, 1e-6)
        errors.append(
            [
                np.max(np.abs(off), initial=0.0)
                for off in ((own - plain) / size, (along - difference) / largest)
            ]
        )
    arrays, slopes = np.max(errors, axis=0)
    margin.within("arrays", arrays, 1e-12)
    margin.within("slopes", slopes, 1e-6)
