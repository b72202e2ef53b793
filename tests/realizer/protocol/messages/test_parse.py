"""Control messages become models, or errors that say what was wanted and what came."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from realizer.protocol.messages.parse import SUPPORTED, parse_control
from realizer.protocol.messages.replies import ErrorMessage
from realizer.protocol.messages.requests import Ping
from tests.protocol import asyncapi
from tests.rows import each_row

DOCUMENT = asyncapi()


def test_parse_control_accepts_every_type() -> None:
    extra = {
        "subscribe": ',"stream":"fap"',
        "unsubscribe": ',"stream":"fap"',
        "scene": ',"objects":{"cup":{"x":0.2,"y":0,"z":1}}',
        "character": ',"id":"Ada"',
        "speech": ',"id":"turn","append":"Hello. "',
        "heard": ',"speaking":true',
        "save": ',"kind":"expression","name":"smirk","content":""',
        "anticipate": ',"id":"clock","syncs":{"beat":2.5}',
    }
    for kind in SUPPORTED:
        message = parse_control(f'{{"type":"{kind}"{extra.get(kind, "")}}}')
        assert not isinstance(message, ErrorMessage), message
        assert message.type == kind


@each_row(
    "text, code, where, says",
    [
        ("{", "bad-json", None, "JSON object"),
        ("{" * 100_000, "bad-json", None, "JSON object"),
        ('{"a":' * 50_000, "bad-json", None, "nested too deeply"),
        (r'{"type":"ping","id":"\ud800"}', "bad-json", None, "half a character"),
        (
            '{"type":"ping","id":{"a":[1]}}',
            "invalid",
            "ping.id",
            'a whole number or a string; got {"a": [1]}',
        ),
        (f'{{"type":"ping","id":["{"x" * 99}"]}}', "invalid", "ping.id", f'got ["{"x" * 75}...'),
        ('{"type":"scene","objects":{"c":{"x":1,"y":0}}}', "invalid", "scene.objects.c.z", "wanted a value"),
        (r'{"type":"ping","\uDFFF":1}', "bad-json", None, "half a character"),
        ("{}", "unsupported", "type", "hello, subscribe"),
        ('{"type":"dance"}', "unsupported", "type", '"dance"'),
        ('{"type":["hello"]}', "unsupported", "type", "hello"),
        ('{"type":"stopp"}', "unsupported", "type", '(did you mean stop?); got "stopp"'),
        (
            '{"type":"subscribe","stream":"fapp"}',
            "unsupported",
            "subscribe.stream",
            '(did you mean fap?); got "fapp"',
        ),
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
        ('{"type":"scene","objects":{"a":[1,"x",2]}}', "invalid", "scene.objects.a", "a number; got"),
        ('{"type":"hello","session":"a b"}', "invalid", "hello.session", "a string that matches"),
        ('{"type":"ping","id":"' + "x" * 300_000 + '"}', "too-large", None, "at most"),
    ],
)
def test_parse_control_says_what_was_wanted(text, code, where, says) -> None:
    error = parse_control(text)
    assert isinstance(error, ErrorMessage)
    assert (error.code, error.where) == (code, where)
    assert says in error.message


def test_parse_control_names_the_speech_of_a_refused_message() -> None:
    refused = parse_control('{"type": "speech", "id": "s1", "append": 3}')
    assert isinstance(refused, ErrorMessage)
    assert (refused.where, refused.id) == ("speech.append", "s1")


def test_parse_control_joins_surrogate_pairs() -> None:
    message = parse_control(r'{"type":"ping","id":"\ud83d\ude00"}')
    assert isinstance(message, Ping)
    assert message.id == "\U0001f600"


@given(st.text(max_size=200))
def test_parse_control_returns_a_message_or_an_error_for_any_text(text) -> None:
    parse_control("{" + text)
