"""What is generated of the text layer: tables of JavaScript, cases for its tests, a table in docs/text.md.

`python -m tests.text` writes them.
"""

from __future__ import annotations

import json
import unicodedata
from pathlib import Path
from typing import Any

from realizer.core.toml_text import parse_toml
from realizer.sources import is_markup
from realizer.tables import toml_table
from realizer.tables.lexemes import face_lexemes, head_lexemes
from realizer.text import marks, numbers, spellout
from realizer.text.spoken import spoken_text

ROOT = Path(__file__).parent.parent
CLIENT = ROOT / "clients" / "javascript"
TABLES = CLIENT / "src" / "text-tables.js"
CASES = CLIENT / "test" / "text-cases.json"
MARKUP = CLIENT / "test" / "markup-cases.json"
PAGE = ROOT / "docs" / "text.md"
BEGIN, END = "<!-- marks: written by python -m tests.text -->", "<!-- end of marks -->"
ROWS = ROOT / "tests" / "realizer" / "text"
HEAD = "// Written by python -m tests.text from realizer/tables; do not edit.\n"


def tables() -> str:
    """Return the module of JavaScript with all tables."""
    table = dict(toml_table(marks.FILE))
    known = {unicodedata.lookup(name): shows for shows, names in table["emoji"].items() for name in names}
    emoticons = {sign: name for name, signs in table["emoticons"].items() for sign in signs.split()}
    values: dict[str, Any] = {
        "elements": table.pop("elements"),
        "marks": {**table, "emoji": known, "emoticons": emoticons},
        "lexemes": {"face": sorted(face_lexemes()), "head": sorted(head_lexemes())},
        "numbers": toml_table(numbers.FILE),
        "spellout": toml_table(spellout.FILE),
    }
    return HEAD + "".join(
        f"export const {name} = {json.dumps(value, ensure_ascii=False)};\n" for name, value in values.items()
    )


def cases() -> str:
    """Return texts and what Python gives for them, one a line."""
    rows = parse_toml((ROWS / "numbers.toml").read_text("utf-8"))
    texts = [(text, language) for language, row in rows.items() for text, _ in row["rows"]]
    texts += [(text, "en") for text in parse_toml((ROWS / "texts.toml").read_text("utf-8"))["texts"]]
    lines = []
    for text, language in texts:
        said = spoken_text(text, language)
        behaviours = [list(one) for one in said.behaviours]
        values = [text, language, said.text, said.markup, behaviours, list(said.warnings)]
        lines.append(json.dumps(values, ensure_ascii=False))
    return "[\n" + ",\n".join(lines) + "\n]\n"


def markup_cases() -> str:
    """Return texts and whether Python takes each as a document, one a line."""
    texts = parse_toml((ROWS / "markup.toml").read_text("utf-8"))
    rows = [(text, is_markup(text)) for text in [*texts["documents"], *texts["texts"]]]
    return "[\n" + ",\n".join(json.dumps(row, ensure_ascii=False) for row in rows) + "\n]\n"


def page() -> str:
    """Return the page of the documentation with the current table of marks."""
    table = toml_table(marks.FILE)
    lines = [
        "| shows | stage directions in English | in other languages | emoji, emoticons |",
        "|---|---|---|---|",
    ]
    names = {name: None for part in (*marks.LANGUAGES, "emoji", "emoticons") for name in table[part]}
    for name in names:
        english = table["en"].get(name, "").replace("+", " .. ")
        others = " ".join(table[language].get(name, "") for language in marks.LANGUAGES[1:]).replace(
            "+", " .. "
        )
        emoji = "".join(unicodedata.lookup(one) for one in table["emoji"].get(name, []))
        signs = " ".join(f"`{sign}`" for sign in table["emoticons"].get(name, "").split())
        cells = [
            f"`{name}`",
            ", ".join(english.split(" ")),
            " ".join(others.split()),
            f"{emoji} {signs}".strip(),
        ]
        lines.append("| " + " | ".join(cell.replace(", .., ", " .. ") for cell in cells) + " |")
    before, _, rest = PAGE.read_text("utf-8").partition(BEGIN)
    return f"{before}{BEGIN}\n" + "\n".join(lines) + f"\n{END}{rest.partition(END)[2]}"


FILES = {TABLES: tables, CASES: cases, MARKUP: markup_cases, PAGE: page}

if __name__ == "__main__":
    for path, make in FILES.items():
        path.write_text(make(), "utf-8")
        print(f"written: {path}")
