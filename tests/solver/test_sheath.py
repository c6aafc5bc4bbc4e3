"""A wire in its sheath against closed forms, against many contacts, and against the energy.

The closed forms are those of Euler's rope with T(x) = T0 exp(-+ mu Theta x / L). Away from them the
profile of ln T after a history of tensions of the drive is computed anew, as the play operator of
every place on a fine grid. `sheath_chain.py` is a chain of contacts with elastic wire between.
"""

from __future__ import annotations

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import notchflex as nf
from loads import strokes, tensions
from robots import ready
from sheath_chain import ChainOfContacts

FRICTION, LENGTH, BEND = 0.15, 1000.0, 180.0
STIFFNESS = 200e3 * np.pi / 4.0 * 0.3**2  # steel wire of 0.3 mm, N
LIMIT = FRICTION * np.radians(BEND)
FIGURE = 1e-9


def sheathed(robot: nf.Robot | None = None, **values: float) -> nf.Robot:
    """Return a robot, wrist A if none is given, behind a sheath."""
    sheath = {
        "sheath_length": LENGTH,
        "sheath_friction": FRICTION,
        "sheath_bend_deg": BEND,
        "sheath_wire_stiffness": STIFFNESS,
    }
    named = {f"tendon.{name}": value for name, value in (sheath | values).items()}
    return (robot or ready("a")).with_values(named)


def follow(robot: nf.Robot, loads) -> nf.EquilibriumPath:
    path = nf.simulate(robot, loads)
    assert path.converged.all(), [reason for reason in path.reason if reason]
    return path


def elastic(path: nf.EquilibriumPath) -> np.ndarray:
    return (path.stroke - path.base_stroke)[:, 0]


def profiles(drive: list[float], limit: float = LIMIT) -> np.ndarray:
    """Return ln T on a grid after every tension of a history: the play operator of each place."""
    place, level, rows = np.linspace(0.0, 1.0, 100_001), np.full(100_001, -300.0), []
    for tension in drive:
        level = np.clip(level, np.log(tension) - limit * place, np.log(tension) + limit * place)
        rows.append(level)
    return np.array(rows)


def test_the_figures_of_a_steel_wire(margin):
    loss = np.exp(-LIMIT)
    turn = 5.0 * loss**2
    path = follow(sheathed(), tensions([5.0, turn * (1.0 + 1e-12), 0.9 * turn]))
    base, stretch = path.base_tension[:, 0], elastic(path)
    pulled = 5.0 * LENGTH / STIFFNESS * (1.0 - loss) / LIMIT
    turned = turn * LENGTH / STIFFNESS * (1.0 / loss - 1.0) / LIMIT
    margin.within("tension over the sheath", base[0] / 5.0 - loss, FIGURE)
    margin.within("base while the drive turns", base[1] - base[0], FIGURE, "N")
    margin.within("base beyond", base[2] / (0.9 * turn) - 1.0 / loss, FIGURE)
    margin.within("stretch", stretch[0] - pulled, FIGURE, "mm")
    margin.within("dead stroke", path.stroke[0] - path.stroke[1] - (pulled - turned), FIGURE, "mm")
    figures = [base[0] / 5.0, turn / 5.0, stretch[0], pulled - turned]
    assert np.round(figures, 4).tolist() == [0.6242, 0.3897, 0.2820, 0.1060]


def test_the_tip_stands_until_the_front_has_passed():
    turn = 1.5 * np.exp(-2.0 * LIMIT)
    path = follow(sheathed(), tensions([1.5, 1.001 * turn, 0.99 * turn, 0.95 * turn]))
    angle = path.total_angle
    assert abs(angle[1] - angle[0]) < 1e-12
    assert angle[3] < angle[2] - 1e-4


HISTORIES = {
    "one loop": [0.4, 1.2, 0.8, 0.3, 0.2, 0.6, 1.1, 1.3],
    "loops within loops": [1.5, 0.9, 1.3, 1.0, 1.25, 1.05, 1.2, 1.1, 1.18, 1.12, 1.4, 1.6],
    "long after the front has passed": [1.0, 0.1, 0.05, 0.7, 1.5, 0.02, 1.0],
}


@pytest.mark.parametrize("name", HISTORIES)
def test_partial_loops(name, margin):
    drive = HISTORIES[name]
    path = follow(sheathed(), tensions(drive))
    rows = profiles(drive)
    place = np.linspace(0.0, 1.0, rows.shape[1])
    stretch = np.trapezoid(np.exp(rows), place, axis=1) * LENGTH / STIFFNESS
    margin.within(f"{name}: base", path.base_tension[:, 0] - np.exp(rows[:, -1]), FIGURE, "N")
    margin.within(f"{name}: stretch", elastic(path) - stretch, FIGURE, "mm")


