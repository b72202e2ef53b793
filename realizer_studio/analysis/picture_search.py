"""Search for expressions that look like a picture of a face (Wojdel 2005, 3.2.2)."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError

from realizer.animation.axis import au_row
from realizer.animation.frames import AUFrames
from realizer.animation.pose import poses
from realizer.core.array_types import Bool, Float32, UInt8
from realizer.core.errors import RealizerError
from realizer.expressions.expression import Expression
from realizer.face.fap_mapping import mapping_of
from realizer.face.load import input_names, list_faces
from realizer.render.light import presets
from realizer.render.renderer import Renderer

HEIGHT = 96  # pixels of compared pictures; small, so that brows of different heights overlap
FINE = 4  # pictures are drawn larger by this factor and reduced, to be smooth
STEPS = (0.5, 1.0)  # compared intensities, which move different regions
LIGHT = "portrait"  # the light of the reference pictures
MIN_CORRELATION = 0.8  # of a front view with the neutral face
# A picture is neutral if its difference from the neutral face is small (root mean square, of white; drawing
# at another size makes 0.0065) and similar to no expression (cosine).
MAX_NEUTRAL, MAX_COSINE = 0.009, 0.45


class UnknownPictureError(RealizerError):
    """A picture that does not show a known face from the front."""


@dataclass(frozen=True, eq=False)
class Likeness:
    """A recognised picture: face, light and expression."""

    face: str
    light: str
    # (expression, cosine between its and the picture's difference from the neutral face), best first.
    matches: Sequence[tuple[Expression, float]]
    neutral: bool  # whether the picture shows the neutral face


def read_picture(path: Path) -> UInt8:
    """Read a picture as (h, w, 3), transparent parts in black; raises UnknownPictureError."""
    try:
        with Image.open(path) as image:
            picture = image.convert("RGBA")
            black = Image.new("RGBA", picture.size, (0, 0, 0, 255))
            return np.asarray(Image.alpha_composite(black, picture).convert("RGB"))
    except (UnidentifiedImageError, OSError, Image.DecompressionBombError) as error:
        raise UnknownPictureError(f"{path}: wanted a picture, got: {error}") from None


def by_picture(
    picture: UInt8, expressions: Sequence[Expression], faces: Sequence[str] | None = None
) -> Likeness:
    """Return the face, light and expressions that are most similar to a picture.

    The face and light are those whose neutral picture has the best correlation. The difference from that
    picture is then compared with the difference that each expression makes, regardless of its strength.

    Args:
        picture: (h, w, 3), a front view as `realizer realize -o x.png --at T` draws it, of any size.
        faces: names of faces to consider; None: all.

    Raises:
        UnknownPictureError: none of the faces is in the picture.
        RenderError: pictures cannot be drawn.
    """
    height, width = picture.shape[:2]
    size = max(round(width * HEIGHT / height), 1), HEIGHT
    if not HEIGHT // 4 <= size[0] <= 4 * HEIGHT:
        raise UnknownPictureError(f"{_EXPECTED}, got one of {width}x{height} pixels")
    brightness = _brightness(_resized(picture, size))
    names = [info.name for info in list_faces()] if faces is None else faces
    # Faces differ more than lights and expressions, so the light is searched for one face only.
    name = max(names, key=lambda name: _correlation(brightness, *_neutral(name, LIGHT, size)))
    light = max(presets(), key=lambda light: _correlation(brightness, *_neutral(name, light, size)))
    if _correlation(brightness, *_neutral(name, light, size)) < MIN_CORRELATION:
        raise UnknownPictureError(f"{_EXPECTED} ({', '.join(names)}), got one that is like none of them")
    candidates = [(expression, step) for expression in expressions for step in STEPS]
    rows = [au_row({}), *(step * au_row(expression.aus) for expression, step in candidates)]
    (rest, face), *drawn = _draw(name, light, size, np.stack(rows))
    difference = (brightness - rest)[face]
    scores: dict[str, float] = {}
    for (expression, _), (drawing, _) in zip(candidates, drawn, strict=True):
        change = (drawing - rest)[face]
        norms = float(np.linalg.norm(change) * np.linalg.norm(difference))
        score = float(change @ difference) / norms if norms else 0.0
        scores[expression.name] = max(score, scores.get(expression.name, 0.0))
    matches = sorted(
        ((expression, scores[expression.name]) for expression in expressions), key=lambda match: -match[1]
    )
    is_small = float(np.sqrt(np.mean(difference**2))) < MAX_NEUTRAL
    neutral = is_small and max(scores.values(), default=0.0) < MAX_COSINE
    return Likeness(name, light, () if neutral else matches, neutral)


_EXPECTED = "wanted a picture of one of our faces from the front, as `realizer realize --at` draws it"


@lru_cache(maxsize=32)
def _neutral(name: str, light: str, size: tuple[int, int]) -> tuple[Float32, Bool]:
    return _draw(name, light, size, au_row({})[None])[0]


def _draw(name: str, light: str, size: tuple[int, int], rows: Float32) -> list[tuple[Float32, Bool]]:
    """Draw poses and return for each the brightness (h, w) 0..1 and a mask of the head."""
    frames = AUFrames(np.arange(len(rows), dtype=np.float64), rows)
    rows_of_poses = poses(frames, input_names(name), mapping_of(name))
    fine = size[0] * FINE, size[1] * FINE
    with Renderer(name, fine, "front", light=light, background="transparent") as renderer:
        pictures = [_resized(picture, size) for picture in renderer.frames(rows_of_poses)]
    return [(_brightness(picture[..., :3]), picture[..., 3] > 250) for picture in pictures]


def _correlation(one: Float32, other: Float32, face: Bool) -> float:
    """Return the correlation of two pictures in the area of the face."""
    a, b = (picture[face] - picture[face].mean() for picture in (one, other))
    norms = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(a @ b) / norms if norms else 0.0


def _brightness(picture: UInt8) -> Float32:
    weights = np.array([0.2126, 0.7152, 0.0722], np.float32) / 255
    return np.asarray(picture.astype(np.float32) @ weights, np.float32)


def _resized(picture: UInt8, size: tuple[int, int]) -> UInt8:
    return np.asarray(Image.fromarray(picture).resize(size, Image.Resampling.BOX))
