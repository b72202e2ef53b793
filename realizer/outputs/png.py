"""The output .png: a contact sheet over time, or the face at one instant."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from realizer.core.array_types import Float32, UInt8
from realizer.outputs.output import Output, RenderSettings

if TYPE_CHECKING:
    from realizer.realization import Realization

MOST = 24  # pictures on a sheet
LEAST = 8  # and so many at least, where there are as many frames
PACE = 0.25  # s; what a sheet without many sync points shows


@dataclass(frozen=True, slots=True)
class Moment:
    """One picture of a sheet: frame number, seconds, and the sync points nearest to it."""

    frame: int
    time: float
    points: tuple[str, ...]


def moments(realization: Realization, most: int = MOST) -> tuple[Moment, ...]:
    """The frames worth a picture, in order: first, last, sync points, then the widest gaps halved.

    Where more than `most` frames have a sync point, those closest to the one before go first.
    """
    count = len(realization.faps.times)
    points = _points(realization, count)
    chosen = sorted({0, count - 1, *points})
    while len(chosen) > most:
        gaps = np.diff(chosen[:-1])
        del chosen[int(np.argmin(gaps)) + 1]
    wanted = min(most, count, max(LEAST, round(realization.duration / PACE)))
    while len(chosen) < wanted:
        gaps = np.diff(chosen)
        widest = int(np.argmax(gaps))
        if gaps[widest] < 2:
            break
        chosen.insert(widest + 1, (chosen[widest] + chosen[widest + 1]) // 2)
    return tuple(Moment(k, k / realization.fps, points.get(k, ())) for k in chosen)


def row_at(realization: Realization, seconds: float) -> Float32:
    """(k,) the pose at an instant, between the two frames around it; outside of all, the nearest."""
    frames = realization.poses
    place = min(max(seconds * realization.fps, 0.0), len(frames) - 1)
    below = int(place)
    above = min(below + 1, len(frames) - 1)
    part = np.float32(place - below)
    row: Float32 = frames[below] * (1 - part) + frames[above] * part
    return row


def encode_png(pixels: UInt8) -> bytes:
    """PNG bytes of (h, w, 3) uint8, or of (h, w, 4) with alpha."""
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(pixels)).save(buffer, "PNG", compress_level=6)
    return buffer.getvalue()


def _encode(realization: Realization, drawing: RenderSettings) -> bytes:
    """With `drawing.at` the picture of that instant; otherwise the sheet, its pictures at half the size."""
    from realizer.render.contact_sheet import sheet

    size, alpha = _picture_size(drawing)
    if drawing.at is not None:
        now = drawing.at * realization.fps
        first, part = next(pair for pair in reversed(realization.faces) if pair[0] <= max(now, 0))
        with drawing.make_renderer(realization, size, alpha=alpha, face=part.face_name) as renderer:
            (picture,) = renderer.draw(row_at(part, drawing.at - first / realization.fps)[None])
        return encode_png(picture)
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
    """Frame number -> the sync points nearest to it; a block is named where there are several."""
    found: dict[int, list[str]] = {}
    several = len(realization.schedules) > 1
    for schedule in realization.schedules:
        for behaviour, times in schedule.times.items():
            for point, time in zip(schedule.points[behaviour], times, strict=True):
                frame = min(max(round((schedule.start + float(time)) * realization.fps), 0), count - 1)
                name = f"{schedule.block}:{behaviour}:{point}" if several else f"{behaviour}:{point}"
                found.setdefault(frame, []).append(name)
    return {frame: tuple(names) for frame, names in found.items()}


PNG = Output(
    ".png",
    "image/png",
    "a contact sheet over time, or one instant",
    _encode,
    ("render",),
    _picture_size,
    reader="PIL",
)
