"""Tests of `realizer.core.logs`."""

from __future__ import annotations

import io
import json
import logging
from collections.abc import Iterator

import pytest

from realizer.core.logs import write_json


@pytest.fixture
def lines() -> Iterator[io.StringIO]:
    root, service = logging.getLogger(), logging.getLogger("realizer")
    before, levels = list(root.handlers), (root.level, service.level)
    stream = io.StringIO()
    write_json(stream)
    yield stream
    root.handlers[:] = before
    root.setLevel(levels[0])
    service.setLevel(levels[1])


def test_json_formatter_writes_a_record_on_one_line(lines: io.StringIO) -> None:
    logging.getLogger("realizer.server.x").info("joined %s\nfor good", "show", extra={"connection": 7})
    (line,) = lines.getvalue().splitlines()
    record = json.loads(line)
    assert record.pop("time").endswith("Z")
    assert record == {
        "level": "info",
        "logger": "realizer.server.x",
        "message": "joined show\nfor good",
        "connection": 7,
    }


def test_json_formatter_includes_the_traceback(lines: io.StringIO) -> None:
    try:
        raise ValueError("of no use")
    except ValueError:
        logging.getLogger("realizer.server.x").exception("it failed")
    (line,) = lines.getvalue().splitlines()
    assert json.loads(line)["exception"].endswith("ValueError: of no use")


def test_write_json_does_not_make_libraries_verbose(lines: io.StringIO) -> None:
    logging.getLogger("somebody.else").info("chatter")
    assert lines.getvalue() == ""
