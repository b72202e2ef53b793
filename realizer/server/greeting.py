"""A session in, what it says to a client that says hello out: what there is, and what is too much."""

from __future__ import annotations

from typing import TYPE_CHECKING

from realizer.server.limits import MAX_CHARACTERS
from realizer.server.messages import MAX_CONTROL, MAX_FPS, PICTURES, STREAMS, Capabilities, Limits, Welcome

if TYPE_CHECKING:
    from realizer.server.session import Session

__all__: list[str] = []


def greeting(session: Session, t: float) -> Welcome:
    """What `hello` is answered with; `t` is seconds on the session clock."""
    s = session.settings
    return Welcome(
        session=session.id,
        time=t,
        seq=session.log.newest,
        capabilities=Capabilities(
            streams={stream: list(encodings) for stream, encodings in STREAMS.items()},
            pictures=list(PICTURES),
            fps=s.fps,
            **session.capabilities,
        ),
        limits=Limits(
            message=s.max_message,
            document=s.max_document,
            control=MAX_CONTROL,
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
