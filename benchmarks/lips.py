"""Measures lip movements of speech: `python -m benchmarks.lips [--voice V] [--faces ada,ben,ida]`.

`realize` plays sixty sentences in six languages. The vertices of faces are measured in frames at 25 a second,
in each of eight phases of this grid. The program prints a line for each way of speaking (a rate, and an
expression of the face), then the worst cases of each fault.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from xml.sax.saxutils import escape

import numpy as np

from realizer.animation.lips.visemes import coarticulation
from realizer.animation.pose import poses
from realizer.face.load import load_face
from realizer.offline import realize
from realizer.speech.registry import find_voice
from realizer.speech.utterance import SpeechRequest, Utterance, Voice
from tests.mouths import Mouth

SENTENCES = {
    "en-US": """Pam brought five very big maps from Bombay, and Mum clapped.
        The quick brown fox jumps over the lazy dog.
        My mother's bumblebee hummed above a pumpkin pie.
        Have you ever seen seven vivid, fluffy foxes fly?
        Stop it! Help me up, Bob.
        She sells sea shells by the sea shore.
        Peter Piper picked a peck of pickled peppers.
        How much wood would a woodchuck chuck?
        We were away a year ago.
        Calm palms in the warm farm arm the alarm.
        Are you comfortable with a lamp from Memphis?
        Papa and Mama bought a puppy.
        Five fifths of a film puff up a trophy.
        I love the tough rough stuff above the shelf.
        Tell him that them from Rome never came home.
        A big pub in Cambridge was open until February.
        Please move both chairs from the front room to the back.
        The empty shop had simple, cheap computers.
        You should blow soap bubbles in the moonlight.
        What an amazing improvement for a problem that big!
        Father asked far too much of the art class.
        He sees these green trees each evening.
        Ben's red bed is next to the desk.
        Nothing is as offensive as a half-full cup of coffee.
        If Fred has fun, Phil will laugh himself hoarse.
        Umbrella, ambulance, embarrassed, impossible, important.
        Keep quiet; do not wake the baby up.
        Is it a beat, a bit, a bet, a bat or a bath?
        Victor gave every visitor a velvet waistcoat.
        Oh, who knew that Hugh could choose the blue shoes?
        Maybe the public will vote for better beaches.
        I'm fine. Um, maybe. Mhm. Oops!
        That's the Olympic symphony chamber.
        A thumb, a limb, a womb, a comb, a bomb, a lamb.
        Jump! Bump! Pump! Lump! Camp! Romp!
        They saw a saw in the hall of the law.
        Sam's team met me Monday morning at ten past one.
        Obviously, a subversive obvious cupful helps people.
        Do not put the purple book on the bush.
        Yes.""",
    "nl": """Ben pakt vijf mooie bloemen voor mama.
        De papegaai op de bank wil brood met boter en jam.
        Mijn moeder woont in een warm huis aan de rivier.
        Fiets je vanavond met ons mee?""",
    "de": """Papa kauft fünf Pflaumen und vier Äpfel.
        Am Bahnhof bleiben wir lieber im warmen Abteil.
        Das Pferd lief um den Apfelbaum.
        Ich muss morgen früh aufstehen.""",
    "fr": """Papa veut du beau pain et un bon vin blanc.
        Ma femme a vu un film formidable avant-hier.
        Tu as bu un peu de jus de pomme.
        Bonjour madame, je m'appelle Philippe.""",
    "pl": """Pani ma psa i mówi po polsku.
        Babcia ubrała wnuka w ciepłe spodnie.
        Żaba skacze przez wielką kałużę.
        Proszę powiedzieć mi, która jest godzina.""",
    "es": """Me gusta mucho el pan blanco con vino.
        Pepe bebe un vaso de agua fría.
        La familia viaja en barco por el mar.
        ¿Dónde vive tu amiga Pilar?""",
}
STEP, FRAME = 0.005, 0.04  # s between two phases, and between two frames of a client
MAX_GAP = 0.03  # of the mouth-nose separation
MIN_WINDOW = 0.06  # s; in every phase, it contains a frame near the middle of a shorter sound
OVERLAP = 0.02  # of the mouth-nose separation, by which a biting lip must cover the teeth
CLOSING, BITING = "pbm", "fv"
OPEN = {"a": "aɑ", "e": "eɛ", "i": "i"}
LONG_VOWEL = 0.06  # s; a shorter vowel has no time to open
EXPRESSIONS = {
    "neutral": "",
    "smile": '<faceLexeme id="x" lexeme="HAPPINESS" amount="0.8" start="0" end="60"/>',
    "anger": '<faceLexeme id="x" lexeme="ANGER" amount="0.8" start="0" end="60"/>',
    "surprise": '<faceLexeme id="x" lexeme="SURPRISE" amount="0.9" start="0" end="60"/>',
    "AU26": '<faceFacs id="x" au="26" amount="0.9" start="0" end="60"/>',
    "AU27": '<faceFacs id="x" au="27" amount="0.9" start="0" end="60"/>',
    "OPEN_MOUTH": '<faceLexeme id="x" lexeme="OPEN_MOUTH" amount="0.8" start="0" end="60"/>',
    "AU22": '<faceFacs id="x" au="22" amount="0.9" start="0" end="60"/>',
}
RATES = (80, 120, 250, 350, 450)  # words a minute
BML = (
    '<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" id="b" composition="REPLACE">{shown}'
    '<speech id="s" start="0.5"><text xml:lang="{language}">{text}</text></speech></bml>'
)


