"""The grammar of `--tension` and `--stroke`."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from notchflex._load_words import TendonCommand, load_columns, parse_spec, parse_whole
from notchflex.errors import InputError

NUMBERS = st.floats(-100.0, 100.0, allow_nan=False)


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("2", [2.0]),
        ("0,1,2.5", [0.0, 1.0, 2.5]),
        ("0:3:4", [0.0, 1.0, 2.0, 3.0]),
        ("0:3:4,3:0:4", [0.0, 1.0, 2.0, 3.0, 3.0, 2.0, 1.0, 0.0]),
        ("1e-3, 2", [0.001, 2.0]),
        ("2:2:1", [2.0]),
        ("0, 1:2:2 ,5", [0.0, 1.0, 2.0, 5.0]),
    ],
)
def test_values_and_ranges(text, values):
    assert parse_spec(text) == values


@given(st.lists(NUMBERS, min_size=1, max_size=8))
def test_any_list_of_numbers_reads_back(values):
    assert parse_spec(",".join(map(repr, values))) == values


@given(NUMBERS, NUMBERS, st.integers(2, 50))
def test_ranges_have_their_ends_and_their_number(start, stop, count):
    values = parse_spec(f"{start}:{stop}:{count}")
    assert len(values) == count
    assert (values[0], values[-1]) == (start, stop)


def command(tendon, *steps):
    return TendonCommand(f"--tension {tendon}={steps}", tendon, list(steps))


def test_single_values_hold_for_all_steps():
    tension, stroke = load_columns([command(1, 0.0, 1.0, 2.0)], [command(2, 0.5)], 3)
    np.testing.assert_array_equal(tension[:, 0], [0.0, 1.0, 2.0])
    np.testing.assert_array_equal(stroke[:, 1], [0.5, 0.5, 0.5])
    assert np.isnan(tension[:, 1:]).all()
    assert np.isnan(stroke[:, [0, 2]]).all()


def test_strokes_may_be_negative():
    _, stroke = load_columns([], [command(None, -0.5)], 1)
    assert stroke.item() == -0.5


@pytest.mark.parametrize(
    ("tension", "tendons"),
    [
        ([], 1),
        ([command(None, 2.0)], 2),
        ([command(3, 2.0)], 2),
        ([command(0, 2.0)], 2),
        ([command(1, 2.0), command(1, 3.0)], 2),
        ([command(1, 0.0, 1.0, 2.0), command(2, 0.0, 1.0)], 2),
    ],
)
def test_commands_that_do_not_fit_are_refused(tension, tendons):
    with pytest.raises(InputError):
        load_columns(tension, [], tendons)


@given(st.integers())
def test_whole_numbers_read_back_within_their_range(value):
    if -5 <= value <= 7:
        assert parse_whole(-5, 7)(str(value)) == value
    else:
        with pytest.raises(InputError):
            parse_whole(-5, 7)(str(value))
