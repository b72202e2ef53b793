"""A machine that judges a study from its pictures alone, by the networks of the tracking."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from realizer.analysis.recognise import recogniser
from realizer.core.array_types import Float64
from realizer.core.errors import TableError
from realizer.study.answers import COLUMNS
from realizer.study.items import NAMES
from realizer.study.kit import ITEMS
from realizer.tables.wheel_words import ring
from realizer.tracking.files import mask
from realizer.tracking.follower import follow
from realizer.tracking.pictures import Picture, read_picture
from realizer.tracking.regressor import Components, Measured, components, measure

NAME = "tracking"
NEAR = 1.0  # distance of action units at which two faces are too different


def read_items(folder: Path) -> dict[str, Any]:
    """Return the items of a study's folder; raises TableError if it is none."""
    try:
        content = (folder / ITEMS).read_text("utf-8")
        return dict(json.loads(content.partition("=")[2].rstrip().removesuffix(";")))
    except (OSError, ValueError) as error:
        raise TableError(f"{folder / ITEMS}: wanted the items of a study, got: {error}") from None


def judge(folder: Path, step: Callable[[int], object]) -> Iterator[list[str]]:
    """Yield the rows of answers, with the columns `COLUMNS`, of a machine that sees the pictures only.

    It chooses the face with the most similar action units, or, by emotion, with the most similar beliefs
    about emotions; and it names faces. It leaves out scores and films, and faces that it does not find.

    Raises:
        TableError: no study. TrackingError: a picture cannot be read. RealizerError: no ai-edge-litert.
    """
    study = read_items(folder)
    eyes = _Eyes(folder)
    for item in study["items"]:
        step(1)
        found = eyes.answer(item)
        if found is not None:
            answer, angle = (item["check"], "") if "check" in item else found
            known = {"study": study["study"], "judge": NAME, "by": "machine", "item": item["id"]}
            known |= {"kind": item["kind"], "answer": answer, "angle": angle}
            yield [known.get(name, "") for name in COLUMNS]


class _Eyes:
    """What the machine sees in the pictures of a folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._seen = cache(self._look)

    def answer(self, item: Mapping[str, Any]) -> tuple[str, str] | None:
        """Return an answer and an angle on the wheel, or None."""
        if item["kind"] == "naming":
            return self._name(item["shown"]["face"])
        if item["kind"] in ("visual", "emotional"):
            chosen = self._most_similar(item)
            return None if chosen is None else (chosen, "")
        return None

    def _name(self, file: str) -> tuple[str, str] | None:
        seen = self._seen(file)
        if seen is None:
            return None
        (name,) = recogniser().names(measure(seen).faps, mask())
        return (name, f"{ring('paul')[name].angle:g}") if name in NAMES else ("other", "")

    def _most_similar(self, item: Mapping[str, Any]) -> str | None:
        shown = item["shown"]
        wanted = self._measured(shown["reference"], shown.get("rest"))
        faces = [self._measured(file, shown["neutral"]) for file in item["options"]]
        if wanted is None or None in faces:
            return None
        kind = _emotions if item["kind"] == "emotional" else _units
        apart = [float(np.linalg.norm(kind(face) - kind(wanted))) for face in faces if face is not None]
        if kind is _units and min(apart) > NEAR:
            return "none"
        return str(item["options"][int(np.argmin(apart))])

    def _measured(self, file: str, rest: str | None) -> Measured | None:
        seen, neutral = self._seen(file), rest and self._seen(rest)
        return None if seen is None else measure(seen, neutral.values[0] if neutral else None)

    def _look(self, file: str) -> Components | None:
        people = follow([Picture(0.0, read_picture(self._folder / file), file)])[1]
        return components(people[0].faces) if people else None


def _units(face: Measured) -> Float64:
    values: Float64 = face.units[0]
    return values


def _emotions(face: Measured) -> Float64:
    beliefs: Float64 = recogniser().beliefs(face.faps, mask())[0]
    return beliefs
