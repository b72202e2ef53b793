"""Logs as JSON lines."""

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


def test_a_record_is_one_line_with_what_it_was_told(lines: io.StringIO) -> None:
    logging.getLogger("realizer.server.x").info("joined %s\nfor good", "show", extra={"connection": 7})
    (line,) = lines.getvalue().splitlines()
    told = json.loads(line)
    assert told.pop("time").endswith("Z")
    assert told == {
        "level": "info",
        "logger": "realizer.server.x",
        "message": "joined show\nfor good",
        "connection": 7,
    }


def test_a_traceback_is_in_its_line(lines: io.StringIO) -> None:
    try:
        raise ValueError("of no use")
    except ValueError:
        logging.getLogger("realizer.server.x").exception("it failed")
    (line,) = lines.getvalue().splitlines()
    assert json.loads(line)["exception"].endswith("ValueError: of no use")


def test_libraries_say_no_more_than_before(lines: io.StringIO) -> None:
    logging.getLogger("somebody.else").info("chatter")
    assert lines.getvalue() == ""
