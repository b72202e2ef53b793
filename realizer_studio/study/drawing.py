"""Pictures for studies: small drawings without metadata, and false-colour images of differences."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageFilter

from realizer.animation.axis import au_row, fap
from realizer.animation.frames import AUFrames
from realizer.animation.pose import poses
from realizer.core.array_types import Float32, UInt8
from realizer.face.fap_mapping import mapping_of
from realizer.face.load import input_names
from realizer.render.light import preset
from realizer.render.renderer import Renderer
from realizer.tables.cooccurrence import rules

PAPER = np.array([24, 26, 29], np.float32)
# The background is the neutral face, blurred, at 25 % opacity (Paul 2010, 4.4.2).
STRENGTH = 0.25
BLUR = 0.012  # of the picture's height
MAX_DIFFERENCE = 0.25  # of the last colour; 1 is the difference between black and white
MIN_DIFFERENCE = 0.012  # three steps of 255; smaller differences are invisible
# Colours (sRGB) of increasing differences, which become lighter, so that the scale does not depend on hues.
COLOURS = np.array([[78, 28, 128], [196, 40, 104], [246, 128, 48], [255, 238, 170]], np.float32)


def ramp(amount: Float32) -> Float32:
    """Return the colours (..., 3), sRGB 0..255, of differences in units of `MAX_DIFFERENCE`, 0..1."""
    stops = np.linspace(0, 1, len(COLOURS))
    return np.stack([np.interp(amount, stops, COLOURS[:, k]) for k in range(3)], axis=-1).astype(np.float32)


def faint(neutral: UInt8) -> Float32:
    """Return the background (h, w, 3), sRGB 0..255, of a difference image, from pixels (h, w, 4)."""
    share = neutral[..., 3:] / np.float32(255)
    lit = np.concatenate([neutral[..., :3] * share, neutral[..., 3:]], axis=2)
    soft = Image.fromarray(np.rint(lit).astype(np.uint8), "RGBA")
    blurred = np.asarray(soft.filter(ImageFilter.GaussianBlur(BLUR * neutral.shape[0])), np.float32)
    out: Float32 = PAPER * (1 - STRENGTH * blurred[..., 3:] / 255) + STRENGTH * blurred[..., :3]
    return out


def difference(picture: UInt8, neutral: UInt8, below: Float32) -> UInt8:
    """Return the difference image (h, w, 3) of two pictures (h, w, 3), over the background `below`.

    The difference of two pixels is that of their most different channel.
    """
    amount = np.abs(picture.astype(np.int16) - neutral).max(axis=2) / np.float32(255)
    colour = ramp(np.minimum(amount / MAX_DIFFERENCE, 1))
    opacity = np.clip((amount - MIN_DIFFERENCE) / (2 * MIN_DIFFERENCE), 0, 1)[..., None]
    out: UInt8 = np.rint(below * (1 - opacity) + colour * opacity).astype(np.uint8)
    return out


def flatten(pixels: UInt8, behind: Any) -> UInt8:
    """Return pixels (h, w, 3) of a picture (h, w, 4), which is not premultiplied, over `behind`.

    Args:
        behind: a colour, or pixels (h, w, 3); 0..255.
    """
    share = pixels[..., 3:] / np.float32(255)
    mixed = pixels[..., :3] * share + np.asarray(behind, np.float32) * (1 - share)
    out: UInt8 = np.rint(mixed).astype(np.uint8)
    return out


SIZE = 240, 300  # pixels
FRONT = "close"
LARGEST = 480  # pixels; longer sides of photographs are reduced to this
VISIBLE, AREA = 20, 0.004  # a visible difference: a channel differs by 20 of 255 in 0.4 % of the pixels
Units = Mapping[tuple[int, str], float]  # (AU, side LEFT | RIGHT | BOTH) -> intensity 0..1


@dataclass(frozen=True)
class Variant:
    """A face, deformer and mapping that a study compares with others."""

    face: str  # name or path
    deformer: str | None = None  # "mpeg4", "au" or None
    mapping: Path | None = None  # file of AUs to FAPs, or None

    @property
    def name(self) -> str:
        parts = Path(self.face).name, self.deformer, self.mapping.name if self.mapping else None
        return " ".join(part for part in parts if part)


@dataclass
class Drawer:
    """A renderer of rows of the animation axis; a context manager, which closes the renderers."""

    step: Callable[[int], object] = lambda count: None  # called with 1 after each picture
    _open: dict[tuple[Variant, str], Renderer] = field(default_factory=dict)
    _stack: ExitStack = field(default_factory=ExitStack)

    def __enter__(self) -> Drawer:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def __call__(self, variant: Variant, rows: Sequence[Float32], camera: str = FRONT) -> list[UInt8]:
        """Return a picture (h, w, 4) of each row, transparent around the head."""
        if (variant, camera) not in self._open:
            renderer = Renderer(
                variant.face, SIZE, camera, background="transparent", deformer=variant.deformer
            )
            self._open[variant, camera] = self._stack.enter_context(renderer)
        frames = AUFrames(np.arange(len(rows), dtype=np.float64), np.stack(rows), rules())
        inputs = input_names(variant.face, deformer=variant.deformer)
        drawn = []
        mapping = mapping_of(variant.face, variant.mapping)
        for picture in self._open[variant, camera].frames(poses(frames, inputs, mapping)):
            drawn.append(picture.copy())
            self.step(1)
        return drawn


def row(units: Units | None = None, faps: Mapping[int, float] | None = None) -> Float32:
    """Return the row of the animation axis, (n_targets,) float32, of action units and FAPs."""
    values = au_row(units or {})
    for number, amount in (faps or {}).items():
        values[fap(number).column] = amount
    return values


def opaque(picture: UInt8) -> UInt8:
    """Return a picture (h, w, 4) over the backdrop's colour, (h, w, 3)."""
    return flatten(picture, np.rint(np.array(preset(None).backdrop_middle) * 255))


def differs(one: UInt8, other: UInt8) -> bool:
    """Return whether two pictures (h, w, 4) differ visibly."""
    apart = np.abs(opaque(one).astype(np.int16) - opaque(other)).max(axis=2)
    return bool((apart >= VISIBLE).mean() >= AREA)


def webp(picture: UInt8) -> bytes:
    """Return a picture (h, w, 3 or 4) as WebP without metadata."""
    buffer = io.BytesIO()
    image = Image.fromarray(opaque(picture) if picture.shape[2] == 4 else picture)
    image.thumbnail((LARGEST, LARGEST))
    image.save(buffer, "WEBP", quality=88)
    return buffer.getvalue()
