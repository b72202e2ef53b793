"""Search for the expressions that look like a picture of a face (Wojdel 2005, 3.2.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from realizer.animation.axis import au, axis
from realizer.animation.frames import AUFrames
from realizer.animation.pose import poses
from realizer.core.array_types import Bool, Float32, UInt8
from realizer.core.errors import RealizerError
from realizer.expressions.expression import Expression
from realizer.face.fap_mapping import mapping_of
from realizer.face.load import input_names, list_faces
from realizer.render import Renderer
from realizer.render.light import presets

HEIGHT = 96  # pixels that pictures are compared at, so that a brow counts wherever in its way it is
FINE = 4  # times as high they are drawn, so that they are as smooth as one made smaller
STEPS = (0.5, 1.0)  # intensities that are compared: weak and strong ones move other places
LIGHT = "portrait"  # the light of the reference pictures
# Correlation with the neutral face: below it, a picture is not that face in front view.
ALIKE = 0.8
# A picture that differs from the neutral one by less (root mean square over the face, of white; what drawing
# at another size leaves is 0.004) in a way that is like no expression (cosine) is neutral.
REST, UNLIKE = 0.006, 0.45


class UnknownPictureError(RealizerError):
    """A picture in which none of our faces is seen from the front."""


@dataclass(frozen=True, eq=False)
class Likeness:
    """A recognised picture: face, light and expression.

    Attributes:
        matches: (expression, cosine 0..1 between what both change in the neutral face), the best first.
        neutral: it looks like no expression, but like the neutral face.
    """

    face: str
    light: str
    matches: Sequence[tuple[Expression, float]]
    neutral: bool


def read_picture(path: Path) -> UInt8:
    """Return a picture file as (h, w, 3), with transparency on black.

    Raises:
        UnknownPictureError: no picture.
    """
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(path) as image:
            seen = image.convert("RGBA")
            plain = Image.new("RGBA", seen.size, (0, 0, 0, 255))
            return np.asarray(Image.alpha_composite(plain, seen).convert("RGB"))
    except (UnidentifiedImageError, OSError, Image.DecompressionBombError) as error:
        raise UnknownPictureError(f"{path}: wanted a picture, got: {error}") from None


def by_picture(
    picture: UInt8, expressions: Sequence[Expression], faces: Sequence[str] | None = None
) -> Likeness:
    """The expressions that change a face as the picture does.

    The face and its light are those whose neutral picture is nearest; the difference to it is
    compared with what each expression changes in it at full intensity, so that weak and strong ones count as
    alike.

    Args:
        picture: (h, w, 3), the front view as `realizer realize -o x.png --at T` draws it, of any size.
        faces: names to look for; None: every face there is.

    Raises:
        UnknownPictureError: none of them is in it.
        RenderError: pictures cannot be drawn here.
    """
    height, width = picture.shape[:2]
    size = max(round(width * HEIGHT / height), 1), HEIGHT
    if not HEIGHT // 4 <= size[0] <= 4 * HEIGHT:
        raise UnknownPictureError(f"{_WANTED}, got one of {width}x{height} pixels")
    seen = _brightness(_resized(picture, size))
    names = [info.name for info in list_faces()] if faces is None else faces
    # The face shows through expression and light; the light is found on that face alone.
    name = max(names, key=lambda one: _alike(seen, *_neutral(one, LIGHT, size)))
    light = max(presets(), key=lambda one: _alike(seen, *_neutral(name, one, size)))
    if _alike(seen, *_neutral(name, light, size)) < ALIKE:
        raise UnknownPictureError(f"{_WANTED} ({', '.join(names)}), got one that is like none of them")
    rows = np.zeros((len(expressions) * len(STEPS) + 1, len(axis())), np.float32)
    asked = [(one, step) for one in expressions for step in STEPS]
    for row, (one, step) in zip(rows[1:], asked, strict=True):
        for (number, side), value in one.aus.items():
            row[[target.column for target in au(number, side)]] = value * step
    (rest, face), *shown = _drawn(name, light, size, rows)
    changed = (seen - rest)[face]
    scores: dict[str, float] = {}
    for (one, _), (look, _) in zip(asked, shown, strict=True):
        change = (look - rest)[face]
        length = float(np.linalg.norm(change) * np.linalg.norm(changed))
        score = float(change @ changed) / length if length else 0.0
        scores[one.name] = max(score, scores.get(one.name, 0.0))
    found = [(one, scores[one.name]) for one in expressions]
    found.sort(key=lambda pair: -pair[1])
    little = float(np.sqrt(np.mean(changed**2))) < REST
    neutral = little and max(scores.values(), default=0.0) < UNLIKE
    return Likeness(name, light, () if neutral else found, neutral)


_WANTED = "wanted a picture of one of our faces from the front, as `realizer realize --at` draws it"


@lru_cache(maxsize=32)
def _neutral(name: str, light: str, size: tuple[int, int]) -> tuple[Float32, Bool]:
    return _drawn(name, light, size, np.zeros((1, len(axis())), np.float32))[0]


def _drawn(name: str, light: str, size: tuple[int, int], rows: Float32) -> list[tuple[Float32, Bool]]:
    """Each pose: brightness (h, w) 0..1, and where the head is."""
    frames = AUFrames(np.arange(len(rows), dtype=np.float64), rows)
    takings = poses(frames, input_names(name), mapping_of(name))
    fine = size[0] * FINE, size[1] * FINE
    with Renderer(name, fine, "front", light=light, background="transparent") as renderer:
        pictures = [_resized(picture, size) for picture in renderer.frames(takings)]
    return [(_brightness(picture[..., :3]), picture[..., 3] > 250) for picture in pictures]


def _alike(seen: Float32, look: Float32, face: Bool) -> float:
    """The correlation of two pictures where the face is; how bright they are does not count."""
    one, other = (part[face] - part[face].mean() for part in (seen, look))
    size = float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(one @ other) / size if size else 0.0


def _brightness(picture: UInt8) -> Float32:
    weights = np.array([0.2126, 0.7152, 0.0722], np.float32) / 255
    return np.asarray(picture.astype(np.float32) @ weights, np.float32)


def _resized(picture: UInt8, size: tuple[int, int]) -> UInt8:
    from PIL import Image

    return np.asarray(Image.fromarray(picture).resize(size, Image.Resampling.BOX))
