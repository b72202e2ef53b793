"""The options of the streams of a client, as keyword arguments."""

from __future__ import annotations

from typing import Literal, TypedDict


class FrameOptions(TypedDict, total=False):
    """Options of streams of frames.

    Attributes:
        fps: frames a second; default: the service's rate.
        character: id of a character; default: the first.
    """

    fps: float
    character: str


class PictureOptions(FrameOptions, total=False):
    """Options of pictures.

    Attributes:
        size: width and height.
        camera, light, background: names; default: the service's.
        format: of the pictures; jpeg, if there is none.
        quality: 1..100, of JPEG and WebP.
    """

    size: tuple[int, int]
    camera: str
    light: str
    background: str
    format: Literal["jpeg", "png", "webp"]
    quality: int


class SoundOptions(TypedDict, total=False):
    """Options of sound.

    Attributes:
        rate: samples a second.
        character: id of a character; default: the first.
    """

    rate: int
    character: str


class SpeechOptions(TypedDict, total=False):
    """Options of a speech.

    Attributes:
        character: id of a character; default: the first.
        composition: of its block; APPEND, if there is none.
    """

    character: str
    composition: Literal["MERGE", "APPEND", "REPLACE"]
