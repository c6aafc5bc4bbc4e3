"""What a path has: spans by the bodies that a tendon runs through, quantities with numbers."""

from types import SimpleNamespace

import pytest

import notchflex as nf
from notchflex.mechanics.chain import assemble
from notchflex.results.quantities import spans_of


@pytest.mark.parametrize(
    ("name", "spans"), [("gao2017", [28]), ("liu2022", [14, 14]), ("two-axis-wrist", [16] * 4)]
)
def test_two_spans_for_each_body_that_a_tendon_runs_through(name, spans):
    path = SimpleNamespace(chain=assemble(nf.load_robot(name)))
    assert [spans_of(path, tendon) for tendon in range(len(spans))] == spans


def test_a_tendon_that_ends_earlier_has_fewer():
    robot = nf.load_robot("liu2022").with_value("tendon[2].end_body", 3)
    path = SimpleNamespace(chain=assemble(robot))
    assert [spans_of(path, tendon) for tendon in (0, 1)] == [14, 6]
