"""What was seen of a film so far, kept in a folder, so that an interrupted run goes on where it ended."""

import json
import shutil
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.atomic_files import replacing, write_bytes
from realizer.tracking.follower import Follower, Person
from realizer.tracking.landmarks import Landmarks

EVERY = 500  # pictures; what comes after the last whole lot is looked at again
KEY = "film.json"
COLUMNS = ("points", "presence", "traits", "eyes")


class Unfinished:
    """Landmarks of a film in lots of pictures, one file each; they show no picture.

    Attributes:
        every: pictures in a lot.
    """

    def __init__(self, folder: Path, source: Path) -> None:
        """Keep a film in a folder, which the first full lot makes; one of another film is deleted."""
        state = source.stat()
        self.every = EVERY
        self._folder = folder
        self._key = json.dumps([str(source.resolve()), state.st_size, state.st_mtime_ns])
        self._lots = 0

    def read(self) -> tuple[list[float], Follower]:
        """Return the times of all pictures that were looked at, and the follower after them."""
        times: list[float] = []
        people: list[Person] = []
        key = self._folder / KEY
        if key.is_file() and key.read_text("utf-8") != self._key:
            self.remove()
        while key.is_file() and self._read(self._folder / f"{self._lots}.npz", times, people):
            self._lots += 1
        return times, Follower(people, len(times))

    def _read(self, path: Path, times: list[float], people: list[Person]) -> bool:
        try:
            with np.load(path, allow_pickle=False) as file:
                lot = {name: file[name] for name in ("times", "who", "frames", *COLUMNS)}
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            return False
        times += lot["times"].tolist()
        columns = (lot["who"].tolist(), lot["frames"].tolist(), *(lot[name] for name in COLUMNS))
        for who, frame, points, presence, traits, eyes in zip(*columns, strict=True):
            people += [Person() for _ in range(who + 1 - len(people))]
            people[who].frames.append(frame)
            people[who].faces.append(Landmarks(points, float(presence), traits, eyes))
        return True

    def add(self, times: Sequence[float], people: Sequence[Person]) -> None:
        """Keep the last lot: what was seen in the last `every` pictures."""
        first = self._lots * self.every
        seen = [
            (k, frame, face)
            for k, person in enumerate(people)
            for frame, face in zip(person.frames, person.faces, strict=True)
            if frame >= first
        ]
        self._folder.mkdir(parents=True, exist_ok=True)
        if not self._lots:
            write_bytes(self._folder / KEY, self._key.encode())
        rows: Any = {name: np.array([getattr(face, name) for _, _, face in seen]) for name in COLUMNS}
        who, frames = (np.array([row[k] for row in seen], int) for k in (0, 1))
        with replacing(self._folder / f"{self._lots}.npz") as draft:
            np.savez(draft, times=np.array(times[first:]), who=who, frames=frames, **rows)
        self._lots += 1

    def remove(self) -> None:
        """Delete what was kept; a folder of that name that is not ours stays."""
        if (self._folder / KEY).is_file():
            shutil.rmtree(self._folder, ignore_errors=True)