@pytest.mark.parametrize("name", HISTORIES)
def test_strokes_return_the_tensions(name, margin):
    robot = sheathed(backlash=0.05)
    by_tension = follow(robot, tensions(HISTORIES[name]))
    by_stroke = follow(robot, strokes(by_tension.stroke))
    difference = by_stroke.base_tension - by_tension.base_tension
    margin.within(f"{name}: base", difference, FIGURE, "N")
    # A front that has only begun is stiff in the tension: the stroke falls with its square.
    margin.within(f"{name}: drive", by_stroke.tension - by_tension.tension, FIGURE, "N")


def test_a_stiff_wire_that_slides_all_along_holds_the_tension_of_the_drive(margin):
    """Near there the stroke changes with its square: rounding of strokes would tell its root."""
    ways = [0.2, 0.4, 0.6, 0.8, 1.0, 0.7, 0.5, 0.3]
    path = follow(sheathed(sheath_wire_stiffness=1e9), strokes(ways))
    fall = np.log(path.tension / path.base_tension)[:, 0]
    margin.within("friction", fall - LIMIT * np.sign(np.diff(ways, prepend=0.0)), 1e-13)


def test_a_tendon_beside_one_in_a_sheath_has_the_same_derivatives(margin):
    """Its drive has the tension of its base, and the slopes of that."""
    plain = ready("a").tendon[0]
    opposite = dataclasses.replace(plain, direction_deg=plain.direction_deg + 180.0)
    pair = ready("a").replace(tendon=(plain, opposite))
    beside = sheathed(pair).replace(tendon=(plain, sheathed(pair).tendon[1]))
    loads = [nf.Load(stroke=(stroke, None), tension=(None, 0.2)) for stroke in (0.5, 0.6)]
    slopes = follow(beside, loads).jacobian(("notch.depth",), ("tension", "base_tension"))
    at_drive, at_base = (slopes[name][:, 0] for name in ("tension", "base_tension"))
    assert np.abs(at_base).min() > 1.0
    margin.within("by depth", at_drive - at_base, 1e-12, "N/mm")


def test_more_reversals_than_corners_forget_the_least(margin):
    swing = 0.4 * 0.8 ** np.arange(40.0)
    drive = (1.0 + swing * (-1.0) ** np.arange(40)).tolist()
    path, rows = follow(sheathed(), tensions(drive)), profiles(drive)
    stretch = np.trapezoid(np.exp(rows), np.linspace(0.0, 1.0, rows.shape[1]), axis=1)
    error = elastic(path) - stretch * LENGTH / STIFFNESS
    margin.within("stretch with 40 reversals", error, 1e-4, "mm")
    assert np.abs(error).max() > 1e-9, "nothing was forgotten"


def test_backlash(margin):
    play = 0.2
    robot, plain = sheathed(backlash=play), sheathed()
    path = follow(robot, strokes([1.0, 0.9, 0.8, 0.75, 0.9, 1.0, 1.05]))
    margin.within("tension within the play", path.tension[:3] - path.tension[0], 1e-7, "N")
    same = follow(plain, strokes([1.0, 0.95, 1.05]))
    # After 0.75, 0.05 mm beyond the play, the wire waits for the drive up to 0.95.
    margin.within("beyond the play", path.tension[[0, 3]] - same.tension[[0, 1]], 1e-7, "N")
    margin.within("back within", path.tension[4] - path.tension[3], 1e-7, "N")
    margin.within("back beyond", path.base_tension[6] - same.base_tension[2], FIGURE, "N")
    pulled = follow(robot, tensions([1.0, 0.9, 1.1]))
    without = follow(plain, tensions([1.0, 0.9, 1.1]))
    lost = (without.stroke - pulled.stroke)[:, 0]
    margin.within("way of the drive under tension", lost - [0.0, play, 0.0], FIGURE, "mm")


LOOPS = {
    "up and down": [0.4, 1.0, 0.4],
    "down and up": [1.0, 0.4, 1.0],
    "loop within a loop": [0.4, 1.0, 0.6, 0.8, 0.63, 0.9, 0.4],
}


def legs_of(turns: list[float], steps: int = 40) -> np.ndarray:
    legs = [np.linspace(a, b, steps + 1)[1:] for a, b in pairwise(turns)]
    return np.concatenate([turns[:1], *legs])


