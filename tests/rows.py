"""Tests of tables: one test for all rows costs less to collect and to report than a test of each."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable
from typing import Any

__all__ = ["each_row"]


def each_row(names: str, rows: Iterable[Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Run a test for each row, as `pytest.mark.parametrize` does, but as one test, whose fixtures rows share.

    All rows are run. Those that fail raise an ExceptionGroup of their errors; a note on each has the row.
    """
    columns, table = [name.strip() for name in names.split(",")], list(rows)
    assert table

    def decorate(test: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(test)
        def run(**fixtures: Any) -> None:
            errors = []
            for row in table:
                values = [row] if len(columns) == 1 else row
                try:
                    test(**dict(zip(columns, values, strict=True)), **fixtures)
                except Exception as error:
                    error.add_note(f"in the row {repr(row)[:300]}")
                    errors.append(error)
            if errors:
                raise ExceptionGroup(f"{len(errors)} of {len(table)} rows", errors)

        signature = inspect.signature(test)
        rest = [p for name, p in signature.parameters.items() if name not in columns]
        run.__signature__ = signature.replace(parameters=rest)  # type: ignore[attr-defined]
        return run

    return decorate
