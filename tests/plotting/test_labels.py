"""Whatever users call their robots, files, trials and models, pictures show it letter by letter."""

from __future__ import annotations

import html
import json
import re
from dataclasses import replace

import numpy as np
import pytest

import notchflex as nf
from fake_path import fake_path
from fitted import DEVIATION, NAMES, OBSERVED
from notchflex.cli import run
from notchflex.fit import calibrate, simulate_measurements
from notchflex.plotting import (
    Picture,
    beside_picture,
    calibration_picture,
    comparison_picture,
    friction_picture,
    path_picture,
    save_animation,
)
from notchflex.plotting.style import SYMBOLS, for_browser, for_paper, heading_lines

NASTY = r"$x_1$ \frac{a} $5 100 % & <b>bold</b> %{x} a_b \$ </script>"
WRIST = "pacheco2021-a"


def nasty_path(steps=3):
    path = fake_path(steps)
    path.robot = path.robot.replace(name=NASTY)
    return path


def nasty_comparison():
    robot = nf.load_robot(WRIST).replace(name=NASTY)
    angles = np.radians([[5.0, 5.0, 5.0, 4.0, 4.0], [9.0, 9.0, 8.0, 8.0, 8.0]])
    loads = nf.pull(0.5, 0.9, steps=2)
    seen = nf.Measurements(NASTY, loads, (NASTY, "_2"), True, {"notch_angle": angles})
    one = nf.compare(robot, seen)
    return comparison_picture(one, {NASTY: one, "_other": one})


def nasty_calibration():
    robot = nf.load_robot(WRIST).replace(name=NASTY)
    loads = [nf.Load(tension=force) for force in (0.4, 1.0, 1.6, 0.4, 1.0, 1.6)]
    pulls = (NASTY,) * 3 + ("_b",) * 3
    seen = simulate_measurements(
        robot, loads, observed=OBSERVED, deviation=DEVIATION, seed=1, pull=pulls
    )
    found = calibrate({NASTY: robot}, {NASTY: seen}, NAMES, starts=1, intervals=False)
    return calibration_picture(found)


def nasty_rig():
    readings = nf.FrictionReadings([200.0, 300.0], [150.0, 221.0], [1.6, 1.6], [1.6, 1.6])
    return friction_picture(nf.friction_rig(replace(readings, source=NASTY)))


KINDS = {
    "path": lambda: path_picture(nasty_path()),
    "beside": lambda: beside_picture({NASTY: nasty_path(), "_two": nasty_path()}, title=NASTY),
    "comparison": nasty_comparison,
    "calibration": nasty_calibration,
    "rig": nasty_rig,
}


@pytest.fixture(scope="module")
def drawn() -> dict[str, Picture]:
    return {kind: make() for kind, make in KINDS.items()}


@pytest.mark.parametrize("kind", KINDS)
def test_every_picture_is_drawn_and_holds_the_text_as_it_is(drawn, tmp_path, kind):
    # Other formats of matplotlib get the same texts: one kind is enough.
    for suffix in (".svg", ".html", *((".png", ".pdf") if kind == "rig" else ())):
        drawn[kind].save(tmp_path / f"a{suffix}")
    svg = (tmp_path / "a.svg").read_text(encoding="utf-8")
    texts = [html.unescape(one) for one in re.findall(r"<text[^>]*>([^<]*)</text>", svg)]
    # A heading may be broken into lines, and a legend has it with other words.
    words = " ".join(texts)
    assert all(word in words for word in NASTY.split())
    page = (tmp_path / "a.html").read_text(encoding="utf-8")
    figure = page[page.index("Plotly.newPlot(") :]
    assert "<b>" not in figure
    assert figure.count("</script>") == 1  # its own end
    assert r"\u003cb\u003e" not in figure
    assert "&#37;{x}" in figure or "%{x}" not in figure.replace("%{x:", "")
    assert NASTY in html.unescape(re.search(r"<title>(.*)</title>", page)[1])


def test_legends_name_what_begins_with_an_underscore(drawn):
    figure = drawn["beside"].figure()
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert " _two" in names


