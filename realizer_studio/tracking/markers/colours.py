"""Colours of markers: boxes in the space of hue, saturation and value (Wojdel 2005, eq. 7.1 and 7.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from realizer.core.array_types import Bool, Float64
from realizer_studio.tracking.network import TrackingError

if TYPE_CHECKING:
    from PIL.Image import Image

FULL = np.array([360.0, 100.0, 100.0])  # degrees, per cent, per cent
SPREAD = (18.0, 25.0, 30.0)  # of a colour that is given by three numbers
LEAST = (15.0, 25.0, 28.0)  # least spread of a learnt colour, because light varies over a face
MORE = 1.5  # spread of a learnt colour, relative to the farthest of its pixels
AROUND = 1  # pixels on each side of a clicked one, of which the median is learnt
SAME = 40.0  # degrees; the largest difference of hue between pixels of one colour


@dataclass(frozen=True, slots=True)
class Colour:
    """A box of colours."""

    name: str  # for messages
    centre: tuple[float, float, float]  # hue in degrees, saturation and value in per cent
    # The largest differences from the centre.
    spread: tuple[float, float, float] = SPREAD

    def mask(self, hsv: Image) -> Bool:
        """Return the mask (h, w) of the pixels of a picture in Pillow's mode HSV that have the colour."""
        from PIL import ImageChops

        levels = np.arange(256)[:, None] * FULL / [256, 255, 255] - self.centre
        levels[:, 0] = _hues(levels[:, 0], 0.0)
        near = np.abs(levels) < self.spread
        bands = [
            band.point((255 * inside).tolist()) for band, inside in zip(hsv.split(), near.T, strict=True)
        ]
        both = ImageChops.darker(bands[0], bands[1])
        return np.asarray(ImageChops.darker(both, bands[2])) > 0


NAMED = {
    one.name: one
    for one in (
        Colour("red", (0, 75, 65), (15, 30, 36)),
        Colour("yellow", (55, 75, 75), (14, 35, 30)),
        Colour("green", (125, 70, 62), (40, 40, 39)),
        Colour("cyan", (185, 70, 65), (18, 35, 36)),
        Colour("blue", (225, 70, 58), (28, 38, 44)),
        Colour("magenta", (305, 65, 65), (28, 35, 36)),
    )
}


def named(name: str) -> Colour:
    """Return a colour of `NAMED` by its name; raises TrackingError for other names."""
    if (colour := NAMED.get(name.strip().lower())) is None:
        raise TrackingError(
            f"marker colours: wanted some of {', '.join(NAMED)}, got {name!r}; other colours are given by "
            "--marker-colour H,S,V or learnt by --marker-at X,Y"
        )
    return colour


def of_numbers(text: str) -> Colour:
    """Return the colour of "H,S,V" or "H,S,V,SPREAD_H,SPREAD_S,SPREAD_V"; raises TrackingError."""
    expectation = (
        "--marker-colour: wanted H,S,V (0 to 360 degrees, 0 to 100, 0 to 100 per cent) and, if you like, "
        f"three spreads above 0, got {text!r}"
    )
    try:
        cells = [float(cell) for cell in text.split(",")]
    except ValueError:
        raise TrackingError(expectation) from None
    good = len(cells) in (3, 6) and np.isfinite(cells).all() and all(cell > 0 for cell in cells[3:])
    if not good or not all(0 <= cell <= most for cell, most in zip(cells, FULL, strict=False)):
        raise TrackingError(expectation)
    centre, spread = cells[:3], cells[3:] or SPREAD
    return Colour(text, (centre[0], centre[1], centre[2]), (spread[0], spread[1], spread[2]))


def learnt(picture: Image, pixels: Sequence[tuple[float, float]], where: str) -> list[Colour]:
    """Return the colours of a picture around clicked pixels; those of similar hues make one colour.

    Args:
        pixels: x, y in pixels from the top left corner, one or more inside markers of each colour.
        where: name of the picture in messages.

    Raises:
        TrackingError: a pixel outside the picture, or a grey one.
    """
    hsv = np.asarray(picture.convert("HSV"), np.float64) * FULL / [256, 255, 255]
    groups: list[list[Float64]] = []
    for x, y in pixels:
        column, row = round(x), round(y)
        if not (0 <= column < picture.width and 0 <= row < picture.height):
            raise TrackingError(
                f"{where}: wanted a marker within {picture.width} x {picture.height} pixels, got {x:g},{y:g}"
            )
        part = hsv[max(row - AROUND, 0) : row + AROUND + 1, max(column - AROUND, 0) : column + AROUND + 1]
        pixel = np.median(part.reshape(-1, 3), axis=0)
        if pixel[1] < LEAST[1]:
            raise TrackingError(
                f"{where}: wanted a coloured marker at {x:g},{y:g}, got {pixel[1]:.0f} % saturation"
            )
        group = next((one for one in groups if abs(_hues(pixel[0], one[0][0])) < SAME), None)
        if group is None:
            groups.append([pixel])
        else:
            group.append(pixel)
    return [_learnt(np.array(group)) for group in groups]


def _learnt(pixels: Float64) -> Colour:
    """Return the smallest box around pixels (n, 3), with a margin."""
    values = pixels.copy()
    values[:, 0] = pixels[0, 0] + _hues(pixels[:, 0], pixels[0, 0])
    low, high = values.min(axis=0), values.max(axis=0)
    hue, saturation, value = ((low + high) / 2).tolist()
    spread = np.maximum((high - low) / 2 * MORE, LEAST).tolist()
    return Colour(f"hue {hue % 360:.0f}", (hue % 360, saturation, value), (spread[0], spread[1], spread[2]))


def _hues(hues: Any, origin: float) -> Any:
    """Return the differences of hues from one, -180 to 180 degrees."""
    return (hues - origin + 180) % 360 - 180
