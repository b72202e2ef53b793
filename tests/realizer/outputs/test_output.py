"""Tests of writing outputs: the same bytes each time, whole or not at all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from realizer.animation.fap.fap_reader import read_fap
from realizer.core.errors import PluginError
from realizer.outputs.output import Output, RenderSettings
from realizer.outputs.registry import OUTPUTS, output_for
from realizer.speech.utterance import Phoneme

SMALL = RenderSettings(size=(32, 32))
HERE = Path(__file__).parent
# Outputs with pictures take 10 s each to start.
# Suffix -> the test module in which another program reads such files, and that program.
READERS = {
    ".arkit.csv": "arkit_csv openfacefx",
    ".glb": "glb trimesh",
    ".mp4": "film av",
    ".png": "png PIL",
    ".rhubarb.json": "rhubarb openfacefx",
    ".srt": "vtt av",
    ".talkinghead.json": "talkinghead talkinghead.html",
    ".textgrid": "textgrid praatio",
    ".vrma": "vrma vrma.mjs",
    ".vtt": "vtt webvtt",
    ".wav": "wav wave",
    ".webm": "film av",
    ".webp": "webp PIL",
}
EACH = [pytest.param(suffix, marks=[pytest.mark.gl, pytest.mark.slow] if output.picture_size else [])
        for suffix, output in OUTPUTS.items()]  # fmt: skip


def written(realization, tmp_path, suffix) -> bytes:
    path = tmp_path / f"out{suffix}"
    output_for(path).write(realization, path, SMALL)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]  # no draft is left
    return path.read_bytes()


@pytest.mark.parametrize(
    ("suffix", "module", "reader"), [(s, *words.split()) for s, words in READERS.items()]
)
def test_output_is_read_by_another_program(suffix, module, reader):
    test = HERE / f"test_{module}.py"
    assert suffix in OUTPUTS
    assert reader in test.read_text("utf-8"), f"add a test to {test} that reads a {suffix} file with {reader}"


@pytest.mark.parametrize("suffix", EACH)
def test_output_is_deterministic(realization, tmp_path, rendering, suffix):
    for copy in range(2):
        OUTPUTS[suffix].write(realization, tmp_path / f"{copy}{suffix}", rendering(SMALL.size, copy))
    first, second = (path.read_bytes() for path in sorted(tmp_path.iterdir()))
    assert first == second
    assert first


def test_output_keeps_the_old_file_when_it_fails(realization, tmp_path):
    path = tmp_path / "out.json"
    path.write_text("old")
    broken = realization.faps.values
    realization.aus.values[0, 0] = np.nan
    with pytest.raises(ValueError, match="JSON"):
        OUTPUTS[".json"].write(realization, path, RenderSettings())
    assert broken is realization.faps.values
    assert path.read_text() == "old"
    assert len(list(tmp_path.iterdir())) == 1


def test_output_writes_to_a_pipe(realization):
    OUTPUTS[".csv"].write(realization, Path("/dev/null"), RenderSettings())
    assert not Path("/dev/null").is_file()


def test_output_of_fap_has_the_integers_of_the_frames(realization, tmp_path):
    text = written(realization, tmp_path, ".fap").decode()
    assert text.splitlines()[0] == "2.1 greeting 25 38"
    clip = read_fap(text)
    assert clip.notes == ()
    assert np.array_equal(clip.values, realization.faps.integers())
    assert np.array_equal(clip.mask, realization.faps.mask)


def test_output_of_fap_has_fap_1_on_request(realization, tmp_path):
    sounds = (Phoneme(0.0, 0.3, ""), Phoneme(0.3, 0.5, "p"), Phoneme(0.5, 0.8, "a"), Phoneme(0.8, 1.0, ""))
    (speaking,) = realization.speeches
    said = replace(speaking, utterance=replace(speaking.utterance, phonemes=sounds))
    spoken = replace(realization, speeches=(said,))
    path = tmp_path / "clip.fap"
    OUTPUTS[".fap"].write(spoken, path, RenderSettings(visemes=True))
    clip = read_fap(path.read_text())
    assert clip.mask[0]
    assert np.array_equal(clip.values, realization.faps.integers())
    assert clip.visemes[round(25 * (said.start + 0.4))].tolist() == [1, 0, 63, 0]
    assert clip.visemes[round(25 * (said.start + 0.65))][0] == 10
    assert clip.visemes[[0, -1]].tolist() == [[0, 0, 63, 0]] * 2
    OUTPUTS[".fap"].write(spoken, path, RenderSettings())
    assert not read_fap(path.read_text()).mask[0]


def test_write_reports_a_plugin_that_fails(tmp_path) -> None:
    def encode(realization, drawing):
        raise KeyError("words")

    output = Output(".words", "text/plain", "words", encode)
    with pytest.raises(PluginError, match=r"the output \.words of a plug-in failed: KeyError: 'words'"):
        output.write(None, tmp_path / "x.words", RenderSettings())
