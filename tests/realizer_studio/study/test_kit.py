"""Tests of `realizer_studio.study.kit`."""

from __future__ import annotations

import json
import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from realizer_studio.study import kit as kits
from realizer_studio.study.drawing import Variant
from realizer_studio.study.judge import read_items
from realizer_studio.study.kit import Plan, check_folder, key_of, texts, write_kit
from tests.studies import ABOUT, displaced, kit, matches, named


def test_write_kit_tells_right_answers_in_the_key_alone(tmp_path: Path) -> None:
    key = json.loads(kit(tmp_path / "s", [*matches(6), *named()]).read_text())
    folder = tmp_path / "s"
    items = (folder / "items.js").read_text()
    for word in ("right", "removed", "added", "salt", "own", "seed"):
        assert f'"{word}"' not in items
    for name, truth in key["items"].items():
        assert name in items
        assert set(truth["options"].values()) <= {"right", "removed", "added"}
        assert all((folder / file).is_file() for file in [*truth["options"], *truth["shown"].values()])
    times = {path.stat().st_mtime for path in folder.iterdir()}
    assert len(times) == 1
    assert not list(tmp_path.glob(".s*"))


def test_write_kit_gives_right_answers_no_place(tmp_path: Path) -> None:
    """The order of items, of their options and of the names of files is that of hashes."""
    places = []
    for study in range(3):
        key = json.loads(kit(tmp_path / str(study), matches(60)).read_text())
        shown = read_items(tmp_path / str(study))["items"]
        order = [list(key["items"]).index(item["id"]) for item in shown]
        assert abs(np.corrcoef(order, np.arange(60))[0, 1]) < 0.5
        places += [
            item["options"].index(
                next(f for f, role in key["items"][item["id"]]["options"].items() if role == "right")
            )
            for item in shown
        ]
    assert all(35 <= places.count(place) <= 85 for place in range(3))  # 60 of 180 each, four deviations


def test_write_kit_makes_names_anew_each_time(tmp_path: Path) -> None:
    one, two = ({p.name for p in kit(tmp_path / n, matches(2)).with_name(n).glob("*.webp")} for n in "ab")
    assert one
    assert not one & two


def test_pictures_have_no_metadata(tmp_path: Path) -> None:
    kit(tmp_path / "s", displaced([True]))
    for path in (tmp_path / "s").glob("*.webp"):
        assert not re.search(rb"EXIF|XMP |ICCP", path.read_bytes())


def test_check_folder_refuses_to_replace_anything(tmp_path: Path) -> None:
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "x").touch()
    key_of(tmp_path / "old").write_text("{}")
    for name, said in (
        ("full", "files in it"),
        ("old", "key of an earlier"),
        ("no/where", "that can be written"),
    ):
        with pytest.raises(ValueError, match=said):
            check_folder(tmp_path / name)
    (tmp_path / "empty").mkdir()
    check_folder(tmp_path / "empty")


def test_write_kit_leaves_nothing_if_the_disk_is_full(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, content: str) -> None:
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr(kits, "write_text", full)
    with pytest.raises(OSError, match="No space"):
        write_kit(tmp_path / "s", named(), ABOUT)
    assert not list(tmp_path.iterdir())


def test_texts_say_the_same_in_each_language() -> None:
    def shape(value: object) -> object:
        if isinstance(value, dict):
            return {name: shape(one) for name, one in value.items()}
        return sorted(re.findall(r"\{\w+\}", str(value))) if isinstance(value, str) else len(value)  # type: ignore[arg-type]

    english, *others = map(shape, texts().values())
    assert set(texts()) == {"en", "de", "pl"}
    assert all(other == english for other in others)


def test_plan_counts_what_it_draws() -> None:
    two = (Variant("ada"), Variant("ben"))
    assert Plan(("visual", "emotional"), two).drawn == 2 * Plan(("visual",), two[:1]).drawn


@pytest.mark.gl
@pytest.mark.slow
@pytest.mark.long
def test_items_of_one_seed_are_the_same() -> None:
    plan = Plan(("naming", "visual"), (Variant("ada"),), "ben", most=4, seed=3)
    one, two = plan.items(), plan.items()
    assert Counter(item.kind for item in one if not item.check) == {"visual": 4, "naming": 4}
    assert Counter(item.kind for item in one if item.check) == {"visual": 2, "naming": 2}
    assert [item.truth for item in one] == [item.truth for item in two]
    assert [item.options for item in one] == [item.options for item in two]
