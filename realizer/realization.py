"""The result of playing documents: sampled frames, sound and feedback of all characters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from bml_schema import Feedback, WarningFeedback
from realizer.animation.axis import AU_NAMES
from realizer.animation.fap.conversion import FapMapping, standard
from realizer.animation.frames import AUFrames, FAPFrames
from realizer.animation.pose import poses
from realizer.core.array_types import Float32, Float64, Int16
from realizer.core.errors import RealizerError
from realizer.core.options import PlayOptions
from realizer.core.units import frame_count
from realizer.playback.block_store import BlockStore
from realizer.playback.player import Player
from realizer.playback.scheduled_speech import SPEECH_FADE, ScheduledSpeech, render_utterance
from realizer.scheduling.timing import Schedule, Warning
from realizer.speech.utterance import Utterance
from realizer.tables import faps

if TYPE_CHECKING:
    from realizer.face.model import Face

# Longest stretch of frames in one call: longer ones need more memory and are hardly faster.
WINDOW = 30.0  # s
# Four hours at 25 fps; more would not fit into memory as JSON or film.
MAX_FRAMES = 360_000


@dataclass(frozen=True, eq=False)
class Performance:
    """The frames of one character: (n, ...) frames at k / fps."""

    aus: AUFrames
    faps: FAPFrames


@dataclass(frozen=True, eq=False)
class FaceChange:
    """A face from a frame on, and its mapping of AUs to FAPs."""

    frame: int
    face: str
    mapping: FapMapping


@dataclass(frozen=True, eq=False)
class Realization:
    """Documents, played from 0 to their end.

    Attributes:
        fps: frames a second; frame k is sampled at k / fps.
        duration: seconds, to the end of the last block.
        face_name: the face folder that is drawn; the last one if it changes.
        deformer: "mpeg4" or "au", the deformer of that face; None for the face's own choice.
        mapping: the mapping of its AUs to FAPs.
        face_changes: the faces of the first character, in order, if it changes.
        blocks: the blocks as they were played, if they are known.
        characters: character id (None: unnamed) -> its frames, the first character first.
        schedules: one per accepted or failed block, in the order of submission.
        feedback_events: BML feedback, in order.
        warnings: all of them, in order.
        refusals: reasons of refused documents and blocks.
        speeches: the utterances with their times.
        plays_nothing: something was asked for, and nothing of it is heard or moves the face.
    """

    fps: float
    duration: float
    face_name: str
    characters: Mapping[str | None, Performance]
    schedules: tuple[Schedule, ...]
    feedback_events: tuple[Feedback, ...]
    warnings: tuple[Warning, ...]
    refusals: tuple[str, ...] = ()
    speeches: tuple[ScheduledSpeech, ...] = field(default=())
    deformer: str | None = None
    mapping: FapMapping = field(default_factory=standard)
    face_changes: tuple[FaceChange, ...] = ()
    blocks: BlockStore | None = field(default=None, repr=False)
    plays_nothing: bool = False

    @property
    def has_content(self) -> bool:
        """Whether some block was accepted, so that there is something to write."""
        return not all(schedule.failed for schedule in self.schedules)

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
        return tuple(f.to_xml() for f in self.feedback_events)

    @property
    def speech(self) -> tuple[tuple[float, Utterance], ...]:
        """(start in seconds, utterance) of each utterance."""
        return tuple((s.start, s.utterance) for s in self.speeches)

    @cached_property
    def face(self) -> Face:
        """The face for drawing pictures.

        Raises:
            FaceError: no such face, or its folder is damaged.
        """
        from realizer.face.load import load_face

        return load_face(self.face_name, deformer=self.deformer)

    @cached_property
    def poses(self) -> Float32:
        """(n, k) float32: poses of the first character, a column for each input of its face.

        Raises:
            FaceError: no such face, or its folder is damaged.
        """
        from realizer.face.load import input_names

        return poses(self.aus, input_names(self.face_name, deformer=self.deformer), self.mapping)

    @cached_property
    def faces(self) -> list[tuple[int, Realization]]:
        """The parts that one face after the other draws: (first frame, those frames without sound)."""
        if len(self.face_changes) < 2:
            return [(0, self)]
        name = next(iter(self.characters))
        ends = [*(change.frame for change in self.face_changes[1:]), self.frames]
        parts = []
        for change, end in zip(self.face_changes, ends, strict=True):
            aus, faps = self.aus.part(change.frame, end), self.faps.values[change.frame : end]
            performance = Performance(aus, FAPFrames(aus.times, faps, self.faps.mask))
            part = replace(
                self,
                face_name=change.face,
                mapping=change.mapping,
                characters={name: performance},
                speeches=(),
                face_changes=(),
            )
            parts.append((change.frame, part))
        return parts

    def with_first(self, character: str) -> Self:
        """Return the same realization with another character as the first, who is drawn and written.

        Raises:
            ValueError: there is no such character; the text lists them.
        """
        names = list(self.characters)
        if character not in names:
            known = ", ".join(name or "one without a name" for name in names)
            raise ValueError(f"character: wanted one of {known}, got {character!r}")
        order = sorted(names, key=lambda name: name != character)
        speeches = (replace(s, character=order.index(names[s.character])) for s in self.speeches)
        changes = self.face_changes if order == names else ()
        characters = {name: self.characters[name] for name in order}
        return replace(self, characters=characters, speeches=tuple(speeches), face_changes=changes)

    def visemes(self, character: int = 0) -> Float64:
        """Return (n, 15) float64: the weight of each MPEG-4 viseme of a character; rows add to 1.

        Column 0 is the closed mouth of silence.

        Args:
            character: its index in `characters`.
        """
        from realizer.animation.lips.viseme_weights import viseme_weights
        from realizer.animation.lips.visemes import VISEME_COUNT

        times = self.aus.times
        weights = np.eye(1, VISEME_COUNT).repeat(len(times), axis=0)
        for speaking in self.speeches:
            if speaking.character == character:
                spoken = viseme_weights(speaking.utterance.phonemes, times - speaking.start)
                fade = np.clip(1 - (times - speaking.until) / SPEECH_FADE, 0, 1)
                weights[:, 1:] = np.maximum(weights[:, 1:], spoken[:, 1:] * fade[:, None])
        weights[:, 1:] /= np.maximum(weights[:, 1:].sum(axis=1, keepdims=True), 1.0)
        weights[:, 0] = np.maximum(1 - weights[:, 1:].sum(axis=1), 0.0)
        return weights

    def sound(self, rate: int = 22050) -> Int16:
        """Return (round(duration x rate),) int16 mono: the mix of all utterances."""
        mix = np.zeros(round(self.duration * rate), np.float32)
        for speaking in self.speeches:
            utterance = speaking.utterance
            if utterance.pcm is None or not len(utterance.pcm):
                continue
            pcm = render_utterance(speaking, rate)
            first = round(speaking.start * rate)
            last = min(len(mix), first + len(pcm))
            mix[first:last] += pcm[: max(0, last - first)]
        return np.clip(np.rint(mix), -32768, 32767).astype(np.int16)

    def to_json(self) -> dict[str, Any]:
        """Return the JSON of `realizer realize -o x.json`."""
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


def realization_of(
    player: Player,
    options: PlayOptions,
    mapping: FapMapping,
    characters: Mapping[str | None, Performance],
    feedback: Sequence[Feedback],
    accepted: Sequence[Schedule],
    refused: Sequence[Warning],
) -> Realization:
    """Return the realization of a player that has played to the end and still has its whole history.

    Args:
        mapping: the mapping of AUs to FAPs that was used for `characters`.
        feedback: all feedback of the player.
        accepted: the schedules of blocks at the time of acceptance.
        refused: warnings of refused documents and blocks.
    """
    from realizer.face.load import face_name

    schedules = [player.latest(schedule) for schedule in accepted]
    return Realization(
        fps=options.fps,
        duration=player.end,
        face_name=face_name(options.face),
        characters=characters,
        schedules=tuple(schedules),
        feedback_events=tuple(feedback),
        warnings=merge_warnings(feedback, schedules, refused),
        refusals=tuple(warning.text for warning in refused),
        speeches=player.speech(),
        deformer=options.deformer,
        mapping=mapping,
        blocks=player.blocks,
        plays_nothing=bool(
            refused or any(s.failed for s in schedules) or any(b.wants for b in player.blocks.all())
        )
        and not any(block.plays for block in player.blocks.all()),
    )


def frame_times(duration: float, fps: float) -> list[Float64]:
    """Return the times of all frames, in stretches short enough to be blended at once.

    Raises:
        RealizerError: there are too many.
    """
    times = np.arange(frames_until(duration, fps)) / fps
    step = max(1, int(WINDOW * fps))
    return [times[i : i + step] for i in range(0, len(times), step)]


def frames_until(duration: float, fps: float) -> int:
    """Return the number of frames in 0..duration.

    Raises:
        RealizerError: there are too many.
    """
    if (count := frame_count(duration, fps)) > MAX_FRAMES:
        raise RealizerError(
            f"wanted at most {MAX_FRAMES} frames, got {count} of {duration:g} s at {fps:g} fps: "
            "play less of it, or at a lower rate"
        )
    return count


def merge_warnings(
    feedback_events: Sequence[Feedback], schedules: Sequence[Schedule], refusals: Sequence[Warning] = ()
) -> tuple[Warning, ...]:
    """Return the warnings among all feedback, with the clauses that planning gave them."""
    planned = {(w.id, w.type, w.text): w for w in (*refusals, *(w for s in schedules for w in s.warnings))}
    known = ((f.id, f.type, f.text) for f in feedback_events if isinstance(f, WarningFeedback))
    return tuple(planned.get(key) or Warning(*key) for key in known)


def _performance_json(performance: Performance, visemes: Float64) -> dict[str, Any]:
    from realizer.animation.lips.viseme_weights import oculus_visemes, oculus_weights

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
