"""What an update of the viewer costs: a solve from the last state, and moves of what was sent.

How many a second that makes is measured by `benchmarks/control.py viewer`.
"""

from collections import OrderedDict

import numpy as np
import pytest

import notchflex as nf
from notchflex.solver.programs.compiled import Native


def test_updates_compile_nothing_anew():
    pytest.importorskip("viser", reason="the extra `viewer` is not installed")
    from notchflex.viewer import Viewer

    viewer = Viewer(nf.load_robot("gao2017"), port=18180)
    try:

        def update(tension: float) -> None:
            viewer.advance(viewer.session.controls.with_tendon(0, "tension", tension))

        update(0.1)
        programs = set(Native.programs)
        for tension in np.concatenate([np.linspace(0.2, 8.0, 40), np.linspace(8.0, 0.2, 40)]):
            update(float(tension))
        assert viewer.message == ""
        assert len(viewer.session.history) == 82
        assert set(Native.programs) == programs
    finally:
        viewer.server.stop()


def test_the_first_drag_compiles_nothing(monkeypatch):
    pytest.importorskip("viser", reason="the extra `viewer` is not installed")
    from notchflex.viewer import Viewer

    monkeypatch.setattr(Native, "programs", OrderedDict())  # whatever other tests have compiled
    viewer = Viewer(nf.load_robot("pacheco2021-a"), port=18186)
    try:
        viewer.show("handle", True)
        programs = set(Native.programs)
        viewer.steer(viewer.session.state.tip_position + 0.1)
        assert viewer.session.controls.value[0] > 0.0
        assert set(Native.programs) == programs
    finally:
        viewer.server.stop()


@pytest.mark.nightly
def test_a_force_across_and_a_weight_are_shown_in_space():
    pytest.importorskip("viser", reason="the extra `viewer` is not installed")
    from notchflex.viewer import Viewer

    viewer = Viewer(nf.load_robot("two-axis-wrist"), port=18185)
    try:
        viewer.point("sideways")
        numbers = viewer.session.controls.numbers
        for change in ([0.5, 0, 0, 0, 0, 0.01, 0, 0], [0, 0, 0, 0, 0, 0, 0, 2.0]):
            numbers = numbers + change
            viewer.advance(viewer.session.controls.with_numbers(numbers))
            assert viewer.message == ""
        arrows = viewer.scene._arrows
        assert arrows.visible
        texts = [label.text for label in viewer.scene._labels]
        assert texts == ["force 0.01 N", "force 0.0196 N, weight"]
        # in the frame of the base, which lies along -x of the world: down is against x of the tube
        way = arrows.points[1, 1] - arrows.points[1, 0]
        assert way / np.linalg.norm(way) == pytest.approx([-1.0, 0.0, 0.0], abs=1e-6)
        viewer.reset()
        assert not arrows.visible
    finally:
        viewer.server.stop()


def test_solids_are_sent_once_and_moved():
    pytest.importorskip("viser", reason="the extra `viewer` is not installed")
    from notchflex.viewer import Viewer

    viewer = Viewer(nf.load_robot("pacheco2021-a"), port=18190)
    try:
        scene = viewer.server.scene
        nodes = {name: id(node) for name, node in scene._handle_from_node_name.items()}
        assert sum("/body_" in name for name in nodes) == 6
        place = viewer.scene._bodies[-1].position.copy()
        viewer.set(0, 1.0, "tension")
        while (controls := viewer.targets.next()) is not None:
            viewer.advance(controls)
        assert {name: id(node) for name, node in scene._handle_from_node_name.items()} == nodes
        assert np.linalg.norm(viewer.scene._bodies[-1].position - place) > 1.0
        tip = viewer.session.state.tip_position
        assert viewer.scene._frames[1].position == pytest.approx(tip, abs=1e-6)
    finally:
        viewer.server.stop()
