"""A smooth background of a photograph, and the contrast against it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.float32]

_COARSE = 240
_ROUNDS = 12


@dataclass(frozen=True)
class Contrast:
    """Difference of a photograph from its background.

    Attributes:
        value: Distance of every pixel from the background over all colours, grey levels.
        threshold: Contrast above which a pixel is not background.
        middle: Middle of the photograph, px, (2,).
    """

    value: Image
    threshold: float
    middle: NDArray[np.float64]

    def reduced(self, factor: float) -> Contrast:
        """Return the same of a photograph made smaller."""
        import cv2

        if factor >= 1.0:
            return self
        small: Any = cv2.resize(
            self.value, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA
        )
        return Contrast(small, self.threshold, (self.middle + 0.5) * factor - 0.5)


def contrast(photograph: NDArray[np.uint8]) -> Contrast:
    """Find the background of a photograph, a smooth surface in each colour, and the contrast."""
    import cv2

    height, width = photograph.shape[:2]
    factor = min(1.0, _COARSE / max(height, width))
    small = cv2.resize(photograph, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    surface = _surface(small.astype(np.float64))
    background: Any = cv2.resize(
        surface.astype(np.float32), (width, height), interpolation=cv2.INTER_CUBIC
    )
    cv2.subtract(photograph.astype(np.float32), background, dst=background)
    cv2.multiply(background, background, dst=background)
    value: Any = np.sqrt(cv2.transform(background, np.full((1, 3), 1.0 / 3.0, np.float32)))
    value = cv2.GaussianBlur(value, (0, 0), 0.7)
    low = cv2.resize(value, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    noise = float(np.median(low))
    # Otsu's threshold between background and the rest, not below the noise of the background.
    capped = np.clip(low, 0.0, 255.0).astype(np.uint8)
    otsu, _ = cv2.threshold(capped, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
    middle = (np.array([width, height]) - 1.0) / 2.0
    return Contrast(value, max(0.6 * float(otsu), 4.0 * noise, 5.0), middle)


def _surface(image: NDArray[np.float64]) -> NDArray[np.float64]:
    """Fit a quadratic surface to the most common colours by reweighted least squares."""
    height, width, _ = image.shape
    y, x = np.meshgrid(np.linspace(-1, 1, height), np.linspace(-1, 1, width), indexing="ij")
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1).reshape(-1, 6)
    colour = image.reshape(-1, 3)
    border = np.ones((height, width), bool)
    border[height // 12 : -height // 12, width // 12 : -width // 12] = False
    middle = np.median(colour[border.ravel()], axis=0)
    away = np.sqrt(((colour - middle) ** 2).mean(axis=1))
    scale = max(60.0, float(np.median(away)))
    fitted = np.broadcast_to(middle, colour.shape)
    for _ in range(_ROUNDS):
        weight = np.maximum(1.0 - (away / scale) ** 2, 0.0) ** 2
        if np.count_nonzero(weight) < len(weight) // 20:
            break
        weighted = terms * weight[:, None]
        coefficients = np.linalg.lstsq(weighted.T @ terms, weighted.T @ colour, rcond=None)[0]
        fitted = terms @ coefficients
        away = np.sqrt(((colour - fitted) ** 2).mean(axis=1))
        scale = max(6.0, min(0.8 * scale, 60.0), 4.0 * float(np.median(away[weight > 0.0])))
    return fitted.reshape(image.shape)
