"""The handle, the cloud and the sensed force in a real browser."""

import io
import threading
import time

import numpy as np
import pytest

import notchflex as nf
from notchflex.plotting import LOADING, UNLOADING
from notchflex.viewer.overlays import text
from notchflex.viewer.session import hysteresis
from visit import Visit, changed

image = pytest.importorskip("matplotlib.image")
pytest.importorskip("viser", reason="the extra `viewer` is not installed")
pytestmark = [pytest.mark.browser, pytest.mark.nightly]

SCENE = {"x": 290, "y": 20, "width": 400, "height": 430}  # above viser's message, which goes away
GRAB = 0.24  # where the square for a plane is, in lengths of the handle's arrows


@pytest.fixture(scope="module")
def visit(browser):
    opened = Visit(browser, nf.load_robot("pacheco2021-a"), size=(1000, 560), port=18640)
    yield opened
    opened.leave()


def switch(visit, label):
    visit.row(label).locator("input[type=checkbox]").first.click()


def drag_the_tip(visit):
    """Show the arrows, and wait until they are there."""
    switch(visit, "drag the tip")
    wait(lambda: visit.viewer.shown.handle)
    there = threading.Event()
    visit.viewer.ask(there.set)
    wait(there.is_set)


def pixel(visit, point):
    """Where a point of the world is on the page."""
    camera = next(iter(visit.viewer.server.get_clients().values())).camera
    w, x, y, z = camera.wxyz
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    seen = turn.T @ (np.asarray(point) - camera.position)
    box = visit.page.locator("canvas").first.bounding_box()
    focus = 0.5 * box["height"] / np.tan(0.5 * camera.fov)
    middle = np.array([box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]])
    return (middle + focus * seen[:2] / seen[2]).tolist()


def drag(visit, points):
    """Pull the tip along points; return how many positions it took, in which times [s].

    The times are of the wall, and of the processor in the thread that solves and draws.
    """
    mouse, viewer = visit.page.mouse, visit.viewer
    size = 0.25 * viewer.scene.length * GRAB * np.array([1.0, 0.0, 1.0])
    visit.settle()
    mouse.move(*pixel(visit, viewer.session.state.tip_position + size))
    visit.page.wait_for_timeout(300)
    clock = time.pthread_getcpuclockid(visit.thread.ident)
    before = len(viewer.session.history), time.perf_counter(), time.clock_gettime(clock)
    mouse.down()
    for point in points:
        mouse.move(*pixel(visit, point + size))
    followed = len(viewer.session.history) - before[0]
    times = time.perf_counter() - before[1], time.clock_gettime(clock) - before[2]
    mouse.up()
    return followed, times


def test_the_tip_follows_the_mouse_with_its_friction_history(visit, record_property):
    wrist = visit.viewer.session.robot
    visit.set_tension(0.6)
    drag_the_tip(visit)
    loading = np.linspace(0.6, 1.4, 41)[1:]
    path = nf.simulate(wrist, [nf.Load(tension=float(one)) for one in [*loading, *loading[::-1]]])
    tips = path.tip_position
    followed, (wall, used) = drag(visit, tips[:40])
    there = visit.still()
    assert there["tension_1"] == pytest.approx(1.4, abs=0.03)
    again, (more, much) = drag(visit, tips[40:])
    back = visit.still()
    assert back["total_angle"] == pytest.approx(np.degrees(path.total_angle[-1]), abs=1.5)
    rate = (followed + again) / (used + much)
    record_property("followed", f"{followed + again} in {wall + more:.2f} s, {rate:.0f} per CPU s")
    print(f"followed {followed + again} in {wall + more:.2f} s, {rate:.0f} per CPU s")
    assert followed + again > 60  # of 80 places of the mouse
    assert rate > 15.0
    # Back at the first angles with less tension than on the way there: the loop shows both ways.
    visit.loop_is("tension", LOADING, UNLOADING)
    tension = hysteresis(visit.viewer.session.history, 0)
    up = np.interp(np.radians(back["total_angle"]), *tension[: np.argmax(tension[:, 0])].T[::-1])
    assert back["tension_1"] < up - 0.05
    visit.no_notice()
    switch(visit, "drag the tip")
    visit.reset()


def test_a_saved_picture_is_without_the_arrows_to_drag(visit):
    def saved():
        _, content = visit.saved("Picture (PNG)")
        return image.imread(io.BytesIO(content), format="png")[..., :3]

    plain, straight = saved(), visit.picture(SCENE)
    drag_the_tip(visit)
    wait(lambda: changed(straight, visit.picture(SCENE)) > 1e-3)
    handle = visit.picture(SCENE)
    assert changed(plain, saved()) < 1e-4
    assert changed(handle, visit.picture(SCENE)) < 1e-3  # on the page they are still there
    switch(visit, "drag the tip")
    wait(lambda: changed(handle, visit.picture(SCENE)) > 1e-3)


def test_the_cloud_and_the_sensed_force_come_and_go(visit):
    viewer, plain = visit.viewer, visit.picture(SCENE)
    switch(visit, "reachable cloud")
    wait(lambda: len(viewer.scene.cloud.points) > 1000)
    wait(lambda: changed(plain, visit.picture(SCENE)) > 0.003)
    visit.set_tension(0.8)
    visit.type("force x [N]", "0.03")
    switch(visit, "sensed force")
    wait(lambda: viewer.session.controls.tip_force[0] == 0.03)
    wait(lambda: viewer.scene.sensed.sensed is not None)
    found = viewer.scene.sensed.sensed
    assert text(found).startswith("sensed x")
    assert found.low[-1, 0] <= 0.03 <= found.high[-1, 0]
    switch(visit, "reachable cloud")
    switch(visit, "sensed force")
    wait(lambda: not len(viewer.scene.cloud.points))
    wait(lambda: viewer.scene.sensed.sensed is None)
    visit.no_notice()
    assert visit.errors == []


def wait(condition):
    end = time.monotonic() + 60.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)
