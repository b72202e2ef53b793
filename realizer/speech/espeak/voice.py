"""The espeak-ng voice; its engine runs in a process of its own."""

import importlib.util
import unicodedata
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache, partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

from realizer.core.errors import VoiceError
from realizer.core.similar import did_you_mean, similar
from realizer.speech.engine_voice import Engine, EngineVoice
from realizer.speech.espeak.document import write_document
from realizer.speech.espeak.events import read_answer, timeline
from realizer.speech.ssml import Script
from realizer.speech.utterance import SpeechRequest, Utterance

WORDS_A_MINUTE = 175  # espeak-ng's own rate
SLOWEST, FASTEST = 80, 450  # words a minute; the range that it accepts
MAX_CACHED_WORDS = 4096
# Scripts that a voice of any language reads by the rules of theirs, instead of letter by letter (measured).
READ_BY_ALL = frozenset({
    "BENGALI", "DEVANAGARI", "GEORGIAN", "GUJARATI", "GURMUKHI", "HANGUL", "KANNADA", "MALAYALAM", "SINHALA",
    "TAMIL",
})  # fmt: skip
# The first word of the Unicode names of a script's letters -> the primary subtags of espeak-ng's languages
# that are written in it, the most spoken first.
LANGUAGES: Mapping[str, tuple[str, ...]] = {
    script: tuple(languages.split())
    for script, languages in {
        "CYRILLIC": "ru uk bg sr be kk ky tt ba cv mk",
        "GREEK": "el grc",
        "CJK": "zh cmn yue hak ja",
        "HIRAGANA": "ja",
        "KATAKANA": "ja",
        "HANGUL": "ko",
        "ARABIC": "ar fa ur sd ug ku",
        "HEBREW": "he",
        "DEVANAGARI": "hi mr ne kok",
        "BENGALI": "bn as bpy",
        "GURMUKHI": "pa",
        "GUJARATI": "gu",
        "ORIYA": "or",
        "TAMIL": "ta",
        "TELUGU": "te",
        "KANNADA": "kn",
        "MALAYALAM": "ml",
        "SINHALA": "si",
        "THAI": "th",
        "MYANMAR": "my shn",
        "GEORGIAN": "ka",
        "ARMENIAN": "hy hyw",
        "ETHIOPIC": "am",
        "CHEROKEE": "chr",
    }.items()
}
INSTALL = "espeak-ng is not installed: pip install 'bml-realizer[speech]' (or apt-get install libespeak-ng1)"


def install_hint() -> str | None:
    """Return a sentence that says how to install espeak-ng, or None if it is installed."""
    if importlib.util.find_spec("espeakng_loader") is not None:
        return None
    import ctypes.util  # slow, and only needed without the package

    return None if ctypes.util.find_library("espeak-ng") else INSTALL


ENGINE = Engine("espeak-ng", Path(__file__).with_name("espeak_worker.py"), install_hint)


