"""Fits and posteriors as data frames and data sets, without a sampler."""

import numpy as np
import pytest

from fitted import NAMES, fitted
from notchflex.fit import Posterior
from refusals import refused

DRAWN = Posterior(NAMES, np.arange(12.0).reshape(2, 3, 2), {}, {}, 1)


@pytest.mark.parametrize("library", ["polars", "pandas"])
def test_a_fit_is_a_row_for_each_constant(library):
    found = fitted()
    table = found.to_dataframe(library)
    assert list(table["constant"]) == list(NAMES)
    assert list(table["value"]) == list(found.values.values())
    assert list(table["unit"]) == ["", "MPa"]
    assert list(table["deviation"]) == list(found.deviations.values())
    wanted = [found.intervals[name].upper for name in NAMES]
    np.testing.assert_array_equal(np.array(table["upper_95"], float), np.array(wanted, float))


@pytest.mark.parametrize("library", ["polars", "pandas"])
def test_a_posterior_is_a_row_for_each_draw(library):
    table = DRAWN.to_dataframe(library)
    assert list(table.columns) == ["chain", "draw", *NAMES]
    assert list(table["chain"]) == [0, 0, 0, 1, 1, 1]
    assert list(table["draw"]) == [0, 1, 2, 0, 1, 2]
    assert list(table[NAMES[1]]) == [1.0, 3.0, 5.0, 7.0, 9.0, 11.0]


def test_a_posterior_has_the_axes_of_arviz():
    every = DRAWN.to_xarray()
    assert dict(every.sizes) == {"chain": 2, "draw": 3}
    for number, name in enumerate(NAMES):
        assert every[name].dims == ("chain", "draw")
        np.testing.assert_array_equal(every[name], DRAWN.draws[..., number])


def test_an_unknown_library_is_refused():
    with refused("UNKNOWN_NAME", "excel"):
        DRAWN.to_dataframe("excel")