@dataclass
class VoiceAtRate:
    """A voice at another rate."""

    voice: Voice
    rate: float
    name: str = "at"

    def say(self, request: SpeechRequest) -> Utterance:
        return self.voice.say(replace(request, rate=request.rate * self.rate))

    def close(self) -> None:
        self.voice.close()


@dataclass
class Score:
    """The measurements of one way of speaking: (value, place) of each sound or curve."""

    closed: list[tuple[float, str]] = field(default_factory=list)
    bitten: list[tuple[float, str]] = field(default_factory=list)
    vowels: dict[str, list[float]] = field(default_factory=lambda: {name: [] for name in OPEN})
    speed: list[tuple[float, str]] = field(default_factory=list)
    jolt: list[tuple[float, str]] = field(default_factory=list)

    def line(self) -> str:
        """Return a line with pass rates, medians, and the largest speed and acceleration."""
        opened = " ".join(f"{100 * float(np.median(v or [np.nan])):5.1f}" for v in self.vowels.values())
        rates = " ".join(
            f"{sum(v < limit for v, _ in found):4d}/{len(found):<4d} worst {100 * max(found)[0]:5.1f} %"
            for found, limit in ((self.closed, MAX_GAP), (self.bitten, 0.0))
            if found
        )
        return f"{rates} | a e i {opened} | {max(self.speed)[0]:6.0f} {max(self.jolt)[0]:8.0f}"


def windows(utterance: Utterance, start: float) -> Iterator[tuple[str, float, float, float, str]]:
    """Yield (IPA, begin, end, length, word) of each phoneme, widened to contain a frame."""
    words = utterance.words
    for phoneme in utterance.phonemes:
        middle = start + (phoneme.start + phoneme.end) / 2
        half = max(MIN_WINDOW, phoneme.end - phoneme.start) / 2
        inside = (w.text for w in words if w.start <= middle - start < w.end)
        yield phoneme.ipa, middle - half, middle + half, phoneme.end - phoneme.start, next(inside, "")


