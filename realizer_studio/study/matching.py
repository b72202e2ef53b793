"""Questions of visual and emotional matching: a reference and three faces (Wojdel 2005, 5.3.2)."""

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from realizer.animation.axis import au
from realizer.animation.frames import AUFrames
from realizer.core.array_types import Float32
from realizer.core.errors import RealizerError, TableError
from realizer.tables.cooccurrence import rules
from realizer.tables.lexemes import face_lexemes, read_aus
from realizer.tables.templates import templates
from realizer_studio.study.drawing import Drawer, Units, Variant, differs, row, webp
from realizer_studio.study.items import EMOTIONS, Item

LABELS = "labels.csv"  # in a folder of photographs: file, aus
FACE = "face.toml"  # in a face folder
UNIT = re.compile(r"(\d+[LR]?)(?::([\d.]+))?")
# Units that are visible in a still picture from the front.
ADDED = (1, 2, 4, 5, 6, 7, 9, 10, 12, 14, 15, 16, 17, 18, 20, 22, 23, 24, 25, 26, 27, 43)
LEAST_ADDED = 0.5
MOST = 8  # additions that are drawn to test their visibility
TRIPLES = 2  # for each reference
HEAD, TURNED = (48, 49, 50), 6000  # FAPs of the head, and their largest random value (3.4 degrees)


@dataclass(frozen=True, eq=False)
class Reference:
    """An expression that judges compare with."""

    name: str  # template, emotion or file
    units: Units  # its action units
    picture: bytes  # a WebP
    rest: bytes | None  # the same person at rest, or None


def references(source: str, draw: Drawer) -> list[Reference]:
    """Return the photographs of a folder, or the twelve templates and six emotions on a face.

    Args:
        source: a face, or a folder with photographs and labels.csv: `file,aus`, such as
            `anna1.jpg,1+2+5:0.6`. A row without action units is the person at rest.

    Raises:
        TableError: labels that cannot be read, with file and line.
        RealizerError: a file that is no picture, or an unknown face.
    """
    if Path(source).is_dir() and not (Path(source) / FACE).exists():
        return _photographs(Path(source))
    expressions = {name.lower(): found.aus for name, found in templates().items()}
    expressions |= {f"basic {name}": face_lexemes()[name.upper()].aus for name in EMOTIONS}
    rest, *drawn = map(webp, draw(Variant(source), [row(), *map(row, expressions.values())]))
    return [
        Reference(*named, picture, rest) for named, picture in zip(expressions.items(), drawn, strict=True)
    ]


def _photographs(source: Path) -> list[Reference]:
    from realizer_studio.tracking.pictures import read_picture

    try:
        lines = list(csv.DictReader((source / LABELS).read_text("utf-8-sig").splitlines()))
    except (OSError, UnicodeError) as error:
        raise TableError(f"{source / LABELS}: wanted a table with the columns file,aus; {error}") from None
    found: list[Reference] = []
    rest = None
    for number, line in enumerate(lines, 2):
        location = f"{source / LABELS}, line {number}"
        if not line.get("file") or line.get("aus") is None:
            raise TableError(f"{location}: wanted the columns file,aus; got {line}")
        parts = [UNIT.fullmatch(part.strip()) for part in line["aus"].split("+") if part.strip()]
        if None in parts:
            raise TableError(f"{location}, aus: wanted units such as 1+2+5:0.6, got {line['aus']!r}")
        cells = {part[1]: float(part[2] or 1) for part in parts if part}
        picture = webp(np.asarray(read_picture(source / line["file"])))
        if cells:
            found.append(Reference(line["file"], read_aus(cells, location), picture, None))
        else:
            rest = picture
    if not found:
        raise TableError(f"{source / LABELS}: wanted at least one photograph with action units, got none")
    return [Reference(one.name, one.units, one.picture, rest) for one in found]


def matching(
    kinds: Sequence[str],
    variant: Variant,
    compared: Sequence[Reference],
    draw: Drawer,
    draws: np.random.Generator,
) -> Iterator[Item]:
    """Yield two triples of each reference, the same for each kind, "visual" or "emotional".

    The second triple removes and adds other units if possible. Heads are turned slightly at random, because
    otherwise the pixels of the right face would lie between those of the other faces.

    Raises:
        RealizerError: no unit can be removed or added visibly.
    """
    for reference in compared:
        fewer, more = _fewer(reference.units), _more(reference.units, draws)
        candidates = [reference.units, *fewer.values(), *more.values()]
        right, *changed_faces = draw(variant, [row(units) for units in candidates])
        names = [("removed", unit) for unit in fewer] + [("added", unit) for unit in more]
        visible = [
            named for named, picture in zip(names, changed_faces, strict=True) if differs(picture, right)
        ]
        changed: dict[str, list[int]] = {"removed": [], "added": []}
        for role, unit in visible:
            changed[role].append(unit)
        if not all(changed.values()):
            raise RealizerError(
                f"{reference.name}: no action unit can be removed or added so that it is seen"
            )
        for k in range(TRIPLES):
            out, new = (changed[role][k % len(changed[role])] for role in ("removed", "added"))
            rows = [_turned(units, draws) for units in (reference.units, fewer[out], more[new])]
            neutral, *faces = map(webp, draw(variant, [row(), *rows]))
            options = dict(zip(("right", "removed", "added"), faces, strict=True))
            base = {"reference": reference.picture, "rest": reference.rest, "neutral": neutral}
            truth = {"variant": variant.name, "reference": reference.name, "removed": out, "added": new}
            for kind in kinds:
                pictures = {role: picture for role, picture in base.items() if picture}
                yield Item(kind, truth | {"triple": k}, pictures, options)


def _turned(units: Units, draws: np.random.Generator) -> Float32:
    turned = row(faps=dict(zip(HEAD, draws.uniform(-TURNED, TURNED, len(HEAD)), strict=True)))
    return row(units) + turned


def _fewer(units: Units) -> dict[int, Units]:
    """Return AU -> the expression without it."""
    numbers = dict.fromkeys(number for number, _ in units)
    return {out: {key: value for key, value in units.items() if key[0] != out} for out in numbers}


def _more(units: Units, draws: np.random.Generator) -> dict[int, Units]:
    """Return AU -> the expression with it, for at most `MOST` random AUs that co-occurrence does not hide."""
    found: dict[int, Units] = {}
    for number in draws.permutation(
        [unit for unit in ADDED if unit not in {present for present, _ in units}]
    ):
        new = {**units, (int(number), "BOTH"): float(draws.uniform(LEAST_ADDED, 1))}
        before, moving = AUFrames(np.zeros(2), np.stack([row(units), row(new)]), rules()).moving.T
        columns = [target.column for target in au(int(number))]
        if (moving[columns] >= LEAST_ADDED).all() and (moving >= 0.8 * before).all():
            found[int(number)] = new
        if len(found) == MOST:
            break
    return found
