"""Questions about single faces (Paul 2010, 4.4) and about pairs of films."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

from realizer.emotions.archetypes import archetypes
from realizer.enrichment import enrich
from realizer.knowledge.enrich import INTENSITY
from realizer.offline import realize
from realizer.result import Realization
from realizer.tables import faps
from realizer.tables.emotions import ring
from realizer.tables.templates import PREFIX, templates
from realizer_studio.faces.mpeg4.fap_scores import weights
from realizer_studio.study.drawing import FRONT, SIZE, Drawer, Variant, difference, faint, opaque, row, webp

EMOTIONS = ("anger", "disgust", "fear", "joy", "sadness", "surprise")
NAMES = (*EMOTIONS, "trust", "anticipation", "other")
PROFILES = ("own", "published", "raw")
STRENGTHS = (0.5, 1.0)
HALF, TURN = 512, 34907  # half of the unit distance (Paul 2010, 4.4.2), and 20 degrees for rotations
SCORES = ("3", "2", "1", "0")
# Answers other than the pictures to choose from.
ANSWERS: Mapping[str, tuple[str, ...]] = {
    "visual": ("none",),
    "emotional": ("none",),
    "naming": NAMES,
    "displacements": SCORES,
    "films": ("same",),
}
KINDS = tuple(ANSWERS)
WHEEL = {emotion.name: emotion.angle for emotion in ring("paul").values() if emotion.kind == "basic"}


@dataclass(frozen=True, eq=False)
class Item:
    """One question of a study."""

    kind: str  # one of `KINDS`
    truth: Mapping[str, Any]  # facts that are only in the key
    # Role -> picture (WebP) of the question, such as "reference".
    shown: Mapping[str, bytes] = field(default_factory=dict)
    # Role -> picture or film to choose from, such as "right"; empty if answers are words.
    options: Mapping[str, bytes] = field(default_factory=dict)
    text: Mapping[str, str] = field(default_factory=dict)  # texts of the question
    # The answer that an attention item requests, or None.
    check: str | None = None


def naming(variants: Sequence[Variant], draw: Drawer) -> Iterator[Item]:
    """Yield the six archetypes of each set of profiles at two strengths, for each variant."""
    for variant in variants:
        for profiles in PROFILES:
            found = {name: next(iter(archetypes(profiles)[name].values())) for name in EMOTIONS}
            cases = [(name, strength) for name in EMOTIONS for strength in STRENGTHS]
            frames = [found[name].scaled(strength).frame() for name, strength in cases]
            rows = [row(faps=dict(enumerate(values.tolist(), 1))) for values in frames]
            for (name, strength), picture in zip(cases, draw(variant, rows), strict=True):
                truth = {"variant": variant.name, "emotion": name, "profiles": profiles, "strength": strength}
                yield Item("naming", truth | {"angle": ring("paul")[name].angle}, {"face": webp(picture)})


def displacements(variants: Sequence[Variant], draw: Drawer) -> Iterator[Item]:
    """Yield the 127 displacements of low-level FAPs for each variant (Paul 2010, 4.4.2).

    Forward displacements are drawn in profile. `truth["moves"]` is False if no pixel changes.
    """
    cases = []
    for found in faps()[2:]:
        size = TURN if found.unit == "angle_unit" else HALF
        camera = "profile" if found.direction == "forward" else FRONT
        ends = (min(size, found.most), max(-size, found.least))
        cases += [(found, value, camera) for value in ends if value]
    for variant in variants:
        for camera in (FRONT, "profile"):
            selected = [(found, value) for found, value, view in cases if view == camera]
            rows = [row(), *(row(faps={found.fap: value}) for found, value in selected)]
            rest, *pictures = draw(variant, rows, camera)
            for (found, value), picture in zip(selected, pictures, strict=True):
                difference_picture = difference(opaque(picture), opaque(rest), faint(rest))
                images = {
                    "neutral": webp(rest),
                    "moved": webp(picture),
                    "difference": webp(difference_picture),
                }
                sign = 1 if value > 0 else -1
                truth = {"variant": variant.name, "fap": found.fap, "sign": sign, "name": found.name}
                truth |= {"weight": weights()[found.fap], "moves": bool((picture != rest).any())}
                direction = f"{found.direction}{'' if sign > 0 else ', reversed'}"
                text = {"fap": f"FAP {found.fap} {found.name} {value:+g} ({direction})"}
                yield Item("displacements", truth, images, text=text)


def checks(items: Sequence[Item], draws: np.random.Generator) -> list[Item]:
    """Return attention items for questions of one kind: one per twenty questions, at least two."""
    found = []
    for k in draws.choice(len(items), max(2, len(items) // 20)):
        item = items[k]
        answer = str(draws.choice(ANSWERS[item.kind]))
        found.append(Item(item.kind, {"check": answer}, item.shown, item.options, item.text, answer))
    return found


PAIRS = (("enriched", "plain"), ("enriched", "random"), ("random", "plain"), ("enriched", "no co-occurrence"))
SAME = 0.02  # of intensities
TAG = "<realizer:expression"
DOCUMENT = (
    '<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" xmlns:realizer="urn:bml-realizer:1" id="bml1">'
    '<speech id="speech1"><text>{}</text></speech>{}</bml>'
)


def control(text: str, expressions: int, draws: np.random.Generator) -> str:
    """Return BML that speaks a text with a number of random templates at random words."""
    words = text.split()
    positions = draws.integers(len(words), size=expressions).tolist()
    speech = " ".join(
        f'<sync id="r{k}"/>{escape(word)}' if k in positions else escape(word) for k, word in enumerate(words)
    )
    names = [str(name).lower() for name in draws.choice(list(templates()), expressions)]
    elements = [
        f'{TAG} id="e{k}" name="{PREFIX}{name}" intensity="{INTENSITY}" start="speech1:r{position}"/>'
        for k, (name, position) in enumerate(zip(names, positions, strict=True))
    ]
    return DOCUMENT.format(speech, "".join(elements))


def films(
    variants: Sequence[Variant],
    texts: Sequence[str],
    language: str,
    draws: np.random.Generator,
    step: Callable[[int], object],
) -> Iterator[Item]:
    """Yield pairs of films of each text: enriched, plain and random ones, and with and without co-occurrence.

    Pairs of equal films are omitted.

    Raises:
        RealizerError: PyAV is not installed.
    """
    for variant in variants:
        play = partial(
            realize, face=variant.face, deformer=variant.deformer, mapping=variant.mapping, language=language
        )
        for text in texts:
            enriched = enrich(text, language=language)
            documents = {
                "plain": (DOCUMENT.format(escape(text), ""), "on"),
                "enriched": (enriched, "on"),
                "random": (control(text, enriched.count(TAG), draws), "on"),
                "no co-occurrence": (enriched, "off"),
            }
            played = {
                name: play(document, cooccurrence=rules) for name, (document, rules) in documents.items()
            }
            encoded: dict[str, bytes] = {}
            for pair in PAIRS:
                one, other = (played[name].aus.moving for name in pair)
                if one.shape == other.shape and np.abs(one - other).max() < SAME:
                    continue
                for name in set(pair) - set(encoded):
                    encoded[name] = _film(played[name])
                    step(1)
                truth = {"variant": variant.name, "text": text, "pair": list(pair)}
                options = {name: padded(encoded[name], draws) for name in pair}
                yield Item("films", truth, {}, options, {"text": text})


def padded(film: bytes, draws: np.random.Generator) -> bytes:
    """Return a WebM file with a Void element of random length, so that copies of a film are different files.

    Otherwise the enriched film could be recognised, because it is in most pairs.
    """
    size = int(draws.integers(1000, 16000))
    return film + b"\xec" + (0x4000 | size).to_bytes(2, "big") + draws.bytes(size)


def _film(played: Realization) -> bytes:
    with TemporaryDirectory() as folder:
        return played.save(Path(folder) / "film.webm", size=SIZE, camera=FRONT).read_bytes()
