"""Strips and U-links: where bodies and openings lie, what fits together, rows that are split."""

import dataclasses
import itertools

import pytest

import notchflex as nf
from notchflex.robot import openings_along, robot_from_text, robot_text, set_values
from notchflex.robot.reading import READY
from refusals import refused

pytestmark = pytest.mark.filterwarnings("ignore::notchflex.InputWarning")  # any numbers


EXACT = 1e-12  # mm
TUBE = nf.Tube(10.0, 6.0)
STRIP = nf.StripNotch(height=3.5, strip_thickness=1.5, depth=6.9)
LINK = nf.ULink(0.275, 0.70, 2.0, "away", repeat=27)


@pytest.fixture
def gao() -> nf.Robot:
    return nf.load_robot("gao2017")


@pytest.fixture
def liu() -> nf.Robot:
    return nf.load_robot("liu2022")


def origins(robot: nf.Robot) -> list[float]:
    """Where each body's origin is on the axis of the straight robot, and last the tip [mm]."""
    at = [0.0, robot.tube.base_length]
    for notch, following in zip(robot.notches, (*robot.notches[1:], None), strict=True):
        at[-1] += notch.height  # the axis crosses the open height
        at.append(at[-1] + notch.spacing(following))
    return at


def contacts(robot: nf.Robot, direction: float) -> list[tuple[int, float, float]]:
    """Bodies that a tendon enters, where it left the one before and where it enters, along z."""
    at = origins(robot)
    before, found = 0, []
    for body, opening in openings_along(robot.notches, direction):
        following = robot.notches[before] if before < robot.number_of_notches else None
        face = robot.notches[before - 1].spacing(following) if before else robot.tube.base_length
        found.append((body, at[before] + face + opening.leaves, at[body] + opening.enters))
        before = body
    return found


def test_gao_is_35_mm_long(gao: nf.Robot):
    at = origins(gao)
    assert len(at) == 29
    assert at[-1] == pytest.approx(35.0, abs=EXACT)
    # each strip begins behind its slot, one pitch beyond the one before
    assert at[1:28] == pytest.approx([0.35 + 0.55 + 1.25 * j for j in range(27)], abs=EXACT)


def test_gao_left_tendon(gao: nf.Robot):
    found = contacts(gao, 0.0)
    assert [body for body, *_ in found] == [*range(2, 27, 2), 27]
    # L_i is slot 2 i: it lies behind 2 i - 1 slots and as many strips
    slots = [0.35 + 1.25 * (2 * i - 1) for i in range(1, 15)]
    assert [low for _, low, _ in found] == pytest.approx(slots, abs=EXACT)
    assert [high for *_, high in found] == pytest.approx([z + 0.55 for z in slots], abs=EXACT)
    # RL pieces are 2 (r_c + l_s) high, from P_2i to P_2i+1; the upper edges are two pitches apart
    pieces = [low - high for (*_, high), (_, low, _) in itertools.pairwise(found)]
    assert pieces == pytest.approx([2 * (0.275 + 0.70)] * 13, abs=EXACT)
    # 27 contacts with friction: one at the base, two on each of RL_1 ... RL_13
    assert 1 + 2 * len(pieces) == 27


@pytest.mark.parametrize("number", [1, 2, 3, 4])
@pytest.mark.parametrize("first", ["away", "toward"])
def test_a_row_opens_each_side_in_turn(number: int, first: str):
    row = dataclasses.replace(LINK, proximal_slot=first, repeat=number, direction_deg=90.0)
    tendon = nf.Tendon(2.5, direction_deg=90.0, path="straight")
    robot = nf.Robot("r", TUBE, (row,), (tendon,), nf.Linear(1.0), nf.Corner(0.1))
    low = [low for side in (90.0, -90.0) for _, low, _ in contacts(robot, side)]
    assert sorted(low) == pytest.approx([1.25 * i for i in range(number + 1)], abs=EXACT)
    start = contacts(robot, 90.0 if first == "toward" else -90.0)[0]
    assert start == (1, 0.0, pytest.approx(0.55, abs=EXACT))


