"""Types of fields: numbers are numbers."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from pydantic import ValidationError

from realizer.protocol.messages.parse import SUPPORTED, parse_control
from realizer.protocol.messages.replies import ErrorMessage
from realizer.protocol.messages.requests import Subscribe
from tests.protocol import REQUESTS, asyncapi
from tests.rows import each_row

DOCUMENT = asyncapi()


def places(node: Any) -> Iterator[tuple[str, str, Callable[[Any], Any]]]:
    """Yield the path and the type of each number or truth value in a schema, and a maker of the JSON."""
    match node:
        case {"$ref": ref}:
            yield from places(DOCUMENT["components"]["schemas"][ref.rpartition("/")[2]])
        case {"anyOf": kinds}:
            if not any(kind.get("type") == "string" for kind in kinds):  # `ping` takes back any id
                for kind in kinds:
                    yield from places(kind)
        case {"type": "number" | "integer" | "boolean" as kind}:
            yield "", kind, lambda value: value
        case {"type": "array"}:
            items = node.get("prefixItems", [node.get("items")])
            for place, item in enumerate(items):
                for where, kind, inner in places(item):
                    yield f".{place}{where}", kind, lambda v, n=place, f=inner: [100] * n + [f(v)]
        case {"type": "object"}:
            rest = dict.fromkeys(node.get("required", ()), 0)
            for name, field in node.get("properties", {"12": node.get("additionalProperties")}).items():
                for where, kind, inner in places(field):
                    yield f".{name}{where}", kind, lambda v, n=name, f=inner, r=rest: {**r, n: f(v)}


PLACES = [
    (name + where, kind, make)
    for name in SUPPORTED
    for where, kind, make in places(DOCUMENT["components"]["messages"][name]["payload"])
]


def test_places_include_nested_numbers() -> None:
    found = {where for where, _, _ in PLACES}
    assert {"subscribe.fps", "subscribe.size.1", "set.aus.12", "scene.objects.12.z"} <= found
    assert {"speech.words.0.start", "set.emotion.angle", "speech.close", "hello.seen"} <= found


@each_row("where, kind, make", PLACES)
def test_message_refuses_values_that_only_look_like_numbers(where, kind, make) -> None:
    name, field, *_ = where.split(".")
    (example, *_) = DOCUMENT["components"]["schemas"][REQUESTS[name].__name__]["examples"]
    for value in (1, "true", []) if kind == "boolean" else (True, "25", []):
        error = parse_control(json.dumps({**example, field: make(value)[field]}))
        assert isinstance(error, ErrorMessage)
        assert error.where == where


def test_whole_accepts_a_number_with_a_point() -> None:
    message = parse_control('{"type":"subscribe","stream":"video","size":[64.0,48.0],"rate":22050.0}')
    assert isinstance(message, Subscribe)
    assert (message.size, message.rate) == ((64, 48), 22050)
    assert isinstance(parse_control('{"type":"subscribe","stream":"video","quality":22.5}'), ErrorMessage)
    assert isinstance(parse_control('{"type":"ping","id":true}'), ErrorMessage)


def test_message_cannot_be_changed() -> None:
    message = Subscribe(type="subscribe", stream="fap")
    with pytest.raises(ValidationError, match="frozen"):
        message.stream = "au"  # type: ignore[misc]
