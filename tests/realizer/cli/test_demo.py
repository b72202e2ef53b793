"""Tests of `realizer demo`."""

from __future__ import annotations

import asyncio
import re
import shlex
import socket
from pathlib import Path

import pytest

from realizer.cli.command_group import COMMANDS
from realizer.cli.demo import _film, _serve
from realizer.core.errors import RenderError
from realizer.outputs import registry


def test_demo_takes_a_free_port_where_its_own_is_in_use(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]

        async def serve() -> str:
            serving = asyncio.create_task(_serve({}, once=False, port=port, voice="silent", face="default"))
            said = ""
            while "now try" not in said:
                await asyncio.sleep(0)
                said += capsys.readouterr().out
            serving.cancel()
            await asyncio.wait([serving])
            return said

        said = asyncio.run(serve())
    (page,) = re.findall(r"^page: http://127\.0\.0\.1:(\d+)/", said, re.MULTILINE)
    assert int(page) != port
    assert int(page) >= 1024  # one that the system chose


def test_demo_names_the_files_that_it_writes_and_leaves_out(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    written: list[str] = []

    class Writer:
        def write(self, realization: object, path: Path, settings: object) -> None:
            if path.suffix == ".mp4":
                raise RenderError("no film")
            written.append(path.name)

    monkeypatch.setattr(registry, "output_for", lambda path: Writer())
    _film(['<bml id="a"><wait id="w" duration="2"/></bml>'], "silent", "default")
    said = capsys.readouterr()
    assert written == ["demo.fap"]
    assert said.out.splitlines() == ["writing demo.fap (2.0 s) ...", "writing demo.mp4 (2.0 s) ..."]
    assert said.err == "realizer: demo.mp4 was left out: no film\n"


def test_demo_says_what_it_made_and_what_to_try(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "demo.fap").write_text("x")
    asyncio.run(_serve({}, once=True, port=0, voice="silent", face="default"))
    lines = capsys.readouterr().out.strip().splitlines()
    assert lines[0] == "made demo.fap: its FAPs"
    assert not [line for line in lines if "http" in line], "the page ends with the demo"
    assert lines[1] == "now try:"
    assert len(lines) <= 10
    for line in lines[2:]:
        assert shlex.split(line)[1] in COMMANDS
