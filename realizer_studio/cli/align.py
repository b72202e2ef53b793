"""`align`: aligns a recording with its text."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from realizer.cli import inputs, options
from realizer.cli.options import option
from realizer.cli.progress import waiting
from realizer.core.errors import RealizerError

if TYPE_CHECKING:
    from realizer_studio.align.alignment import Alignment


@click.command()
@click.argument("audio", type=options.FILE)
@click.argument("text")
@option("--language TAG", "Language, as a BCP-47 tag.  [default: en-US]", default="en-US", show_default=False)
@option("--aligner", "Use only this aligner.", click.Choice(["pocketsphinx", "espeak"]))
@option("-o --output FILE", "Write a .json or .vtt file.", options.OUTPUT)
def align(audio: Path, text: str, language: str, aligner: str | None, output: Path | None) -> None:
    """Find when each word of a recording is spoken.

    AUDIO is a sound file, TEXT the words spoken in it, or @FILE for a file that holds them. Prints start,
    end, confidence and word; with -o writes the phonemes too (.json), or subtitles (.vtt).

    \b
    realizer align hello.wav "Hello there"
    realizer align talk.flac @talk.txt --language de -o talk.json
    """
    from realizer.behaviours.sound_file import read_sound
    from realizer_studio.align.aligner import align as find_words

    inputs.check_suffix(output, ".json", ".vtt")
    if text.startswith("@"):
        content = inputs.read_file(text[1:])
        text = inputs.decode(content, text[1:], "a text")
    if not text.strip():
        raise click.BadParameter("wanted the spoken words, got none", param_hint="TEXT")
    with inputs.reporting(RealizerError, f"{audio}: ", click.ClickException):
        recording = read_sound(audio.read_bytes())
    with waiting("aligning"):
        alignment = find_words(recording.pcm, recording.rate, text, language, aligner=aligner)  # type: ignore[arg-type]
    for warning in alignment.warnings:
        click.echo(f"realizer: {warning}", err=True)
    if output is None:
        click.echo(f"{alignment.aligner}, confidence {alignment.confidence:.2f}")
        for word, confidence in zip(alignment.words, alignment.confidences, strict=True):
            click.echo(f"{word.start:8.3f} {word.end:8.3f}  {confidence:.2f}  {word.text}")
    else:
        with inputs.opening(output):
            output.write_text((_json if output.suffix.lower() == ".json" else _vtt)(alignment), "utf-8")


def _json(alignment: Alignment) -> str:
    words = zip(alignment.words, alignment.confidences, strict=True)
    phonemes = zip(alignment.phonemes, alignment.phoneme_confidences, strict=True)
    return json.dumps(
        {
            "duration": round(alignment.duration, 6),
            "aligner": alignment.aligner,
            "confidence": round(alignment.confidence, 3),
            "words": [_times(w.start, w.end, c) | {"text": w.text} for w, c in words],
            "phonemes": [_times(p.start, p.end, c) | {"ipa": p.ipa, "stress": p.stress} for p, c in phonemes],
        },
        ensure_ascii=False,
        indent=1,
    )


def _times(start: float, end: float, confidence: float) -> dict[str, object]:
    return {"start": round(start, 4), "end": round(end, 4), "confidence": round(confidence, 3)}


def _vtt(alignment: Alignment) -> str:
    from realizer.outputs.vtt import timestamp

    words = (word for word in alignment.words if word.end > word.start)
    cues = [f"{timestamp(w.start)} --> {timestamp(w.end)}\n{w.text}\n" for w in words]
    return "\n".join(["WEBVTT\n", *cues])
