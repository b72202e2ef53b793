"""A tracker of several people's faces from picture to picture, and a cache of a film's landmarks."""

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
from realizer_studio.tracking.network import Region
from realizer_studio.tracking.pictures import Picture

DETECT_EVERY = 15  # pictures between detections of new people
SMALL_EVERY, SMALL_LOST = 150, 5  # pictures between searches of small faces, with and without people
SAME_PLACE = 0.35  # largest distance of two regions of one face in a picture, relative to their side
NEAR = 1.5  # largest distance of a lost person who is found again, relative to the side of the face
MAX_PEOPLE = 8


@dataclass(eq=False)
class Person:
    """One person over time."""

    # Numbers of the pictures in which the face was found, ascending.
    frames: list[int] = field(default_factory=list)
    faces: list[Landmarks] = field(default_factory=list)  # the face in each of them

    @property
    def region(self) -> Region:
        """The latest region of the face."""
        return self.faces[-1].region

    @property
    def weight(self) -> float:
        """The sum of the face's heights over all pictures."""
        return sum(float(np.ptp(face.points[:, 1])) for face in self.faces)


class Follower:
    """A tracker of faces: it searches each at its last region, and detects new and lost ones.

    Attributes:
        people: all people so far, in the order of appearance.
    """

    def __init__(self, people: Iterable[Person] = (), count: int = 0) -> None:
        """
        Args:
            people: in earlier pictures, in the order of appearance; count: the number of those pictures.
        """
        self.people = list(people)
        self._count = count

    def __call__(self, picture: Picture) -> list[Person]:
        """Track faces in the next picture, and return the people in it."""
        number, self._count = self._count, self._count + 1
        visible: list[Person] = []
        for person in [p for p in self.people if p.frames and p.frames[-1] == number - 1]:
            self._add(person, landmarks(picture.image, person.region), number, visible)
        if not visible or number % DETECT_EVERY == 0:
            small = number % (SMALL_EVERY if visible else SMALL_LOST) == 0
            for region in detect(picture.image, small):
                if any(_distance(region, person.region) < SAME_PLACE for person in visible):
                    continue
                face = landmarks(picture.image, region, refine=True)
                if face.presence < NEW_PRESENCE:
                    continue
                self._add(self._person_at(face.region, visible), face, number, visible)
        return visible

    def _add(self, person: Person, face: Landmarks, number: int, visible: list[Person]) -> None:
        if face.presence < MIN_PRESENCE or not np.isfinite(face.points).all():
            return
        if any(_distance(face.region, other.region) < SAME_PLACE for other in visible):
            return  # both regions converged to one face
        person.frames.append(number)
        person.faces.append(face)
        visible.append(person)
        if person not in self.people:
            self.people.append(person)

    def _person_at(self, region: Region, visible: list[Person]) -> Person:
        """Return the lost person nearest to a region, or a new person."""
        candidates = [(_distance(region, p.region), k) for k, p in enumerate(self.people) if p not in visible]
        # If there was only one person so far, the distance does not matter.
        if candidates and (
            min(candidates)[0] < NEAR or len(self.people) == 1 or len(self.people) >= MAX_PEOPLE
        ):
            return self.people[min(candidates)[1]]
        return Person()


EVERY = 500  # pictures of a batch; those after the last complete batch are tracked again
KEY = "film.json"
COLUMNS = ("points", "presence", "traits", "eyes")


class LandmarkCache:
    """A cache of a film's landmarks in a folder, with a file for each batch of pictures.

    Attributes:
        every: pictures of a batch.
    """

    def __init__(self, folder: Path, source: Path) -> None:
        """Use a folder, which is created with the first batch; the cache of another film is deleted."""
        state = source.stat()
        self.every = EVERY
        self._folder = folder
        self._key = json.dumps([str(source.resolve()), state.st_size, state.st_mtime_ns])
        self._batches = 0

    def read(self) -> tuple[list[float], Follower]:
        """Return the times of all cached pictures, and the follower after them."""
        times: list[float] = []
        people: list[Person] = []
        key = self._folder / KEY
        if key.is_file() and key.read_text("utf-8") != self._key:
            self.remove()
        while key.is_file() and self._read(self._folder / f"{self._batches}.npz", times, people):
            self._batches += 1
        return times, Follower(people, len(times))

    def _read(self, path: Path, times: list[float], people: list[Person]) -> bool:
        try:
            with np.load(path, allow_pickle=False) as file:
                batch = {name: file[name] for name in ("times", "who", "frames", *COLUMNS)}
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            return False
        times += batch["times"].tolist()
        columns = (batch["who"].tolist(), batch["frames"].tolist(), *(batch[name] for name in COLUMNS))
        for person_index, frame, points, presence, traits, eyes in zip(*columns, strict=True):
            people += [Person() for _ in range(person_index + 1 - len(people))]
            people[person_index].frames.append(frame)
            people[person_index].faces.append(Landmarks(points, float(presence), traits, eyes))
        return True

    def add(self, times: Sequence[float], people: Sequence[Person]) -> None:
        """Store the batch of the last `every` pictures."""
        first = self._batches * self.every
        new_faces = [
            (k, frame, face)
            for k, person in enumerate(people)
            for frame, face in zip(person.frames, person.faces, strict=True)
            if frame >= first
        ]
        self._folder.mkdir(parents=True, exist_ok=True)
        if not self._batches:
            write_bytes(self._folder / KEY, self._key.encode())
        rows: Any = {name: np.array([getattr(face, name) for _, _, face in new_faces]) for name in COLUMNS}
        person_index, frames = (np.array([row[k] for row in new_faces], int) for k in (0, 1))
        with replacing(self._folder / f"{self._batches}.npz") as draft:
            np.savez(draft, times=np.array(times[first:]), who=person_index, frames=frames, **rows)
        self._batches += 1

    def remove(self) -> None:
        """Delete the cache; a folder that is no cache is kept."""
        if (self._folder / KEY).is_file():
            shutil.rmtree(self._folder, ignore_errors=True)


def follow(
    pictures: Iterable[Picture], cache: LandmarkCache | None = None
) -> tuple[list[float], list[Person]]:
    """Return the times of all pictures, and the people in them by descending weight.

    `cache` has the landmarks of an interrupted run, whose pictures are skipped, and stores new ones.
    """
    times, follower = cache.read() if cache is not None else ([], Follower())
    processed = len(times)
    for number, picture in enumerate(pictures):
        if number < processed:
            continue
        times.append(picture.time)
        follower(picture)
        if cache is not None and len(times) % cache.every == 0:
            cache.add(times, follower.people)
    return times, sorted(follower.people, key=lambda person: -person.weight)


def _distance(one: Region, other: Region) -> float:
    """Return the distance of two regions plus half the difference of their sides, relative to the larger."""
    distance = np.hypot(one.x - other.x, one.y - other.y) + abs(one.side - other.side) / 2
    return float(distance) / max(one.side, other.side)
