"""What programs know of a chain beforehand: nothing is lost, and dimensions are no part of it."""

import numpy as np

import notchflex as nf
from notchflex.analysis.solve import prepare_for
from notchflex.loads.load_path import load_path
from notchflex.solver.programs.prepare import PreparedChain

LOADS = {
    "pacheco2021-a": nf.Load(tension=1.0),
    "gao2017": nf.Load(tension=1.0, tip_force=(0.1, 0.0, 0.0)),
    "two-axis-wrist": nf.Load(tension=[0.1], tip_force=(0.001, 0.002, 0.0)),
    "liu2022": nf.Load(tension=1.0),
}


def ready(robot: nf.Robot, load: nf.Load) -> PreparedChain:
    return prepare_for(robot, load_path(load, robot.number_of_tendons))


def test_dimensions_do_not_change_the_form() -> None:
    """Nor what is zero by chance: a straight notch, no friction."""
    load = LOADS["pacheco2021-a"]
    wrist = nf.load_robot("pacheco2021-a")
    own = ready(wrist, load).static_structure
    assert ready(nf.load_robot("pacheco2021-b-specimen"), load).static_structure is own
    for name, value in {"notch[2].depth": 1.3, "friction.coefficient": 0.0}.items():
        assert ready(wrist.with_value(name, value), load).static_structure is own


def test_rounding_does_not_change_the_form() -> None:
    links, load = nf.load_robot("gao2017"), LOADS["gao2017"]
    own = ready(links, load).static_structure
    other = {"notch.strip_thickness": 0.7003, "tube.inner_diameter": 4.0007}
    assert ready(links.with_values(other), load).static_structure is own


def test_robots_that_differ_share_few_structures() -> None:
    """Where notches point needs none of its own; which tendons end before the tip does."""
    name, sides = "shared forms", [0.0, 90.0, 180.0, 270.0]
    random = np.random.default_rng(0)
    forms = []
    for number in range(12):
        directions = random.permutation(sides) if number else np.zeros(4)
        notches = tuple(
            nf.ArcNotch("on-axis", 1.3, 1.0, uncut_length=0.6, direction_deg=side)
            for side in directions
        )
        ends = (4, *random.integers(2, 5, size=2)) if number else (4, 4, 4)
        tendons = tuple(
            nf.Tendon(0.7, side, end_body=int(end)) for side, end in zip(sides, ends, strict=False)
        )
        robot = nf.load_robot("two-axis-wrist").replace(name=name, notch=notches, tendon=tendons)
        own = ready(robot, nf.Load(tension=[0.1], tip_force=(0.001, 0.002, 0.0)))
        forms.append(own.static_structure)
        back = own.chain_layout.pack(own.static_structure.unpack(own.dynamic_vector))
        np.testing.assert_allclose(back, own.vector, rtol=0.0, atol=1e-14)
    assert len({id(one.form) for one in forms}) == 1
    assert len({id(one) for one in forms}) <= 6
