"""The hibari voice, neural English speech; its model runs in a process of its own."""

import importlib.util
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from realizer import tables
from realizer.core.array_types import Int16
from realizer.speech.engine_voice import Engine, EngineVoice
from realizer.speech.hibari.times import (
    Sound,
    SpeechBuffer,
    Token,
    cut,
    guess_lengths,
    signs_of,
    sounds,
    trim_to_sound,
    word_spans,
)
from realizer.speech.letter_to_sound import subtag, syllable_facts
from realizer.speech.ssml import Break, Mark, Script
from realizer.speech.ssml_prosody import PLAIN, Prosody
from realizer.speech.utterance import STRETCH, SpeechRequest, Utterance, Word
from realizer.speech.words import PlacedMark, words_in

INSTALL = "hibari (neural, English) is not installed: pip install 'bml-realizer[neural]'"
SHOWN = 3  # words quoted in a warning


@dataclass(frozen=True, slots=True)
class ProsodyRun:
    """Text with one prosody."""

    text: str  # plain; may be empty if the script ends in a pause
    words: tuple[str, ...]  # of the text, in order
    prosody: Prosody = PLAIN  # of the text
    pause: float = 0.0  # seconds of silence before it


def runs(script: Script) -> tuple[tuple[ProsodyRun, ...], tuple[PlacedMark, ...]]:
    """Divide a script at each <break>, and where <prosody> begins or ends; <sub> is read by its alias.

    hibari does not support other SSML elements: their text is spoken.
    """
    found: list[ProsodyRun] = []
    marks: list[PlacedMark] = []
    manners = [PLAIN]  # of the open tags, outermost first
    hidden = 0  # depth inside <sub>
    count = 0  # of words before
    text, pause = "", 0.0

    def close() -> None:
        nonlocal text, pause, count
        if text.strip() or pause:
            words = tuple(word for word, _ in words_in(text))
            found.append(ProsodyRun(text, words, manners[-1], pause))
            count += len(words)
            text, pause = "", 0.0

    for part in script.parts:
        if isinstance(part, str):
            text += "" if hidden else part
        elif isinstance(part, Mark):
            marks.append(PlacedMark(part.name, count + len(list(words_in(text))), False))
        elif isinstance(part, Break):
            if text.strip():
                close()
            pause += part.seconds
            marks = [replace(mark, paused=mark.paused or mark.word == count) for mark in marks]
        elif part.name == "prosody":
            if text.strip():
                close()
            if part.attributes is None:
                manners.pop()
            else:
                manners.append(manners[-1].within(dict(part.attributes)))
        elif part.name == "sub":
            if part.attributes is not None and not hidden:
                text += dict(part.attributes).get("alias", "")
            hidden += 1 if part.attributes is not None else -1
    close()
    return tuple(found), tuple(marks)


def install_hint() -> str | None:
    """Return a sentence that says how to install hibari, or None if it is installed."""
    installed = all(importlib.util.find_spec(name) for name in ("hibari", "onnxruntime"))
    return None if installed else INSTALL


def voice_hint(name: str) -> str | None:
    """Return a sentence that says how to get a voice of hibari, or None if it is on this machine."""
    from hibari.voices import VOICES, voice_path

    if name not in VOICES:
        return f"hibari: wanted one of its voices {', '.join(VOICES)}, got {name!r}"
    try:
        voice_path(name, download_missing=False)
    except OSError:
        return f"hibari's voice {name!r} is not on this machine; `hibari --voice {name} Hello` fetches it"
    return None


ENGINE = Engine("hibari", Path(__file__).with_name("hibari_worker.py"), install_hint)


