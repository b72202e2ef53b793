"""Tests that what is generated of the text layer is current."""

from pathlib import Path

from tests.rows import each_row
from tests.text import FILES


@each_row("path", list(FILES))
def test_generated_file_is_current(path: Path) -> None:
    assert path.read_text("utf-8") == FILES[path](), f"{path.name}: run python -m tests.text"
