"""Draws the picture of the page on photographs into docs/images: a rendered one with its overlay.

`python docs/make/photograph_overlay.py`.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

import notchflex as nf
from notchflex.photographs.measured import write_overlay

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))

from photographs.renderer import render
from photographs.test_board import BOARD, SCENE, laid

IMAGES = Path(__file__).resolve().parents[1] / "images"
ANGLES_DEG = (14.0, 22.0, 18.0, 9.0, 16.0)


def main() -> None:
    """Render a wrist beside a board, measure it, and write the overlay."""
    wrist = nf.load_robot("pacheco2021-a")
    grey = render(wrist, np.radians(ANGLES_DEG), SCENE).astype(np.float32)
    picture = cv2.cvtColor(laid(BOARD, (-1.0, -4.6), SCENE, grey), cv2.COLOR_GRAY2BGR)
    with tempfile.TemporaryDirectory() as folder:
        file, overlay = f"{folder}/wrist.png", Path(folder) / "overlay.png"
        cv2.imwrite(file, picture)
        found = nf.measure(file, wrist, board=BOARD).photographs[0]
        write_overlay(overlay, picture, found)
        print(found.reason or np.degrees(found.notch_angle))
        image = cv2.imread(str(overlay))
    cv2.imwrite(str(IMAGES / "photograph.jpg"), image, [cv2.IMWRITE_JPEG_QUALITY, 85])


if __name__ == "__main__":
    main()
