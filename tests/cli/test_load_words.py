"""External loads in the head of the table."""

from notchflex.cli.path_table import load_sentences
from notchflex.loads.load import NOTHING, BodyForce, ExternalLoad
from notchflex.loads.load_path import external_words

PUSH = ExternalLoad(tip_force=(0.0, 0.0, -0.2), tip_point=(0.0, 0.0, 1.5))


def _words(load):
    return ", ".join(external_words(load))


def test_nothing_is_said_of_nothing():
    assert load_sentences(NOTHING) == []


def test_every_load_is_named_with_its_unit():
    side = BodyForce(3, (0.1, 0, 0), moment=(0, 2, 0), point=(0.8, 0, 0), following=True)
    load = ExternalLoad(
        tip_moment=(1, 0, 0), following=True, tip_mass=20, gravity=(0, 9.81, 0), body_forces=[side]
    )
    assert _words(load) == (
        "tip moment (1, 0, 0) N mm following the tip, tip mass 20 g, gravity (0, 9.81, 0) m/s², "
        "force (0.1, 0, 0) N on body 3 at (0.8, 0, 0) mm following it, "
        "moment (0, 2, 0) N mm on body 3 following it"
    )
    assert _words(PUSH) == "tip force (0, 0, -0.2) N at (0, 0, 1.5) mm from the tip"


def test_lines_fit():
    lines = load_sentences(ExternalLoad(tip_moment=(1, 2, 3), tip_mass=20, gravity=(0, 0, -9.81)))
    assert lines[0].startswith("external loads: tip moment (1, 2, 3) N mm, ")
    assert all(len(line) <= 80 for line in lines)
