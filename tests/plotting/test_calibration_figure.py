"""The picture of a fit: data, band, residuals, profiles, correlations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import t

from fitted import NAMES, fitted
from notchflex.fit import Interval
from notchflex.plotting import calibration_picture
from notchflex.plotting.marks import Area
from notchflex.plotting.style import VERMILLION


def panel(figure, title):
    """The panel of a title, and its line of the model or profile."""
    return next(axes for axes in figure.axes if axes.get_title(loc="left") == title)


def curve(axes):
    """The longest line of a panel."""
    return max(
        axes.get_lines(), key=lambda line: len(line.get_xdata()) * (line.get_linestyle() == "-")
    )


def test_panels_and_units():
    figure = calibration_picture(fitted()).figure()
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles == [
        *(f"notch {number}" for number in range(1, 6)),
        "total bending angle",
        "model less measured",
        "profile of constant 1, dotted: 95 %",
        "profile of constant 2, dotted: 95 %",
        "correlation",
    ]
    labels = [(axes.get_xlabel(), axes.get_ylabel()) for axes in figure.axes]
    assert labels[0] == ("tendon tension $T$ [N]", "angle [deg]")
    assert labels[6][1] == "residual / its noise [-]"
    assert labels[8][0].replace("\n", "") == "material.elastic_modulus [MPa]"


def test_model_measured_and_band_are_those_of_the_fit():
    found = fitted()
    axes = panel(calibration_picture(found).figure(), "notch 2")
    model = curve(axes)
    measured = found.problem.samples.every[0].measured
    order = np.argsort(measured.load.tension[:, 0], kind="stable")
    own = (found.residuals.quantity == 0) & (found.residuals.part == 1)
    off = found.residuals.values[own]
    expected = np.degrees(measured.observed["notch_angle"][:, 1] + off)
    np.testing.assert_allclose(model.get_ydata(), expected[order])
    np.testing.assert_allclose(model.get_xdata(), measured.load.tension[order, 0])
    marks = [line for line in axes.get_lines() if line.get_linestyle() == "None"]
    seen = np.concatenate([line.get_ydata() for line in marks])
    np.testing.assert_allclose(
        np.sort(seen), np.sort(np.degrees(measured.observed["notch_angle"][:, 1]))
    )
    assert len(marks) == 2  # one kind of marker for each pull
    slopes = found.residuals.slopes[own][order]
    # the noise is known, so rows are normal; two pulls have one degree of freedom
    times = t.ppf(0.975, np.where(found.by_pulls.counts, 1.0, np.inf))
    covariance = found.covariance * np.outer(times, times)
    half = np.degrees(np.sqrt(np.diag(slopes @ covariance @ slopes.T)))
    (band,) = axes.patches
    heights = band.get_xy()[:, 1]
    assert heights.max() == pytest.approx(np.max(expected[order] + half))
    assert heights.min() == pytest.approx(np.min(expected[order] - half))


def test_profile_goes_through_the_points_and_shows_the_ends():
    found = fitted()
    axes = panel(calibration_picture(found).figure(), "profile of constant 1, dotted: 95 %")
    interval = found.intervals[NAMES[0]]
    x, y = curve(axes).get_data()
    assert y.min() == pytest.approx(0.0, abs=0.05)
    assert np.interp(interval.lower, x, y) == pytest.approx(3.84, rel=0.03)
    ends = [line.get_xdata()[0] for line in axes.get_lines() if line.get_color() == VERMILLION]
    assert ends == [interval.lower, interval.upper]
    assert not axes.texts


def test_open_ends_and_unknown_constants_are_drawn():
    found = fitted()
    profile = found.intervals[NAMES[0]].profile
    known = profile[profile[:, 0] <= found.values[NAMES[0]]]
    opened = replace(found, intervals={NAMES[0]: Interval(None, None, known, "nothing")})
    # nothing depends on the second constant
    curvature = np.diag([found.reached.curvature[0, 0], 0.0])
    cost = found.reached._replace(curvature=curvature)
    opened = replace(opened, best=found.best._replace(cost=cost))
    figure = calibration_picture(opened).figure()
    axes = panel(figure, "profile of constant 1, dotted: 95 %")
    assert [text.get_text() for text in axes.texts] == ["open below and above"]
    assert not panel(figure, "notch 1").patches  # no band where the covariance is infinite
    told = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "model" in told
    assert not [text for text in told if "95 %" in text]
    numbers = [text.get_text() for text in panel(figure, "correlation").texts]
    assert (numbers[0], numbers[-1]) == ("1.00", "-")


def test_legend_fits_on_the_paper():
    found = fitted()
    own = calibration_picture(found)
    # Least of all are the total angle and its residuals.
    for made in (own, replace(own, column_width=2.5, row_height=2.4, cells=own.cells[:2])):
        figure = made.figure()
        figure.draw_without_rendering()
        (legend,) = figure.legends
        box = legend.get_window_extent()
        assert 0.0 <= box.x0 < box.x1 <= figure.bbox.x1
        names = [text.get_text() for text in legend.get_texts()]
        notches = [f"residuals of notch {number}" for number in range(1, 6)]
        assert names[-6:] == [*notches, "residuals of others"]


def test_browser_shows_band_ends_and_correlations():
    found = fitted()
    made = calibration_picture(found)
    shown = made.interactive()
    (area,) = (item for item in made.cells[1].panel.items if isinstance(item, Area))
    (band,) = (one for one in shown.data if one.xaxis == "x2" and one.fill == "toself")
    count = len(area.polygons[0])
    np.testing.assert_allclose(band.y[:count], area.polygons[0][:, 1], rtol=1e-5)
    legend = {one.legendgroup: one.name for one in shown.data if one.showlegend}
    assert legend[band.legendgroup] == "95 % band of the model"
    upright = [one for one in shown.data if one.x is not None and one.x[0] == one.x[-1]]
    ends = [end for one in found.intervals.values() for end in (one.lower, one.upper)]
    assert [one.x[0] for one in upright] == pytest.approx(ends)
    assert {legend[one.legendgroup] for one in upright} == {"end of the 95 % interval"}
    squares = [one.name for one in shown.data if one.xaxis == "x10"]
    assert squares[1] == "friction.coefficient, material.elastic_modulus"
    texts = [one.text for one in shown.layout.annotations if one.xref == "x10 domain"]
    assert texts == [f"{value:.2f}" for value in found.correlation.ravel()]
    points = [one for one in shown.data if (one.name or "") == "measured, pull a"]
    assert len(points) == 6  # five notches and the total