def measure(voice: Voice, mouth: Mouth, shown: str, language: str, text: str, score: Score) -> None:
    """Measure one sentence in every phase."""
    document = BML.format(shown=EXPRESSIONS[shown], language=language, text=escape(text))
    played = realize(document, voice=voice, fps=1 / STEP, idle=False, face=mouth.face.name)
    speech = played.speeches[0]
    times = played.aus.times
    keep = times < speech.start + speech.utterance.duration + 0.2
    times, rows = times[keep], poses(played.aus, mouth.face.inputs)[keep]
    vertices = mouth.vertices(rows)
    gap, bite, path = mouth.gap(vertices), mouth.bite(vertices), mouth.path(vertices)
    phases = round(FRAME / STEP)
    here = f"{mouth.face.name} {language} {text[:24]!r}"
    for ipa, begin, end, length, word in windows(speech.utterance, speech.start):
        inside = np.flatnonzero((times >= begin - 1e-9) & (times <= end + 1e-9))
        grids = [inside[inside % phases == phase] for phase in range(phases)]
        where = f"{here} {word!r} /{ipa}/ {begin:.3f}-{end:.3f} s"
        if ipa[:1] in CLOSING and ipa:
            worst = max(float(gap[grid].min()) if len(grid) else np.inf for grid in grids)
            score.closed.append((worst, where))
        elif ipa[:1] in BITING and ipa:
            # Below 0 if in some frame the lip covers the teeth partly, so that they are visible above it.
            worst = max(float((OVERLAP - bite[grid].min(axis=1)).min()) if len(grid) else 1 for grid in grids)
            score.bitten.append((worst, where))
        for name, letters in OPEN.items():
            if ipa[:1] and ipa[0] in letters and len(ipa.rstrip("ː")) == 1 and length >= LONG_VOWEL:
                score.vowels[name].append(float(gap[inside].max()))
    for phase in range(phases):
        steps = np.diff(path[phase::phases], axis=0)
        at = np.linalg.norm(steps, axis=2) / FRAME * 1024
        turn = np.linalg.norm(np.diff(steps, axis=0), axis=2) / FRAME**2 * 1024
        for found, into, off in ((at, score.speed, 1), (turn, score.jolt, 1)):
            k, point = np.unravel_index(found.argmax(), found.shape)
            when = times[phase::phases][int(k) + off]
            into.append(
                (float(found.max()), f"{here} at {when:.3f} s, {('upper', 'lower', 'L', 'R')[point]}")
            )


def lines(languages: str | None, every: int) -> list[tuple[str, str]]:
    """Return each `every`th (language, sentence)."""
    found = [
        (language, line.strip())
        for language, text in SENTENCES.items()
        for line in text.splitlines()
        if languages is None or language.split("-")[0] in languages.split(",")
    ]
    return found[::every]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--voice", default=None)
    parser.add_argument("--faces", default="ada,ben,ida")
    parser.add_argument("--languages", default=None)
    parser.add_argument("--every", type=int, default=1, help="take each n-th sentence")
    parser.add_argument("--worst", type=int, default=5)
    parser.add_argument("--only", default="", help="only ways of speaking whose name contains this")
    parser.add_argument("--deformer", default=None)
    options = parser.parse_args()
    voice = find_voice(options.voice)
    usual = 175.0
    ways = [(shown, 1.0) for shown in EXPRESSIONS] + [("neutral", rate / usual) for rate in RATES]
    ways += [("surprise", RATES[-1] / usual)]
    speeds = coarticulation()["speed"]
    print(f"{len(lines(options.languages, options.every))} sentences by {voice.name}; limits {speeds}")
    print("way: p b m closed | f v bitten | openings of a e i in % | fastest MNS/s, sharpest MNS/s2")
    for name in options.faces.split(","):
        mouth = Mouth(load_face(name, deformer=options.deformer))
        for shown, rate in ways:
            title = f"{name} {shown} {rate * usual:.0f}"
            if options.only not in title:
                continue
            score = Score()
            for language, text in lines(options.languages, options.every):
                measure(VoiceAtRate(voice, rate), mouth, shown, language, text, score)
            print(f"{title:24s} {score.line()}", flush=True)
            for kind, found, limit in (
                ("open", score.closed, MAX_GAP),
                ("not bitten", score.bitten, 0.0),
                ("fast", score.speed, speeds["lips"]),
                ("sharp", score.jolt, np.inf),
            ):
                for value, where in sorted(found, reverse=True)[: options.worst]:
                    if value >= limit:
                        print(f"    {kind} {value:.3f} {where}")
    voice.close()


if __name__ == "__main__":
    main()
