"""The output .json: schedule, FAPs, AUs, feedback and warnings."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from realizer.outputs.output import Output, RenderSettings

if TYPE_CHECKING:
    from realizer.realization import Realization


def encode_json(realization: Realization) -> str:
    """Return a line of JSON.

    Raises:
        ValueError: if a number is not finite.
    """
    text = json.dumps(realization.to_json(), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text + "\n"


def _encode(realization: Realization, drawing: RenderSettings) -> bytes:
    return encode_json(realization).encode()


JSON = Output(
    ".json", "application/json", "schedule, FAPs, AUs, feedback and warnings", _encode, all_characters=True
)