@pytest.mark.parametrize("friction", [0.0, FRICTION])
@pytest.mark.parametrize("name", LOOPS)
def test_the_drive_works_for_friction_alone(name, friction, margin):
    # Within the backlash the wire's end stays where it is, and no work is done: over a closed loop
    # the drive's work is what friction has taken, that of the same way of the wire alone.
    play, wire, ways = 0.05, 0.0, list[float]()
    twice = np.concatenate([legs_of(LOOPS[name]), legs_of(LOOPS[name])[1:]])
    for drive in twice:
        wire = min(max(wire, drive), drive + play)
        ways.append(wire)
    path = follow(sheathed(sheath_friction=friction, backlash=play), strokes(twice))
    same = follow(sheathed(sheath_friction=friction), strokes(ways))
    margin.within("tension", path.tension - same.tension, 1e-6, "N")
    margin.within("work", path.tendon_work - same.tendon_work, 1e-7, "N mm")
    work, stored = path.tendon_work[:, 0], path.stored_energy
    begin = len(path) // 2  # the second loop returns to where it began
    margin.within("closed", stored[-1] - stored[begin], 1e-9, "N mm")
    in_wrist = path.dissipation[:, 0].sum(axis=-1)
    in_sheath = work - stored - in_wrist
    assert work[-1] - work[begin] > in_wrist[-1] - in_wrist[begin] - 1e-9 > 0.005
    if friction:
        # By the trapezoid rule a step in which a front begins seems to give a little.
        assert np.diff(in_sheath).min() > -3e-4
        assert in_sheath[-1] - in_sheath[begin] > 0.1
    else:
        margin.within("in the sheath", in_sheath, 1e-9, "N mm")


@pytest.mark.parametrize("turns", [[0.3, 1.2, 0.3], [1.2, 0.3, 1.2], [0.3, 1.2, 0.7, 1.0, 0.3]])
def test_under_tension_a_backlash_takes_and_gives_no_work(turns, margin):
    loads = tensions(legs_of([*turns, *turns[1:]], 12).tolist())
    path, plain = (follow(sheathed(backlash=play), loads) for play in (0.05, 0.0))
    margin.within("work", path.tendon_work - plain.tendon_work, 1e-12, "N mm")
    assert np.abs(path.stroke - plain.stroke).max() == pytest.approx(0.05, abs=1e-12)


# A history in which the drive and a force at the tip take turns.
PULLED = [0.2, 0.8, 0.7, 0.6, 0.6, 0.6, 0.65, 0.75, 0.75, 0.75, 0.5, 0.45]
PUSHED = [0.0, 0.0, 0.0, 0.0, 0.02, 0.08, 0.08, 0.08, 0.0, -0.05, -0.05, -0.05]
PARTS = 12


def chain_of(contacts: int, strokes_at) -> tuple[ChainOfContacts, np.ndarray]:
    """Follow that history by a chain of contacts, every step in parts; rows of base and stroke."""
    chain, rows = ChainOfContacts(contacts, LIMIT, LENGTH / STIFFNESS), []
    before = PULLED[0], PUSHED[0]
    for after in zip(PULLED, PUSHED, strict=True):
        for part in np.arange(1, PARTS + 1) / PARTS:
            between = [strokes_at[push] for push in (before[1], after[1])]
            chain.set_tension(
                before[0] * (after[0] / before[0]) ** part,
                lambda tension, part=part, between=between: float(
                    (1.0 - part) * between[0](tension) + part * between[1](tension)
                ),
            )
        rows.append((chain.tension, chain.stroke))
        before = after
    return chain, np.array(rows)


def test_one_sheath_is_the_limit_of_many_contacts(margin):
    # Drive and tip pull in turn: fronts start from both ends.
    plain = ready("a").with_values({"friction.kind": "frictionless", "material.kind": "linear"})

    def loads(tension, force) -> list[nf.Load]:
        pairs = np.broadcast(tension, force)
        return [nf.Load(tension=float(t), tip_force=(-float(f), 0.0, 0.0)) for t, f in pairs]

    grid, strokes_at = np.linspace(0.01, 1.2, 160), {}
    for push in set(PUSHED):
        states = nf.solve_each(plain, loads(grid, push))
        strokes_at[push] = CubicSpline(grid, states.stroke[:, 0])
    path = follow(sheathed(plain), loads(PULLED, PUSHED))
    found = np.stack([path.base_tension[:, 0], path.stroke[:, 0]], axis=1)
    errors = {}
    for contacts in (50, 200):
        _, rows = chain_of(contacts, strokes_at)
        errors[contacts] = np.abs(rows / found - 1.0).max()
        margin.note(f"{contacts} contacts: {errors[contacts]:.2e}")
    margin.within("200 contacts", errors[200], 5e-6)
    assert errors[50] > 3.0 * errors[200], "not of first order in the number"