def test_animation_of_a_nasty_robot(tmp_path, monkeypatch):
    monkeypatch.setattr("notchflex.plotting.pictures.DOTS_PER_INCH", 12)
    save_animation(nasty_path(2), tmp_path / "a.gif")
    assert (tmp_path / "a.gif").stat().st_size > 1000


@pytest.mark.parametrize("suffix", ["png", "html"])
def test_command_line_draws_nasty_robots(tmp_path, monkeypatch, capsys, suffix):
    monkeypatch.chdir(tmp_path)
    robot = nf.load_robot(WRIST).replace(name=NASTY)
    nf.save_robot(robot, "a$b_c$.toml")
    pull = ("simulate", "a$b_c$.toml", "--tension", "0:1:3")
    assert run([*pull, "--csv", r"$\frac$.csv", "--plot", f"a.{suffix}"]) == 0
    assert run([*pull, "--beside", r"$\x_1$: friction.coefficient=0", "--plot", f"b.{suffix}"]) == 0
    assert run(["compare", "a$b_c$.toml", r"$\frac$.csv", "--plot", f"c.{suffix}"]) == 0
    assert {file.name for file in tmp_path.iterdir()} >= {f"{name}.{suffix}" for name in "abc"}


def test_our_own_symbols_are_mathematics():
    for symbol in SYMBOLS:
        assert for_paper(f"angle ${symbol}$ [deg]") == f"angle ${symbol}$ [deg]"
        assert "$" not in for_browser(f"angle ${symbol}$ [deg]")


@pytest.mark.parametrize(
    "text", [NASTY, "$", "$$", "a$b", r"\$", r"\\$\$", "_", "$T$$", "\x00\x1b"]
)
def test_any_text_is_drawn_by_matplotlib(text):
    from matplotlib.figure import Figure

    figure = Figure()
    figure.suptitle(for_paper(text))
    figure.draw_without_rendering()


def test_unprintable_letters_have_a_stand_in():
    assert for_paper("a\x00b\ud800") == "a�b�"
    assert for_browser("tab\tnew\nline") == "tab new<br>line"


def test_long_headings_are_broken():
    lines = heading_lines("word " * 60, 6.0)
    assert max(map(len, lines)) <= 66
    assert " ".join(lines).split() == ["word"] * 60
    path = fake_path(2)
    path.robot = path.robot.replace(name="word " * 60)
    figure = path_picture(path).figure()
    box = figure._suptitle.get_window_extent()
    assert 0.0 <= box.x0 < box.x1 <= figure.bbox.x1


@pytest.mark.browser
@pytest.mark.nightly
def test_a_browser_shows_the_heading_letter_by_letter(browser, tmp_path):
    file = tmp_path / "a.html"
    path_picture(nasty_path()).save(file)
    page = browser.new_page(viewport={"width": 1500, "height": 1000})
    page.goto(file.as_uri())
    page.locator(".gtitle").wait_for(state="attached")
    assert page.locator(".gtitle").text_content().replace("\xa0", " ") == NASTY
    # As wide as its window: nothing is cut off, and nothing has to be scrolled.
    for width in (1500, 1900):
        page.set_viewport_size({"width": width, "height": 1000})
        page.wait_for_function(
            f"Math.abs(document.querySelector('.main-svg').clientWidth - {width}) < 40"
        )
        assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert json.loads(page.evaluate("JSON.stringify(document.title)")) == NASTY
    page.close()


@pytest.mark.parametrize("column", ["tip_x_mm", "notch_3_deg", "notch_12_deg"])
def test_the_symbol_of_one_entry_is_mathematics(column):
    wrist = nf.load_robot("pacheco2021-a")
    twelve = replace(wrist, notch=(replace(wrist.notch[0], repeat=12),))
    axes = nf.solve_each(twelve, nf.pull(0.0, 0.5, steps=2)).plot(column, "total_angle")
    label = axes.get_xlabel()
    assert r"\$" not in label
    assert label.count("$") == 2
    assert "$" not in for_browser(label)
