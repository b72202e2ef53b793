"""The protocol is described once: the file and the tables are current, and what is sent is as described."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import connect

from realizer.core.settings import Settings
from realizer.protocol.messages.common import ANSWERS
from realizer.protocol.messages.parse import SUPPORTED, parse_control
from realizer.protocol.messages.replies import ErrorMessage
from realizer.protocol.streams import JSON_STREAMS, KINDS, STREAMS
from realizer.server.serve import Server
from tests.protocol import (
    BEGIN,
    END,
    FILE,
    PARTS,
    REPLIES,
    REQUESTS,
    asyncapi,
    render,
    tables,
    within,
)
from tests.rows import each_row
from tests.waiting import LIMIT

DOCUMENT = asyncapi()
NUMERIC = [row.name for row in STREAMS.values() if row.numeric]


def references(node: Any) -> Iterator[str]:
    if isinstance(node, dict):
        if isinstance(node.get("$ref"), str):
            yield node["$ref"]
        for value in node.values():
            yield from references(value)
    elif isinstance(node, list):
        for value in node:
            yield from references(value)


def resolved(reference: str) -> Any:
    node: Any = DOCUMENT
    for part in reference.removeprefix("#/").split("/"):
        node = node[part]
    return node


def validator(schema: dict[str, Any]) -> Any:
    """Of a payload, with the schemas of the document at hand."""
    jsonschema = pytest.importorskip("jsonschema", reason="needs the test extra")
    return jsonschema.Draft202012Validator({**schema, "components": DOCUMENT["components"]})


def test_the_file_is_current() -> None:
    assert FILE.read_text("utf-8") == render(), "run: python -m tests.protocol"


@pytest.mark.parametrize("path", PARTS, ids=lambda path: path.name)
def test_generated_part_of_a_file_is_current(path: Path) -> None:
    if not path.is_file():
        pytest.skip(f"no {path.name} beside the tests")
    part, *marks = PARTS[path]
    text = path.read_text("utf-8")
    assert within(text, part(), *marks) == text, "run: python -m tests.protocol"


def test_tables_go_between_their_markers_alone() -> None:
    text = f"before\n{BEGIN}\nold\n{END}\nafter\n"
    assert within(text, tables()) == f"before\n{BEGIN}\n{tables()}{END}\nafter\n"
    with pytest.raises(ValueError, match="wanted the lines"):
        within("nothing", tables())


def test_everything_that_is_named_is_there_and_everything_there_is_named() -> None:
    named = set(references(DOCUMENT))
    for reference in named:
        assert resolved(reference)
    for message in DOCUMENT["components"]["messages"]:
        assert f"#/components/messages/{message}" in named
        assert f"#/channels/ws/messages/{message}" in named
    assert set(SUPPORTED) == set(REQUESTS) == set(REQUESTS) & set(DOCUMENT["components"]["messages"])
    assert ANSWERS.keys() < REQUESTS.keys()
    assert set(ANSWERS.values()) < REPLIES.keys()


@each_row("name", sorted(DOCUMENT["components"]["schemas"]))
def test_each_schema_is_one(name: str) -> None:
    validator({}).check_schema(DOCUMENT["components"]["schemas"][name])


@pytest.mark.parametrize("name", SUPPORTED)
def test_each_example_is_taken_and_fits_its_schema(name: str) -> None:
    examples = resolved(DOCUMENT["components"]["messages"][name]["payload"]["$ref"])["examples"]
    assert examples
    for example in examples:
        message = parse_control(json.dumps(example))
        assert not isinstance(message, ErrorMessage), message
        assert message.type == name
        validator(DOCUMENT["components"]["messages"][name]["payload"]).validate(example)


def test_a_table_names_every_message_stream_and_kind() -> None:
    text = tables()
    for name in SUPPORTED:
        assert f'"type":"{name}"' in text
    for name in (*STREAMS, *REPLIES.keys() - {"frame"}):
        assert f"| `{name}` |" in text
    assert all(f"| {kind}: {row.payload} |" in text for kind, row in KINDS.items())


def test_what_the_service_says_fits_the_file(tmp_path: Path) -> None:
    replies: list[dict[str, Any]] = []
    asked = [
        {"type": "hello", "seen": 99},
        {"type": "hello", "version": 7},
        *({"type": "subscribe", "stream": s, "encoding": "json"} for s in JSON_STREAMS),
        *({"type": "subscribe", "stream": s, "fps": 10} for s in ("mesh", "audio", "feedback")),
        {"type": "subscribe", "stream": "smell"},
        {"type": "character", "face": "ben"},
        {"type": "set", "aus": {"12": 0.5}},
        {"type": "state"},
        {"type": "save", "kind": "expression", "name": "smirk", "content": "aus = { 12L = 0.6 }"},
        {"type": "ping", "id": "x"},
    ]

    payloads = {
        name: DOCUMENT["components"]["messages"][name]["payload"]
        for name in REPLIES
        if name not in ("state", "error")
    }
    payloads |= {
        name: DOCUMENT["components"]["messages"][f"{name}-message"]["payload"] for name in ("state", "error")
    }
    payloads |= dict.fromkeys(NUMERIC, payloads.pop("frame"))

    def missing() -> list[str]:
        return sorted(payloads.keys() - {message["type"] for message in replies})

    settings = Settings(port=0, voice="silent", edit=tmp_path)

    async def run() -> None:
        async with asyncio.timeout(LIMIT), Server(settings) as server:
            socket = await connect(server.url)
            async with socket:
                await socket.send('<bml id="b"><speech id="s"><text>One two.</text></speech></bml>')
                for message in asked:
                    await socket.send(json.dumps(message))
                while missing():
                    text = await socket.recv()
                    if isinstance(text, str) and text.startswith("{"):
                        replies.append(json.loads(text))

    try:
        asyncio.run(run())
    except TimeoutError:
        pytest.fail(f"not sent within {LIMIT} s: {', '.join(missing())}; `asked` must cause each message")
    assert {message["type"] for message in replies} == payloads.keys()
    for message in replies:
        validator(payloads[message["type"]]).validate(message)
