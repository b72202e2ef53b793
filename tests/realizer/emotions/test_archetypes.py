"""Tests of `realizer.emotions.archetypes`."""

from pathlib import Path

import pytest

from realizer.emotions.archetypes import archetypes, split_set
from realizer.tables import faps

SIX = {"anger", "sadness", "joy", "disgust", "fear", "surprise"}


def test_archetypes_have_the_25_published_profiles() -> None:
    for profiles in ("published", "raw"):
        counts = {emotion: len(numbered) for emotion, numbered in archetypes(profiles).items()}
        assert counts == {"anger": 5, "sadness": 1, "joy": 4, "disgust": 1, "fear": 10, "surprise": 4}


def test_archetypes_open_eyes_in_corrected_fear_and_surprise() -> None:
    for emotion in ("fear", "surprise"):
        assert all(v > 0 for fap, v in archetypes("raw")[emotion][0].midpoint().items() if 19 <= fap <= 22)
        assert all(
            v < 0 for fap, v in archetypes("published")[emotion][0].midpoint().items() if 19 <= fap <= 22
        )
    assert archetypes("published")["joy"][1].midpoint()[19] > 0


def test_archetypes_have_no_corrected_range_without_width() -> None:
    for numbered in archetypes("published").values():
        for profile in numbered.values():
            assert all(high > low for low, high in profile.ranges.values())


def test_archetypes_of_our_own_are_eight_and_symmetric() -> None:
    own = archetypes("own")
    assert set(own) == SIX | {"trust", "anticipation"}
    for emotion, numbered in own.items():
        for fap, (low, high) in numbered[0].ranges.items():
            row = faps()[fap - 1]
            assert row.least <= low < high <= row.most, (emotion, fap)
            assert row.sign == 1
            assert numbered[0].ranges[row.mirror] == (low, high), (emotion, fap)


def test_archetypes_refuse_an_unknown_set() -> None:
    with pytest.raises(ValueError, match=r"wanted own, published, raw or a file FILE\.txt, got 'ekman'"):
        archetypes("ekman")


FILE = "Fear 9\nF3 [400, 560], F5 [307, 399]\nFear 0\nF3 [10, 20]\nSmug 1\nF12 [100, 200]\n"


def test_archetypes_of_a_file_have_all_its_profiles(tmp_path: Path) -> None:
    path = tmp_path / "a, b.txt"
    path.write_text(FILE)
    found = archetypes(str(path))
    assert {emotion: list(numbered) for emotion, numbered in found.items()} == {"fear": [9, 0], "smug": [1]}
    assert list(archetypes(f"{path}, fear 0")["fear"]) == [0, 9]


def test_archetypes_begin_with_the_chosen_profile() -> None:
    assert next(iter(archetypes("published")["fear"])) == 8
    assert next(iter(archetypes("published, fear 3, sadness 0")["fear"])) == 3
    with pytest.raises(ValueError, match=r"wanted one of .*joy 3.*; got 'joy 7'"):
        archetypes("published, joy 7")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "wanted a file of profiles, got: No such file"),
        (b"", "wanted at least one profile, got none"),
        (b"Joy 0\nF3 [1\n", r"line 2: Joy 0, column 1: wanted F3 \[low, high\]"),
        (b"\xff\xfe", "wanted a text in UTF-8"),
    ],
)
def test_archetypes_refuse_a_damaged_file(content: bytes | None, said: str, tmp_path: Path) -> None:
    if content is not None:
        (tmp_path / "x.txt").write_bytes(content)
    with pytest.raises(ValueError, match=said):
        archetypes(str(tmp_path / "x.txt"))


@pytest.mark.parametrize(
    ("profiles", "name", "chosen"),
    [
        ("own", "own", {}),
        ("published, fear 3,Joy  0", "published", {"fear": 3, "joy": 0}),
        ("a, b 2.txt", "a, b 2.txt", {}),
        ("a, b.txt, fear 1", "a, b.txt", {"fear": 1}),
        ("x, 3", "x, 3", {}),
    ],
)
def test_split_set_takes_profiles_from_the_end(profiles: str, name: str, chosen: dict[str, int]) -> None:
    assert split_set(profiles) == (name, chosen)


def test_split_set_takes_long_texts_in_one_pass() -> None:
    for text in (", 1 1" * 200_000, "," + " " * 1_000_000 + "x", ", fear 3" * 100_000):
        assert split_set(text)[0] is not None
