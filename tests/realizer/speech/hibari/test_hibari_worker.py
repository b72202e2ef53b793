"""The worker of hibari, without its model."""

from pathlib import Path

import pytest

from realizer.speech.hibari.hibari_worker import DURATIONS, LONGEST, split, with_output


def test_split_cuts_long_sentences_at_commas_or_else_at_blanks() -> None:
    words = [("w", "wɜd", True)] * (LONGEST // 5) + [(",", ",", True)] + [("w", "wɜd", True)] * LONGEST
    pieces = split(words)
    assert [word for piece in pieces for word in piece] == words
    assert pieces[0][-1][0] == ","
    assert all(sum(len(phonemes) for _, phonemes, _ in piece) <= LONGEST for piece in pieces)
    assert len(split([("x", "a" * (3 * LONGEST), False)])) == 3


@pytest.mark.hibari
def test_with_output_adds_an_output_to_an_onnx_model() -> None:
    onnxruntime = pytest.importorskip("onnxruntime")
    from hibari.voices import voice_path

    model = Path(voice_path("heart", download_missing=False)).read_bytes()
    before, after = (
        [output.name for output in onnxruntime.InferenceSession(content).get_outputs()]
        for content in (model, with_output(model, DURATIONS))
    )
    assert after == [*before, DURATIONS]


def test_with_output_appends_nested_protocol_buffers() -> None:
    assert with_output(b"model", "abc") == b"model" + bytes([0x3A, 7, 0x62, 5, 0x0A, 3]) + b"abc"