def test_a_stuck_wire_gives_way_by_its_stretch_alone(margin):
    """A force at the tip draws a soft tendon: beyond the front from the base nothing moves."""
    plain = ready("a").with_values({"friction.kind": "frictionless", "material.kind": "linear"})
    robot = sheathed(plain, axial_stiffness=50.0)
    loads = [nf.Load(tension=0.8, tip_force=(-force, 0.0, 0.0)) for force in (0.0, 0.03)]
    path = follow(robot, loads)
    base, place = path.base_tension[:, 0], np.linspace(0.0, 1.0, 100_001)
    before = np.log(0.8) - LIMIT * place
    after = np.maximum(before, np.log(base[1]) - LIMIT * (1.0 - place))
    assert base[1] > 1.02 * base[0]
    assert after[1000] == before[1000]
    stretch = LENGTH / STIFFNESS * np.trapezoid(np.exp(after) - np.exp(before), place)
    margin.note(f"stretch {stretch:.3e} mm")
    margin.within("way of the wire", np.diff(path.base_stroke[:, 0])[0] + stretch, FIGURE, "mm")


def test_the_energy_balances(margin):
    # Work of the drive = stored + turned to heat in the wrist + in the sheath, that of a
    # chain of contacts with the same history.
    turns = [1.2, 0.3, 0.9, 0.5, 1.1, 0.05]
    legs = [np.linspace(a, b, 60)[1:] for a, b in zip([0.01, *turns], turns, strict=False)]
    drive = np.concatenate([[0.01], *legs])
    path = follow(sheathed(), tensions(drive))
    tendon = CubicSpline(np.arange(len(drive)), path.base_stroke[:, 0])
    chain = ChainOfContacts(200, LIMIT, LENGTH / STIFFNESS)
    for step, tension in enumerate(drive):
        # The wrist as it was found: at its tension its stroke, elsewhere stiff.
        here, stroke = path.base_tension[step, 0], float(tendon(step))
        chain.set_tension(tension, lambda t, here=here, stroke=stroke: stroke + 10.0 * (t - here))
    span, slid = path.span_tension[:, 0], path.contact_slid[:, 0]
    wrist = np.trapezoid(span[:, :-1] - span[:, 1:], slid, axis=0).sum()
    work = np.trapezoid(path.tension[:, 0], path.stroke[:, 0])
    change = path.stored_energy[-1] - path.stored_energy[0]
    margin.note(f"work {work:.4f}, wrist {wrist:.4f}, sheath {chain.dissipated:.4f} N mm")
    margin.within("balance", (work - change - wrist - chain.dissipated) / work, 5e-4)
    assert min(wrist, chain.dissipated) > 0.05 * work


def test_a_sheath_that_is_bent_more_or_less(margin):
    # More bend holds what is there; less lets the wire slide.
    loads = [nf.Load(tension=1.0, sheath_bend_deg=bend) for bend in (90.0, 270.0, 45.0)]
    loads.append(nf.Load(tension=1.0))
    path = follow(sheathed(), loads)
    expected = np.exp(-FRICTION * np.radians([90.0, 90.0, 45.0, 45.0]))
    margin.within("base", path.base_tension[:, 0] - expected, FIGURE, "N")
    stiff = 1.0 / STIFFNESS + 1.0 / 5e4
    short = follow(sheathed(sheath_friction=0.0, sheath_stiffness=5e4), tensions([1.0]))
    margin.within("compressed sheath", elastic(short) - LENGTH * stiff, FIGURE, "mm")


def test_a_small_way_before_less_bend_stays_small():
    """The front of a way u is as long as its root; a shift of the whole line would be one more."""
    robot = sheathed(sheath_length=140.0, sheath_wire_stiffness=1420.0, sheath_friction=0.14)
    ways = np.array([0.0, 1e-9, 1e-7])
    ends = []
    for way in ways:
        turns = (0.6, 10.0), (0.6, 460.0), (0.6 + way, 460.0), (0.6 + way, 180.0), (0.6 + way, 20.0)
        loads = [nf.Load(stroke=stroke, sheath_bend_deg=bend) for stroke, bend in turns]
        path = follow(robot, loads)
        ends.append((path.tension[-1, 0], path.base_tension[-1, 0]))
    drive, base = np.abs(np.array(ends) - ends[0]).T
    assert (base < 1e-9).all()
    assert (drive <= np.sqrt(ways)).all()


