"""The eight steps without a clock: BML documents in, a Realization of frames, sound and feedback out."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bml_schema import Block, BMLError, Feedback, WarningFeedback, read
from realizer.animation.curves import gain_at
from realizer.animation.fap import to_fap
from realizer.animation.frames import AUFrames, FAPFrames
from realizer.animation.mapping import FapMapping, standard
from realizer.animation.pose import poses
from realizer.animation.targets import AU_NAMES
from realizer.arrays import Float32, Float64, Int16
from realizer.behaviours import VOCABULARY
from realizer.behaviours.kind import Position
from realizer.composition.playing import HUSH, Speaking
from realizer.errors import RealizerError, VoiceError
from realizer.mapping import mapping_of
from realizer.player import Player
from realizer.scheduling.timing import Schedule, Warning
from realizer.speech.fitting import fitted, stretched
from realizer.speech.utterance import Say, Utterance, Voice
from realizer.tables import faps
from realizer.units import frame_count

if TYPE_CHECKING:
    from realizer.face.model import Face

__all__ = ["Realization", "realize", "schedule", "speak"]

# Longest stretch of frames computed in one call: the cost of a call is flat up to here, its memory is not.
WINDOW = 10.0  # s
# More is a mistake (four hours at 25 fps) and would not fit into memory as JSON or film.
MOST_FRAMES = 360_000
# Cut-off speech fades this long, so that it does not click, and is over in 50 ms with a packet cut in two.
CUT = 0.04  # s


@dataclass(frozen=True, eq=False)
class Performance:
    """What one character does: (n, ...) frames at k / fps."""

    aus: AUFrames
    faps: FAPFrames


@dataclass(frozen=True, eq=False)
class Realization:
    """Documents, played from 0 to their end.

    Attributes:
        fps: frames a second; frame k is sampled at k / fps.
        duration: seconds, to the end of the last block.
        face_name: which face folder pictures are drawn with.
        deformer: "mpeg4" or "au", what moves that face; None is what it says itself.
        mapping: what its AUs ask of FAPs.
        characters: character id (None: unnamed) -> its frames, the first character first.
        schedules: one per accepted or failed block, in the order of submission.
        told: BML feedback, in order.
        warnings: all of them, in order.
        refused: documents and blocks that gave nothing to play.
        speaking: what sounds when.
    """

    fps: float
    duration: float
    face_name: str
    characters: Mapping[str | None, Performance]
    schedules: tuple[Schedule, ...]
    told: tuple[Feedback, ...]
    warnings: tuple[Warning, ...]
    refused: tuple[str, ...] = ()
    speaking: tuple[Speaking, ...] = field(default=())
    deformer: str | None = None
    mapping: FapMapping = field(default_factory=standard)

    @property
    def frames(self) -> int:
        """Number of frames: floor(duration x fps) + 1."""
        return len(self.aus.times)

    @property
    def aus(self) -> AUFrames:
        """AU frames of the first character."""
        return next(iter(self.characters.values())).aus

    @property
    def faps(self) -> FAPFrames:
        """FAP frames of the first character."""
        return next(iter(self.characters.values())).faps

    @cached_property
    def feedback(self) -> tuple[str, ...]:
        """BML feedback as XML text, in order."""
        return tuple(f.to_xml() for f in self.told)

    @property
    def speech(self) -> tuple[tuple[float, Utterance], ...]:
        """(start in seconds, utterance) of everything said."""
        return tuple((s.start, s.utterance) for s in self.speaking)

    @cached_property
    def face(self) -> Face:
        """The face pictures are drawn with.

        Raises:
            FaceError: no such face, or its folder is damaged.
        """
        from realizer.face import load_face

        return load_face(self.face_name, deformer=self.deformer)

    @cached_property
    def poses(self) -> Float32:
        """(n, k) float32: what the first character is drawn by, a column for each thing its face takes.

        Raises:
            FaceError: no such face, or its folder is damaged.
        """
        from realizer.face import takes

        return poses(self.aus, takes(self.face_name, deformer=self.deformer), self.mapping)

    def visemes(self, character: int = 0) -> Float64:
        """(n, 15) float64: how much of each MPEG-4 viseme a character says; column 0 is none, rows add to 1.

        Args:
            character: its place in `characters`.
        """
        from realizer.animation.viseme_weights import viseme_weights
        from realizer.animation.visemes import lip_shapes

        times = self.aus.times
        weights = np.eye(1, len(lip_shapes())).repeat(len(times), axis=0)
        for speaking in self.speaking:
            if speaking.character == character:
                said = viseme_weights(speaking.utterance.phonemes, times - speaking.start)
                left = np.clip(1 - (times - speaking.until) / HUSH, 0, 1)
                weights[:, 1:] = np.maximum(weights[:, 1:], said[:, 1:] * left[:, None])
        weights[:, 1:] /= np.maximum(weights[:, 1:].sum(axis=1, keepdims=True), 1.0)
        weights[:, 0] = np.maximum(1 - weights[:, 1:].sum(axis=1), 0.0)
        return weights

    def sound(self, rate: int = 22050) -> Int16:
        """(round(duration x rate),) int16 mono: all that is said, mixed; silence where nobody speaks."""
        mix = np.zeros(round(self.duration * rate), np.float32)
        for speaking in self.speaking:
            utterance = speaking.utterance
            if utterance.pcm is None or not len(utterance.pcm):
                continue
            pcm = heard(speaking, rate)
            first = round(speaking.start * rate)
            last = min(len(mix), first + len(pcm))
            mix[first:last] += pcm[: max(0, last - first)]
        return np.clip(np.rint(mix), -32768, 32767).astype(np.int16)

    def to_json(self) -> dict[str, Any]:
        """The JSON of `realizer realize -o x.json`."""
        first, *others = self.characters.items()
        out: dict[str, Any] = {
            "fps": self.fps,
            "frames": self.frames,
            "duration": round(self.duration, 6),
            "face": self.face_name,
            "schedule": [s.to_json() for s in self.schedules],
            **_performance_json(first[1], self.visemes()),
            "feedback": list(self.feedback),
            "warnings": [w.to_json() for w in self.warnings],
        }
        if others:
            out["characters"] = {
                str(name): _performance_json(p, self.visemes(k)) for k, (name, p) in enumerate(others, 1)
            }
        return out


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
    from realizer.face import face_name, takes

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


def seen(
    player: Player,
    told: Sequence[Feedback],
    accepted: Sequence[Schedule],
    refused: Sequence[Warning] = (),
    *,
    fps: float,
    face: str,
    deformer: str | None = None,
    mapping: FapMapping,
) -> Realization:
    """What a player has played to its end, of which it has forgotten nothing.

    Args:
        told: all its feedback.
        accepted: the schedules that it gave.
        refused: what it did not take.

    Raises:
        RealizerError: it lasts too long.
    """
    schedules = [player.latest(s) for s in accepted]
    end = player.end
    count = frame_count(end, fps)
    if count > MOST_FRAMES:
        raise RealizerError(
            f"wanted at most {MOST_FRAMES} frames, got {count} of {end:g} s at {fps:g} fps: "
            "play less of it, or at a lower rate"
        )
    times = np.arange(count) / fps
    characters: dict[str | None, Performance] = {}
    for index, name in enumerate(player.characters):
        step = max(1, int(WINDOW * fps))
        windows = [player.frames(times[i : i + step], index) for i in range(0, len(times), step)]
        aus = AUFrames.joined(windows)
        characters[name] = Performance(aus, to_fap(aus, mapping))
    speaking = player.speech()
    # Those of planning say more than what is told of them; others arise while blocks play.
    planned = {(w.id, w.type, w.text): w for w in (*refused, *(w for s in schedules for w in s.warnings))}
    known = ((f.id, f.type, f.text) for f in told if isinstance(f, WarningFeedback))
    warnings = tuple(planned.get(key) or Warning(*key) for key in known)
    return Realization(
        fps=fps,
        duration=end,
        face_name=face,
        characters=characters,
        schedules=tuple(schedules),
        told=tuple(told),
        warnings=warnings,
        refused=tuple(w.text for w in refused),
        speaking=speaking,
        deformer=deformer,
        mapping=mapping,
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
        from realizer.speech import find_voice

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
            from realizer.speech.silent import without_sound

            utterances[behaviour] = without_sound(say, error)
    return utterances


def heard(speaking: Speaking, rate: int) -> Float32:
    """(n,) float32: the sound of an utterance at a rate, cut off and faded where it was stopped.

    Films and streams are made from it alike. The utterance must have sound.
    """
    utterance = speaking.utterance
    assert utterance.pcm is not None
    pcm = resample(utterance.pcm, utterance.sample_rate, rate)
    if speaking.until < speaking.start + utterance.duration:
        kept = max(0, round((speaking.until + CUT - speaking.start) * rate))
        pcm = pcm[:kept].copy()
        ramp = min(len(pcm), round(CUT * rate))
        pcm[len(pcm) - ramp :] *= np.linspace(1, 0, ramp, dtype=np.float32)
    if speaking.gains:
        times = speaking.start + np.arange(len(pcm)) / rate
        pcm = (pcm * gain_at(speaking.gains, times)).astype(np.float32)
    return pcm


def resample(pcm: Int16, rate: int, wanted: int) -> Float32:
    """PCM at another rate, (n,) float32; linear, after a box filter where the rate falls."""
    samples: Float32 = pcm.astype(np.float32)
    if rate == wanted:
        return samples
    if wanted < rate:
        width = max(1, round(rate / wanted))
        samples = np.convolve(samples, np.full(width, 1 / width, np.float32), "same")
    count = round(len(pcm) * wanted / rate)
    at = np.arange(count) * (rate / wanted)
    out: Float32 = np.interp(at, np.arange(len(samples)), samples).astype(np.float32)
    return out


def parse_scene(text: str) -> dict[str, Position]:
    """A scene from JSON `{"cup": [x, y, z], ...}` or lines `cup x y z`; metres, origin between the eyes.

    Raises:
        ValueError: says which entry and what was wanted.
    """
    import json

    if text.lstrip().startswith("{"):
        entries = json.loads(text)
        items = [(str(k), v.values() if isinstance(v, dict) else v) for k, v in entries.items()]
    else:
        lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
        items = [(parts[0], parts[1:]) for parts in (re.split(r"[\s,]+", line.strip()) for line in lines)]
    scene: dict[str, Position] = {}
    for name, numbers in items:
        try:
            x, y, z = (float(v) for v in numbers)
        except (TypeError, ValueError):
            raise ValueError(f"{name}: wanted three numbers x y z in metres, got {list(numbers)}") from None
        if not all(abs(v) <= 1e4 for v in (x, y, z)):
            raise ValueError(f"{name}: wanted metres within 10 km, got {x:g} {y:g} {z:g}")
        scene[name] = (x, y, z)
    return scene


def _performance_json(performance: Performance, visemes: Float64) -> dict[str, Any]:
    from realizer.animation.viseme_weights import oculus_visemes, oculus_weights

    return {
        "fap": {
            "names": [row.name for row in faps()],
            "values": performance.faps.integers().tolist(),
            "mask": performance.faps.mask.astype(int).tolist(),
        },
        "au": {
            "names": list(AU_NAMES()),
            "values": [[round(v, 4) for v in row] for row in performance.aus.aus.tolist()],
        },
        "visemes": {
            "names": [row.name for row in oculus_visemes()],
            "values": [[round(v, 3) for v in row] for row in oculus_weights(visemes).tolist()],
        },
    }
