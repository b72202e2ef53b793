"""The silent voice, which estimates the times of words, marks and phonemes."""

from collections.abc import Iterator

from realizer.speech.base_voice import BaseVoice
from realizer.speech.letter_to_sound import GENERIC, letters_to_phonemes, syllable_facts, vowel_units
from realizer.speech.ssml import Mark, read_script
from realizer.speech.ssml_support import supported
from realizer.speech.utterance import STRETCH, SpeechRequest, Utterance, Word, tile
from realizer.speech.words import Pause, WordToken, tokens
from realizer.tables.phonemes import vowels

SLOWEST, FASTEST = 0.25, 4.0  # of the voice's own rate


class SilentVoice(BaseVoice):
    """A voice without sound that estimates durations by vowel units (Wojdel 2005, 6.4.1)."""

    name = "silent"
    engine = "rules"
    description = "no sound: times and lips by rule, for any language"

    @classmethod
    def languages(cls) -> tuple[str, ...]:
        return tuple(name for name in syllable_facts()["languages"] if name != GENERIC)

    def say(self, request: SpeechRequest) -> Utterance:
        """Estimate times: a word lasts a unit (0.2 s at rate 1) for each vowel, a punctuation mark one."""
        script = supported(read_script(request), self.elements, "the silent voice")
        facts = syllable_facts()
        if script.is_silent and not any(not isinstance(part, (str, Mark)) for part in script.parts):
            return Utterance(0.0, (), (), dict.fromkeys(script.marks, 0.0), warnings=script.warnings)
        rate = min(FASTEST, max(SLOWEST, request.rate))
        now = facts["edge"]
        words: list[Word] = []
        starts: list[tuple[float, str, int]] = [(0.0, "", 0)]
        marks: dict[str, float] = {}
        waiting: list[str] = []  # marks before the next word
        for item in tokens(script, facts["phrase"]):
            if isinstance(item, Mark):
                waiting.append(item.name)
                continue
            if isinstance(item, Pause):
                if item.seconds:  # a mark before a <break> is at its start
                    marks.update(dict.fromkeys(waiting, now))
                    waiting = []
                length = item.seconds or facts["unit"] / rate
                starts.append((now, "", 0))
            else:
                marks.update(dict.fromkeys(waiting, now))
                waiting = []
                length = vowel_units(item.text, request.language) * facts["unit"] / (rate * item.rate)
                words.append(Word(now, now + length, item.text))
                starts += _phonemes(item, request.language, now, length, facts["consonant"])
            now += length
        spoken_end = words[-1].end if words else now
        marks.update(dict.fromkeys(waiting, spoken_end))
        starts.append((now, "", 0))
        return Utterance(
            duration=now + facts["closing"],
            words=tuple(words),
            phonemes=tile(starts, now + facts["closing"]),
            marks=marks,
            stretch=STRETCH,
            warnings=script.warnings,
        )


def _phonemes(
    word: WordToken, language: str, start: float, length: float, consonant: float
) -> Iterator[tuple[float, str, int]]:
    ipa = letters_to_phonemes(word.text, language) or ("",)
    vowel = [not sound or sound[0] in vowels() for sound in ipa]  # an unknown sound counts as a vowel
    times = [1.0 if is_vowel else consonant for is_vowel in vowel]
    share = length / sum(times)
    stressed = vowel.index(True) if any(vowel) else None
    for k, (sound, time) in enumerate(zip(ipa, times, strict=True)):
        # Short words are mostly unstressed; in longer ones the stress is assumed on the first vowel.
        yield start, sound, 1 if k == stressed and len(word.text) > 3 else 0
        start += time * share
