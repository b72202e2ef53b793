"""Sound clips that clients send in chunks, with their annotations."""

import json
from collections.abc import Mapping, Sequence
from itertools import pairwise

from realizer.core.array_types import Int16
from realizer.core.decoder_process import DECODER
from realizer.core.errors import RealizerError
from realizer.protocol.messages.speech import SpeechMessage, TimedText
from realizer.protocol.wire import ClipPiece
from realizer.server.session.control_fields import FieldError
from realizer.server.speech.clip import ArrivingClip, Clip, samples_of
from realizer.speech.recorded.recorded_speech import sound_of
from realizer.speech.utterance import RATES, Phoneme, Recording, Word
from realizer.text.spoken import spoken_text

MAX_BYTES = 64 * 2**20  # of all clips of a session: half an hour of speech; the oldest are removed
MAX_CLIPS = 1000  # of a session
HEARD = "heard:"  # before the id of a character: a sound that it hears
MAX_TIMES = 20_000  # words, or phonemes, of one clip
# Mouth shapes are recognised in pieces as they arrive, unless one is so long that it would delay others.
MAX_PIECE = 2.0  # s


class ClipError(FieldError):
    """A clip or its annotation is invalid; `where` is the field."""


class AudioClips:
    """The sound clips of one session."""

    def __init__(self) -> None:
        self.recordings: dict[str, Recording] = {}  # id -> clip whose sound and annotation are complete
        self._clips: dict[str, Clip] = {}
        self._arriving: dict[str, ArrivingClip] = {}  # those that are spoken already
        self._refused: set[str] = set()
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
        if len(self._refused) >= MAX_CLIPS:
            self._refused.clear()
        self._refused.add(piece.id)
        self._add(piece)
        self._refused.discard(piece.id)

    def _add(self, piece: ClipPiece) -> None:
        where, begins = f"clip:{piece.id}", piece.number == 0
        clip = self._clips.get(piece.id)
        if clip is None or (begins and clip.sound is not None):
            clip = Clip()
        if begins and clip.pieces and piece.id in self._arriving:
            raise ClipError(where, f"wanted piece {len(clip.pieces)} of the clip that is spoken, got piece 0")
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
        if (arriving := self._arriving.get(piece.id)) is not None:
            arriving.rate, clip.recogniser = piece.rate, None
            arriving.sound += piece.sound
        if clip.is_described or len(piece.sound) > 2 * MAX_PIECE * piece.rate:
            clip.recogniser = None
        if clip.recogniser is not None:
            clip.heard += clip.recogniser.feed(samples_of(piece.sound))
        self._changed.add(piece.id)
        if piece.final:
            self._complete(piece.id, clip)
        self._make_room(piece.id)

    def check(self, message: SpeechMessage, *, annotates: bool) -> None:
        """Check that the clip that a message names can be spoken, if it is annotated by that message or not.

        Raises:
            FieldError: nothing came of it, it was refused, or its annotation is not complete.
        """
        id = message.clip or ""
        clip = self._clips.get(id)
        is_annotated = message.final if annotates else clip is not None and clip.is_annotated
        is_refused = id in self._refused and (clip is None or clip.sound is None)
        if not is_annotated or is_refused:
            raise FieldError("clip", f"wanted a clip that was sent to its last piece, got {message.clip!r}")
        if id in self._arriving:
            raise FieldError("clip", f"wanted a clip that no speech waits for, got {message.clip!r}")

    def follow(self, id: str) -> bool:
        """Divide a clip into parts from now on, as it arrives. Return False if it is complete."""
        clip = self._clips[id]
        if clip.sound is not None:
            return False
        clip.recogniser = None
        sound = bytearray(b"".join(clip.pieces))
        self._arriving[id] = ArrivingClip(clip.rate, clip.words, clip.phonemes, sound)
        return True

    def unfollow(self, id: str) -> None:
        """Divide a clip no longer, because no speech waits for it."""
        self._arriving.pop(id, None)

    def next_parts(self, id: str, *, is_last: bool) -> list[str]:
        """Return the ids of new parts of a clip that arrives; of a clip in one piece, its own id.

        Args:
            is_last: whether no more will be spoken of it.
        """
        clip, arriving = self._clips.get(id), self._arriving[id]
        if is_last:
            del self._arriving[id]
        if clip is None:
            return []
        if clip.sound is not None and not arriving.count:
            return [id]
        # A text is found in the whole sound only, and a file is read as a whole.
        is_whole = not clip.rate or (clip.text is not None and not (clip.words or clip.phonemes))
        count = 0 if is_whole else len(arriving.sound) // 2 if is_last else arriving.ready
        if not count:
            return []
        part = f"{id}/{arriving.count}"
        pcm, words, phonemes = arriving.take(count, ends=is_last and clip.sound is not None)
        self._clips[part] = Clip(rate=clip.rate, sound=(clip.rate, pcm), words=words, phonemes=phonemes)
        self._changed.add(part)
        self._publish(part, self._clips[part])
        self._make_room(part)
        return [part]

    def annotate(self, message: SpeechMessage) -> None:
        """Set the text and the times of a clip, or add to them after an annotation that was not final.

        Raises:
            ClipError: a viseme is unknown, times decrease, or there are too many of them.
        """
        assert message.clip is not None
        phonemes = [*message.phonemes, *_phonemes(message)]
        clip = self._clips.get(message.clip) or Clip()
        old = Clip() if clip.is_annotated else clip
        sounds = "visemes" if message.visemes else "phonemes"
        for name, known, new in (("words", old.words, message.words), (sounds, old.phonemes, phonemes)):
            for sooner, later in pairwise((*known[-1:], *new)):
                if later.start < sooner.start:
                    got = f"{later.start:g} s after {sooner.start:g} s"
                    raise ClipError(f"speech.{name}", f"wanted times that rise, got {got}")
            if len(known) + len(new) > MAX_TIMES:
                raise ClipError(f"speech.{name}", f"wanted at most {MAX_TIMES}, got more")
        self._changed.add(message.clip)
        clip.words, clip.phonemes = [*old.words, *message.words], [*old.phonemes, *phonemes]
        clip.is_annotated = message.final
        clip.text = old.text
        if message.text is not None:
            clip.text = (
                message.text if message.plain else str(spoken_text(message.text, message.language or "en"))
            )
        self._clips[message.clip] = clip
        self._publish(message.clip, clip)
        self._make_room(message.clip)

    def _complete(self, id: str, clip: Clip) -> None:
        content, clip.pieces = b"".join(clip.pieces), []
        try:
            if clip.rate:
                clip.sound = clip.rate, samples_of(content)
                if not len(clip.sound[1]):
                    raise RealizerError("wanted sound, got none")
                if clip.recogniser is not None:
                    clip.heard += clip.recogniser.close()
            else:
                sound: Recording = DECODER.decode("realizer.behaviours.sound_file:read_sound", content)
                clip.sound, clip.warnings = (sound.rate, sound.pcm), sound.warnings
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
        self.recordings[id] = Recording(rate, pcm, text, words, phonemes, heard, clip.warnings)

    def _make_room(self, newest: str) -> None:
        """Remove the oldest clips if there are too many. Blocks that play have their own reference."""
        sizes = {id: clip.size for id, clip in self._clips.items()}
        while sum(sizes.values()) > MAX_BYTES or len(sizes) > MAX_CLIPS:
            oldest = next(id for id in sizes if id != newest and id not in self._arriving)
            del sizes[oldest], self._clips[oldest]
            self._changed.add(oldest)
            self.recordings.pop(oldest, None)


def heard_samples(piece: ClipPiece) -> Int16:
    """Return the samples of a part of the sound that a character hears.

    Raises:
        ClipError: it is not raw PCM, or of an unusual rate.
    """
    _check_pcm(piece)
    return samples_of(piece.sound)


def _check_pcm(piece: ClipPiece, otherwise: str = "") -> None:
    where = f"clip:{piece.id}"
    if not RATES[0] <= piece.rate <= RATES[1]:
        raise ClipError(where, f"wanted {RATES[0]}..{RATES[1]} Hz,{otherwise} got {piece.rate}")
    if len(piece.sound) % 2:
        raise ClipError(where, f"wanted samples of two bytes, got {len(piece.sound)} bytes")


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
        end = max(item.start, next_start) if item.end is None else item.end
        spans.append((item.start, end, item.text))
    return spans
