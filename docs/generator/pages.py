"""Pages that are made from the code: each function returns the files of one page, by name."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import Field, fields
from functools import cache
from typing import Any

import click

from docs.generator import steps
from realizer import cli as commands
from realizer import tables
from realizer.cli.serve import serve
from realizer.core.settings import PREFIX, Settings
from realizer.server.http.http_site import asyncapi
from realizer.server.http.vocabulary import vocabulary as served_vocabulary
from realizer.tables.lexemes import face_lexemes


def cli() -> dict[str, str]:
    """Return the help of all commands."""
    context = click.Context(commands.cli, info_name="realizer", max_content_width=100)
    return {"cli.md": "# All commands and options\n\n" + "\n".join(_help(context, 2))}


def _help(context: click.Context, level: int) -> Iterator[str]:
    yield f"{'#' * level} {context.command_path}\n\n```text\n{context.get_help()}\n```\n"
    if isinstance(context.command, click.Group):
        for name, command in context.command.commands.items():
            yield from _help(
                click.Context(command, context, info_name=name, max_content_width=100), level + 1
            )


def api() -> dict[str, str]:
    """Return the public functions and classes of Python, from their docstrings."""
    import realizer
    import realizer.client

    lines = ["# Python, by name", "", "From `import realizer`; how to use them is in [Python](../python.md)."]
    for name in sorted(set(realizer.__all__) - {"client"}, key=str.lower):
        value = getattr(realizer, name)
        lines += ["", f"::: {value.__module__}.{value.__qualname__}"]
    lines += ["", "# Clients", "", "From `import realizer.client`."]
    for name in sorted(realizer.client.__all__, key=str.lower):
        value = getattr(realizer.client, name)
        lines += ["", f"::: {value.__module__}.{value.__qualname__}"]
    return {"api.md": "\n".join(lines) + "\n"}


def settings() -> dict[str, str]:
    """Return the table of settings."""
    head = (
        f"# Settings\n\nEach is a variable (`{PREFIX}MAX_RATE=100`), a line of a TOML file "
        "(`max_rate = 100`, `realizer serve --config FILE.toml`), and, where the table has one, a flag of "
        "`realizer serve`. Flags override variables, and variables override the file.\n\n"
    )
    flags = {option.name: f"`{option.opts[-1]}`" for option in serve.params}
    rows = (
        (f"`{f.name}`", flags.get(f.name, ""), _value(f.default), _wanted(f), f.metadata["description"])
        for f in fields(Settings)
    )
    return {"settings.md": head + table(("setting", "flag", "default", "values", "what it sets"), rows)}


def _wanted(setting: Field[Any]) -> str:
    """Return what a setting accepts, as the error of a wrong value says it."""
    try:
        setting.metadata["read"](object())
    except ValueError as wanted:
        return str(wanted)
    raise AssertionError(f"{setting.name} accepts anything")


def messages() -> dict[str, str]:
    """Return every message of the WebSocket with its fields, from the AsyncAPI document of the service."""
    document = json.loads(asyncapi())
    parts = [
        "# Messages, field by field\n\nMade from `GET /asyncapi.json`. "
        "[Protocol](../protocol.md) explains them.\n"
    ]
    for message in document["components"]["messages"].values():
        about = (message.get(key, "") for key in ("summary", "description"))
        parts.append("\n\n".join((f"## {message['name']}", *filter(None, about), "")))
        schema = document["components"]["schemas"].get(message["payload"].get("$ref", "").rpartition("/")[2])
        if schema and schema.get("properties"):
            rows = [
                (
                    f"`{name}`",
                    kind(field),
                    _default(field, name in schema.get("required", ())),
                    field.get("description", ""),
                )
                for name, field in schema["properties"].items()
            ]
            parts.append(table(("field", "type", "default", "meaning"), rows))
        examples = [json.dumps(example) for example in (schema or {}).get("examples", ())]
        if examples:
            parts.append("```json\n" + "\n".join(examples) + "\n```\n")
    return {"messages.md": "\n".join(parts)}


def value_tables() -> dict[str, str]:
    """Return the tables of action units, FAPs, face lexemes and words of emotions."""
    units = ((f"AU{u.au}", u.name, "yes" if u.sides else "") for u in tables.action_units())
    faps = ((str(f.fap), f"`{f.name}`", f.unit, str(f.group)) for f in tables.faps())
    lexemes = (
        (
            f"`{name}`",
            ", ".join(f"AU{au}{SIDES[side]} {amount:g}" for (au, side), amount in lexeme.aus.items()),
        )
        for name, lexeme in face_lexemes().items()
    )
    wheel = ((place["name"], f"{place['angle']:g}°") for place in vocabulary()["wheel"])
    text = (
        "# Tables\n\nThe files in `realizer/tables/` say where each table comes from.\n\n"
        "## Action units\n\n"
        + table(("unit", "name", "left and right"), units)
        + "\n## FAPs\n\n"
        + table(("FAP", "name", "unit", "group"), faps)
        + "\n## Face lexemes\n\n"
        + table(("lexeme", "action units at amount 1"), lexemes)
        + "\n## Places on the wheel of emotions\n\n"
        + table(("emotion", "angle"), wheel)
    )
    return {"tables.md": text}


def bml() -> dict[str, str]:
    """Return every element of the language, with its attributes, an example and its schedule."""
    from docs.generator.examples import example_of, plot

    files: dict[str, str] = {}
    parts = [
        "# BML, element by element\n\nThe examples are documents of the tests. Pictures show when they play: "
        "[scheduling](../scheduling.md) explains them. "
        "[CONFORMANCE.md](../../bml_schema/CONFORMANCE.md) has every rule.\n"
    ]
    for element in vocabulary()["elements"]:
        name = f"{element['prefix']}:{element['name']}" if element["prefix"] else element["name"]
        about = re.sub(r"(<[\w:]+>)", r"`\1`", element["about"])
        parts.append(f"## {name}\n\n{about}\n")
        rows = [
            (f"`{a['name']}`", a["wanted"], "required" if a["required"] else "")
            for a in element["attributes"]
        ]
        if rows:
            parts.append(table(("attribute", "value", ""), rows))
        if element.get("syncs"):
            parts.append("Sync points: " + ", ".join(f"`{sync}`" for sync in element["syncs"]) + ".\n")
        example = example_of(element["namespace"], element["name"])
        if example is not None:
            parts.append(f"{example.says}\n\n```xml\n{example.text.strip()}\n```\n")
            if picture := plot(example):
                file = f"bml/{name.replace(':', '-')}.svg"
                files[file] = picture
                parts.append(f"![The schedule of the example]({file})\n")
    return {"bml.md": "\n".join(parts), **files}


SIDES = {"BOTH": "", "LEFT": "L", "RIGHT": "R"}

# The pages below generated/, and what makes them.
PAGES: Mapping[str, Callable[[], dict[str, str]]] = {
    "api": api,
    "bml": bml,
    "cli": cli,
    "messages": messages,
    "settings": settings,
    "steps": steps.page,
    "tables": value_tables,
}


@cache
def vocabulary() -> dict[str, Any]:
    """Return what `GET /vocabulary.json` of the service answers."""
    found: dict[str, Any] = json.loads(served_vocabulary())
    return found


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Return a table in Markdown."""
    head = list(head)
    lines = [head, ["---"] * len(head), *rows]
    return "".join("| " + " | ".join(_cell(cell) for cell in line) + " |\n" for line in lines)


def kind(field: Mapping[str, Any]) -> str:
    """Return the type of a field of a JSON schema, in words."""
    return " or ".join(dict.fromkeys(_kinds(field))) or "any"


def _kinds(field: Mapping[str, Any]) -> Iterator[str]:
    if "enum" in field:
        yield from (f"`{json.dumps(word)}`" for word in field["enum"])
    elif "const" in field:
        yield f"`{json.dumps(field['const'])}`"
    elif "anyOf" in field:
        for one in field["anyOf"]:
            yield from _kinds(one)
    elif "$ref" in field:
        yield field["$ref"].rpartition("/")[2]
    elif field.get("type") == "array" and isinstance(field.get("items"), dict):
        yield f"list of {kind(field['items'])}"
    elif "type" in field:
        yield field["type"]


def _default(field: Mapping[str, Any], required: bool) -> str:
    if required or "const" in field:
        return "required"
    return "" if field.get("default") is None else f"`{json.dumps(field['default'])}`"


def _value(value: object) -> str:
    return "" if value is None or value == () else f"`{value}`"


def _cell(text: str) -> str:
    return " ".join(str(text).replace("|", "\\|").split())
