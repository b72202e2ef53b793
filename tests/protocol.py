"""The generated descriptions of the protocol: asyncapi.json, docs/protocol.md, constants in JavaScript.

`python -m tests.protocol` writes them, from the models of messages and the table of streams.
"""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

import realizer
from realizer.protocol.messages.common import ANSWERS, PROTOCOL
from realizer.protocol.messages.parse import SUPPORTED
from realizer.protocol.messages.replies import (
    ErrorCode,
    ErrorMessage,
    FaceChanged,
    FrameMessage,
    Gap,
    Pong,
    Saved,
    ScheduleMessage,
    StateMessage,
    Subscribed,
    Welcome,
)
from realizer.protocol.messages.requests import Control, Subscribe
from realizer.protocol.streams import JSON_STREAMS, KINDS, STREAMS
from realizer.protocol.wire import FINAL, FLUSH, VERSION
from realizer.protocol.wire import HEADER as BYTES

FILE = Path(realizer.__path__[0]) / "server" / "asyncapi.json"
PAGE = Path(__file__).parent.parent / "docs" / "protocol.md"
BEGIN = "<!-- protocol: written by python -m tests.protocol -->"
END = "<!-- end of protocol -->"
SCRIPT = Path(__file__).parent.parent / "clients" / "javascript" / "src" / "frames.js"
TYPES = SCRIPT.with_name("index.d.ts")
SCRIPT_MARKS = ("// protocol: written by python -m tests.protocol", "// end of protocol")

REQUESTS: dict[str, type[BaseModel]] = {
    model.model_fields["type"].annotation.__args__[0]: model for model in get_args(Control)
}
REPLIES: dict[str, type[BaseModel]] = {
    "welcome": Welcome,
    "subscribed": Subscribed,
    "changed": FaceChanged,
    "state": StateMessage,
    "saved": Saved,
    "pong": Pong,
    "gap": Gap,
    "error": ErrorMessage,
    "frame": FrameMessage,
    "schedule": ScheduleMessage,
}
# A client that has missed feedback gets a gap before the answer.
BESIDE = {"hello": ["gap"]}
BML = (
    "One or more BML documents, in any text that starts with `<`. A broken part causes one warning, and "
    "reading continues at the next `<bml>`."
)
FEEDBACK = (
    "One element of BML 1.0 feedback per message, with an attribute `seq` (1, 2, ...) in the namespace "
    "urn:bml-realizer:1. A warning about documents that could not be saved, or came too late, has no `seq`."
)
HEADER = (
    f"Little-endian: u8 kind, u8 version ({VERSION}), u16 flags, u32 frame, f64 time in seconds on the "
    "session clock; then the data of the kind"
)
_FLUSHED = ", ".join(f"`{row.name}`" for row in STREAMS.values() if row.flushes)
FLAGS = (
    "The low byte of flags is the `index` of `subscribed`; "
    f"{FLUSH:#x} on {_FLUSHED} means: discard everything from this time on."
)
CLIP = (
    f"A part of a sound clip: u8 kind 4, u8 version {VERSION}, u16 flags ({FINAL:#x}: the last part), u32 "
    "number of the part, f64 0, u32 rate in Hz of raw mono int16 PCM (0: the parts are a sound file), u8 "
    "length of the id, the id, sound. Documents refer to it as `clip:ID`. PCM with the id `heard:CHARACTER` "
    "is what that character hears."
)
ABOUT = (
    "Clients send BML and receive feedback and a moving face. `hello` names the version of the protocol. If "
    "the service has another version, it answers with an error with the code `version`, and changes nothing."
)
CHANNEL = "A WebSocket is a connection to a session. Sessions are joined or created by name."


