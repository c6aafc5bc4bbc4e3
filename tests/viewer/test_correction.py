"""The page on which fits to photographs are corrected by hand."""

import signal
import subprocess
import sys
import threading
from dataclasses import replace

import cv2
import numpy as np
import pytest

from chromium import PATIENCE
from notchflex.cli.app import run
from notchflex.photographs.measure import measure_picture
from notchflex.photographs.measured import MeasuredPhotograph, MeasuredPhotographs
from notchflex.photographs.outline import PlanarRobot
from photographs.renderer import render
from photographs.test_chain import ANGLES, BY_HAND, ROBOT, SCENE, cluttered

pytest.importorskip("viser", reason="the extra `viewer` is not installed")
pytest.importorskip("trimesh")
pytest.importorskip("manifold3d")
pytest.importorskip("matplotlib")


@pytest.fixture
def unmeasured(tmp_path):
    """Two photographs in which nothing was found."""
    table = PlanarRobot(ROBOT)
    files = [str(tmp_path / f"wrist_{number}.png") for number in (1, 2)]
    for file in files:
        cv2.imwrite(file, cluttered())
    notches = table.notches
    refused = [MeasuredPhotograph.refused(file, notches, "nothing found") for file in files]
    return MeasuredPhotographs(ROBOT, tuple(refused))


def test_points_are_dragged_then_fitted_then_accepted(unmeasured, capsys):
    """All that the buttons do, without a browser."""
    from notchflex.viewer.correction import LEFT_OUT, Correction

    page = Correction(unmeasured, port=18700)
    for action in (page.accept, page.moved):  # a refused photograph is not accepted
        action()
        assert page.number == 0
    page.plane.chain = np.full((7, 2), 5.0)
    page.refit()
    assert "one place" in page.message
    page.plane.chain = BY_HAND
    page.moved()
    np.testing.assert_allclose(page.plane.chain, BY_HAND, atol=1e-6)
    page.refit()
    np.testing.assert_allclose(page.results[0].notch_angle, ANGLES, atol=np.radians(0.15))
    page.moved()
    page.accept()  # what was dragged since has not been fitted
    assert page.number == 0
    page.refit()
    page.accept()
    assert page.number == 1
    page.leave_out()
    assert page.done
    found = page.run()
    assert capsys.readouterr().out == ""  # where `-o -` writes the CSV
    assert [one.reason for one in found.photographs] == ["", LEFT_OUT]
    assert len(found.columns()["photograph"]) == 1


def test_what_was_accepted_before_ctrl_c_is_kept(unmeasured, monkeypatch, tmp_path, capsys):
    """The first photograph was accepted, the second was shown: one row is written, code 130."""
    from notchflex.viewer.correction import NOT_LOOKED_AT, Correction

    fitted = measure_picture(cluttered(), PlanarRobot(ROBOT), "wrist", chain=BY_HAND)

    def accepted(page, count):
        for number in range(count):
            page.results[number] = replace(fitted, source=page.results[number].source)
            page.accept()
        page._tasks.add(interrupted)

    def interrupted():
        raise KeyboardInterrupt

    page = Correction(unmeasured, port=18740)
    accepted(page, 1)
    found = page.run()
    assert not page.done
    assert [one.reason for one in found.photographs] == ["", NOT_LOOKED_AT]

    monkeypatch.setattr("notchflex.photographs.measure", lambda *_, **__: unmeasured)
    served = Correction.run
    words = ["measure", *(one.source for one in unmeasured.photographs)]
    words += ["--robot", "pacheco2021-a", "--correct", "--port", "18760"]
    for count, table in ((0, tmp_path / "none.csv"), (1, tmp_path / "one.csv")):

        def run_and_stop(page, count=count):
            accepted(page, count)
            return served(page)

        monkeypatch.setattr(Correction, "run", run_and_stop)
        assert run([*words, "-o", str(table)]) == 130
        assert table.exists() == (count == 1)
    assert len(table.read_text().splitlines()) == 2
    assert "photograph 2 of 2" in capsys.readouterr().err


