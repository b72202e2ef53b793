"""Folders of expressions of one's own."""

from collections.abc import Callable
from pathlib import Path

import pytest


@pytest.fixture
def folder(tmp_path: Path) -> Callable[..., Path]:
    """A folder with these files: name -> text."""

    def make(**files: str) -> Path:
        made = tmp_path / "mine"
        made.mkdir()
        for name, text in files.items():
            (made / f"{name}.toml").write_text(text, "utf-8")
        return made

    return make
