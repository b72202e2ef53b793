"""A machine that judges a study from its pictures alone, by the networks of the tracking."""

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
        kind, shown = item["kind"], item["shown"]
        if kind not in ("visual", "emotional", "naming"):
            return None
        pairs = [(shown["face"], "")] if kind == "naming" else [(shown["reference"], shown.get("rest", ""))]
        faces = [
            self._measured(*pair) for pair in [*pairs, *((o, shown["neutral"]) for o in item["options"])]
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
        apart = np.linalg.norm(np.stack(values[1:]) - values[0], axis=1)
        too_far = kind == "visual" and apart.min() > NEAR
        return "none" if too_far else str(item["options"][int(np.argmin(apart))]), ""

    def _measured(self, file: str, rest: str) -> Measured | None:
        seen, neutral = self._seen(file), self._seen(rest) if rest else None
        return None if seen is None else measure(seen, neutral.values[0] if neutral else None)

    def _look(self, file: str) -> Components | None:
        people = follow([Picture(0.0, read_picture(self._folder / file), file)])[1]
        return components(people[0].faces) if people else None
