"""A machine judge, which answers a study from its pictures, by the networks of the tracking."""

import json
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.errors import TableError
from realizer.tables.emotions import ring
from realizer_studio.analysis.recognise import recogniser
from realizer_studio.study.answers import COLUMNS
from realizer_studio.study.items import NAMES
from realizer_studio.study.kit import ITEMS
from realizer_studio.tracking.files import mask
from realizer_studio.tracking.follower import follow
from realizer_studio.tracking.pictures import Picture, read_picture
from realizer_studio.tracking.regressor import Components, Measured, components, measure

NAME = "tracking"
NEAR = 1.0  # largest distance of action units between two faces that match


def read_items(folder: Path) -> dict[str, Any]:
    """Return the items in a study's folder; raises TableError if the folder is no study."""
    try:
        content = (folder / ITEMS).read_text("utf-8")
        return dict(json.loads(content.partition("=")[2].rstrip().removesuffix(";")))
    except (OSError, ValueError) as error:
        raise TableError(f"{folder / ITEMS}: wanted the items of a study, got: {error}") from None


def judge(folder: Path, step: Callable[[int], object]) -> Iterator[list[str]]:
    """Yield rows of answers, with the columns `COLUMNS`, by a machine that reads only the pictures.

    It chooses the face with the most similar action units or, for emotions, the most similar beliefs, and it
    names faces. It skips scores and films, and pictures in which no face is found.

    Raises:
        TableError: the folder is no study.
        TrackingError: a picture cannot be read.
        RealizerError: ai-edge-litert is not installed.
    """
    study = read_items(folder)
    vision = _Vision(folder)
    for item in study["items"]:
        step(1)
        found = vision.answer(item)
        if found is not None:
            answer, angle = (item["check"], "") if "check" in item else found
            columns = {"study": study["study"], "judge": NAME, "by": "machine", "item": item["id"]}
            columns |= {"kind": item["kind"], "answer": answer, "angle": angle}
            yield [columns.get(name, "") for name in COLUMNS]


class _Vision:
    """The faces in the pictures of a folder, tracked on demand."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._components = cache(self._track)

    def answer(self, item: Mapping[str, Any]) -> tuple[str, str] | None:
        """Return an answer and an angle on the wheel, or None."""
        kind, pictures = item["kind"], item["shown"]
        if kind not in ("visual", "emotional", "naming"):
            return None
        pairs = (
            [(pictures["face"], "")]
            if kind == "naming"
            else [(pictures["reference"], pictures.get("rest", ""))]
        )
        faces = [
            self._measured(*pair) for pair in [*pairs, *((o, pictures["neutral"]) for o in item["options"])]
        ]
        found = [face for face in faces if face is not None]
        if len(found) < len(faces):
            return None
        if kind == "naming":
            (name,) = recogniser().names(found[0].faps, mask())
            return (name, f"{ring('paul')[name].angle:g}") if name in NAMES else ("other", "")
        if kind == "emotional":
            values = [recogniser().beliefs(face.faps, mask())[0] for face in found]
        else:
            values = [face.units[0] for face in found]
        distance = np.linalg.norm(np.stack(values[1:]) - values[0], axis=1)
        too_far = kind == "visual" and distance.min() > NEAR
        return "none" if too_far else str(item["options"][int(np.argmin(distance))]), ""

    def _measured(self, file: str, rest: str) -> Measured | None:
        face, neutral = self._components(file), self._components(rest) if rest else None
        return None if face is None else measure(face, neutral.values[0] if neutral else None)

    def _track(self, file: str) -> Components | None:
        people = follow([Picture(0.0, read_picture(self._folder / file), file)])[1]
        return components(people[0].faces) if people else None
