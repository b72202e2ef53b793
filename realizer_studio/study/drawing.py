"""A drawer of small pictures without metadata, for studies."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from PIL import Image

from realizer.animation.axis import au_row, fap
from realizer.animation.frames import AUFrames
from realizer.animation.pose import poses
from realizer.core.array_types import Float32, UInt8
from realizer.face.fap_mapping import mapping_of
from realizer.face.load import input_names
from realizer.render.light import preset
from realizer.render.renderer import Renderer
from realizer.tables.cooccurrence import rules
from realizer_studio.study.difference_image import flatten

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
