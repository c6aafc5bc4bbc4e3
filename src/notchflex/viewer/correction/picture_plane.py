"""A photograph in the scene, with the fitted outline and the points of the chain to drag."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from notchflex.photographs.measured import MeasuredPhotograph
from notchflex.photographs.overlay import LONGEST
from notchflex.viewer.scene.scene import CameraPose, framed

Numbers = NDArray[np.float64]

_ROOT = "/photograph"
_WIDE = 10.0  # of the longer side, in lengths of the scene
# x to the right, y down and z away from the eye, as in photographs, which stand in the plane x-z.
_STANDING = (math.sqrt(0.5), -math.sqrt(0.5), 0.0, 0.0)
_BEFORE = 0.02  # how far in front of the photograph lines are drawn
_POINT, _LINE = 0.025, 3.0
_ARROW = 0.6  # not of the chain: a fit to the wrong thing may be too small to be seized
_FOUND, _MISSED, _CHAIN = (60, 200, 60), (255, 140, 40), (0, 114, 178)


class PicturePlane:
    """A photograph, standing upright, and what is drawn over it.

    Args:
        server: The server.
        picture: Blue, green and red, (height, width, 3).
        chain: Points of the chain, px, (n + 2, 2).
        dragged: Called in the event loop after a point was moved.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        picture: NDArray[np.uint8],
        chain: Numbers,
        dragged: Callable[[], None],
    ) -> None:
        import cv2

        height, width = picture.shape[:2]
        self._scene, self._middle = server.scene, np.array([width - 1.0, height - 1.0]) / 2.0
        self._pixel = _WIDE / max(width, height)
        self._size = self._pixel * np.array([width, height])
        factor = min(1.0, LONGEST / max(width, height))
        small = cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
        self._root = self._scene.add_frame(_ROOT, wxyz=_STANDING, show_axes=False)
        self._scene.add_image(
            f"{_ROOT}/picture", np.ascontiguousarray(small[..., ::-1]), *self._size,
            jpeg_quality=90, cast_shadow=False, receive_shadow=False,
        )  # fmt: skip
        self._handles = [self._handle(number, dragged) for number in range(len(chain))]
        self.chain = chain

    def _handle(self, number: int, dragged: Callable[[], None]) -> Any:
        handle = self._scene.add_transform_controls(
            f"{_ROOT}/point_{number}", scale=_ARROW, active_axes=(True, True, False),
            disable_rotations=True, depth_test=False,
        )  # fmt: skip

        @handle.on_update
        async def _(_event: Any) -> None:
            dragged()

        return handle

    @property
    def chain(self) -> Numbers:
        """Points of the chain as they were dragged, px, (n + 2, 2)."""
        positions = np.array([one.position[:2] for one in self._handles], float)
        return positions / self._pixel + self._middle

    @chain.setter
    def chain(self, points: Numbers) -> None:
        for node, position in zip(self._handles, self._placed(points), strict=True):
            node.position = position
        self.draw_chain()

    def draw_chain(self) -> None:
        """Draw lines between the points of the chain."""
        points = self._placed(self.chain)
        pairs = np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)
        self._scene.add_line_segments(
            f"{_ROOT}/chain", pairs, _CHAIN, thickness=_LINE, thickness_units="screen"
        )

    def draw_outline(self, photograph: MeasuredPhotograph) -> None:
        """Draw a fitted outline: green points lie on an edge, orange ones on none."""
        within = np.abs(photograph.outline - self._middle).max(axis=1, initial=0.0) < 1e4
        colours = np.where(photograph.seen[within][:, None], _FOUND, _MISSED).astype(np.uint8)
        self._scene.add_point_cloud(
            f"{_ROOT}/outline", self._placed(photograph.outline[within]).astype(np.float32),
            colours, point_size=_POINT, point_shape="circle", precision="float32",
            point_shading="flat",
        )  # fmt: skip

    def eye(self, aspect: float) -> CameraPose:
        """Return a camera that shows all of the photograph, of a width over height."""
        x, z = 0.5 * self._size
        corners = np.array([[-x, 0.0, -z], [x, 0.0, z]])
        return framed(corners, np.array([0.0, -1.0, 0.0]), aspect, room=1.05)

    def remove(self) -> None:
        """Remove all of it."""
        self._root.remove()

    def _placed(self, points: Numbers) -> Numbers:
        """Return points of the photograph (px) in its plane, in front of it."""
        flat = self._pixel * (points - self._middle)
        return np.concatenate([flat, np.full((len(flat), 1), -_BEFORE)], axis=1)
