"""Playing and scheduling without a clock: `realizer.realize` and `realizer.schedule`."""

import errno
import os
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from bml_schema import parse
from realizer import pipeline
from realizer.behaviours.kind import Position
from realizer.behaviours.registry import VOCABULARY
from realizer.core.options import DEFAULTS, PlayOptions
from realizer.playback.player import Player
from realizer.playback.speaking import open_voice, submit_with_speech
from realizer.result import Realization
from realizer.scheduling.timing import Schedule
from realizer.sources import Source, documents_of, first_error, folder_of
from realizer.speech.utterance import Voice


def realize(
    source: Source | Iterable[Source],
    *,
    face: str | Path = "default",
    deformer: str | None = None,
    fps: float = 25.0,
    voice: Voice | str | None = None,
    scene: Mapping[str, Position] | None = None,
    seed: int = 0,
    idle: bool = True,
    liveliness: float = 1.0,
    language: str = "en-US",
    media: Path | str | None = None,
    expressions: Path | str | None = None,
    cooccurrence: str = "on",
    prosody: bool = True,
    jaw: float = 1.0,
    lips: float = 1.0,
    mapping: Path | str | None = None,
    grace: float = 0.5,
    max_planning: int = DEFAULTS.max_planning,
    strict_bml: bool = False,
    plain: bool = False,
) -> Realization:
    """Play documents or texts from start to end, without a clock.

    Args:
        source: BML, a text to speak, a file, or a list of these, which are submitted at 0 s, in order. A
            word that ends in .bml, .xml or .txt or holds a path separator is the name of a file; any other
            string, or bytes, that begin no document are spoken, as `spoken_text` reads them. A sound file
            is played; the lips follow it. Without `media`, documents find their files in their own folder.
        voice: a voice or its name; None for espeak-ng, or the silent voice if that is not installed.
        plain: whether a text is spoken sign by sign, without Markdown, stage directions and the like.
        face, deformer, fps, scene, seed, idle, liveliness, language, media, expressions, cooccurrence,
            prosody, jaw, lips, mapping, grace, max_planning, strict_bml: as in
            `realizer.core.options.PlayOptions`.

    Raises:
        BMLError: no document of the source can be read; with line and path.
        FileNotFoundError: there is no such file or folder.
        TypeError: the source or an option has another type.
        ValueError: there is no such face or voice, or a number is out of its range.
        TableError: a file of rules, a mapping or an expression that cannot be used.
        VoiceError: the named voice is not installed.
    """
    options = PlayOptions(
        face=str(face) if isinstance(face, Path) else face,
        deformer=deformer,
        fps=fps,
        scene=scene,
        seed=seed,
        idle=idle,
        liveliness=liveliness,
        language=language,
        media=_existing(media),
        expressions=_existing(expressions),
        cooccurrence=cooccurrence if cooccurrence in ("on", "off") else _file(cooccurrence),
        prosody=prosody,
        jaw=jaw,
        lips=lips,
        mapping=_existing(mapping),
        grace=grace,
        max_planning=max_planning,
        strict_bml=strict_bml,
    )
    documents = documents_of(source, language=language, plain=plain)
    options = replace(options, media=options.media or folder_of(document.file for document in documents))
    played = pipeline.play([document.bml for document in documents], options, _checked(voice))
    if not played.schedules:
        raise first_error(documents, VOCABULARY, strict_bml=strict_bml)
    return Realization.of(played)


def schedule(
    source: Source,
    *,
    voice: Voice | str | None = None,
    scene: Mapping[str, Position] | None = None,
    media: Path | str | None = None,
    strict_bml: bool = False,
) -> Schedule:
    """Return the sync times of one BML document, without animation.

    Args:
        source: BML, a text to speak, or a file, as in `realize`.

    Raises:
        BMLError: there is no valid document; with line and path.
        FileNotFoundError, TypeError, ValueError, VoiceError: as `realize`.
    """
    options = PlayOptions(scene=scene, media=_existing(media), strict_bml=strict_bml)
    documents = documents_of(source)
    if len(documents) > 1:
        raise ValueError(f"source: wanted one document, got {len(documents)}")
    options = replace(options, media=options.media or folder_of([documents[0].file]))
    block = parse(documents[0].bml, VOCABULARY, strict_bml=strict_bml)
    player = Player(options, animates=False)
    with open_voice(_checked(voice)) as speaker:
        return submit_with_speech(player, block, speaker)


def _existing(path: Path | str | None) -> Path | None:
    """Return a path that exists.

    Raises:
        FileNotFoundError: it does not; TypeError: it is none.
    """
    if path is None or not isinstance(path, Path | str):
        return path  # PlayOptions refuses what is no path
    if not Path(path).exists():
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
    return Path(path)


def _file(path: str) -> str:
    _existing(path)
    return path


def _checked(voice: Voice | str | None) -> Voice | str | None:
    if not (voice is None or isinstance(voice, str) or callable(getattr(voice, "say", None))):
        raise TypeError(f"voice: wanted the name of a voice, or a voice with a method `say`, got {voice!r}")
    return voice
