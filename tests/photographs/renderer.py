"""Photographs of known wrists: a mesh of the notched tube, seen by a pinhole camera and shaded.

It shares nothing with the model that is fitted but the poses of the bodies.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import notchflex as nf

FINE = 3
SHIFT = 4
WIDER = 0.53  # so that squares of 20 to 200 px, turned at random, have their area
Numbers = NDArray[np.float64]


@dataclass
class Scene:
    """How a wrist is photographed. Angles deg, lengths mm, grey levels 0 to 255."""

    size: tuple[int, int] = (1200, 900)
    scale: float = 75.0
    direction: float = 80.0
    roll: float = 5.0
    tilt: float = 3.0
    distance: float = 150.0
    place: tuple[float, float] = (600.0, 200.0)
    background: float = 170.0
    slope: float = 20.0
    grain: float = 3.0
    dark: float = 40.0
    bright: float = 90.0
    stripe: float = 160.0
    stripe_at: float = 25.0
    blur: float = 1.0
    noise: float = 3.0
    base: float = 2.0
    collet: bool = True
    tendon: bool = True
    paper: bool = False
    seed: int = 0


def render(robot: nf.Robot, angles: Numbers, scene: Scene) -> NDArray[np.uint8]:
    """Return a grey photograph of a wrist with the given notch angles (rad)."""
    random = np.random.default_rng(scene.seed)
    width, height = scene.size
    image = _background(scene, random)
    quads, shades = [], []
    for surface in _surfaces(robot, angles, scene):
        corners, normals, kind = surface
        quads.append(_camera(corners, scene))
        shades.append(_shade(_turn(normals, scene), kind, scene))
    corner, shade = np.concatenate(quads), np.concatenate(shades)
    order = np.argsort(-corner[..., 2].mean(axis=1))
    xy = _project(corner, scene)
    fixed = np.round((xy * FINE + 0.5 * (FINE - 1)) * 2**SHIFT).astype(np.int32)
    empty = image.copy()
    for number in order:
        cv2.fillConvexPoly(image, fixed[number], float(shade[number]), cv2.LINE_8, SHIFT)
    image = empty + _shrunk(image != empty) * (image - empty)
    image = cv2.GaussianBlur(image, (0, 0), math.hypot(scene.blur, 0.3) * FINE)
    small = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
    noisy = small + random.normal(0.0, scene.noise, small.shape)
    return np.clip(np.round(noisy), 0, 255).astype(np.uint8)


def _shrunk(drawn: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return how much of each pixel the wrist covers.

    Polygons of OpenCV reach half a pixel too far, because their borders are drawn with them.
    """
    whole = drawn.astype(np.float32)
    within = cv2.erode(whole, cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3)))
    return whole - np.float32(WIDER) * (whole - within)