def test_a_row_of_uneven_strips_keeps_its_edges(gao: nf.Robot):
    robot = gao.with_values({"notch[4].strip_thickness": 0.9, "notch[5].strip_thickness": 0.5})
    high = 0.0
    for side in (0.0, 180.0):
        for _, low, high in contacts(robot, side):  # a slot stays a slot
            assert high - low == pytest.approx(0.55, abs=EXACT)
    assert high < origins(robot)[-1] == pytest.approx(35.0, abs=EXACT)


def test_a_row_between_other_notches():
    arc = nf.ArcNotch("on-axis", depth=8.0, height=1.0, uncut_length=0.5)
    row = dataclasses.replace(LINK, repeat=2, uncut_length=0.4)
    tendon = nf.Tendon(4.0, path="straight")
    robot = nf.Robot("r", TUBE, (arc, row, arc), (tendon,), nf.Linear(1.0), nf.Corner(0.1))
    assert origins(robot)[-1] == pytest.approx(1.5 + 2 * 0.7 + 3 * 0.55 + 0.4 + 1.5, abs=EXACT)
    left = [(1, 0.0, 1.0), (3, 2.75, 3.3), (4, pytest.approx(4.95), pytest.approx(5.95))]
    assert [body for body, *_ in contacts(robot, 0.0)] == [1, 3, 4]
    for found, wanted in zip(contacts(robot, 0.0), left, strict=True):
        assert found == pytest.approx(wanted, abs=EXACT)
    assert [body for body, *_ in contacts(robot, 180.0)] == [1, 2, 3, 4]


def test_liu_is_35_mm_long(liu: nf.Robot):
    at = origins(liu)
    assert at == pytest.approx([0.0, *(3.5 + 5.0 * i for i in range(7)), 35.0], abs=EXACT)
    toward, away = contacts(liu, 20.0), contacts(liu, 200.0)
    assert [body for body, *_ in toward] == [body for body, *_ in away] == list(range(1, 8))
    for i in range(7):
        # Q is on the body before, P level with the strip, H beyond it; on the other side the
        # second notch of the pair begins there
        assert toward[i][1:] == pytest.approx((5.0 * i, 5.0 * i + 3.5), abs=EXACT)
        assert away[i][1:] == pytest.approx((5.0 * i + 3.5, 5.0 * i + 7.0), abs=EXACT)


@pytest.mark.parametrize("number", [1, 2, 3, 4, 26, 27])
def test_a_split_row_goes_on_alternating(gao: nf.Robot, number: int):
    new = gao.with_value(f"notch[{number}].strip_thickness", 0.6)
    assert [n.proximal_slot for n in new.notches] == [n.proximal_slot for n in gao.notches]
    assert [n.strip_thickness != 0.7 for n in new.notches].index(True) == number - 1
    assert len(new.notch) == (2 if number in (1, 27) else 3)
    again = new.with_value("notch[9].strip_length", 1.9)
    assert [n.proximal_slot for n in again.notches] == [n.proximal_slot for n in gao.notches]
    # saved with the comments of its file, and bare
    source = (READY / "gao2017.toml").read_text()
    for text in (robot_text(again, source), robot_text(again, "")):
        assert robot_from_text(text) == again


def test_splitting_and_setting_all_go_together(gao: nf.Robot):
    values = [("notch[2].strip_length", 1.9), ("notch.proximal_slot", "toward")]
    one, two = (set_values(gao, order).robot for order in (values, values[::-1]))
    assert one == two
    assert [n.proximal_slot for n in one.notches][:4] == ["toward", "away", "toward", "away"]
    assert [n.strip_length for n in one.notches][:3] == [2.0, 1.9, 2.0]


def test_a_kind_that_lacks_keys_is_told_even_where_a_row_is_split():
    wrist = nf.load_robot("pacheco2021-a")
    with refused("INVALID_ROBOT", "`notch[1].slot_radius`"):
        wrist.with_values({"notch.kind": "u-link", "notch[2].uncut_length": 1.0})


