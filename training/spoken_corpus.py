"""Speech whose phonemes have known times: by espeak-ng, Festival, flite and hibari, and recordings of people.

Apart from espeak-ng and hibari, which are extras, it comes from Debian: apt-get install festival flite
festival-czech festival-ca festvox-{kallpc16k,kdlpc16k,itapc16k,italp16k,czech-dita,czech-krb,czech-machac}
festvox-{czech-ph,suopuhe-lj,suopuhe-mv,us-slt-hts,ca-ona-hts,ru} pocketsphinx-testdata hunspell-cs
w{american,dutch,ngerman,french,polish,spanish,italian,swedish,catalan,portuguese}
fortunes fortunes-{de,it,es,cs,pl,br}
"""

from __future__ import annotations

import re
import subprocess
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from realizer.animation.lips.visemes import sounds
from realizer.behaviours.sound_file import read_wav
from realizer.core.array_types import Float64, Index, Int16
from realizer.speech.registry import find_voice
from realizer.speech.sound_visemes.mel_stream import viseme_facts
from realizer.speech.utterance import Phoneme, SpeechRequest
from realizer_studio.align.aligner import align
from realizer_studio.align.alignment import AlignError

DICTIONARIES = Path("/usr/share/dict")
CZECH_WORDS = Path("/usr/share/hunspell/cs_CZ.dic")
RECORDED = Path("/usr/share/festival/voices/russian/msu_ru_nsh_clunits")
LIBRIVOX = Path("/usr/share/pocketsphinx/test/data/librivox")
WORDS = (3, 9)  # words of a random sentence
FORTUNES = Path("/usr/share/games/fortunes")
# Dictionary -> files of `FORTUNES` with sentences of the language.
QUOTES = {
    "american-english": "[!b]*",
    "ngerman": "de/*",
    "italian": "it/*",
    "spanish": "es/*",
    "czech": "cs/*",
    "polish": "pl/*",
    "portuguese": "brasil",
}
CLAUSE = re.compile(r"(?:[^\W\d_]+(?:'[^\W\d_]+)?,? ){3,11}[^\W\d_]+[.!?]")


def _ipa_of(pairs: str) -> dict[str, str]:
    """Return phone -> IPA, for phones whose names are not IPA."""
    return dict(pair.split(":") for pair in pairs.split())


ARPABET = _ipa_of("""aa:ɑ ae:æ ah:ʌ ao:ɔ aw:aʊ ax:ə axr:ɚ ay:aɪ b:b ch:tʃ d:d dh:ð dx:ɾ eh:ɛ el:əl em:m en:n
    er:ɝ ey:eɪ f:f g:ɡ hh:h hv:h ih:ɪ iy:i jh:dʒ k:k l:l m:m n:n nx:n ng:ŋ ow:oʊ oy:ɔɪ p:p r:ɹ s:s sh:ʃ t:t
    th:θ uh:ʊ uw:u v:v w:w y:j z:z zh:ʒ""")
ITALIAN = _ipa_of("E:ɛ O:ɔ U:u S:ʃ Z:ʒ tS:tʃ dZ:dʒ J:ɲ ng:ŋ nf:ɱ L:ʎ")
CZECH = _ipa_of("c:ts c~:tʃ ch:x d~:ɟ dz~:dʒ h:ɦ n*:ŋ n~:ɲ r~:r r~*:r s~:ʃ t~:c z~:ʒ")
FINNISH = _ipa_of("@:æ 7:ø &:ə T:θ S:ʃ N:ŋ D:ð Z:ʒ L:ʎ")
CATALAN = _ipa_of("ax:ə E:ɛ O:ɔ J:ɲ L:ʎ rr:r r:ɾ S:ʃ Z:ʒ")
# Doubled consonants are palatalised, doubled vowels are stressed.
RUSSIAN = _ipa_of("ay:ə ae:ɪ aa:a ii:i ee:e oo:o uu:u y:ɨ yy:ɨ ur:ʊ ch:tɕ sch:ɕ sh:ʂ zh:ʐ c:ts h:x hh:x")
# Festival's voice -> language, coding of its texts, phones.
FESTIVAL = {
    "kal_diphone": ("american-english", "latin1", ARPABET),
    "ked_diphone": ("american-english", "latin1", ARPABET),
    "cmu_us_slt_arctic_hts": ("american-english", "latin1", ARPABET),
    "pc_diphone": ("italian", "latin1", ITALIAN),
    "lp_diphone": ("italian", "latin1", ITALIAN),
    "czech_dita": ("czech", "latin2", CZECH),
    "czech_krb": ("czech", "latin2", CZECH),
    "czech_machac": ("czech", "latin2", CZECH),
    "czech_ph": ("czech", "latin2", CZECH),
    "suo_fi_lj_diphone": ("swedish", "latin1", FINNISH),
    "hy_fi_mv_diphone": ("italian", "latin1", FINNISH),
    "upc_ca_ona_hts": ("catalan", "latin1", CATALAN),
}
NOT_SEEN = -1  # the class of sounds without a shape of the lips, such as h
PAUSES = {"pau", "#", "##", "h#", "_", "brth"}


