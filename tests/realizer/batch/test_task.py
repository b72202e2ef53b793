"""The key of an output: another one as soon as anything that decides about the bytes is another."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import pytest

from realizer.batch.task import Options, fingerprint, key_of

OTHER = {
    "formats": (".json",),
    "voice": "espeak",
    "face": "bo",
    "deformer": "au",
    "fps": 30.0,
    "scene": {"cup": (0.0, 1.0, 2.0)},
    "seed": 1,
    "idle": False,
    "language": "nl",
    "cooccurrence": "off",
    "prosody": False,
    "size": (64, 64),
    "camera": "close",
    "light": "evening",
    "background": "#000000",
}
FILES = {"media", "expressions", "mapping"}


def test_every_option_is_looked_at_below() -> None:
    assert {f.name for f in fields(Options)} == OTHER.keys() | FILES


@pytest.mark.parametrize("name", OTHER)
def test_another_option_is_another_key(name: str, options: Options, monkeypatch: pytest.MonkeyPatch) -> None:
    from realizer.face.load import list_faces

    value = OTHER[name]
    if name == "face":
        value = next(face.name for face in list_faces() if face.name != "ada")
    assert fingerprint(replace(options, **{name: value})) != fingerprint(options)


@pytest.mark.parametrize("name", sorted(FILES))
def test_what_is_in_the_files_counts_and_not_where_they_lie(
    name: str, options: Options, tmp_path: Path
) -> None:
    marks = []
    for place, content in (("a", "1"), ("b", "1"), ("c", "2")):
        (tmp_path / place).mkdir()
        (tmp_path / place / "file").write_text(content)
        marks.append(fingerprint(replace(options, **{name: tmp_path / place})))
    assert marks[0] == marks[1] != marks[2]
    assert marks[0] != fingerprint(options)


def test_another_document_is_another_key() -> None:
    assert key_of(b"<bml/>", "m") == key_of(b"<bml/>", "m") != key_of(b"<bml />", "m")
    assert key_of(b"<bml/>", "m") != key_of(b"<bml/>", "n")
