"""Tests of `realizer_studio.faces.au.model_file`."""

from __future__ import annotations

from pathlib import Path

from realizer.face.au.file import read_model
from realizer.face.load import folder_of
from realizer_studio.faces.au.model_file import write_model


def test_write_model_writes_what_read_model_reads(tmp_path: Path) -> None:
    model = read_model(folder_of("ada") / "au_published.toml")
    for name in ("one.toml", "two.toml"):
        write_model(tmp_path / name, model)
        model = read_model(tmp_path / name)
    assert (tmp_path / "one.toml").read_text() == (tmp_path / "two.toml").read_text()
