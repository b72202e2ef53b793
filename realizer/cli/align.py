"""`align`: aligns a recording with its text."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from realizer.speech.align.alignment import Alignment


@click.command()
@click.argument("audio", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.argument("text")
@click.option("--language", default="en-US", metavar="TAG", help="BCP-47.  [default: en-US]")
@click.option("--aligner", type=click.Choice(["pocketsphinx", "espeak"]), help="Only this one.")
@click.option("-o", "output", metavar="FILE", type=click.Path(path_type=Path), help=".json or .vtt")
def align(audio: Path, text: str, language: str, aligner: str | None, output: Path | None) -> None:
    """Find when AUDIO says each word of TEXT (or of a file, as @FILE)."""
    from realizer.behaviours.sound_file import read_sound
    from realizer.speech.align.aligner import align as aligned

    if output is not None and output.suffix not in (".json", ".vtt"):
        raise click.UsageError(f"-o: wanted a .json or a .vtt file, got {output}")
    if text.startswith("@"):
        try:
            text = Path(text[1:]).read_text("utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise click.UsageError(f"{text}: {error}") from None
    recording = read_sound(audio.read_bytes())
    found = aligned(recording.pcm, recording.rate, text, language, aligner=aligner)  # type: ignore[arg-type]
    for warning in found.warnings:
        click.echo(f"realizer: {warning}", err=True)
    if output is None:
        click.echo(f"{found.aligner}, confidence {found.confidence:.2f}")
        for word, sure in zip(found.words, found.confidences, strict=True):
            click.echo(f"{word.start:8.3f} {word.end:8.3f}  {sure:.2f}  {word.text}")
    else:
        write = _json if output.suffix == ".json" else _vtt
        output.write_text(write(found), "utf-8")


def _json(found: Alignment) -> str:
    words = zip(found.words, found.confidences, strict=True)
    phonemes = zip(found.phonemes, found.phoneme_confidences, strict=True)
    return json.dumps(
        {
            "duration": round(found.duration, 6),
            "aligner": found.aligner,
            "confidence": round(found.confidence, 3),
            "words": [_times(w.start, w.end, sure) | {"text": w.text} for w, sure in words],
            "phonemes": [
                _times(p.start, p.end, sure) | {"ipa": p.ipa, "stress": p.stress} for p, sure in phonemes
            ],
        },
        ensure_ascii=False,
        indent=1,
    )


def _times(start: float, end: float, sure: float) -> dict[str, object]:
    return {"start": round(start, 4), "end": round(end, 4), "confidence": round(sure, 3)}


def _vtt(found: Alignment) -> str:
    cues = [f"{_clock(w.start)} --> {_clock(w.end)}\n{w.text}\n" for w in found.words if w.end > w.start]
    return "\n".join(["WEBVTT\n", *cues])


def _clock(seconds: float) -> str:
    ms = round(seconds * 1000)
    return f"{ms // 3_600_000:02}:{ms // 60_000 % 60:02}:{ms // 1000 % 60:02}.{ms % 1000:03}"