def test_states_and_batches_know_the_sheath(tmp_path, margin):
    robot, drive = sheathed(backlash=0.02), [1.2, 0.6, 0.9, 0.7, 1.0, 0.2]
    path = follow(robot, tensions(drive))
    path[2].state.save(tmp_path / "state.json")
    state = nf.State.load(tmp_path / "state.json")
    rest = nf.simulate(robot, tensions(drive[3:]), from_state=state)
    for name in ("tension", "stroke", "base_tension", "total_angle"):
        np.testing.assert_array_equal(getattr(rest, name), getattr(path, name)[3:], name)
    rows = nf.batch(
        robot,
        {"tendon.sheath_friction": [0.1, 0.15]},
        tensions(drive),
        outputs=("stroke", "base_tension", "total_angle", "tendon_work"),
    )
    nf.save_path(rest, tmp_path / "rest.json")
    read = nf.read_path(tmp_path / "rest.json")
    np.testing.assert_array_equal(read.tendon_work, rest.tendon_work)
    for name in ("stroke", "base_tension", "total_angle", "tendon_work"):
        margin.within(f"batch, {name}", rows[name][1] - getattr(path, name), 1e-9)
    stepper = nf.Stepper(robot, ("stroke", "total_angle"))
    step_state = stepper.rest()
    for number, tension in enumerate(drive):
        step = stepper.step(step_state, [tension])
        step_state = step.state
        np.testing.assert_array_equal(step.values["stroke"], path.stroke[number])
        assert stepper.drives_of(step_state) == tension
    low, high = stepper.dead_band(step_state)[0]
    ends = [stepper.step(step_state, [side]).values for side in (1.01 * low, 0.99 * high)]
    beyond = [stepper.step(step_state, [side]).values for side in (0.99 * low, 1.01 * high)]
    here = path.total_angle[-1]
    assert max(abs(end["total_angle"] - here) for end in ends) < 1e-9
    assert min(abs(end["total_angle"] - here) for end in beyond) > 1e-5


NUMBERS = (
    "friction.coefficient",
    "tendon.sheath_friction",
    "tendon.sheath_bend_deg",
    "tendon.sheath_wire_stiffness",
    "tendon.sheath_length",
    "notch.depth",
)


@pytest.mark.parametrize(("kind", "values"), [
    ("tension", [0.5, 1.2, 1.0, 0.6, 0.4, 0.7, 0.9]),
    ("stroke", [0.3, 1.0, 0.97, 0.9, 0.8, 0.85, 0.95]),
])  # fmt: skip
def test_derivatives(kind, values, margin):
    robot, loads = sheathed(), (tensions if kind == "tension" else strokes)(values)
    asked = ("total_angle", "base_tension", "stroke" if kind == "tension" else "tension")
    path = follow(robot, loads)
    slopes = path.jacobian(NUMBERS, asked)
    from notchflex.robot.value_names import number_at

    for column, name in enumerate(NUMBERS):
        value = number_at(robot, name)
        step = 1e-5 * value
        ends = [follow(robot.with_value(name, value + side * step), loads) for side in (1, -1)]
        for output in asked:
            difference = (getattr(ends[0], output) - getattr(ends[1], output)) / (2.0 * step)
            found = slopes[output][..., column].reshape(difference.shape)
            scale = np.abs(difference).max() + 1e-2 * np.abs(getattr(path, output)).max() / value
            margin.within(f"{kind}: {output} by {name}", (found - difference) / scale, 2e-6)
    weights = {"total_angle": np.ones(len(values)), asked[2]: np.ones((len(values), 1))}
    gradient = path.gradient(weights).by(NUMBERS)
    summed = slopes["total_angle"].sum(axis=0) + slopes[asked[2]].sum(axis=(0, 1))
    margin.within(f"{kind}: adjoint", gradient / summed - 1.0, 1e-9)


def test_a_robot_without_a_sheath_has_no_quantities_of_it():
    path = follow(ready("a"), tensions([1.0]))
    assert np.isnan(path.base_tension).all()
    assert not {"base_tension_N", "base_stroke_mm"} & path[0].to_dict().keys()


@pytest.mark.parametrize(("values", "words"), [
    ({"sheath_wire_stiffness": None}, "is missing; give E A of the wire"),
    ({"sheath_length": None}, "needs a sheath; give sheath_length"),
    ({"sheath_friction": -0.1}, "at least 0"),
    ({"sheath_friction": 1000.0}, "at most 10"),
    ({"sheath_length": 0.0}, "greater than 0"),
])  # fmt: skip
def test_what_is_refused(values, words):
    with pytest.raises(nf.InputError, match=words):
        sheathed(**values)
