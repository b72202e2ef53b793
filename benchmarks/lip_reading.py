"""Reads lips by machine: `python -m benchmarks.lip_reading [--faces ada,ben,ida] [--noise 0.5]`.

A linear discriminant analysis learns twelve classes of visemes from sentences of one face and tells them in
other sentences of another face, by a single moment, the middle of each sound, as neighbouring frames would
tell the context too. It sees points of the lips and the chin, and how much of teeth and tongue shows between
the lips, each relative to the face at rest and to its mouth. Noise stands for the error of a camera's points.

Classes are the visemes of MPEG-4; /t d/, /n l/ and /k g/ are one, as for human lip-readers (Fisher 1968).
"""

from __future__ import annotations

import argparse
from typing import NamedTuple
from xml.sax.saxutils import escape

import numpy as np

from benchmarks.lips import BML, lines
from realizer.animation.lips.visemes import sounds
from realizer.animation.pose import poses
from realizer.core.array_types import Float64, Index
from realizer.face.deform import deform
from realizer.face.load import load_face
from realizer.offline import realize
from realizer.speech.registry import find_voice
from realizer.speech.utterance import Voice

CLASSES = ("p", "f", "θ", "t k", "ʃ", "s", "ɹ", "ɑ", "ɛ", "ɪ", "ɔ", "u")
# MPEG-4 viseme -> class.
OF_VISEME = {1: 0, 2: 1, 3: 2, 4: 3, 5: 3, 8: 3, 6: 4, 7: 5, 9: 6, 10: 7, 11: 8, 12: 9, 13: 10, 14: 11}
POINTS = (*(f"2.{k}" for k in range(1, 10)), *(f"8.{k}" for k in range(1, 9)))
SHRINKAGE = 0.02  # of the covariance towards that of independent features
TEETH, TONGUE = 0.005, 0.008  # m to either side of the middle
BEHIND, AHEAD = 0.014, 0.003  # m behind the front of the teeth: a tongue seen between them, and before them
FPS = 100


class Sounds(NamedTuple):
    """The moments of one face: features (n, m), classes (n,), numbers of sentences (n,)."""

    features: Float64
    classes: Index
    sentences: Index


def shown(vertices: Float64, rest: Float64, parts: dict[str, Index], lips: tuple[int, int]) -> Float64:
    """Return (n, 5) metres that show in the middle: the gap, upper and lower teeth, the tongue twice."""
    upper, lower = (vertices[:, lip, 1] for lip in lips)
    edge = vertices[:, parts["upper_teeth"], 1].min(axis=1)
    front = vertices[:, parts["upper_teeth"], 2].max(axis=1)[:, None]
    top = vertices[:, parts["lower_teeth"], 1].max(axis=1)
    tongue = vertices[:, parts["tongue"]]
    behind, ahead = (
        np.where(tongue[..., 2] > front - back, tongue[..., 1], -1.0).max(axis=1) for back in (BEHIND, AHEAD)
    )
    spans = (
        (lower, upper),
        (np.maximum(edge, lower), upper),
        (lower, np.minimum(top, upper)),
        (np.maximum(lower, top), np.minimum(np.minimum(upper, edge), behind)),
        (lower, np.minimum(upper, ahead)),
    )
    return np.stack([np.maximum(last - first, 0.0) for first, last in spans], axis=1)


