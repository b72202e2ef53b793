"""Tests of writing charts to files."""

from __future__ import annotations

from pathlib import Path

import pytest

from realizer.charts.write_chart import write_timeline, writer_for


@pytest.mark.parametrize(("name", "begins"), [("x.svg", b"<svg"), ("x.PNG", b"\x89PNG")])
def test_write_timeline_selects_the_format_by_suffix(lines, tmp_path: Path, name: str, begins: bytes) -> None:
    write_timeline(lines('<bml id="b"><wait id="w" duration="1"/></bml>'), tmp_path / name)
    assert (tmp_path / name).read_bytes().startswith(begins)


@pytest.mark.parametrize("name", ["x.gif", "svg", "x"])
def test_writer_for_lists_the_known_suffixes(name: str) -> None:
    with pytest.raises(ValueError, match=r"wanted a suffix of \.svg \.png"):
        writer_for(name)
