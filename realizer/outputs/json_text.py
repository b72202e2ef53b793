"""A realization as JSON (.json): schedule, FAPs, AUs, feedback and warnings."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from realizer.outputs.files import write_text
from realizer.outputs.output import Drawing, Output

if TYPE_CHECKING:
    from realizer.realization import Realization

__all__ = ["OUTPUTS", "encode_json", "write_json"]


def encode_json(realization: Realization) -> str:
    """One line of JSON and a line end.

    Raises:
        ValueError: a number that JSON has no word for (nan, inf).
    """
    text = json.dumps(realization.to_json(), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text + "\n"


def write_json(realization: Realization, path: Path, drawing: Drawing) -> None:
    write_text(path, encode_json(realization))


OUTPUTS = (
    Output(
        ".json", "application/json", "schedule, FAPs, AUs, feedback and warnings", write_json, everybody=True
    ),
)
