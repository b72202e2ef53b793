"""Rhubarb's cues, read by a foreign reader."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise

import pytest

from realizer.offline import realize
from realizer.outputs.output import RenderSettings
from realizer.outputs.registry import OUTPUTS
from realizer.speech.utterance import Phoneme

importers = pytest.importorskip("openfacefx.importers", reason="pip install openfacefx")


def content(realization):
    return json.loads(OUTPUTS[".rhubarb.json"].encode(realization, RenderSettings()))


def shapes(realization, phonemes):
    """The mouth shapes of phonemes that follow each other, a tenth of a second each."""
    (speaking,) = realization.speeches
    spoken = tuple(Phoneme(k / 10, (k + 1) / 10, ipa) for k, ipa in enumerate(phonemes.split()))
    utterance = replace(speaking.utterance, phonemes=spoken)
    cues = content(replace(realization, speeches=(replace(speaking, utterance=utterance),)))["mouthCues"]
    return "".join(cue["value"] for cue in cues)


def test_rhubarb_has_a_shape_for_each_sound(realization):
    assert shapes(realization, "m ɑ f iː l ɛ uː") == "XADGBHCFX"


def test_rhubarb_joins_equal_shapes(realization):
    assert shapes(realization, "t s k p b m") == "XBAX"


def test_rhubarb_rests_where_a_speech_is_cut_off(realization):
    (speaking,) = realization.speeches
    cut = replace(realization, speeches=(replace(speaking, until=0.6),))
    assert [cue["value"] for cue in content(cut)["mouthCues"]][-1] == "X"
    assert content(cut)["mouthCues"][-1]["start"] == 0.6


def test_rhubarb_cues_cover_the_time_without_gaps(turn):
    played = realize(turn, voice="silent", idle=False)
    found = content(played)
    cues = found["mouthCues"]
    text = OUTPUTS[".rhubarb.json"].encode(played, RenderSettings()).decode()
    intervals = [(cue["start"], cue["end"], cue["value"]) for cue in cues]
    assert importers.parse_rhubarb_json(text) == (intervals, found["metadata"]["duration"])
    assert (cues[0]["start"], cues[-1]["end"]) == (0, found["metadata"]["duration"])
    assert all(before["end"] == after["start"] for before, after in pairwise(cues))
    assert all(before["value"] != after["value"] for before, after in pairwise(cues))
    assert {cue["value"] for cue in cues} <= set("ABCDEFGHX")
    assert len(cues) > 10


def test_rhubarb_of_silence_is_one_cue_at_rest():
    played = realize('<bml id="b"><head id="n" lexeme="NOD"/></bml>', idle=False)
    assert [cue["value"] for cue in content(played)["mouthCues"]] == ["X"]
