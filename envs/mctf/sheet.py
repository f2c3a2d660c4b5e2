"""A picture while it is drawn: lines, discs and words, with smooth edges."""

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from mctf.rules import Rules

Color = tuple[int, ...]
Point = tuple[float, float]
PAPER: Color = (250, 251, 252)
SHARPNESS = 3
"""Pictures are drawn so many times larger, then reduced: that makes edges smooth."""


class Sheet:
    """A picture that is being drawn, in metres of the field and in pixels of the finished picture."""

    def __init__(self, rules: Rules, width: int, captioned: bool) -> None:
        """Lays out field, heading line and, if ``captioned``, a line below; width in pixels."""
        self.margin, self.line = 0.02 * width, 0.055 * width
        self.scale = (width - 2 * self.margin) / rules.width_m  # pixels a metre
        self.top = self.line
        self.bottom = self.top + self.scale * rules.height_m
        self.size = width, round(self.bottom + (self.line if captioned else self.margin))
        self.hull = max(0.02 * width, 10.0)  # half the length
        self.image = Image.new("RGB", [SHARPNESS * side for side in self.size], PAPER)
        self.draw = ImageDraw.Draw(self.image, "RGBA")

    def copy(self) -> "Sheet":
        """Returns a sheet on which the same is drawn already."""
        other = object.__new__(Sheet)
        other.__dict__ |= self.__dict__
        other.image = self.image.copy()
        other.draw = ImageDraw.Draw(other.image, "RGBA")
        return other

    def at(self, x: float, y: float) -> Point:
        """Returns the pixel of a point in m."""
        return self.margin + self.scale * x, self.bottom - self.scale * y

    def disc(self, middle: Point, radius: float, fill: Color | None, edge: Color, width: float) -> None:
        """Draws a disc; all in pixels."""
        (x, y), s = middle, SHARPNESS
        box = [s * (x - radius), s * (y - radius), s * (x + radius), s * (y + radius)]
        self.draw.ellipse(box, fill, edge, max(1, round(s * width)))

    def arc(self, middle: Point, radius: float, share: float, color: Color, width: float) -> None:
        """Draws a ``share`` of a circle, clockwise from the top; in pixels."""
        (x, y), s = middle, SHARPNESS
        box = [s * (x - radius), s * (y - radius), s * (x + radius), s * (y + radius)]
        self.draw.arc(box, -90, -90 + 360 * share, color, round(s * width))

    def rectangle(self, corner: Point, opposite: Point, fill: Color) -> None:
        """Draws a rectangle; in pixels."""
        self.draw.rectangle([SHARPNESS * value for value in (*corner, *opposite)], fill)

    def lines(self, points: Sequence[Point], color: Color, width: float) -> None:
        """Draws from point to point; in pixels."""
        flat = [SHARPNESS * value for point in points for value in point]
        self.draw.line(flat, color, max(1, round(SHARPNESS * width)), joint="curve")

    def polygon(self, points: Sequence[Point], fill: Color, edge: Color, width: float) -> None:
        """Draws an outlined polygon; in pixels."""
        flat = [tuple(SHARPNESS * value for value in point) for point in points]
        self.draw.polygon(flat, fill)
        self.draw.line([*flat, *flat[:2]], edge, max(1, round(SHARPNESS * width)), joint="curve")

    def write(self, where: Point, words: str, size: float, color: Color, anchor: str) -> float:
        """Writes words; returns how wide they are. In pixels; anchors as of Pillow."""
        font = _font(round(SHARPNESS * size))
        self.draw.text((SHARPNESS * where[0], SHARPNESS * where[1]), words, color, font, anchor=anchor)
        return self.draw.textlength(words, font) / SHARPNESS

    def array(self) -> NDArray[np.uint8]:
        """Returns the finished picture, (H, W, 3)."""
        return np.array(self.image.reduce(SHARPNESS))


@functools.lru_cache(maxsize=64)
def _font(size: int) -> Any:
    return ImageFont.load_default(size)
