"""The parser of control messages."""

import json
import re
from collections.abc import Iterable
from typing import Annotated, get_args

from pydantic import Field, TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from realizer.core.json_reader import parse_json
from realizer.core.similar import similar
from realizer.protocol.messages.common import MAX_CONTENT, MAX_CONTROL
from realizer.protocol.messages.replies import ErrorMessage
from realizer.protocol.messages.requests import Control
from realizer.protocol.streams import STREAMS

SUPPORTED: tuple[str, ...] = tuple(
    get_args(model.model_fields["type"].annotation)[0] for model in get_args(Control)
)
# Kind of a pydantic error -> what was wanted, in the style of our other messages.
_WANTED = {
    "missing": "a value",
    "extra_forbidden": "no field of that name",
    "greater_than": "more than {gt:g}",
    "greater_than_equal": "at least {ge:g}",
    "less_than_equal": "at most {le:g}",
    "multiple_of": "a multiple of {multiple_of:g}",
    "finite_number": "a finite number",
    "float_type": "a number",
    "float_parsing": "a number",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_parsing_size": "a whole number of a usual size",
    "int_from_float": "a whole number",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "literal_error": "{expected}",
    "string_type": "a string",
    "string_pattern_mismatch": "a string that matches {pattern}",
    "string_too_short": "a string of at least {min_length} characters",
    "string_too_long": "a string of at most {max_length} characters",
    "too_long": "at most {max_length} of them",
    "list_type": "a list",
    "tuple_type": "a list",
    "dict_type": "an object",
    "model_type": "an object",
}
# JSON can contain half of a surrogate pair, which is no character.
_SURROGATE = re.compile(r"[\ud800-\udfff]|\\u[dD][89a-fA-F]")
_ADAPTER: TypeAdapter[Control] = TypeAdapter(Annotated[Control, Field(discriminator="type")])


def parse_control(text: str, *, can_save: bool = False) -> Control | ErrorMessage:
    """Parse a control message, or return the error: code bad-json, too-large, unsupported or invalid.

    Args:
        can_save: whether a `save` message may be longer than others.
    """
    if len(text) > MAX_CONTROL and not (can_save and len(text) < 2 * MAX_CONTENT):
        return _too_large(text)
    try:
        message = parse_json(text)
    except ValueError as error:
        return ErrorMessage(code="bad-json", message=f"wanted a JSON object with a type: {error}")
    if _SURROGATE.search(text) and not _is_text(message):
        words = r"wanted text, got half a character: a lone \ud800..\udfff in a string"
        return ErrorMessage(code="bad-json", message=words)
    kind = message.get("type")
    if kind not in SUPPORTED:
        # Clients compare the end with the type that they asked for.
        words = f"wanted a type of {', '.join(SUPPORTED)}{_near(kind, SUPPORTED)}; got {_short(kind)}"
        return ErrorMessage(code="unsupported", message=words, where="type")
    if kind != "save" and len(text) > MAX_CONTROL:
        return _too_large(text)
    if kind == "subscribe" and message.get("stream") not in tuple(STREAMS):
        stream = message.get("stream")
        words = f"wanted a stream of {', '.join(STREAMS)}{_near(stream, STREAMS)}; got {_short(stream)}"
        return ErrorMessage(code="unsupported", message=words, where="subscribe.stream")
    try:
        return _ADAPTER.validate_python(message)
    except ValidationError as error:
        errors = error.errors(include_url=False)
        where = _where(errors[0], message)
        same = [other for other in errors if _where(other, message) == where]
        id = message.get("id") if kind == "speech" and isinstance(message.get("id"), str) else None
        return ErrorMessage(code="invalid", message=_explain(same), where=where, id=id)


def _too_large(text: str) -> ErrorMessage:
    words = f"wanted a control message of at most {MAX_CONTROL} bytes, got {len(text)}"
    return ErrorMessage(code="too-large", message=words)


def _where(error: ErrorDetails, message: object) -> str:
    """Return the path to the wrong value, without pydantic's names of the members of unions."""
    kind, *parts = error["loc"]
    path, value = [str(kind)], message
    for part in parts:
        if isinstance(value, list) and isinstance(part, int):
            value = value[part] if part < len(value) else None
        elif isinstance(value, dict) and part in value:
            value = value[part]
        elif error["type"] != "missing" or part != parts[-1]:
            continue
        path.append(str(part))
    return ".".join(path)


def _is_text(message: object) -> bool:
    """Whether a JSON value can be encoded as UTF-8."""
    try:
        json.dumps(message, ensure_ascii=False).encode()
    except UnicodeEncodeError:
        return False
    return True


def _explain(errors: list[ErrorDetails]) -> str:
    first = errors[0]
    got = "nothing" if first["type"] == "missing" else _short(first["input"])
    if first["type"] not in _WANTED:
        said = first["msg"].removeprefix("Value error, ")
        return said if ", got " in said else f"{said}; got {got}"
    wanted = [_WANTED[e["type"]].format(**e.get("ctx", {})) for e in errors if e["type"] in _WANTED]
    return f"wanted {' or '.join(dict.fromkeys(wanted))}; got {got}"


def _near(value: object, known: Iterable[str]) -> str:
    near = similar(value, known) if isinstance(value, str) else ()
    return f" (did you mean {' or '.join(near)}?)" if near else ""


def _short(value: object) -> str:
    text = json.dumps(value, default=str)
    return text if len(text) <= 80 else text[:77] + "..."
