"""The picture of a fit: data, band, residuals, profiles, correlations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import t

from fitted import NAMES, fitted
from notchflex.calibrate import Interval
from notchflex.plot import calibration_figure, save


def panel(figure, title):
    """The panel of a title, and its line of the model or profile."""
    return next(axes for axes in figure.axes if axes.get_title(loc="left") == title)


def curve(axes):
    """The longest line of a panel."""
    return max(
        axes.get_lines(), key=lambda line: len(line.get_xdata()) * (line.get_linestyle() == "-")
    )


def test_panels_and_units():
    figure = calibration_figure(fitted())
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
    assert labels[6][1] == "residual / its noise"
    assert labels[8][0].replace("\n", "") == "material.elastic_modulus [MPa]"


def test_model_measured_and_band_are_those_of_the_fit():
    found = fitted()
    axes = panel(calibration_figure(found), "notch 2")
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
    spread = np.sqrt(np.diag(slopes @ found.covariance @ slopes.T))
    half = np.degrees(t.ppf(0.975, found.freedom) * spread)
    (band,) = axes.collections
    heights = band.get_paths()[0].vertices[:, 1]
    assert heights.max() == pytest.approx(np.max(expected[order] + half))
    assert heights.min() == pytest.approx(np.min(expected[order] - half))


def test_profile_goes_through_the_points_and_shows_the_ends():
    found = fitted()
    axes = panel(calibration_figure(found), "profile of constant 1, dotted: 95 %")
    interval = found.intervals[NAMES[0]]
    x, y = curve(axes).get_data()
    assert y.min() == pytest.approx(0.0, abs=0.05)
    assert np.interp(interval.lower, x, y) == pytest.approx(3.84, rel=0.03)
    ends = [line.get_xdata()[0] for line in axes.get_lines() if line.get_linestyle() == "--"]
    assert ends == [interval.lower, interval.upper]
    assert not axes.texts


def test_open_ends_and_unknown_constants_are_drawn():
    found = fitted()
    profile = found.intervals[NAMES[0]].profile
    known = profile[profile[:, 0] <= found.values[NAMES[0]]]
    opened = replace(found, intervals={NAMES[0]: Interval(None, None, known, "nothing")})
    # nothing depends on the second constant
    curvature = np.diag([found.reached.curvature[0, 0], 0.0])
    opened = replace(opened, reached=found.reached._replace(curvature=curvature))
    figure = calibration_figure(opened)
    axes = panel(figure, "profile of constant 1, dotted: 95 %")
    assert [text.get_text() for text in axes.texts] == ["open below and above"]
    assert not panel(figure, "notch 1").collections  # no band where the covariance is infinite
    numbers = [text.get_text() for text in panel(figure, "correlation").texts]
    assert (numbers[0], numbers[-1]) == ("1.00", "-")


def test_is_written(tmp_path):
    for name in ("a.svg", "b.svg"):
        save(calibration_figure(fitted()), tmp_path / name)
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
