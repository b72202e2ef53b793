"""The key of an output: another one as soon as anything that decides about the bytes is another."""

from dataclasses import fields, replace
from pathlib import Path

import pytest

from realizer_studio.batch.task import Options, fingerprint, key_of

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
    "liveliness": 0.5,
    "prosody": False,
    "jaw": 0.5,
    "lips": 0.5,
    "grace": 0.1,
    "max_planning": 1_000_000,
    "strict_bml": True,
    "size": (64, 64),
    "camera": "close",
    "light": "evening",
    "background": "#000000",
}
FILES = {"media", "expressions", "mapping"}


def test_fingerprint_covers_every_option() -> None:
    assert {f.name for f in fields(Options)} == OTHER.keys() | FILES


@pytest.mark.parametrize("name", OTHER)
def test_fingerprint_differs_with_each_option(
    name: str, options: Options, monkeypatch: pytest.MonkeyPatch
) -> None:
    from realizer.face.load import list_faces

    value = OTHER[name]
    if name == "face":
        value = next(face.name for face in list_faces() if face.name != "ada")
    assert fingerprint(replace(options, **{name: value})) != fingerprint(options)


@pytest.mark.parametrize("name", sorted(FILES))
def test_fingerprint_depends_on_the_content_of_files_not_their_path(
    name: str, options: Options, tmp_path: Path
) -> None:
    marks = []
    for place, content in (("a", "1"), ("b", "1"), ("c", "2")):
        (tmp_path / place).mkdir()
        (tmp_path / place / "file").write_text(content)
        marks.append(fingerprint(replace(options, **{name: tmp_path / place})))
    assert marks[0] == marks[1] != marks[2]
    assert marks[0] != fingerprint(options)


def test_key_of_differs_with_the_document() -> None:
    assert key_of(b"<bml/>", "m") == key_of(b"<bml/>", "m") != key_of(b"<bml />", "m")
    assert key_of(b"<bml/>", "m") != key_of(b"<bml/>", "n")
