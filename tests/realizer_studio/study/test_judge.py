"""Tests of `realizer_studio.study.judge`."""

from __future__ import annotations

from pathlib import Path

import pytest

from realizer.core.errors import TableError
from realizer_studio.study.judge import judge, read_items
from tests.studies import kit, matches


def test_read_items_refuses_another_folder(tmp_path: Path) -> None:
    with pytest.raises(TableError, match=r"items\.js: wanted the items of a study"):
        read_items(tmp_path)
    (tmp_path / "items.js").write_text("hello")
    with pytest.raises(TableError, match="items of a study"):
        read_items(tmp_path)


def test_judge_leaves_out_what_has_no_face(tmp_path: Path) -> None:
    pytest.importorskip("ai_edge_litert")
    kit(tmp_path / "s", matches(1))
    steps: list[int] = []
    assert list(judge(tmp_path / "s", steps.append)) == []
    assert steps == [1]
