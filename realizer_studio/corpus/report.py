"""A writer of the description of a corpus: a CSV for each table, and an HTML report."""

from base64 import b64encode
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from realizer.core.atomic_files import write_text
from realizer.outputs.csv_table import csv_text
from realizer_studio.corpus.agreement import agreement
from realizer_studio.corpus.rules import statistics, write_rules
from realizer_studio.corpus.statistics import TABLES, Study, Table

STYLE = (
    ":root{color-scheme:light dark}body{font:15px sans-serif;margin:2em}"
    "table{border-collapse:collapse;display:block;overflow-x:auto}"
    "td,th{padding:.1em .7em;text-align:right}tr:nth-child(even){background:#8881}"
    "figure{display:inline-block;vertical-align:top;margin:0 1.5em 1em 0;max-width:100%}"
    "figure img{max-height:24em;max-width:100%}figure img:not(:only-of-type){max-height:11em}"
)


def describe(folder: Path, study: Study, corpus: Path) -> list[str]:
    """Write tables, rules, the report and the map of the corpus to a folder; return the files' names."""
    folder.mkdir(parents=True, exist_ok=True)
    tables = [make(study) for make in TABLES]
    tables += [agreement(study.recordings)] if any(len(r.annotators) > 1 for r in study.recordings) else []
    tables += [statistics(study)] if any(r.faps is not None for r in study.recordings) else []
    write_tables(folder, tables)
    names = [f"{table.name}.csv" for table in tables] + write_rules(folder, study)
    picture = corpus / "map.png"
    pictures = {"Map of faces": [picture.read_bytes()]} if picture.is_file() else {}
    write_text(folder / "report.html", html("Corpus", tables, pictures))
    return [*names, "report.html"]


def write_tables(folder: Path, tables: Sequence[Table]) -> None:
    """Write a CSV for each table."""
    for table in tables:
        write_text(folder / f"{table.name}.csv", csv_text(table.columns, map(_cells, table.rows)))


def html(title: str, tables: Sequence[Table], pictures: Mapping[str, Sequence[bytes]]) -> str:
    """Return a page with tables, and pictures (PNG or WebP) with their captions."""
    parts = [
        f"<!DOCTYPE html><meta charset=utf-8><title>{title}</title><style>{STYLE}</style><h1>{title}</h1>"
    ]
    for table in tables:
        rows = ["".join(f"<th>{escape(column)}" for column in table.columns)]
        rows += ["".join(f"<td>{escape(cell)}" for cell in _cells(row)) for row in table.rows]
        parts.append(
            f"<h2>{escape(table.name)}: {escape(table.title)}</h2><table><tr>{'<tr>'.join(rows)}</table>"
        )
    parts += ["<h2>Pictures</h2>"] if pictures else []
    for caption, files in pictures.items():
        images = [
            f'<img alt="" src="data:image/{_kind(file)};base64,{b64encode(file).decode()}">' for file in files
        ]
        parts.append(f"<figure>{' '.join(images)}<figcaption>{escape(caption)}</figcaption></figure>")
    return "\n".join(parts) + "\n"


def _cells(row: Sequence[Any]) -> list[str]:
    # NaN is not equal to itself.
    return [
        "" if cell is None or cell != cell else f"{cell:.4g}" if isinstance(cell, float) else str(cell)
        for cell in row
    ]


def _kind(file: bytes) -> str:
    return "webp" if file[8:12] == b"WEBP" else "png"