def test_the_verb_refuses_what_has_no_page(tmp_path, capsys):
    words = ["measure", "a.png", "--robot", "pacheco2021-a", "--correct"]
    assert run([*words, "--cut"]) == 2
    assert run([*words, "--port", "0"]) == 2
    for alone in (["--port", "8080"], ["--open"]):
        assert run([*words[:-1], *alone]) == 2
        assert "need --correct" in capsys.readouterr().err


@pytest.mark.browser
@pytest.mark.nightly
def test_in_a_browser(browser, unmeasured):
    """A point follows the mouse; the buttons fit, accept and leave out."""
    from notchflex.viewer.correction import Correction

    correction = Correction(unmeasured, port=18720)
    results = []
    thread = threading.Thread(target=lambda: results.append(correction.run()))
    thread.start()
    page = browser.new_page(viewport={"width": 1000, "height": 640})
    page.set_default_timeout(PATIENCE)
    try:
        page.goto(correction.address)
        page.get_by_text("1 of 2").wait_for()
        page.wait_for_timeout(5000)
        before = correction.plane.chain
        # The photograph fills the height of the page; its middle is that of the page.
        pixel = 640.0 / (1.05 * SCENE.size[1])
        grab = np.array([500.0, 320.0]) + pixel * (before[6] - [359.5, 309.5])
        grab += 0.24 * 0.6 / 10.0 * 720.0 * pixel * np.ones(2)  # the square beside the arrows
        way = np.array([-60.0, -40.0])
        page.mouse.move(*grab)
        page.wait_for_timeout(500)
        page.mouse.down()
        page.mouse.move(*(grab + way), steps=5)
        page.mouse.up()
        page.wait_for_timeout(2000)
        moved = correction.plane.chain - before
        np.testing.assert_allclose(moved[6], way / pixel, atol=12.0)
        np.testing.assert_allclose(moved[:6], 0.0, atol=1e-6)
        correction.plane.chain = BY_HAND
        page.get_by_role("button", name="Refit").click()
        page.locator("[data-name=angle_5]").wait_for()
        page.get_by_role("button", name="Accept").click()
        page.get_by_text("2 of 2").wait_for()
        page.get_by_role("button", name="Leave out").click()
        thread.join(30.0)
        assert [bool(one.reason) for one in results[0].photographs] == [False, True]
    finally:
        page.close()
        while not correction.done:
            correction.leave_out()
        thread.join(30.0)


@pytest.mark.browser
@pytest.mark.nightly
@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGINT for another process")
def test_ctrl_c_after_a_click_in_a_browser(browser, tmp_path):
    """The program is interrupted while it shows the second photograph; the first is written."""
    files, table = [str(tmp_path / f"wrist_{number}N.png") for number in (1, 2)], tmp_path / "m.csv"
    for file in files:
        cv2.imwrite(file, render(ROBOT, ANGLES, SCENE))
    words = [sys.executable, "-m", "notchflex", "measure", *files, "--robot", "pacheco2021-a"]
    words += ["--pattern", "wrist_{tension}N", "--correct", "--port", "18780", "-o", str(table)]
    program = subprocess.Popen(words, stderr=subprocess.PIPE, text=True)
    page = browser.new_page(viewport={"width": 1000, "height": 640})
    page.set_default_timeout(PATIENCE)
    try:
        line = next(line for line in program.stderr if "http://" in line)
        address = next(word for word in line.split() if word.startswith("http://"))
        page.goto(address)
        page.get_by_text("1 of 2").wait_for()
        page.wait_for_timeout(3000)
        page.get_by_role("button", name="Accept").click()
        page.get_by_text("2 of 2").wait_for()
        program.send_signal(signal.SIGINT)
        _, errors = program.communicate(timeout=60.0)
        assert program.returncode == 130
        assert "Traceback" not in errors
        rows = table.read_text().splitlines()
        assert len(rows) == 2
        assert "wrist_1N.png" in rows[1]
    finally:
        page.close()
        program.kill()
