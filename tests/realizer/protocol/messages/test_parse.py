"""Control messages: good ones become models, bad ones an error that says what was wanted and what came."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.protocol.messages.parse import SUPPORTED, parse_control
from realizer.protocol.messages.replies import ErrorMessage
from realizer.protocol.messages.requests import Ping, SceneMessage, Subscribe
from realizer.protocol.streams import STREAMS
from tests.protocol import REQUESTS, asyncapi

DOCUMENT = asyncapi()


def test_every_supported_type_is_understood() -> None:
    extra = {
        "subscribe": ',"stream":"fap"',
        "unsubscribe": ',"stream":"fap"',
        "scene": ',"objects":{"cup":{"x":0.2,"y":0,"z":1}}',
        "character": ',"id":"Ada"',
        "speech": ',"id":"turn","append":"Hello. "',
        "anticipate": ',"id":"clock","syncs":{"beat":2.5}',
    }
    for kind in SUPPORTED:
        message = parse_control(f'{{"type":"{kind}"{extra.get(kind, "")}}}')
        assert not isinstance(message, ErrorMessage), message
        assert message.type == kind


@pytest.mark.parametrize(
    ("text", "code", "where", "says"),
    [
        ("{", "bad-json", None, "JSON object"),
        ("{" * 100_000, "bad-json", None, "JSON object"),
        ('{"a":' * 50_000, "bad-json", None, "nested too deeply"),
        (r'{"type":"ping","id":"\ud800"}', "bad-json", None, "half a character"),
        ('{"type":"ping","id":{"a":[1]}}', "invalid", "ping.id", "wanted a whole number or a string; got"),
        ('{"type":"scene","objects":{"c":{"x":1,"y":0}}}', "invalid", "scene.objects.c.z", "wanted a value"),
        (r'{"type":"ping","\uDFFF":1}', "bad-json", None, "half a character"),
        ("{}", "unsupported", "type", "hello, subscribe"),
        ('{"type":"dance"}', "unsupported", "type", '"dance"'),
        ('{"type":["hello"]}', "unsupported", "type", "hello"),
        ('{"type":"speak"}', "unsupported", "type", "hello"),
        ('{"type":"anticipate"}', "invalid", "anticipate.id", "wanted a value; got nothing"),
        ('{"type":"anticipate","id":"a:b","syncs":{}}', "invalid", "anticipate.id", "a string that matches"),
        ('{"type":"subscribe","stream":"smell"}', "unsupported", "subscribe.stream", "fap, au"),
        ('{"type":"subscribe","stream":[]}', "unsupported", "subscribe.stream", "fap, au"),
        (
            '{"type":"subscribe","stream":"fap","fps":-1}',
            "invalid",
            "subscribe.fps",
            "wanted more than 0; got -1",
        ),
        ('{"type":"subscribe","stream":"fap","fps":1e9}', "invalid", "subscribe.fps", "240"),
        ('{"type":"subscribe","stream":"fap","fps":NaN}', "invalid", "subscribe.fps", ""),
        (
            '{"type":"subscribe","stream":"fap","colour":1}',
            "invalid",
            "subscribe.colour",
            "no field of that name; got 1",
        ),
        (
            '{"type":"subscribe","stream":"video","size":"64x64"}',
            "invalid",
            "subscribe.size",
            "wanted a list",
        ),
        ('{"type":"subscribe","stream":"video","size":[0,9]}', "invalid", "subscribe.size.0", "16"),
        (
            '{"type":"subscribe","stream":"video","size":[1e30,9]}',
            "invalid",
            "subscribe.size.0",
            "wanted a whole number",
        ),
        ('{"type":"subscribe","stream":"video","format":"gif"}', "invalid", "subscribe.format", "'webp'"),
        ('{"type":"subscribe","stream":"video","quality":0}', "invalid", "subscribe.quality", "1"),
        ('{"type":"subscribe","stream":"video","background":"red"}', "invalid", "subscribe.background", ""),
        ('{"type":"subscribe","stream":"audio","rate":50}', "invalid", "subscribe.rate", "8000"),
        ('{"type":"subscribe","stream":"audio","rate":22051}', "invalid", "subscribe.rate", "50"),
        ('{"type":"set","aus":{"12":7}}', "invalid", "set.aus.12", "wanted at most 1; got 7"),
        ('{"type":"scene","objects":{"a":{"x":1e99,"y":0,"z":0}}}', "invalid", "scene.objects.a.x", "10000"),
        ('{"type":"hello","session":"a b"}', "invalid", "hello.session", "a string that matches"),
        ('{"type":"ping","id":"' + "x" * 300_000 + '"}', "too-large", None, "at most"),
    ],
)
def test_a_bad_message_is_told_what_was_wanted(text, code, where, says) -> None:
    error = parse_control(text)
    assert isinstance(error, ErrorMessage)
    assert (error.code, error.where) == (code, where)
    assert says in error.message


def test_a_character_that_takes_two_escapes_is_one() -> None:
    message = parse_control(r'{"type":"ping","id":"\ud83d\ude00"}')
    assert isinstance(message, Ping)
    assert message.id == "\U0001f600"


@given(st.text(max_size=200))
def test_any_text_gives_a_message_or_an_error(text) -> None:
    parse_control("{" + text)


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ("", "the id of a speech, or a clip"),
        (',"clip":"c","append":"Hello"', "the id of the speech"),
        (',"id":"t","words":[]', ""),
        (',"id":"t","text":"Hello"', "the clip that this is said in"),
        (',"clip":"c","phonemes":[{"start":0,"ipa":"p"}],"visemes":[{"start":0,"viseme":1}]', "got both"),
        (',"clip":"c","words":[{"start":-1,"text":"a"}]', "wanted at least 0; got -1"),
        (',"id":"t 1","append":"x"', "a string that matches"),
    ],
)
def test_a_speech_says_what_it_lacks(fields, says) -> None:
    message = parse_control('{"type":"speech"' + fields + "}")
    assert isinstance(message, ErrorMessage) == bool(says)
    if isinstance(message, ErrorMessage):
        assert message.code == "invalid"
        assert says in message.message


def test_a_subscription_has_the_defaults_of_the_protocol() -> None:
    message = parse_control('{"type":"subscribe","stream":"video"}')
    assert isinstance(message, Subscribe)
    assert (message.size, message.quality) == ((512, 512), 85)
    # The service's own.
    assert (message.camera, message.light, message.background, message.fps) == (None,) * 4
    assert STREAMS["fap"].encodings[0] == "binary"


@pytest.mark.parametrize(
    "objects",
    [
        {"cup": {"x": 0.1, "y": 0, "z": 0.5}},
        {"cup": [0.1, 0, 0.5]},
        [{"id": "cup", "x": 0.1, "y": 0, "z": 0.5}],
    ],
)
def test_a_scene_may_be_written_in_any_of_three_ways(objects: object) -> None:
    message = parse_control(json.dumps({"type": "scene", "objects": objects}))
    assert isinstance(message, SceneMessage)
    assert message.objects is not None
    assert (message.objects["cup"].x, message.objects["cup"].z) == (0.1, 0.5)


def places(node: Any) -> Iterator[tuple[str, str, Callable[[Any], Any]]]:
    """Where JSON of a schema may hold a number or a truth value, which, and what makes the rest around it."""
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


def test_numbers_are_found_in_messages() -> None:
    found = {where for where, _, _ in PLACES}
    assert {"subscribe.fps", "subscribe.size.1", "set.aus.12", "scene.objects.12.z"} <= found
    assert {"speech.words.0.start", "set.emotion.angle", "speech.close", "hello.seen"} <= found


@pytest.mark.parametrize(("where", "kind", "make"), PLACES, ids=[where for where, _, _ in PLACES])
def test_what_only_looks_like_a_number_is_none(where, kind, make) -> None:
    name, field, *_ = where.split(".")
    (example, *_) = DOCUMENT["components"]["schemas"][REQUESTS[name].__name__]["examples"]
    for value in (1, "true", []) if kind == "boolean" else (True, "25", []):
        error = parse_control(json.dumps({**example, field: make(value)[field]}))
        assert isinstance(error, ErrorMessage)
        assert error.where == where


def test_a_whole_number_may_be_written_with_a_point() -> None:
    message = parse_control('{"type":"subscribe","stream":"video","size":[64.0,48.0],"rate":22050.0}')
    assert isinstance(message, Subscribe)
    assert (message.size, message.rate) == ((64, 48), 22050)
    assert isinstance(parse_control('{"type":"subscribe","stream":"video","quality":22.5}'), ErrorMessage)
    assert isinstance(parse_control('{"type":"ping","id":true}'), ErrorMessage)
