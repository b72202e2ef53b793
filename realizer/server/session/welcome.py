"""The `welcome` message: version, capabilities and limits."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from realizer.core.settings import Settings
from realizer.expressions.library import library_of
from realizer.protocol.messages.common import MAX_CONTENT, MAX_CONTROL, MAX_FPS, PICTURES
from realizer.protocol.messages.replies import Capabilities, Limits, Welcome
from realizer.protocol.streams import STREAMS
from realizer.server.documents.limits import MAX_CHARACTERS


def build_welcome(id: str, t: float, seq: int, s: Settings, capabilities: Mapping[str, Any]) -> Welcome:
    """Return the answer to `hello`.

    Args:
        id: name of the session.
        t: seconds on the session clock.
        seq: number of the newest feedback.
        capabilities: result of `capabilities_of`.
    """
    return Welcome(
        session=id,
        time=t,
        seq=seq,
        capabilities=Capabilities(
            streams={stream: list(row.encodings) for stream, row in STREAMS.items()},
            pictures=list(PICTURES),
            fps=s.fps,
            # Those of a folder may have changed since the service began.
            **{
                **capabilities,
                **({} if s.edit is None else {"expressions": sorted(library_of(s.library_folder))}),
            },
        ),
        limits=Limits(
            message=s.max_message,
            document=s.max_document,
            control=MAX_CONTROL,
            content=MAX_CONTENT,
            behaviours=s.max_behaviours,
            elements=s.max_elements,
            duration=s.max_duration,
            speech=s.max_speech,
            blocks=s.max_blocks,
            characters=MAX_CHARACTERS,
            connections=s.max_connections,
            rate=s.max_rate,
            picture=s.max_size,
            pixels=s.max_pixels,
            fps=MAX_FPS,
            keep=s.keep,
        ),
    )


def capabilities_of(settings: Settings) -> dict[str, Any]:
    """Return the capabilities of the service without its streams: names that documents and messages use."""
    from realizer.animation.axis import AU_NAMES
    from realizer.behaviours.registry import KINDS
    from realizer.emotions.words import known_words
    from realizer.face.load import list_faces, load_face
    from realizer.render.cameras import camera_names
    from realizer.render.light import presets
    from realizer.speech.registry import voices
    from realizer.tables.lexemes import face_lexemes, head_lexemes

    return {
        "behaviours": sorted(tag.partition("}")[2] for tag in KINDS),
        "lexemes": {"faceLexeme": sorted(face_lexemes()), "head": sorted(head_lexemes())},
        "emotions": sorted(known_words()),
        "expressions": sorted(library_of(settings.library_folder)),
        "aus": list(AU_NAMES()),
        "faces": [face.name for face in list_faces()],
        "voices": [voice.name for voice in voices() if voice.available],
        "cameras": list(camera_names(load_face(settings.face, deformer=settings.deformer))),
        "lights": list(presets()),
    }