SENTENCES = [
    # robot, path, value, what the one sentence must hold
    ("liu2022", "notch.depth", 5.0, ["`notch[1].depth` is 5.0 mm", "outer radius, 5.0 mm"]),
    ("liu2022", "notch[3].depth", 4.0, ["`notch[3].depth` is 4.0 mm"]),
    ("liu2022", "notch.precurvature_deg", 2, ["`notch[1].precurvature_deg`", "must be 0"]),
    ("liu2022", "tendon.path", "wall-arc", ["`tendon[1].path`", '"straight-follower"']),
    ("liu2022", "tendon[2].direction_deg", 90, ["`tendon[2].direction_deg`", "within 60 deg"]),
    ("liu2022", "notch[4].direction_deg", 90, ["`tendon[1].direction_deg`", "toward 90.0 deg"]),
    ("gao2017", "notch.strip_length", 4.92, ["`notch[1].strip_length`", "less than the outer"]),
    ("gao2017", "notch[3].slot_radius", 0.3, ["`notch[3].slot_radius`", "before it, 0.275 mm"]),
    ("gao2017", "notch[27].direction_deg", 9, ["`notch[27].direction_deg`", "before it, 0.0 deg"]),
    ("gao2017", "notch[4].proximal_slot", "away", ["`notch[4].proximal_slot`", 'be "toward"']),
    ("liu2022", "notch.strip_length", 50.0, ["strip_length", "outer diameter, 10.0 mm"]),
    ("liu2022", "notch.strip_thickness", 20.0, ["thinner than it is long"]),
    ("gao2017", "tendon.radius", 1.0, ["`tendon[1].radius`", "half the strip length, 1.0 mm"]),
    ("gao2017", "tendon.direction_deg", 70, ["`tendon[1].radius`", "2.5 mm at 70.0 deg"]),
    ("gao2017", "tendon.end_body", 3, ["`tendon[1].end_body` is 3", "the bodies 2 and 4 "]),
]


@pytest.mark.parametrize(("name", "path", "value", "wanted"), SENTENCES)
def test_one_clear_sentence(name: str, path: str, value: object, wanted: list[str]):
    robot = nf.load_robot(name)
    with pytest.raises(nf.InputError) as caught:
        # the second tendon would say the same as the first
        robot.replace(tendon=robot.tendon[: 2 if "tendon[2]" in path else 1]).with_value(
            path, value
        )
    message = str(caught.value)
    assert len(message.splitlines()) == 1
    for words in wanted:
        assert words in message


@pytest.mark.parametrize(
    ("name", "path", "value"),
    [
        ("liu2022", "tendon.direction_deg", 59.0),
        ("gao2017", "notch.strip_length", 4.91),
        ("gao2017", "notch.direction_deg", 30.0),
        ("gao2017", "tendon.radius", 1.001),
        ("gao2017", "tendon.end_body", 4),
    ],
)
def test_what_is_allowed(name: str, path: str, value: object):
    nf.load_robot(name).with_value(path, value)


def test_a_tendon_that_ends_before_a_strip_need_not_fit_it():
    arc = nf.ArcNotch("on-axis", depth=8.0, height=1.0, uncut_length=0.5)
    tendon = nf.Tendon(4.0, path="wall-arc", end_body=1)
    parts = {"name": "r", "tube": TUBE, "material": nf.Linear(1.0), "friction": nf.Corner(0.1)}
    nf.Robot(notch=(arc, STRIP), tendon=(tendon,), **parts)
    with refused("INVALID_ROBOT", "`tendon[1].path`"):
        nf.Robot(notch=(arc, STRIP), tendon=(nf.Tendon(4.0),), **parts)


def test_problems_behind_a_row_count_its_links(gao: nf.Robot):
    with refused("INVALID_ROBOT", "`notch[28].depth`", "2.0 mm"):
        gao.replace(notch=(*gao.notch, dataclasses.replace(STRIP, depth=2.0)))
    with refused("INVALID_ROBOT", "`notch`", "10000"):
        gao.replace(notch=(dataclasses.replace(LINK, repeat=9_000),) * 2)