def asyncapi() -> dict[str, Any]:
    """Return the AsyncAPI 3.0.0 document, from the service's point of view."""
    modes = [(m, "validation") for m in REQUESTS.values()] + [(m, "serialization") for m in REPLIES.values()]
    _, definitions = models_json_schema(
        modes,  # type: ignore[arg-type]
        ref_template="#/components/schemas/{model}",
    )
    messages = {
        **{name: _message(model, name) for name, model in REQUESTS.items()},
        **{_out(name): _message(model, _out(name)) for name, model in REPLIES.items()},
        "bml": _text("bml", BML),
        "feedback": _text("feedback", FEEDBACK),
        "clip": _binary("clip", CLIP),
        **{stream: _binary(stream, f"{HEADER}: {says}. {FLAGS}") for stream, says in _kinds()},
    }
    return {
        "asyncapi": "3.0.0",
        "info": {
            "title": "bml-realizer",
            "version": str(PROTOCOL),
            "description": ABOUT,
            "license": {"name": "MIT"},
        },
        "defaultContentType": "application/json",
        "servers": {"service": {"host": "127.0.0.1:8765", "protocol": "ws"}},
        "channels": {
            "ws": {
                "address": "/ws",
                "description": CHANNEL,
                "messages": {name: {"$ref": f"#/components/messages/{name}"} for name in messages},
                "bindings": {
                    "ws": {
                        "query": {
                            "type": "object",
                            "properties": {
                                "session": {"type": "string", "pattern": "^[A-Za-z0-9._~-]{1,64}$"},
                                "seen": {"type": "integer", "minimum": 0},
                            },
                        },
                        "bindingVersion": "0.1.0",
                    }
                },
            }
        },
        "operations": dict(_operations()),
        "components": {"messages": messages, "schemas": definitions["$defs"]},
    }


def _operations() -> Iterator[tuple[str, dict[str, Any]]]:
    channel = {"$ref": "#/channels/ws"}

    def refs(names: list[str]) -> list[dict[str, str]]:
        return [{"$ref": f"#/channels/ws/messages/{name}"} for name in names]

    for name in ("bml", "clip", *REQUESTS):
        operation = {"action": "receive", "channel": channel, "messages": refs([name])}
        if name in ANSWERS:
            answers = [_out(answer) for answer in (ANSWERS[name], *BESIDE.get(name, []), "error")]
            operation["reply"] = {"channel": channel, "messages": refs(answers)}
        yield f"receive-{name}", operation
    for name in (
        "feedback",
        "error-message",
        "changed",
        "frame",
        *(stream for stream in JSON_STREAMS if not STREAMS[stream].numeric),
        *(stream for stream, _ in _kinds()),
    ):
        yield f"send-{name}", {"action": "send", "channel": channel, "messages": refs([_out(name)])}


def _out(name: str) -> str:
    """Return the name of a reply; `state` and `error` are names of requests or schemas too."""
    return {"state": "state-message", "error": "error-message"}.get(name, name)


def _kinds() -> list[tuple[str, str]]:
    return [(row.name, f"kind {kind}, {row.payload}") for kind, row in KINDS.items()]


def _message(model: type[BaseModel], name: str) -> dict[str, Any]:
    first, _, rest = inspect.cleandoc(model.__doc__ or "").partition("\n")
    message = {"name": name, "summary": first, "payload": {"$ref": f"#/components/schemas/{model.__name__}"}}
    return message | ({"description": rest.strip()} if rest.strip() else {})


def _text(name: str, description: str) -> dict[str, Any]:
    return {
        "name": name,
        "description": description,
        "contentType": "text/xml",
        "payload": {"type": "string"},
    }


def _binary(name: str, description: str) -> dict[str, Any]:
    payload = {"type": "string", "format": "binary"}
    return {
        "name": name,
        "description": description,
        "contentType": "application/octet-stream",
        "payload": payload,
    }


def render() -> str:
    """Return the text of asyncapi.json."""
    return json.dumps(asyncapi(), indent=1, ensure_ascii=False) + "\n"