@dataclass(frozen=True, eq=False)
class Spoken:
    """Speech of a speaker: int16 samples (n,) at `rate` Hz, and phonemes in order, "" for a pause."""

    speaker: str
    rate: int
    pcm: Int16
    phonemes: tuple[Phoneme, ...]


@cache
def words_of(dictionary: str) -> list[str]:
    """Return the words of a language."""
    if dictionary == "czech":
        lines = [line.split("/")[0] for line in CZECH_WORDS.read_text("utf-8").splitlines()]
    else:
        lines = (DICTIONARIES / dictionary).read_text("utf-8", "replace").splitlines()
    return [word for word in lines if word.isalpha() and word.islower() and 2 <= len(word) <= 11]


def sentences(dictionary: str, count: int, random: np.random.Generator) -> list[str]:
    """Return random words of a language as sentences."""
    words = words_of(dictionary)
    picked = (
        [words[k] for k in random.integers(len(words), size=random.integers(*WORDS))] for _ in range(count)
    )
    return [" ".join(some).capitalize() + "." for some in picked]


@cache
def quotes_of(dictionary: str) -> list[str]:
    """Return sentences of a language that people wrote, of at most twelve words."""
    files = sorted(FORTUNES.glob(QUOTES[dictionary])) if dictionary in QUOTES else []
    # Links lead to other languages, and files with other suffixes are indices.
    real = (
        f for f in files if f.suffix in ("", ".fortunes") and f.is_file() and f.parent == f.resolve().parent
    )
    texts = (file.read_bytes().decode("utf-8", "replace") for file in real)
    return [clause for text in texts for clause in CLAUSE.findall(" ".join(text.split()))]