def _background(scene: Scene, random: np.random.Generator) -> NDArray[np.float32]:
    width, height = scene.size
    x, y = np.meshgrid(np.linspace(-1, 1, width * FINE), np.linspace(-1, 1, height * FINE))
    turn = random.uniform(0, 2 * math.pi)
    image = scene.background + scene.slope * (x * math.cos(turn) + y * math.sin(turn))
    grain = random.normal(0.0, 1.0, (height // 4 + 1, width // 4 + 1))
    grain = cv2.resize(grain, (width * FINE, height * FINE), interpolation=cv2.INTER_CUBIC)
    image += scene.grain * grain
    if scene.paper:
        step = int(scene.scale * FINE)
        image[::step] -= 12
        image[:, ::step] -= 12
        image = cv2.GaussianBlur(image, (0, 0), 2.5 * FINE)
    return image.astype(np.float32)


def _camera(point: Numbers, scene: Scene) -> Numbers:
    turned = _turn(point, scene)
    width, height = scene.size
    offset = (np.array(scene.place) - [(width - 1) / 2, (height - 1) / 2]) / scene.scale
    return turned + np.array([*offset, scene.distance])


def _turn(vector: Numbers, scene: Scene) -> Numbers:
    """Tube coordinates (bend x, across y, along z) to camera axes (right, down, forward)."""
    laid = vector[..., [2, 0, 1]]
    whole = Rotation.from_euler("ZYX", [scene.direction, -scene.tilt, scene.roll], degrees=True)
    return laid @ whole.as_matrix().T


def _project(point: Numbers, scene: Scene) -> Numbers:
    width, height = scene.size
    middle = [(width - 1) / 2, (height - 1) / 2]
    return middle + scene.scale * scene.distance * point[..., :2] / point[..., 2:]


def _shade(normal: Numbers, kind: str, scene: Scene) -> Numbers:
    if kind == "tendon":
        return np.full(len(normal), 0.5 * (scene.dark + scene.bright))
    if kind == "collet":
        return 30.0 + 60.0 * np.abs(normal[:, 0])
    side = np.degrees(np.arctan2(normal[:, 1], -normal[:, 2]))
    light = scene.dark + (scene.bright - scene.dark) * np.clip(-normal[:, 2], 0, 1)
    stripe = scene.stripe * np.exp(-(((side - scene.stripe_at) / 6.0) ** 2))
    return np.clip(light + stripe * (normal[:, 2] < 0.0), 0, 255)


def _surfaces(robot, angles, scene):
    pieces = _pieces(robot, angles, scene)
    outer, inner = robot.tube.outer_radius, robot.tube.inner_radius
    around = np.radians(np.arange(0, 361, 5.0))
    for frames, half in pieces:
        t = around if half is None else np.linspace(math.pi - half, math.pi + half, 25)
        for radius, sign in ((outer, 1.0), (inner, -1.0)):
            yield _sheet(frames, t, radius, radius, sign)
        for last in (0, -1):
            yield _cap(frames[last], t, inner, outer, 1.0 if last else -1.0)
        if half is not None:
            for edge in (t[0], t[-1]):
                yield _edge(frames, edge, inner, outer)
    if scene.collet:
        end = Rotation.identity().as_matrix()
        frames = [(np.array([0, 0, z]), end) for z in (-scene.base - 9.0, -scene.base)]
        corners, normals, _ = _sheet(frames, around, 5.0, 5.0, 1.0)
        yield corners, normals, "collet"
        corners, normals, _ = _cap(frames[-1], around, 0.01, 5.0, 1.0)
        yield corners, normals, "collet"
    if scene.tendon:
        frames = [frame for piece, _ in pieces for frame in piece]
        radius = robot.tendon[0].radius - 0.1
        frames = [(o + r @ [radius, 0, 0], r) for o, r in frames]
        o, r = frames[-1]
        frames.append((o + r @ [0.0, 0.0, 0.6], r))
        corners, normals, _ = _sheet(frames, np.radians(np.arange(0, 361, 45.0)), 0.08, 0.08, 1)
        yield corners, normals, "tendon"


def _pieces(robot, angles, scene):
    """Rings and spines from the collet to the tip: frames along each, and half its arc."""
    position, rotation = (one[0] for one in nf.bodies_from_angles(robot, angles[None]))
    position = position - [0, 0, robot.tube.base_length]
    position[0] = 0.0
    tube = robot.tube
    pieces = [([(np.array([0, 0, z]), np.eye(3)) for z in np.linspace(-scene.base, 0, 8)], None)]
    end = (np.zeros(3), np.eye(3))
    for number, notch in enumerate(robot.notches, 1):
        next_ = (position[number], rotation[number])
        half = math.acos((notch.section_depth(tube) - tube.outer_radius) / tube.outer_radius)
        pieces.append((_bent(end, next_, angles[number - 1]), half))
        ring = [
            (next_[0] + next_[1] @ [0, 0, z], next_[1])
            for z in np.linspace(0, notch.uncut_length, 8)
        ]
        pieces.append((ring, None))
        end = ring[-1]
    return pieces


def _bent(start, end, angle):
    chord = end[0] - start[0]
    local = start[1].T @ chord
    length = np.linalg.norm(local) / np.sinc(angle / 2 / math.pi)
    frames = []
    for part in np.linspace(0, 1, 9):
        turn = part * angle
        reach = part * length * np.sinc(turn / 2 / math.pi)
        step = reach * np.array([math.sin(turn / 2), 0, math.cos(turn / 2)])
        turned = Rotation.from_euler("y", turn).as_matrix()
        frames.append((start[0] + start[1] @ step, start[1] @ turned))
    return frames


def _ring(frame, t, radius):
    circle = np.stack([np.cos(t), np.sin(t), np.zeros_like(t)], axis=-1)
    return frame[0] + radius * circle @ frame[1].T, circle @ frame[1].T


def _sheet(frames, t, first, last, sign):
    rows = [
        _ring(frame, t, r)
        for frame, r in zip(frames, np.linspace(first, last, len(frames)), strict=True)
    ]
    p, n = (np.stack(one) for one in zip(*rows, strict=True))
    corners = np.stack([p[:-1, :-1], p[:-1, 1:], p[1:, 1:], p[1:, :-1]], axis=2)
    normals = sign * 0.25 * (n[:-1, :-1] + n[:-1, 1:] + n[1:, 1:] + n[1:, :-1])
    return corners.reshape(-1, 4, 3), normals.reshape(-1, 3), "tube"


def _cap(frame, t, inner, outer, sign):
    a, b = _ring(frame, t, inner)[0], _ring(frame, t, outer)[0]
    corners = np.stack([a[:-1], a[1:], b[1:], b[:-1]], axis=1)
    return corners, np.tile(sign * frame[1][:, 2], (len(corners), 1)), "tube"


def _edge(frames, t, inner, outer):
    one = np.array([t])
    a = np.stack([_ring(f, one, inner)[0][0] for f in frames])
    b = np.stack([_ring(f, one, outer)[0][0] for f in frames])
    corners = np.stack([a[:-1], a[1:], b[1:], b[:-1]], axis=1)
    side = np.array([-math.sin(t), math.cos(t), 0.0])
    return corners, np.stack([f[1] @ side for f in frames[:-1]]), "tube"
