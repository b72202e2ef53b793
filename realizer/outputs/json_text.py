"""The output .json: schedule, FAPs, AUs, feedback and warnings."""

import json
from typing import Any

from realizer.outputs.output import text_output
from realizer.realization import Realization


def json_line(content: Any) -> str:
    """Return a line of JSON.

    Raises:
        ValueError: if a number is not finite.
    """
    return json.dumps(content, ensure_ascii=False, allow_nan=False, separators=(",", ":")) + "\n"


def encode_json(realization: Realization) -> str:
    """Return `Realization.to_json` as a line; errors as `json_line`."""
    return json_line(realization.to_json())


JSON = text_output(
    ".json",
    "application/json",
    "schedule, FAPs, AUs, feedback and warnings",
    encode_json,
    all_characters=True,
)