def texts(dictionary: str, count: int, random: np.random.Generator) -> list[str]:
    """Return sentences, two thirds of them by people if there are any in this language."""
    quotes = quotes_of(dictionary)
    quoted = min(len(quotes), 2 * count // 3)
    some = [quotes[k] for k in random.choice(len(quotes), quoted, replace=False)] if quoted else []
    return some + sentences(dictionary, count - quoted, random)


def classes(phonemes: Sequence[Phoneme], times: Float64) -> Index:
    """Return (n,) the class at each time: the last for silence, `NOT_SEEN` for sounds without mouth shape."""
    numbers = [row["visemes"] for row in viseme_facts()["class"]]
    known = {viseme: k for k, visemes in enumerate(numbers) for viseme in visemes}
    starts, found = [0.0], [known[0]]
    for p in phonemes:
        at, parts = p.start, sounds(p.ipa) if p.ipa else ()
        for part in parts:
            viseme = max(part.mix, key=lambda pair: pair[1])[0] if part.mix else None
            starts.append(at)
            found.append(NOT_SEEN if viseme is None else known[viseme])
            at += part.share * (p.end - p.start)
        if not parts:
            starts.append(at)
            found.append(NOT_SEEN if p.ipa else known[0])
    if phonemes:
        starts.append(phonemes[-1].end)
        found.append(known[0])
    return np.array(found)[np.searchsorted(starts, times, "right") - 1]


def by_voice(name: str, language: str, texts: Iterable[str], rates: tuple[float, ...]) -> Iterator[Spoken]:
    """Yield texts as a voice of the realizer speaks them, at each rate in turn."""
    voice = find_voice(name)
    for k, text in enumerate(texts):
        said = voice.say(SpeechRequest(text, language=language, rate=rates[k % len(rates)]))
        if said.pcm is not None and said.phonemes:
            yield Spoken(voice.name, said.sample_rate, said.pcm, said.phonemes)
    voice.close()


def by_festival(name: str, texts: list[str], rates: tuple[float, ...]) -> Iterator[Spoken]:
    """Yield texts as a voice of Festival speaks them, at each rate in turn."""
    _, coding, phones = FESTIVAL[name]
    with tempfile.TemporaryDirectory() as folder:
        lines = [f"(voice_{name})"]
        for k, text in enumerate(texts):
            lines.append(f"(Parameter.set 'Duration_Stretch {1 / rates[k % len(rates)]:.3f})")
            # Some voices fail at some words.
            lines.append(f'(unwind-protect (begin (set! u (SynthText "{text}"))')
            lines.append(f'(utt.save.wave u "{folder}/{k}.wav" \'riff)')
            lines.append(f'(utt.save.segs u "{folder}/{k}.lab")) nil)')
        script = Path(folder, "say.scm")
        script.write_text("\n".join(lines), coding, errors="ignore")
        subprocess.run(["festival", "-b", str(script)], check=False, capture_output=True)
        for k in range(len(texts)):
            wave, label = Path(folder, f"{k}.wav"), Path(folder, f"{k}.lab")
            if wave.exists() and label.exists():
                yield _labelled(name, wave, _ends(label), phones)


def by_flite(name: str, texts: Iterable[str], rates: tuple[float, ...]) -> Iterator[Spoken]:
    """Yield texts as a voice of flite speaks them, at each rate in turn."""
    with tempfile.TemporaryDirectory() as folder:
        for k, text in enumerate(texts):
            wave = Path(folder, "said.wav")
            stretch = f"duration_stretch={1 / rates[k % len(rates)]:.3f}"
            command = ["flite", "-voice", name, "-psdur", "--setf", stretch, "-t", text, "-o", str(wave)]
            printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
            pairs = [item.rsplit(":", 1) for item in printed.split() if ":" in item]
            yield _labelled(f"flite {name}", wave, [(float(end), phone) for phone, end in pairs], ARPABET)


def russian(chosen: slice) -> Iterator[Spoken]:
    """Yield recordings of a Russian man, from which Festival's voice takes its sounds."""
    for label in sorted((RECORDED / "lab").glob("*.lab"))[chosen]:
        yield _labelled("msu_ru_nsh", RECORDED / "wav" / f"{label.stem}.wav", _ends(label), RUSSIAN)


def librivox() -> Iterator[Spoken]:
    """Yield recordings of an Englishwoman."""
    lines = (LIBRIVOX / "transcription").read_text("utf-8").splitlines()
    pairs = [line.replace("<s>", "").replace("</s>", "").rpartition(" (")[::2] for line in lines]
    waves = (read_wav((LIBRIVOX / f"{name.rstrip(')')}.wav").read_bytes()) for _, name in pairs)
    speech = (Spoken("librivox", rate, pcm, ()) for rate, pcm in waves)
    return aligned(speech, (text.strip() for text, _ in pairs))


def aligned(speech: Iterable[Spoken], texts: Iterable[str]) -> Iterator[Spoken]:
    """Yield English speech with the phonemes that pocketsphinx finds, unless it does not find the text."""
    for spoken, text in zip(speech, texts, strict=True):
        with suppress(AlignError):
            found = align(spoken.pcm, spoken.rate, text, aligner="pocketsphinx")
            yield replace(spoken, phonemes=found.phonemes)


def _ends(label: Path) -> list[tuple[float, str]]:
    rows = (line.split() for line in label.read_text("latin1").splitlines())
    return [(float(row[0]), row[2]) for row in rows if len(row) == 3]


def _labelled(speaker: str, wave: Path, ends: list[tuple[float, str]], phones: dict[str, str]) -> Spoken:
    """Return a recording whose phones end at those times."""
    rate, pcm = read_wav(wave.read_bytes())
    phonemes, now = [], 0.0
    for end, phone in ends:
        plain = phone.rstrip(":1")
        # Outside the tables a doubled letter is one sound, and single letters are IPA.
        ipa = "" if phone in PAUSES else phones.get(phone, phones.get(plain, plain[:1]))
        phonemes.append(Phoneme(now, end, ipa))
        now = end
    return Spoken(speaker, rate, pcm, tuple(phonemes))
