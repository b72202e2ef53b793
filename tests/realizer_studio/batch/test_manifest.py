"""The manifest: rows survive a crash, and unchanged outputs are recognized."""

import hashlib
import json
from pathlib import Path
from typing import Any

import pytest

from realizer_studio.batch.manifest import NAME, BusyError, Manifest


def row(name: str, status: str = "done", content: bytes = b"") -> dict[str, Any]:
    output = {"file": f"{name}.fap", "bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}
    outputs = {".fap": output} if content else {}
    return {"document": name, "key": f"key of {name}", "status": status, "outputs": outputs}


def test_manifest_writes_rows_at_once_and_sorts_them_at_the_end(tmp_path: Path) -> None:
    with Manifest(tmp_path).open() as manifest:
        for name in "ba":
            manifest.add(row(name))
        assert [json.loads(line)["document"] for line in manifest.path.read_text().splitlines()] == ["b", "a"]
    assert [json.loads(line)["document"] for line in manifest.path.read_text().splitlines()] == ["a", "b"]


def test_manifest_loses_only_the_line_that_a_crash_cut_short(tmp_path: Path) -> None:
    lines = [json.dumps(row(name)) for name in "abc"]
    (tmp_path / NAME).write_text("\n".join(lines)[:-20])
    with Manifest(tmp_path).open() as manifest:
        assert [manifest.is_done(name, f"key of {name}") is not None for name in "abc"] == [True, True, False]
        manifest.add(row("d"))
        manifest.path.read_text()
    with Manifest(tmp_path).open() as manifest:
        assert [manifest.is_done(name, f"key of {name}") is not None for name in "abcd"] == [
            True,
            True,
            False,
            True,
        ]


def test_manifest_is_done_only_for_unchanged_outputs(tmp_path: Path) -> None:
    with Manifest(tmp_path).open() as manifest:
        (tmp_path / "a.fap").write_bytes(b"face")
        manifest.add(row("a", content=b"face"))
        assert manifest.is_done("a", "key of a")
        assert not manifest.is_done("a", "another key")
        (tmp_path / "a.fap").write_bytes(b"farce")
        assert not manifest.is_done("a", "key of a")
        (tmp_path / "a.fap").unlink()
        assert not manifest.is_done("a", "key of a")


def test_manifest_repeats_failed_documents_but_not_refused_ones(tmp_path: Path) -> None:
    with Manifest(tmp_path).open() as manifest:
        manifest.add(row("a", "failed"))
        manifest.add(row("b", "refused"))
        assert not manifest.is_done("a", "key of a")
        assert manifest.is_done("b", "key of b")


def test_manifest_of_a_folder_is_written_by_one_batch(tmp_path: Path) -> None:
    pytest.importorskip("fcntl")
    with (
        Manifest(tmp_path).open(),
        pytest.raises(BusyError, match="another batch writes here"),
        Manifest(tmp_path).open(),
    ):
        pass
    with Manifest(tmp_path).open():
        pass


def test_manifest_makes_the_folders_above_it(tmp_path: Path) -> None:
    with Manifest(tmp_path / "a" / "b").open() as manifest:
        manifest.add(row("a"))
    assert (tmp_path / "a" / "b" / NAME).is_file()
