"""The registry of outputs: one row for each suffix that can be written."""

from pathlib import Path

from realizer.core.registry import Registry
from realizer.outputs.output import Output

OUTPUTS: Registry[Output] = Registry(
    "realizer.outputs",
    {
        ".fap": "realizer.outputs.fap_text:FAP",
        ".json": "realizer.outputs.json_text:JSON",
        ".csv": "realizer.outputs.csv_table:CSV",
        ".vtt": "realizer.outputs.vtt:VTT",
        ".srt": "realizer.outputs.vtt:SRT",
        ".textgrid": "realizer.outputs.textgrid:TEXTGRID",
        ".wav": "realizer.outputs.wav:WAV",
        ".png": "realizer.outputs.png:PNG",
        ".mp4": "realizer.outputs.film:MP4",
        ".webm": "realizer.outputs.film:WEBM",
        ".webp": "realizer.outputs.webp:WEBP",
        ".glb": "realizer.outputs.glb:GLB",
        ".vrma": "realizer.outputs.vrma:VRMA",
        ".arkit.csv": "realizer.outputs.csv_table:ARKIT_CSV",
        ".talkinghead.json": "realizer.outputs.talkinghead:TALKINGHEAD",
        ".rhubarb.json": "realizer.outputs.rhubarb:RHUBARB",
    },
    wanted="a realizer.outputs.output.Output",
    accepts=lambda value: isinstance(value, Output),
    name_of=lambda output: output.suffix,
)


def output_for(path: str | Path) -> Output:
    """Return the output for the longest known suffix of a path, so that `x.arkit.csv` is not `.csv`.

    Raises:
        ValueError: if there is no suffix or an unknown one; the text lists the known ones.
    """
    parts = [part.lower() for part in Path(path).suffixes]
    for k in range(len(parts)):
        if "".join(parts[k:]) in OUTPUTS:
            return OUTPUTS["".join(parts[k:])]
    known = " ".join(name for name, _ in OUTPUTS.working())
    raise ValueError(f"{path}: wanted a suffix of {known}, got {parts[-1] if parts else 'none'}")
