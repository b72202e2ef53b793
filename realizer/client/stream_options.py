"""Options of the streams and speeches of a client; the service chooses what is left out."""

from typing import Literal, TypedDict


class FrameOptions(TypedDict, total=False):
    """Frames a second, and the id of a character."""

    fps: float
    character: str


class PictureOptions(FrameOptions, total=False):
    """How pictures are drawn and encoded: width and height, names of camera, light and background."""

    size: tuple[int, int]
    camera: str
    light: str
    background: str
    format: Literal["jpeg", "png", "webp"]
    quality: int


class SoundOptions(TypedDict, total=False):
    """Samples a second, and the id of a character."""

    rate: int
    character: str


class SpeechOptions(TypedDict, total=False):
    """The id of a character, and the composition of the block; APPEND by default."""

    character: str
    composition: Literal["MERGE", "APPEND", "REPLACE"]


class TextOptions(SpeechOptions, total=False):
    """The id of speech that comes as text, its language, and whether it has no Markdown and the like."""

    id: str
    language: str
    plain: bool