def tables() -> str:
    """Return the tables of docs/protocol.md: requests, streams and replies."""
    lines = ["| in | with | |", "|---|---|---|", f"| text | | {_cell(BML)} |"]
    for name in SUPPORTED:
        model = REQUESTS[name]
        example = json.dumps(_examples(model)[0], separators=(",", ":"))
        lines.append(f"| `{example}` | {_fields(model)} | {_cell(_first(model))} |")
    lines.append(f"| binary | | {_cell(CLIP)} |")
    lines += ["", "| stream | encodings | takes | binary: the header, then |", "|---|---|---|---|"]
    for row in STREAMS.values():
        takes = ", ".join(f"`{name}`" for name in row.options)
        payload = "" if row.kind is None else _cell(f"{row.kind}: {row.payload}")
        lines.append(f"| `{row.name}` | {', '.join(row.encodings)} | {takes} | {payload} |")
    lines += ["", "| out | with | |", "|---|---|---|", f"| XML | | {_cell(FEEDBACK)} |"]
    for name, model in REPLIES.items():
        called = "`, `".join(row.name for row in STREAMS.values() if row.numeric) if name == "frame" else name
        codes = f" Codes: {', '.join(get_args(ErrorCode))}." if name == "error" else ""
        lines.append(f"| `{called}` | {_fields(model)} | {_cell(_first(model))}{codes} |")
    lines.append(f"| binary | | {_cell(f'{HEADER}. {FLAGS}')} |")
    return "\n".join(lines) + "\n"


def _fields(model: type[BaseModel]) -> str:
    if model is Subscribe:
        return "`stream`, `encoding`, and what the stream takes"
    return ", ".join(f"`{field}`" for field in model.model_fields if field != "type")


def _examples(model: type[BaseModel]) -> list[dict[str, Any]]:
    extra: Any = model.model_config["json_schema_extra"]
    examples: list[dict[str, Any]] = extra["examples"]
    return examples


def _first(model: type[BaseModel]) -> str:
    """Return the first paragraph of a model's docstring."""
    return " ".join(inspect.cleandoc(model.__doc__ or "").partition("\n\n")[0].split())


def _cell(text: str) -> str:
    return re.sub(r"(?<!\\)\|", r"\\|", text)


def constants() -> str:
    """Return the constants of frames.js: version, binary messages, JSON streams, types of answers."""
    arrays = {"<i4": "Int32Array", "<f4": "Float32Array", "<i2": "Int16Array", None: "Uint8Array"}
    kinds = [f'  {kind}: ["{row.name}", {arrays[row.dtype]}],' for kind, row in KINDS.items()]
    answers = ", ".join(f'{question}: "{answer}"' for question, answer in ANSWERS.items())
    return "\n".join(
        [
            "/** Version of the protocol; a service that speaks another one refuses `hello`. */",
            f"export const VERSION = {PROTOCOL};",
            f"const HEADER = {BYTES.size}; // bytes: u8 kind, u8 version, u16 flags, u32 frame, f64 time",
            f"const FORGET = {FLUSH:#x}; // flag: forget everything from this time on",
            f"const LAST = {FINAL:#x}; // flag: the last piece of a clip",
            f"const SOUND = {STREAMS['audio'].kind}; // kind of a clip",
            f"const PICTURE = {STREAMS['video'].kind}; // kind of a picture",
            "const KINDS = {",
            *kinds,
            "};",
            f"export const JSON_STREAMS = [{', '.join(json.dumps(name) for name in JSON_STREAMS)}];",
            f"export const ANSWERS = {{ {answers} }};",
            "",
        ]
    )


def types() -> str:
    """Return the names of streams for index.d.ts."""
    names = " | ".join(json.dumps(row.name) for row in STREAMS.values() if row.encodings != ("text",))
    return f"/** A stream whose messages are frames. */\nexport type StreamName = {names};\n"


# file -> the text between its marks, and the marks
PARTS = {
    PAGE: (tables, BEGIN, END),
    SCRIPT: (constants, *SCRIPT_MARKS),
    TYPES: (types, *SCRIPT_MARKS),
}


def within(text: str, part: str, begin: str = BEGIN, end: str = END) -> str:
    """Return a text with *part* between its markers.

    Raises:
        ValueError: it has no markers.
    """
    before, found, rest = text.partition(begin)
    _, ends, after = rest.partition(end)
    if not found or not ends:
        raise ValueError(f"wanted the lines {begin} and {end}")
    return f"{before}{begin}\n{part}{end}{after}"


if __name__ == "__main__":
    FILE.write_text(render(), "utf-8")
    for path, (part, *marks) in PARTS.items():
        path.write_text(within(path.read_text("utf-8"), part(), *marks), "utf-8")
    print("written:", *map(str, (FILE, *PARTS)), sep="\n")