class EspeakVoice(EngineVoice):
    """espeak-ng, with over 100 languages; a request gives the same samples in any order and process.

    Args:
        voice: a voice of espeak-ng ("nl", "en-gb+f3", "+m3" for a variant of the default voice), or None.
        options: for the worker process ("--data", PATH; "--no-fork").
    """

    name = "espeak"
    engine = "espeak-ng"
    description = "espeak-ng speaks over 100 languages; a variant is named as in espeak:en-gb+f3 or espeak:nl"
    elements = frozenset({"emphasis", "lang", "p", "prosody", "s", "say-as", "sub", "voice"})
    worker = ENGINE
    # (voice, word) -> phonemes of the word spoken separately; replaced, never changed.
    _alone: Mapping[tuple[str, str], tuple[str, ...]] = MappingProxyType({})

    @classmethod
    def missing(cls, voice: str | None = None) -> str | None:
        return install_hint()

    def _synthesize(self, request: SpeechRequest, script: Script) -> Utterance:
        hello = self._process.hello()
        voice, warnings = self._choose(request.voice or self._voice, request.language)
        wpm = round(min(FASTEST, max(SLOWEST, WORDS_A_MINUTE * request.rate)))
        document = write_document(script)
        head, body = self._process.ask({"op": "say", "text": document.text, "voice": voice, "wpm": wpm})
        rate: int = hello["rate"]
        events, pcm = read_answer(head, body)
        said = timeline(document, events, pcm, rate, lambda words: self._word_phonemes(voice, words))
        if not any(phoneme.ipa for phoneme in said.phonemes) and not script.is_silent:
            warnings = (*warnings, "espeak-ng found nothing to pronounce in the text")
        id = voice.partition("+")[0]
        tag = next((t for v in hello["voices"] if v["id"] == id for _, t in v["languages"]), "")
        letters = foreign_script(script.text, tag)
        if letters is not None and letters not in READ_BY_ALL:
            text = f"the text is in {letters} letters, which a voice of {tag} spells one by one"
            warnings = (*warnings, f"{text}: wanted its language, such as {LANGUAGES[letters][0]!r}")
        return replace(said, warnings=(*script.warnings, *warnings))

    @cached_property
    def _choose(self) -> Callable[[str | None, str], tuple[str, tuple[str, ...]]]:
        return lru_cache(maxsize=100)(partial(choose_voice, self._process.hello()))

    def _word_phonemes(self, voice: str, words: Sequence[str]) -> list[tuple[str, ...]]:
        known = dict(self._alone)
        unknown = sorted({word for word in words if (voice, word) not in known})
        if unknown:
            head, _ = self._process.ask({"op": "phonemes", "voice": voice, "words": unknown})
            for word, ipa in zip(unknown, head["phonemes"], strict=True):
                known[voice, word] = tuple(ipa)
            self._alone = known if len(known) <= MAX_CACHED_WORDS else {}
        return [known[voice, word] for word in words]


def choose_voice(hello: dict[str, Any], wanted: str | None, language: str) -> tuple[str, tuple[str, ...]]:
    """Return espeak-ng's name of a voice, and warnings.

    espeak-ng accepts "nl" and "en-gb" but not "nl-NL" or "fr-fr"; its list of voices has the tags of each.

    Args:
        wanted: a tag, an identifier or a name from the list, with or without "+variant"; or None.
        language: BCP-47, used if `wanted` is not a voice.
    """
    warnings: list[str] = []
    base, _, variant = (wanted or "").partition("+")
    found = _by_tag(hello, base) or _by_name(hello, base) if base else None
    if base and found is None and base in hello["variants"]:  # "f3" alone
        base, variant = "", base
    if base and found is None:
        names = {tag for v in hello["voices"] for tag in (v["name"], *(t for _, t in v["languages"]))}
        near = did_you_mean(similar(base, sorted(names), cutoff=0.7))
        warnings.append(
            f"espeak-ng has no voice {base!r}{near or ':'} the default voice of the language is used"
        )
    if variant and hello["variants"] and variant not in hello["variants"]:
        warnings.append(f"espeak-ng has no variant {variant!r}: the plain voice is used")
        variant = ""
    if found is None:
        found = _by_tag(hello, language)
    if found is None:
        warnings.append(f"espeak-ng does not speak {language!r}: spoken as English")
        found = _by_tag(hello, "en-us")
    if found is None:
        raise VoiceError("espeak-ng has no English voice: its installation is damaged")
    return found + (f"+{variant}" if variant else ""), tuple(warnings)


def _by_tag(hello: dict[str, Any], tag: str) -> str | None:
    """Return the voice for a BCP-47 tag, or for the longest part of it that has one."""
    subtags = tag.lower().replace("_", "-").split("-")
    for length in range(len(subtags), 0, -1):
        part = "-".join(subtags[:length])
        has = [(p, v["id"]) for v in hello["voices"] for p, t in v["languages"] if t.lower() == part]
        if has:
            return str(min(has, key=lambda pair: pair[0])[1])
    return None


def _by_name(hello: dict[str, Any], name: str) -> str | None:
    for voice in hello["voices"]:
        if name.lower() in (voice["id"].lower(), voice["name"].lower()):
            return str(voice["id"])
    return None


def foreign_script(text: str, language: str) -> str | None:
    """Return the script of most letters of a text, if the language is not written in it; else None.

    Args:
        language: a tag, of which the primary subtag counts.
    """
    scripts = Counter(unicodedata.name(c, "").partition(" ")[0] for c in text if c.isalpha())
    script, count = next(iter(scripts.most_common(1)), ("", 0))
    is_foreign = language.lower().partition("-")[0] not in LANGUAGES.get(script, ())
    return script if script in LANGUAGES and is_foreign and 2 * count > scripts.total() else None