def spoken(
    name: str, voice: Voice, texts: list[tuple[str, str]], noise: float, random: np.random.Generator
) -> Sounds:
    """Return the sounds of a face, with noise of so many metres."""
    face = load_face(name)
    rest, at = face.vertices.astype(np.float64), [face.feature_points[point] for point in POINTS]
    parts = {
        part: first + np.flatnonzero(np.abs(rest[slice(*face.parts[part]), 0]) < near)
        for part, near in (("upper_teeth", TEETH), ("lower_teeth", TEETH), ("tongue", TONGUE))
        for first in face.parts[part][:1]
    }
    unit = np.array([face.fapu.mw0, face.fapu.mns0, face.fapu.mns0])
    found, classes, sentences = list[Float64](), list[int](), list[int]()
    for number, (language, text) in enumerate(texts):
        document = BML.format(shown="", language=language, text=escape(text))
        played = realize(document, voice=voice, fps=FPS, idle=False, face=name)
        speech = played.speeches[0]
        heard = [(speech.start + (p.start + p.end) / 2, class_of(p.ipa)) for p in speech.utterance.phonemes]
        middles, kinds = zip(*((at, kind) for at, kind in heard if kind is not None), strict=True)
        rows = poses(played.aus, face.inputs)[np.rint(np.array(middles) * FPS).astype(int)]
        vertices = deform(face, rows).astype(np.float64)
        moved = (vertices[:, at] - rest[at]) + random.normal(0, noise, (len(rows), len(at), 3))
        seen = shown(vertices, rest, parts, (face.feature_points["2.2"], face.feature_points["2.3"]))
        seen += random.normal(0, noise, seen.shape)
        found.append(np.concatenate([(moved / unit).reshape(len(rows), -1), seen / unit[1]], axis=1))
        classes += kinds
        sentences += [number] * len(rows)
    return Sounds(np.concatenate(found), np.array(classes), np.array(sentences))


def class_of(ipa: str) -> int | None:
    """Return the class of a phoneme, of its first sound, or None for a pause and for /h/."""
    parts = sounds(ipa)
    return OF_VISEME[max(parts[0].mix, key=lambda pair: pair[1])[0]] if parts and parts[0].mix else None


def found_classes(learn: Sounds, test: Sounds) -> Index:
    """Return the class (n,) that the discriminant functions of `learn` find for each row of `test`."""
    scale = np.maximum(learn.features.std(axis=0), 1e-9)
    x, y = learn.features / scale, test.features / scale
    kinds = np.arange(len(CLASSES))
    means = np.array([x[learn.classes == kind].mean(axis=0) for kind in kinds])
    spread = np.mean([np.cov(x[learn.classes == kind].T, bias=True) for kind in kinds], axis=0)
    spread = (1 - SHRINKAGE) * spread + SHRINKAGE * np.trace(spread) / len(spread) * np.eye(len(spread))
    weights = np.linalg.solve(spread, means.T)
    return np.asarray((y @ weights - (means.T * weights).sum(axis=0) / 2).argmax(axis=1))


def confusion(speakers: list[Sounds]) -> Index:
    """Return (12, 12) counts, row = the sound, column = what it is taken for."""
    counts = np.zeros((len(CLASSES), len(CLASSES)), int)
    for learn, test in zip(speakers, speakers[1:] + speakers[:1], strict=True):
        for part in (0, 1):
            some, others = learn.sentences % 2 == part, test.sentences % 2 != part
            learned, tested = Sounds(*(v[some] for v in learn)), Sounds(*(v[others] for v in test))
            np.add.at(counts, (tested.classes, found_classes(learned, tested)), 1)
    return counts


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--faces", default="ada,ben,ida", help="each is read by what the one before taught")
    parser.add_argument("--voice", default=None)
    parser.add_argument("--noise", type=float, default=0.5, help="mm, standard deviation (0.5)")
    options = parser.parse_args()
    texts, voice, random = lines("en", 1), find_voice(options.voice), np.random.default_rng(0)
    names, noise = options.faces.split(","), options.noise / 1000
    counts = confusion([spoken(name, voice, texts, noise, random) for name in names])
    voice.close()
    shares = 100 * counts / counts.sum(axis=1, keepdims=True)
    print("%    " + "".join(f"{name:>5}" for name in CLASSES) + "  sounds")
    for name, row, count in zip(CLASSES, shares, counts.sum(axis=1), strict=True):
        print(f"{name:<5}" + "".join(f"{share:5.0f}" for share in row) + f"{count:8d}")
    print(f"balanced accuracy {shares.diagonal().mean() / 100:.2f} with noise of {options.noise} mm")


if __name__ == "__main__":
    main()
