"""Short documents with options, and the outcomes of a batch of them."""

from pathlib import Path

import pytest

from realizer_studio.batch.task import Options, Task, fingerprint, key_of


@pytest.fixture(scope="session")
def options() -> Options:
    return Options(formats=(".fap", ".vtt"), voice="silent")


@pytest.fixture
def talks(tmp_path: Path) -> Path:
    """A folder of six documents, one of which gives nothing to play."""
    folder = tmp_path / "talks"
    (folder / "more").mkdir(parents=True)
    for k in range(4):
        text = f'<bml id="b{k}"><head id="n" lexeme="NOD" start="{k / 10}"/></bml>'
        (folder / f"{k}.bml").write_text(text)
    (folder / "more" / "said.xml").write_text(
        '<bml id="s"><speech id="s"><text>Oh, hello!</text></speech></bml>'
    )
    (folder / "broken.bml").write_text('<bml id="x"><head')
    (folder / "notes.txt").write_text("no document")
    return folder


@pytest.fixture
def tasks(talks: Path, options: Options) -> list[Task]:
    mark = fingerprint(options)
    return [
        Task(path.stem, key_of(path.read_bytes(), mark), path.read_bytes(), mark)
        for path in sorted(talks.rglob("*.*ml"))
    ]
