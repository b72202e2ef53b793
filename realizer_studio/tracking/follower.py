"""Faces followed from picture to picture, several people at once, and what was seen so far of a film."""

import json
import shutil
import zipfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.atomic_files import replacing, write_bytes
from realizer_studio.tracking.detector import detect
from realizer_studio.tracking.landmarks import MIN_PRESENCE, NEW_PRESENCE, Landmarks, landmarks
from realizer_studio.tracking.pictures import Picture
from realizer_studio.tracking.region import Region

DETECT_EVERY = 15  # pictures, for people who come later
SMALL_EVERY, SMALL_LOST = 150, 5  # pictures, for small faces; the second, while nobody is there
SAME_PLACE = 0.35  # distance of two regions of one person in one picture, relative to their side
NEAR = 1.5  # distance of someone who was lost and is found again, relative to the side of the face
MAX_PEOPLE = 8


@dataclass(eq=False)
class Person:
    """One person over time."""

    # Numbers of the pictures in which the face was found, rising.
    frames: list[int] = field(default_factory=list)
    faces: list[Landmarks] = field(default_factory=list)  # the face in each of them

    @property
    def region(self) -> Region:
        """The region of the face where it was seen last."""
        return self.faces[-1].region

    @property
    def weight(self) -> float:
        """How long and how large the person is seen."""
        return sum(float(np.ptp(face.points[:, 1])) for face in self.faces)


class Follower:
    """Follows faces: each is looked for where it was; the detector finds those that are lost or new.

    Attributes:
        people: everybody who was seen, in the order of appearance.
    """

    def __init__(self, people: Iterable[Person] = (), count: int = 0) -> None:
        """
        Args:
            people: who was seen in earlier pictures, in the order of appearance; count: of those pictures.
        """
        self.people = list(people)
        self._count = count

    def __call__(self, picture: Picture) -> list[Person]:
        """Look for faces in the next picture; return the people who are in it."""
        number, self._count = self._count, self._count + 1
        here: list[Person] = []
        for person in [p for p in self.people if p.frames and p.frames[-1] == number - 1]:
            self._add(person, landmarks(picture.image, person.region), number, here)
        if not here or number % DETECT_EVERY == 0:
            small = number % (SMALL_EVERY if here else SMALL_LOST) == 0
            for region in detect(picture.image, small):
                if any(_distance(region, person.region) < SAME_PLACE for person in here):
                    continue
                face = landmarks(picture.image, region, refine=True)
                if face.presence < NEW_PRESENCE:
                    continue
                self._add(self._who(face.region, here), face, number, here)
        return here

    def _add(self, person: Person, face: Landmarks, number: int, here: list[Person]) -> None:
        if face.presence < MIN_PRESENCE or not np.isfinite(face.points).all():
            return
        if any(_distance(face.region, other.region) < SAME_PLACE for other in here):
            return  # two regions slid to one face
        person.frames.append(number)
        person.faces.append(face)
        here.append(person)
        if person not in self.people:
            self.people.append(person)

    def _who(self, region: Region, here: list[Person]) -> Person:
        """Return who was lost near a region, or a new person."""
        lost = [(_distance(region, p.region), k) for k, p in enumerate(self.people) if p not in here]
        # In a crowd, the one who was lost nearest; alone, whoever was there alone before.
        if lost and (min(lost)[0] < NEAR or len(self.people) == 1 or len(self.people) >= MAX_PEOPLE):
            return self.people[min(lost)[1]]
        return Person()


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


def follow(pictures: Iterable[Picture], kept: Unfinished | None = None) -> tuple[list[float], list[Person]]:
    """Return the times of all pictures, and the people in them, the longest and largest seen first.

    `kept` has what was seen in an interrupted run, which is not looked at again, and keeps what is seen now.
    """
    times, follower = kept.read() if kept is not None else ([], Follower())
    known = len(times)
    for number, picture in enumerate(pictures):
        if number < known:
            continue
        times.append(picture.time)
        follower(picture)
        if kept is not None and len(times) % kept.every == 0:
            kept.add(times, follower.people)
    return times, sorted(follower.people, key=lambda person: -person.weight)


def _distance(one: Region, other: Region) -> float:
    """Return the distance of two regions and the difference of their sides, relative to the larger one."""
    apart = np.hypot(one.x - other.x, one.y - other.y) + abs(one.side - other.side) / 2
    return float(apart) / max(one.side, other.side)
