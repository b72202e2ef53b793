"""Studies without drawing: keys, and judges whose accuracy is known."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from realizer.outputs.csv_table import csv_text
from realizer_studio.study.answers import COLUMNS
from realizer_studio.study.items import ANSWERS, EMOTIONS, Item
from realizer_studio.study.kit import key_of, write_kit

ABOUT = {"judges": 4, "language": "en", "seed": 1, "variants": ["ada"]}
ROLES = ("right", "removed", "added")


def picture(number: int) -> bytes:
    """Return a small WebP that differs by its number."""
    buffer = io.BytesIO()
    Image.new("RGB", (24, 30), (number * 37 % 256, number * 91 % 256, number % 256)).save(buffer, "WEBP")
    return buffer.getvalue()


def matches(count: int, variant: str = "ada", kind: str = "visual") -> list[Item]:
    return [
        Item(
            kind,
            {"variant": variant, "reference": f"r{k // 2}", "removed": 1, "added": 2, "triple": k % 2},
            {"reference": picture(7), "neutral": picture(8)},
            {role: picture(10 * k + place) for place, role in enumerate(ROLES)},
        )
        for k in range(count)
    ]


def named(repeats: int = 1, variant: str = "ada") -> list[Item]:
    return [
        Item(
            "naming",
            {"variant": variant, "emotion": name, "profiles": "own", "strength": 1.0, "angle": 45.0 * k},
            {"face": picture(k)},
        )
        for _ in range(repeats)
        for k, name in enumerate(EMOTIONS)
    ]


def displaced(moves: Sequence[bool], variant: str = "ada") -> list[Item]:
    return [
        Item(
            "displacements",
            {
                "variant": variant,
                "fap": 3 + k,
                "sign": 1,
                "name": f"fap{k}",
                "weight": 1 + k % 3,
                "moves": moved,
            },
            {role: picture(k) for role in ("neutral", "moved", "difference")},
            text={"fap": f"FAP {3 + k}"},
        )
        for k, moved in enumerate(moves)
    ]


def key(items: Sequence[Item], study: str = "s1") -> dict[str, Any]:
    """Return a key as `write_kit` writes it, without files."""
    return {
        "study": study,
        "items": {
            f"i{k}": {
                "kind": item.kind,
                **item.truth,
                "shown": {},
                "options": {f"i{k}{role}.webp": role for role in item.options},
            }
            for k, item in enumerate(items)
        },
    }


def kit(folder: Path, items: Sequence[Item]) -> Path:
    write_kit(folder, items, ABOUT)
    return key_of(folder)


def line(found: dict[str, Any], item: str, role: str, judge: object = 1, **more: object) -> list[object]:
    """Return the row of an answer: a role, or a word."""
    truth = found["items"][item]
    files = {role: file for file, role in truth["options"].items()}
    known = {"study": found["study"], "judge": judge, "by": "person", "item": item, "kind": truth["kind"]}
    known |= {"answer": files.get(role, role), "seconds": 5, **more}
    return [known.get(name, "") for name in COLUMNS]


def write(path: Path, rows: Sequence[Sequence[object]]) -> Path:
    path.write_text(csv_text(COLUMNS, rows), "utf-8")
    return path


def guess(truth: dict[str, Any], accuracy: float, chance: np.random.Generator) -> str:
    """Return the answer of somebody who is right with a probability, and else takes any wrong one."""
    if "check" in truth:
        return str(truth["check"])
    right = str(truth.get("emotion", "right"))
    every = [*truth["options"].values(), *ANSWERS[truth["kind"]]]
    wrong = [role for role in every if role != right]
    return right if chance.random() < accuracy else str(chance.choice(wrong))


def simulated(
    found: dict[str, Any], judges: int, accuracy: float, spread: float, chance: np.random.Generator
) -> list[list[object]]:
    """Return the answers of judges whose accuracies have a mean and a standard deviation (beta)."""
    rows = []
    for judge in range(1, judges + 1):
        own = accuracy
        if spread:
            size = accuracy * (1 - accuracy) / spread**2 - 1
            own = chance.beta(accuracy * size, (1 - accuracy) * size)
        rows += [
            line(found, item, guess(truth, own, chance), judge) for item, truth in found["items"].items()
        ]
    return rows
