"""WebVTT, read by a foreign reader."""

from __future__ import annotations

import html
from dataclasses import replace

import pytest

from realizer.offline import realize
from realizer.outputs.captions import captions
from realizer.outputs.output import RenderSettings
from realizer.outputs.registry import OUTPUTS

webvtt = pytest.importorskip("webvtt", reason="pip install webvtt-py")


def cues(realization, tmp_path):
    """(start, end, kind, text) of what webvtt-py finds."""
    OUTPUTS[".vtt"].write(realization, tmp_path / "x.vtt", RenderSettings())
    found = []
    for cue in webvtt.read(str(tmp_path / "x.vtt")):
        kind = cue.raw_text.removeprefix("<c.").partition(">")[0]
        found.append((seconds(cue.start_time), seconds(cue.end_time), kind, html.unescape(cue.text)))
        assert cue.identifier == (cue.text if kind == "sync" else None)
    return found


def seconds(time):
    return time.hours * 3600 + time.minutes * 60 + time.seconds + time.milliseconds / 1000


def test_vtt_has_cues_in_order(realization, tmp_path):
    assert cues(realization, tmp_path) == [
        (0.2, 0.24, "sync", "greeting:nod:start"),
        (0.25, 0.65, "word", "Hello"),
        (0.25, 0.35, "phoneme", "h"),
        (0.35, 0.65, "phoneme", "oʊ"),
        (0.65, 1.15, "word", "R&D <team>"),
        (0.75, 1.15, "phoneme", "iː"),
        (0.81, 0.85, "sync", "greeting:nod:stroke"),
        (1.4, 1.44, "sync", "greeting:nod:end"),
    ]


def test_vtt_excludes_words_that_were_cut_off(realization, tmp_path):
    (speaking,) = realization.speeches
    short = replace(realization, speeches=(replace(speaking, until=0.6),))
    shown = [cue for cue in cues(short, tmp_path) if cue[2] != "sync"]
    assert [cue[3] for cue in shown] == ["Hello", "h", "oʊ"]
    assert max(cue[1] for cue in shown) == 0.6


def test_vtt_has_every_word_and_point(turn, tmp_path):
    played = realize(turn, voice="silent", idle=False)
    found = cues(played, tmp_path)
    assert [text for _, _, kind, text in found if kind == "word"] == [
        word.text for _, utterance in played.speech for word in utterance.words
    ]
    assert {text for _, _, kind, text in found if kind == "sync"} == {
        f"a:{behaviour}:{point}" for behaviour, names in played.schedules[0].points.items() for point in names
    }
    assert all(end > start for start, end, _, _ in found)


av = pytest.importorskip("av", reason="pip install 'bml-realizer[film]'")


def read(realization, tmp_path):
    """(start, end, text) of what FFmpeg finds."""
    OUTPUTS[".srt"].write(realization, tmp_path / "x.srt", RenderSettings())
    with av.open(str(tmp_path / "x.srt")) as file:
        assert file.format.name == "srt"
        return [
            (
                float(packet.pts * packet.time_base),
                float((packet.pts + packet.duration) * packet.time_base),
                bytes(packet).decode(),
            )
            for packet in file.demux()
            if packet.size
        ]


def test_srt_has_the_captions_of_a_film(realization, tmp_path):
    (caption,) = captions(realization)
    assert caption.text == "Hello R&D <team>"
    assert read(realization, tmp_path) == [(caption.start, realization.duration, caption.text)]


def test_srt_numbers_captions_and_uses_commas(tmp_path):
    played = realize("First. " * 12, voice="silent", idle=False)
    blocks = OUTPUTS[".srt"].encode(played, RenderSettings()).decode().split("\n\n")
    assert len(blocks) > 1
    assert [block.split("\n")[0] for block in blocks] == [str(n + 1) for n in range(len(blocks))]
    assert len(read(played, tmp_path)) == len(blocks)
    assert all("," in block.split("\n")[1] for block in blocks)


def test_srt_of_silence_is_empty():
    played = realize('<bml id="b"><head id="n" lexeme="NOD"/></bml>', idle=False)
    assert OUTPUTS[".srt"].encode(played, RenderSettings()) == b""
