"""Sound clips that clients send in chunks, with their annotations."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from realizer.core.array_types import Int16
from realizer.core.errors import RealizerError
from realizer.protocol.messages.speech import SpeechMessage, TimedText
from realizer.protocol.wire import ClipPiece
from realizer.server.session.control_fields import FieldError
from realizer.speech.recorded.viseme_names import sound_of
from realizer.speech.utterance import RATES, Phoneme, Recording, Word

if TYPE_CHECKING:
    from realizer.speech.sound_visemes.recogniser import VisemeRecogniser

MAX_BYTES = 64 * 2**20  # of all clips of a session: half an hour of speech; the oldest are removed
MAX_CLIPS = 1000  # of a session
HEARD = "heard:"  # before the id of a character: a sound that it hears
MAX_TIMES = 20_000  # words, or phonemes, of one clip
# Mouth shapes are recognised in pieces as they arrive, unless one is so long that it would delay others.
MAX_PIECE = 2.0  # s


class ClipError(FieldError):
    """A clip or its annotation is invalid; `where` is the field."""


@dataclass(eq=False)
class Clip:
    """A clip, complete or not.

    Attributes:
        pieces: the bytes received so far, until the last piece has arrived.
        rate: Hz of raw PCM; 0 for a sound file.
        sound: rate and int16 samples; None until the last piece has arrived.
        is_annotated: whether the annotation is complete.
        recogniser: recognises mouth shapes in the pieces; None if they come too fast, or are not needed.
        heard: the phonemes that it has recognised.
    """

    pieces: list[bytes] = field(default_factory=list)
    rate: int = 0
    sound: tuple[int, Int16] | None = None
    text: str | None = None
    words: list[TimedText] = field(default_factory=list)
    phonemes: list[TimedText] = field(default_factory=list)
    is_annotated: bool = True
    recogniser: VisemeRecogniser | None = None
    heard: list[Phoneme] = field(default_factory=list)

    @property
    def size(self) -> int:
        return sum(map(len, self.pieces)) if self.sound is None else self.sound[1].nbytes

    @property
    def is_described(self) -> bool:
        """Whether its text or its times are known, so that mouth shapes need not be recognised."""
        return bool(self.text or self.words or self.phonemes)

    def to_json(self) -> dict[str, Any]:
        """Return the fields as JSON values, without what can be recognised again."""
        sound = None
        if self.sound is not None:
            sound = {"rate": self.sound[0], "pcm": _base64(self.sound[1].astype("<i2").tobytes())}
        return {
            "pieces": [_base64(piece) for piece in self.pieces],
            "rate": self.rate,
            "sound": sound,
            "text": self.text,
            "words": [word.model_dump() for word in self.words],
            "phonemes": [phoneme.model_dump() for phoneme in self.phonemes],
            "told": self.is_annotated,
        }

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> Clip:
        """Return the clip that `to_json` wrote.

        Raises:
            KeyError, TypeError, ValueError: it is not one.
        """
        sound = None
        if fields["sound"] is not None:
            sound = int(fields["sound"]["rate"]), _samples(base64.b64decode(fields["sound"]["pcm"]))
        words, phonemes = ([TimedText(**item) for item in fields[name]] for name in ("words", "phonemes"))
        pieces = [base64.b64decode(piece) for piece in fields["pieces"]]
        return cls(pieces, fields["rate"], sound, fields["text"], words, phonemes, fields["told"])


class AudioClips:
    """The sound clips of one session.

    Attributes:
        recordings: id -> clip whose sound and annotation are complete.
    """

    def __init__(self) -> None:
        self.recordings: dict[str, Recording] = {}
        self._clips: dict[str, Clip] = {}
        self._changed: set[str] = set()

    @property
    def ids(self) -> list[str]:
        """The ids of all clips, complete or not, the oldest first."""
        return list(self._clips)

    def changes(self) -> dict[str, str | None]:
        """Return the clips that changed since `settle`: id -> JSON, or None for a removed clip."""
        return {
            id: json.dumps(clip.to_json(), ensure_ascii=False) if (clip := self._clips.get(id)) else None
            for id in sorted(self._changed)
        }

    def settle(self) -> None:
        """Forget the changes, because they are saved."""
        self._changed.clear()

    def restore(self, clips: Mapping[str, Clip]) -> None:
        """Add the clips of a checkpoint, the oldest first."""
        for id, clip in clips.items():
            self._clips[id] = clip
            self._publish(id, clip)

    def add_chunk(self, piece: ClipPiece) -> None:
        """Add a piece to a clip.

        Raises:
            ClipError: the piece is out of order, too large or has a wrong rate; or the sound file is invalid,
                and the clip is removed.
        """
        where, begins = f"clip:{piece.id}", piece.number == 0
        clip = self._clips.get(piece.id)
        if clip is None or (begins and clip.sound is not None):
            clip = Clip()
        pieces = [] if begins else clip.pieces
        size = sum(map(len, pieces)) + len(piece.sound)
        if piece.number != len(pieces):
            raise ClipError(where, f"wanted piece {len(pieces)}, got {piece.number}")
        if not begins and piece.rate != clip.rate:
            raise ClipError(where, f"wanted {clip.rate} Hz as in piece 0, got {piece.rate}")
        if piece.rate:
            _check_pcm(piece, " or 0 for a file,")
        if size > MAX_BYTES:
            raise ClipError(where, f"wanted at most {MAX_BYTES} bytes, got {size}")
        if begins:
            from realizer.speech.sound_visemes.recogniser import LOWEST, VisemeRecogniser

            self.recordings.pop(piece.id, None)
            self._clips[piece.id] = clip
            clip.rate, clip.pieces = piece.rate, pieces
            clip.recogniser = VisemeRecogniser(piece.rate) if piece.rate >= LOWEST else None
            clip.heard = []
        pieces.append(piece.sound)
        if clip.is_described or len(piece.sound) > 2 * MAX_PIECE * piece.rate:
            clip.recogniser = None
        if clip.recogniser is not None:
            clip.heard += clip.recogniser.feed(_samples(piece.sound))
        self._changed.add(piece.id)
        if piece.final:
            self._complete(piece.id, clip)
        self._make_room(piece.id)

    def check(self, message: SpeechMessage, *, annotates: bool) -> None:
        """Check that the clip that a message names can be spoken, if it is annotated by that message or not.

        Raises:
            FieldError: its sound or its annotation is not complete.
        """
        clip = self._clips.get(message.clip or "")
        is_annotated = clip is not None and (message.final if annotates else clip.is_annotated)
        if clip is None or clip.sound is None or not is_annotated:
            raise FieldError("clip", f"wanted a clip that was sent to its last piece, got {message.clip!r}")

    def annotate(self, message: SpeechMessage) -> None:
        """Set the text and the times of a clip, or add to them after an annotation that was not final.

        Raises:
            ClipError: a viseme is unknown, times decrease, or there are too many of them.
        """
        assert message.clip is not None
        phonemes = [*message.phonemes, *_phonemes(message)]
        clip = self._clips.get(message.clip) or Clip()
        old = Clip() if clip.is_annotated else clip
        for name, known, new in (("words", old.words, message.words), ("phonemes", old.phonemes, phonemes)):
            if any(later.start < sooner.start for sooner, later in pairwise((*known[-1:], *new))):
                raise ClipError(f"speech.{name}", "wanted times that rise, got some that go back")
            if len(known) + len(new) > MAX_TIMES:
                raise ClipError(f"speech.{name}", f"wanted at most {MAX_TIMES}, got more")
        self._changed.add(message.clip)
        clip.words, clip.phonemes = [*old.words, *message.words], [*old.phonemes, *phonemes]
        clip.is_annotated = message.final
        clip.text = old.text if message.text is None else message.text
        self._clips[message.clip] = clip
        self._publish(message.clip, clip)
        self._make_room(message.clip)

    def _complete(self, id: str, clip: Clip) -> None:
        content, clip.pieces = b"".join(clip.pieces), []
        try:
            if clip.rate:
                clip.sound = clip.rate, _samples(content)
                if not len(clip.sound[1]):
                    raise RealizerError("wanted sound, got none")
                if clip.recogniser is not None:
                    clip.heard += clip.recogniser.close()
            else:
                from realizer.behaviours.sound_file import read_sound  # most clips are PCM

                sound = read_sound(content)
                clip.sound = sound.rate, sound.pcm
        except RealizerError as error:
            del self._clips[id]
            raise ClipError(f"clip:{id}", str(error)) from None
        self._publish(id, clip)

    def _publish(self, id: str, clip: Clip) -> None:
        self.recordings.pop(id, None)
        if clip.sound is None or not clip.is_annotated:
            return
        rate, pcm = clip.sound
        duration = len(pcm) / rate
        words = tuple(Word(*span) for span in _spans(clip.words, duration))
        phonemes = tuple(Phoneme(*span) for span in _spans(clip.phonemes, duration))
        text = clip.text
        if text is None and words:
            text = " ".join(word.text for word in words)
        heard = None if clip.recogniser is None else tuple(clip.heard)
        self.recordings[id] = Recording(rate, pcm, text, words, phonemes, heard)

    def _make_room(self, newest: str) -> None:
        """Remove the oldest clips if there are too many. Blocks that play have their own reference."""
        sizes = {id: clip.size for id, clip in self._clips.items()}
        while sum(sizes.values()) > MAX_BYTES or len(sizes) > MAX_CLIPS:
            oldest = next(id for id in sizes if id != newest)
            del sizes[oldest], self._clips[oldest]
            self._changed.add(oldest)
            self.recordings.pop(oldest, None)


def heard_samples(piece: ClipPiece) -> Int16:
    """Return the samples of a part of the sound that a character hears.

    Raises:
        ClipError: it is not raw PCM, or of an unusual rate.
    """
    _check_pcm(piece)
    return _samples(piece.sound)


def _check_pcm(piece: ClipPiece, otherwise: str = "") -> None:
    where = f"clip:{piece.id}"
    if not RATES[0] <= piece.rate <= RATES[1]:
        raise ClipError(where, f"wanted {RATES[0]}..{RATES[1]} Hz,{otherwise} got {piece.rate}")
    if len(piece.sound) % 2:
        raise ClipError(where, f"wanted samples of two bytes, got {len(piece.sound)} bytes")


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode()


def _samples(data: bytes) -> Int16:
    return np.frombuffer(data, "<i2").astype(np.int16, copy=False)


def _phonemes(message: SpeechMessage) -> list[TimedText]:
    """Return the visemes of a message as phonemes of the same mouth shape."""
    name = message.viseme_set
    try:
        return [v.model_copy(update={"text": sound_of(name, v.text)}) for v in message.visemes]
    except KeyError as error:
        raise ClipError("speech.visemes", str(error.args[0])) from None


def _spans(timed: Sequence[TimedText], duration: float) -> list[tuple[float, float, str]]:
    """Return (start, end, text); a missing end is the start of the next one."""
    following = [*(item.start for item in timed[1:]), duration]
    spans = []
    for item, next_start in zip(timed, following, strict=False):  # `following` is never empty
        end = next_start if item.end is None else item.end
        spans.append((item.start, max(item.start, end), item.text))
    return spans
