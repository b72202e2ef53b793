"""The eight steps without a clock: BML documents in, a Realization of frames, sound and feedback out."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from bml_schema import Block, BMLError, read
from realizer.behaviours.kind import Position
from realizer.behaviours.registry import VOCABULARY
from realizer.core.errors import VoiceError
from realizer.face.fap_mapping import mapping_of
from realizer.playback.player import Player
from realizer.realization import Realization, seen
from realizer.scheduling.timing import Schedule, Warning
from realizer.speech.duration_fit import fitted, stretched, without_sound
from realizer.speech.utterance import Say, Utterance, Voice

if TYPE_CHECKING:
    pass


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
    language: str = "en-US",
    media: Path | None = None,
    expressions: Path | None = None,
    cooccurrence: str = "on",
    prosody: bool = True,
    mapping: Path | None = None,
) -> Realization:
    """Play BML documents from start to end, without a clock.

    Args:
        documents: BML text, or several texts; all are submitted at t = 0, in order.
        face: name of a face folder.
        deformer: what moves it: "mpeg4" (FAPs) or "au" (its model of action units); None is what it says.
        fps: frames a second.
        voice: a voice or its name; None takes espeak-ng where it is installed, otherwise the silent voice.
        scene: target name -> (x, y, z) metres, origin between the eyes.
        seed: for idle motion; the same seed gives the same frames.
        idle: blinks and small head motion.
        media: the folder of the files that documents may name.
        expressions: a folder of expressions of the user's own, which documents may name.
        cooccurrence: which AUs a face can show together: "on", "off", or a file of rules.
        prosody: nods, brows, blinks and looks that go with what is said; none without `idle`.
        mapping: a file of what AUs ask of FAPs; it goes before what the face says.

    Raises:
        FaceError: no such face.
        TableError: a file of rules, a mapping or an expression that cannot be used.
        VoiceError: the named voice is not installed.
    """
    from realizer.face.load import face_name, takes

    in_force = mapping_of(face, mapping)
    texts = [documents] if isinstance(documents, str | bytes) else list(documents)
    if not (math.isfinite(fps) and fps > 0):
        raise ValueError(f"fps: wanted a number above 0, got {fps}")
    player = Player(
        scene=scene,
        seed=seed,
        idle=idle,
        language=language,
        media=media,
        expressions=expressions,
        history=float("inf"),
        cooccurrence=cooccurrence,
        prosody=prosody,
        takes=lambda _: takes(face, deformer=deformer),
    )
    accepted, refused = play(texts, player, voice)
    # Blocks act on each other while they play: what is seen and heard is known when all of them have ended.
    told = player.due(float("inf"))
    return seen(
        player, told, accepted, refused, fps=fps, face=face_name(face), deformer=deformer, mapping=in_force
    )


def schedule(
    document: str | bytes,
    *,
    voice: Voice | str | None = None,
    scene: Mapping[str, Position] | None = None,
    media: Path | None = None,
) -> Schedule:
    """The sync times of one BML document: parse, timing, solve; no animation.

    Raises:
        BMLError: the document gives no block; with line and path.
        VoiceError: the named voice is not installed.
    """
    from bml_schema import parse

    player = Player(scene=scene, idle=False, media=media)
    block = parse(document, VOCABULARY)
    with _opened(voice) as speaker:
        return submitted(player, block, speaker)


def play(
    texts: Sequence[str | bytes], player: Player, voice: Voice | str | None = None
) -> tuple[list[Schedule], list[Warning]]:
    """Submit every document of every text at t = 0; returns the schedules, and what was refused."""
    schedules: list[Schedule] = []
    refused: list[Warning] = []
    with _opened(voice) as speaker:
        for item in (item for text in texts for item in read(text, VOCABULARY)):
            if isinstance(item, Block):
                planned = submitted(player, item, speaker)
                schedules.append(planned)
                if planned.failed:
                    refused += planned.warnings
            else:
                warning = warning_of(item)
                player.refuse(warning, 0.0)
                refused.append(warning)
    return schedules, refused


def submitted(player: Player, block: Block, voice: Voice, now: float = 0.0) -> Schedule:
    """Submit a block with what the voice makes of it, at other rates where that lets more fit."""
    says = player.wants(block)
    utterances = speak(says, voice)
    planned = player.submit(block, now, utterances)
    if planned.lengths:
        again = {b: replace(says[b], seconds=times["end"]) for b, times in planned.lengths.items()}
        utterances = {b: as_it_is(u) for b, u in utterances.items()} | speak(again, voice)
        planned = player.submit(block, now, utterances)
    if planned.lengths:
        planned = player.submit(block, now, warped(utterances, planned.lengths))
    return planned


def as_it_is(utterance: Utterance) -> Utterance:
    """An utterance that is not to be spoken again."""
    return replace(utterance, stretch=(1.0, 1.0))


def warped(
    utterances: Mapping[str, Utterance], lengths: Mapping[str, Mapping[str, float]]
) -> dict[str, Utterance]:
    """Utterances that come near to what was asked for, brought to it; none is to be spoken again."""
    return {b: stretched(u, lengths[b]) if b in lengths else as_it_is(u) for b, u in utterances.items()}


@contextmanager
def _opened(voice: Voice | str | None) -> Iterator[Voice]:
    """A voice by its name, closed afterwards; a voice that was handed in stays open."""
    if voice is not None and not isinstance(voice, str):
        yield voice
        return
    speaker = _Speaker(voice)
    try:
        yield speaker
    finally:
        speaker.close()


class _Speaker:
    """The voice of a name; the default one is looked for when something is to be said."""

    def __init__(self, name: str | None) -> None:
        self.name = name or "default"
        self._voice = None if name is None else self._find(name)

    def say(self, request: Say) -> Utterance:
        if self._voice is None:
            self._voice = self._find(None)
        return self._voice.say(request)

    def close(self) -> None:
        if self._voice is not None:
            self._voice.close()

    @staticmethod
    def _find(name: str | None) -> Voice:
        from realizer.speech.registry import find_voice

        return find_voice(name)


def warning_of(error: BMLError) -> Warning:
    """The BML warning of a document that gave no block."""
    return Warning(error.block or "<no id>", "PARSING_FAILURE", str(error))


def speak(says: Mapping[str, Say], voice: Voice) -> dict[str, Utterance]:
    """Let a voice say what a block wants; where it fails the silent voice takes over, with a warning."""
    utterances: dict[str, Utterance] = {}
    for behaviour, say in says.items():
        try:
            utterances[behaviour] = fitted(voice, say)
        except VoiceError as error:
            utterances[behaviour] = without_sound(say, error)
    return utterances
