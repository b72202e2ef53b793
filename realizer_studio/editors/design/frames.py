"""Vertices of timelines and expressions, for the head of the page."""

import io
import tempfile
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from bml_schema import CORE, OWN, parse
from realizer.animation.axis import AU_NAMES
from realizer.animation.blend import blend
from realizer.animation.channel import Channel
from realizer.animation.frames import AUFrames
from realizer.animation.pose import poses
from realizer.behaviours import pose_channels
from realizer.behaviours.registry import VOCABULARY
from realizer.core.options import PlayOptions
from realizer.core.settings import Settings
from realizer.expressions.library import library_of
from realizer.expressions.timeline import Timeline
from realizer.expressions.timeline_file import write_timeline
from realizer.face.deform import deform
from realizer.face.fap_mapping import mapping_of
from realizer.face.load import face_folders, face_name, input_names, load_face
from realizer.face.surface import quantise
from realizer.playback.player import Player
from realizer.tables.lexemes import read_aus

FPS = 25.0
MOST = 50  # frames of one answer
FILE = "timeline.toml"
PICTURE, THUMB = 108, 84  # pixels of a picture, and of the face in it
COLUMNS = 8  # of the sheet


def document(name: str = FILE) -> str:
    """Return BML that plays a timeline file of the media folder, as `realizer timeline` does."""
    node = f'<own:timeline id="timeline" fileName={quoteattr(name)}/>'
    return f'<bml xmlns="{CORE}" xmlns:own="{OWN}" id="timeline">{node}</bml>'


def timeline_frames(request: Mapping[str, Any], timeline: Timeline, settings: Settings) -> dict[str, Any]:
    """Return the vertices of `count` frames, 25 a second, from frame `first`, as int16 in base64.

    The face is `face` of the request, without idle motion; scale and offset are those of the stream `mesh`.
    """
    first, count = int(request.get("first", 0)), int(request.get("count", 1))
    if not (0 <= first <= 10**6 and 1 <= count <= MOST):
        raise ValueError(f"frames: wanted first from 0 and count 1..{MOST}, got {first} and {count}")
    options = _options(request, settings)
    player = _player(write_timeline(timeline), options, library_of(settings.library_folder).edition)
    times = np.arange(first, first + count) / FPS
    channels, idle = player.motion(times)
    return {"first": first, **_vertices(blend(channels, times, player.rules, idle), options)}


def expression_frame(request: Mapping[str, Any], settings: Settings) -> dict[str, Any]:
    """Return the vertices of action units, {"12L": 0..1}, and as `seen` the units after co-occurrence."""
    intensities = {name: value for name, value in dict(request["aus"]).items() if value}
    options = _options(request, settings)
    channels = _constant_channels(read_aus(intensities, "aus") if intensities else {})
    frames = blend(channels, np.array([0.5]), Player(options).rules)
    blended = {
        name: round(float(value), 3)
        for name, value in zip(AU_NAMES(), frames.moving[:, 0], strict=True)
        if value
    }
    requested = {channel.target.name: round(float(channel.values[0]), 3) for channel in channels}
    return {"first": 0, "seen": blended, "asked": requested, **_vertices(frames, options)}


def sheet(face: str, settings: Settings) -> bytes:
    """Return a contact sheet of the library's expressions, 8 in a row, as WebP."""
    from PIL import Image

    from realizer.render.renderer import Renderer

    options = replace(settings.play_options(), face=face)
    expressions = list(library_of(settings.library_folder).values())
    rows = [
        blend(_constant_channels(expression.aus), np.array([0.5])).values[0] for expression in expressions
    ]
    frames = AUFrames(np.arange(len(rows), dtype=np.float64), np.stack(rows))
    columns = poses(
        frames, input_names(face, deformer=options.deformer), mapping_of(options.face, options.mapping)
    )
    with Renderer(face, (PICTURE, PICTURE), "close", deformer=options.deformer) as renderer:
        pictures = renderer.draw(columns)[:, PICTURE - THUMB - 8 : PICTURE - 8, (PICTURE - THUMB) // 2 :][
            :, :, :THUMB
        ]
    contact_sheet = Image.new("RGB", (COLUMNS * THUMB, -(-len(pictures) // COLUMNS) * THUMB))
    for k, picture in enumerate(pictures):
        contact_sheet.paste(
            Image.fromarray(picture[..., :3].copy()), (k % COLUMNS * THUMB, k // COLUMNS * THUMB)
        )
    file = io.BytesIO()
    contact_sheet.save(file, "webp", quality=80)
    return file.getvalue()


def _constant_channels(aus: Mapping[tuple[int, str], float]) -> Sequence[Channel]:
    return [
        Channel(target, np.array([0.0, 1.0]), np.array([value, value]))
        for target, value in pose_channels.columns(aus, 1.0).items()
    ]


def _options(request: Mapping[str, Any], settings: Settings) -> PlayOptions:
    face = str(request.get("face") or settings.face)
    if face != settings.face and face_name(face) not in face_folders():
        raise ValueError(f"face: wanted one of {', '.join(face_folders())}, got {face[:80]!r}")
    return replace(settings.play_options(), face=face, idle=False)


@lru_cache(maxsize=8)
def _player(content: str, options: PlayOptions, edition: int) -> Player:
    """Return a player with a timeline that starts at 0 s, for an edition of the library."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, FILE).write_text(content, "utf-8")
        player = Player(
            replace(options, media=Path(folder)),
            history=float("inf"),
            face_inputs=lambda _: input_names(options.face, deformer=options.deformer),
        )
        player.submit(parse(document(), VOCABULARY), 0.0, {})
    return player


def _vertices(frames: AUFrames, options: PlayOptions) -> dict[str, Any]:
    face = load_face(options.face, deformer=options.deformer)
    moved = quantise(
        face, deform(face, poses(frames, face.inputs, mapping_of(options.face, options.mapping)))
    )
    data = b64encode(moved.astype("<i2").tobytes()).decode()
    return {"count": len(moved), "face": options.face, "data": data}
