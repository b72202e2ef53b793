"""The output .png: a contact sheet over time, or the face at one instant."""

import io
from dataclasses import dataclass

import numpy as np

from realizer.core.array_types import Float32, UInt8
from realizer.outputs import speech_spans
from realizer.outputs.output import Output, RenderSettings
from realizer.realization import Realization

MOST = 24  # pictures on a sheet
LEAST = 8  # pictures at least, if there are as many frames
PACE = 0.25  # s between pictures of a sheet without many sync points


@dataclass(frozen=True, slots=True)
class Moment:
    """A picture of a sheet: frame number, seconds, and the sync points nearest to it."""

    frame: int
    time: float
    points: tuple[str, ...]


def moments(realization: Realization) -> tuple[Moment, ...]:
    """Choose frames for a sheet: the first, the last, those of sync points, and the middles of wide gaps.

    If more than MOST frames have sync points, those closest to the one before are dropped.
    """
    count = len(realization.faps.times)
    points = _points(realization, count)
    chosen = sorted({0, count - 1, *points})
    while len(chosen) > MOST:
        gaps = np.diff(chosen[:-1])
        del chosen[int(np.argmin(gaps)) + 1]
    wanted = min(MOST, count, max(LEAST, round(realization.duration / PACE)))
    while len(chosen) < wanted:
        gaps = np.diff(chosen)
        widest = int(np.argmax(gaps))
        if gaps[widest] < 2:
            break
        chosen.insert(widest + 1, (chosen[widest] + chosen[widest + 1]) // 2)
    return tuple(Moment(k, k / realization.fps, points.get(k, ())) for k in chosen)


def row_at(realization: Realization, seconds: float) -> Float32:
    """Return the pose (k,) at an instant, interpolated between frames; the nearest outside of them."""
    frames = realization.poses
    place = min(max(seconds * realization.fps, 0.0), len(frames) - 1)
    below, part = int(place), np.float32(place % 1)
    above = min(below + 1, len(frames) - 1)
    return np.asarray(frames[below] * (1 - part) + frames[above] * part)


def picture_at(realization: Realization, drawing: RenderSettings) -> UInt8:
    """Return the picture at `drawing.at`, (h, w, 3) uint8; with alpha, if the background is transparent."""
    seconds = drawing.at or 0.0
    size, alpha = _picture_size(drawing)
    first, part = next(f for f in reversed(realization.faces) if f[0] <= max(seconds * realization.fps, 0))
    with drawing.make_renderer(realization, size, part.face_name, alpha=alpha) as renderer:
        pictures: UInt8 = renderer.draw(row_at(part, seconds - first / realization.fps)[None])
    picture: UInt8 = pictures[0]
    return picture


def encode_png(pixels: UInt8) -> bytes:
    """Encode (h, w, 3) uint8, or (h, w, 4) with alpha, as PNG."""
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(pixels)).save(buffer, "PNG", compress_level=6)
    return buffer.getvalue()


def _encode(realization: Realization, drawing: RenderSettings) -> bytes:
    """Encode the picture at `drawing.at`, or else the sheet, with pictures of half the size."""
    from realizer.render.contact_sheet import sheet

    if drawing.at is not None:
        return encode_png(picture_at(realization, drawing))
    size, _ = _picture_size(drawing)
    shown = moments(realization)
    pictures = drawing.pictures(realization, size, [moment.frame for moment in shown])
    titles = [f"{moment.time:.2f} s" for moment in shown]
    return encode_png(sheet(list(pictures), titles, [moment.points for moment in shown]))


def _picture_size(drawing: RenderSettings) -> tuple[tuple[int, int], bool]:
    width, height = drawing.size
    if drawing.at is not None:
        return (width, height), True
    return (max(1, width // 2), max(1, height // 2)), False


def _points(realization: Realization, count: int) -> dict[int, tuple[str, ...]]:
    """Return the sync points nearest to each frame, with block names if there are several blocks."""
    names: dict[int, tuple[str, ...]] = {}
    # With one block, its name is left out.
    own = "" if len(realization.schedules) != 1 else f"{realization.schedules[0].block}:"
    for time, name in speech_spans.points(realization):
        frame = min(max(round(time * realization.fps), 0), count - 1)
        names[frame] = (*names.get(frame, ()), name.removeprefix(own))
    return names


PNG = Output(
    ".png", "image/png", "a contact sheet over time, or one instant", _encode, ("render",), _picture_size
)