class HibariVoice(EngineVoice):
    """hibari, which speaks English; the same request gives the same samples.

    A long text is spoken sentence by sentence, so that other requests can be served in between; `limit` is
    the greatest duration of the synthesis of one, in seconds. The voice, or None, has to be on this machine.
    """

    name = "hibari"
    engine = "hibari-tts"
    description = "a neural voice, English only; its other voices are named as in hibari:emma"
    worker = ENGINE

    def __init__(
        self, voice: str | None = None, *, limit: float = 30.0, options: tuple[str, ...] = ()
    ) -> None:
        chosen = ("--voice", voice) if voice else ()
        super().__init__(voice, limit=limit, options=(*chosen, *options))

    @classmethod
    def missing(cls, voice: str | None = None) -> str | None:
        return install_hint() or (voice_hint(voice) if voice else None)

    @classmethod
    def languages(cls) -> tuple[str, ...]:
        return "en-US", "en-GB"

    def _synthesize(self, request: SpeechRequest, script: Script) -> Utterance:
        hello = self._process.hello()
        rate: int = hello["rate"]
        parts, placed = runs(script)
        head, _ = self._process.ask({"op": "read", "texts": [run.text for run in parts]})
        track = SpeechBuffer()
        for k, reading in enumerate(head["texts"]):
            self._speak_run(track, parts, k, reading, request.rate, rate)
        warnings = [*script.warnings, *_warnings(request, track, hello)]
        return Utterance(
            duration=track.length / rate,
            stretch=STRETCH,
            words=tuple(Word(first / rate, last / rate, text) for first, last, text in track.words),
            phonemes=track.sounds(rate),
            marks={name: sample / rate for name, sample in track.marks(placed).items()},
            sample_rate=rate,
            pcm=np.concatenate(track.pcm) if track.pcm else np.zeros(0, np.int16),
            warnings=tuple(warnings),
        )

    def _speak_run(
        self,
        track: SpeechBuffer,
        parts: Sequence[ProsodyRun],
        index: int,
        reading: Sequence[Sequence[Token]],
        pace: float,
        rate: int,
    ) -> None:
        """Synthesize the run with this index and append it to `track`."""
        run = parts[index]
        # Whether it follows the run before, and precedes the run after, without a pause.
        joined = index > 0 and not run.pause
        goes_on = index + 1 < len(parts) and not parts[index + 1].pause
        track.add(np.zeros(round(run.pause * rate), np.int16))
        heard: list[Sound] = []
        tokens: list[Token] = []
        for k, sentence in enumerate(reading):
            if not any(phonemes for _, phonemes, _ in sentence):
                tokens += sentence
                continue
            pcm, timed = self._sentence(sentence, run, pace, rate)
            # The silence at its start is kept, except for the first sentence.
            lead = 0 if joined else round(syllable_facts()["edge"] * rate)
            first = max(0, timed[0].end - lead) if not heard and not timed[0].ipa else 0
            ends_open = goes_on and k + 1 == len(reading) and not _ends_in_pause(sentence)
            last = timed[-1].start if ends_open and not timed[-1].ipa else len(pcm)
            at = track.length - first
            for sound in timed:
                start, end = max(sound.start, first), min(sound.end, last)
                if end > start:
                    moved = replace(sound, start=at + start, end=at + end, token=sound.token + len(tokens))
                    heard.append(moved)
            track.add(cut(pcm, first, last, rate))
            tokens += sentence
        end = track.words[-1][1] if track.words else track.length
        for word, (begin, until) in zip(
            run.words, word_spans(run.words, tokens, heard, self._word_phonemes), strict=True
        ):
            start = heard[begin].start if until > begin else end
            end = heard[until - 1].end if until > begin else end
            track.words.append((start, end, word))
        track.phonemes += heard

    def _sentence(
        self, sentence: Sequence[Token], run: ProsodyRun, pace: float, rate: int
    ) -> tuple[Int16, list[Sound]]:
        """Return the sound of a sentence and its phonemes, which cover it without gaps."""
        facts = tables.toml_table("hibari.toml")
        speed = min(facts["fastest"], max(facts["slowest"], pace * run.prosody.rate))
        request = {"op": "say", "phonemes": signs_of(sentence)[0], "speed": speed, "pitch": run.prosody.pitch}
        head, body = self._process.ask(request)
        volume = 32767 * run.prosody.volume
        pcm = np.rint(np.clip(np.frombuffer(body, "<f4") * volume, -32768, 32767)).astype(np.int16)
        if head["signs"] is None:
            return pcm, sounds(sentence, guess_lengths(sentence, pcm))
        timed = sounds(sentence, [head["lead"], *head["signs"], head["tail"]])
        shift = round(facts["offset"] * rate)
        borders = [0, *(min(max(0, sound.end + shift), len(pcm)) for sound in timed[:-1]), len(pcm)]
        heard = [
            replace(sound, start=start, end=end)
            for sound, start, end in zip(timed, borders, borders[1:], strict=False)
        ]
        return pcm, trim_to_sound(heard, pcm)

    def _word_phonemes(self, words: Sequence[str]) -> list[list[str]]:
        head, _ = self._process.ask({"op": "read", "texts": list(words)})
        found = []
        for text in head["texts"]:
            each = (sounds(sentence, [0, *(1 for _ in signs_of(sentence)[0]), 0]) for sentence in text)
            found.append([sound.ipa for timed in each for sound in timed if sound.ipa])
        return found


def _ends_in_pause(sentence: Sequence[Token]) -> bool:
    signs = signs_of(sentence)[0].rstrip()
    return not sounds([("", signs[-1:], False)], [0, 1, 0])[-1].ipa


def _warnings(request: SpeechRequest, track: SpeechBuffer, hello: dict[str, Any]) -> list[str]:
    found = []
    if subtag(request.language) != "en":
        found.append(f"hibari speaks English only: {request.language!r} is read as English")
    if not hello["durations"]:
        found.append("this hibari does not report the durations of its phonemes: their times are estimated")
    if not track.phonemes:
        found.append("hibari found nothing to pronounce in the text")
    else:
        mute = [
            word
            for first, last, word in track.words
            if any(map(str.isalpha, word))
            and (
                first == last or not any(unicodedata.name(letter, "").startswith("LATIN") for letter in word)
            )
        ]
        if mute:
            more = ", ..." if len(mute) > SHOWN else ""
            found.append(f"hibari cannot pronounce {', '.join(map(repr, mute[:SHOWN]))}{more}")
    return found
