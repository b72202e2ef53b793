"""Tests of `realizer demo`."""

from __future__ import annotations

import asyncio
import re
import socket

import pytest

from realizer.cli.demo import _serve


def test_demo_takes_a_free_port_where_its_own_is_in_use(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        asyncio.run(_serve({}, once=True, port=port, voice="silent", face="default"))
    (page,) = re.findall(r"page: http://127\.0\.0\.1:(\d+)/", capsys.readouterr().out)
    assert int(page) != port
    assert int(page) >= 1024  # one that the system chose
