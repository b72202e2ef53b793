"""Playing and scheduling without a clock: `realizer.realize` and `realizer.schedule`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from bml_schema import parse
from realizer import pipeline
from realizer.behaviours.kind import Position
from realizer.behaviours.registry import VOCABULARY
from realizer.core.options import DEFAULTS, PlayOptions
from realizer.playback.player import Player
from realizer.playback.speaking import open_voice, submit_with_speech
from realizer.realization import Realization
from realizer.scheduling.timing import Schedule
from realizer.speech.utterance import Voice


def realize(
    documents: str | bytes | Iterable[str | bytes],
    *,
    face: str = "default",
    deformer: str | None = None,
    fps: float = 25.0,
    voice: Voice | str | None = None,
    scene: Mapping[str, Position] | None = None,
    seed: int = 0,
    idle: bool = True,
    liveliness: float = 1.0,
    language: str = "en-US",
    media: Path | None = None,
    expressions: Path | None = None,
    cooccurrence: str = "on",
    prosody: bool = True,
    jaw: float = 1.0,
    lips: float = 1.0,
    mapping: Path | None = None,
    grace: float = 0.5,
    max_planning: int = DEFAULTS.max_planning,
    strict_bml: bool = False,
) -> Realization:
    """Play BML documents from start to end, without a clock.

    Args:
        documents: BML text, or several texts; all are submitted at t = 0, in order.
        voice: a voice or its name; None for espeak-ng, or the silent voice if that is not installed.
        face, deformer, fps, scene, seed, idle, liveliness, language, media, expressions, cooccurrence,
            prosody, jaw, lips, mapping, grace, max_planning, strict_bml: as in
            `realizer.core.options.PlayOptions`.

    Raises:
        FaceError: no such face.
        TableError: a file of rules, a mapping or an expression that cannot be used.
        ValueError: `fps` is not a number above 0, or `liveliness` not one from 0 to 1.
        VoiceError: the named voice is not installed.
    """
    options = PlayOptions(
        face=face,
        deformer=deformer,
        fps=fps,
        scene=scene,
        seed=seed,
        idle=idle,
        liveliness=liveliness,
        language=language,
        media=media,
        expressions=expressions,
        cooccurrence=cooccurrence,
        prosody=prosody,
        jaw=jaw,
        lips=lips,
        mapping=mapping,
        grace=grace,
        max_planning=max_planning,
        strict_bml=strict_bml,
    )
    texts = [documents] if isinstance(documents, str | bytes) else documents
    return pipeline.play(texts, options, voice)


def schedule(
    document: str | bytes,
    *,
    voice: Voice | str | None = None,
    scene: Mapping[str, Position] | None = None,
    media: Path | None = None,
    strict_bml: bool = False,
) -> Schedule:
    """Return the sync times of one BML document, without animation.

    Raises:
        BMLError: the text has no valid document; with line and path.
        VoiceError: the named voice is not installed.
    """
    player = Player(PlayOptions(scene=scene, media=media), animates=False)
    block = parse(document, VOCABULARY, strict_bml=strict_bml)
    with open_voice(voice) as speaker:
        return submit_with_speech(player, block, speaker)
