"""The description of a corpus as files: a CSV for each table, and one HTML report."""

import base64
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

from realizer.core.atomic_files import write_text
from realizer.corpus.agreement import agreement
from realizer.corpus.rules import statistics, write_rules
from realizer.corpus.statistics import TABLES, Study, Table
from realizer.outputs.csv_table import csv_text

STYLE = "body{font:15px sans-serif;margin:2em}td,th{padding:.1em .7em;text-align:right}"


def describe(folder: Path, study: Study, corpus: Path) -> list[str]:
    """Write all tables, rules and the report into a folder, and return the names of the files.

    Args:
        corpus: folder of the corpus, whose picture of the map is in the report.
    """
    folder.mkdir(parents=True, exist_ok=True)
    tables = [make(study) for make in TABLES]
    tables += [agreement(study.recordings)] if any(len(r.annotators) > 1 for r in study.recordings) else []
    tables += [statistics(study)] if any(r.faps is not None for r in study.recordings) else []
    for table in tables:
        write_text(folder / f"{table.name}.csv", csv_text(table.columns, map(_cells, table.rows)))
    names = [f"{table.name}.csv" for table in tables] + write_rules(folder, study)
    write_text(folder / "report.html", html(tables, corpus / "map.png"))
    return [*names, "report.html"]


def html(tables: Sequence[Table], picture: Path) -> str:
    """Return a page with all tables, and the picture if there is one."""
    parts = [f"<!DOCTYPE html><meta charset=utf-8><title>Corpus</title><style>{STYLE}</style><h1>Corpus</h1>"]
    for table in tables:
        rows = ["".join(f"<th>{escape(column)}" for column in table.columns)]
        rows += ["".join(f"<td>{escape(cell)}" for cell in _cells(row)) for row in table.rows]
        parts.append(
            f"<h2>{escape(table.name)}: {escape(table.title)}</h2><table><tr>{'<tr>'.join(rows)}</table>"
        )
    if picture.is_file():
        data = base64.b64encode(picture.read_bytes()).decode()
        parts.append(
            f'<h2>Map of faces</h2><img alt="distances of neurons" src="data:image/png;base64,{data}">'
        )
    return "\n".join(parts) + "\n"


def _cells(row: Sequence[Any]) -> list[str]:
    return ["" if cell is None else f"{cell:.4g}" if isinstance(cell, float) else str(cell) for cell in row]
