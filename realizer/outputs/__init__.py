"""The outputs: encodings of a realization, by file suffix."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path

from realizer.outputs.output import Drawing, Output

__all__ = ["OUTPUTS", "Drawing", "Output", "output_for"]

MODULES = (
    "fap_text",
    "json_text",
    "csv_table",
    "vtt",
    "textgrid",
    "wav",
    "png",
    "film",
    "webp",
    "glb",
    "vrma",
    "arkit_csv",
    "talkinghead",
)

OUTPUTS: Mapping[str, Output] = {
    output.suffix: output for name in MODULES for output in import_module(f"realizer.outputs.{name}").OUTPUTS
}


def output_for(path: str | Path) -> Output:
    """The encoding of a path's suffix, either case; the longest that fits: `x.arkit.csv` is no `.csv`.

    Raises:
        ValueError: no or an unknown suffix; the text lists the known ones.
    """
    parts = [part.lower() for part in Path(path).suffixes]
    for k in range(len(parts)):
        if "".join(parts[k:]) in OUTPUTS:
            return OUTPUTS["".join(parts[k:])]
    raise ValueError(f"{path}: wanted a suffix of {' '.join(OUTPUTS)}, got {parts[-1] if parts else 'none'}")
