"""SubRip, read by FFmpeg."""

from __future__ import annotations

import pytest

from realizer.offline import realize
from realizer.outputs.captions import captions
from realizer.outputs.output import RenderSettings
from realizer.outputs.registry import OUTPUTS

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
