"""Pairs of films: with expressions by rules, with random expressions, and without expressions."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.sax.saxutils import escape

import numpy as np

from realizer.enrichment import enrich
from realizer.knowledge.enrich import INTENSITY
from realizer.offline import realize
from realizer.result import Realization
from realizer.tables.templates import PREFIX, templates
from realizer_studio.study.drawing import FRONT, SIZE, Variant
from realizer_studio.study.items import Item

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
    expressions_ = [
        f'{TAG} id="e{k}" name="{PREFIX}{name}" intensity="{INTENSITY}" start="speech1:r{position}"/>'
        for k, (name, position) in enumerate(zip(names, positions, strict=True))
    ]
    return DOCUMENT.format(speech, "".join(expressions_))


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
