"""Documents in; schedule, frames, sound and feedback out, without a clock."""

from __future__ import annotations

import json
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from bml_schema import BMLError
from realizer import realize, schedule
from realizer.examples import examples
from realizer.playback.active_block import Speaking
from realizer.playback.scene_file import parse_scene
from realizer.realization import Realization
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import Phoneme, Utterance
from realizer.tables import faps

GOLDEN = Path(__file__).parent.parent / "golden"
HELLO = examples()["greeting"]


@pytest.mark.parametrize("name", examples())
def test_the_examples_play_without_a_warning(name: str) -> None:
    played = realize(examples()[name], voice=SilentVoice())
    assert played.warnings == ()
    assert played.duration > 1


def test_frames_reach_from_0_to_the_end() -> None:
    played = realize(HELLO, voice=SilentVoice(), fps=30)
    assert played.frames == int(played.duration * 30 + 1e-6) + 1
    assert played.faps.values.shape == (played.frames, 68)
    assert played.aus.times[1] == pytest.approx(1 / 30)


def test_the_json_holds_what_it_promises() -> None:
    out = json.loads(json.dumps(realize(HELLO, voice=SilentVoice()).to_json()))
    assert {"fps", "frames", "duration", "face", "schedule", "fap", "au", "feedback", "warnings"} <= set(out)
    assert len(out["fap"]["names"]) == len(out["fap"]["mask"]) == 68
    assert len(out["fap"]["values"]) == len(out["au"]["values"]) == out["frames"]
    assert all(isinstance(v, int) for v in out["fap"]["values"][0])
    assert all(0 <= v <= 1 for row in out["au"]["values"] for v in row)
    assert len(out["visemes"]["names"]) == 15
    assert [sum(row) for row in out["visemes"]["values"]] == pytest.approx([1] * out["frames"], abs=0.01)
    assert out["schedule"][0]["block"] == "greeting"
    assert out["feedback"][0].startswith("<predictionFeedback")


def test_several_documents_are_composed() -> None:
    nod = '<bml id="{}" composition="APPEND"><head id="n" lexeme="NOD"/></bml>'
    played = realize([nod.format("a"), nod.format("b")])
    first, second = played.schedules
    assert second.start == pytest.approx(first.end)
    assert played.duration == pytest.approx(second.end)


def test_two_characters_stand_side_by_side() -> None:
    nod = '<bml id="{0}" characterId="{0}"><head id="n" lexeme="NOD"/></bml>'
    played = realize([nod.format("Ann"), nod.format("Bob")])
    assert list(played.characters) == ["Ann", "Bob"]
    assert set(played.to_json()["characters"]) == {"Bob"}


def test_a_broken_document_is_refused_and_the_next_one_plays() -> None:
    played = realize(['<bml id="x"><head', '<bml id="b"><head id="n" lexeme="NOD"/></bml>'])
    assert len(played.refused) == 1
    assert played.duration > 0


def test_the_same_seed_gives_the_same_frames_and_another_seed_does_not() -> None:
    document = '<bml id="b"><wait id="w" duration="12"/></bml>'
    one, two, other = (realize(document, seed=s).faps.values for s in (1, 1, 2))
    assert np.array_equal(one, two)
    assert not np.array_equal(one, other)


def test_without_idle_an_empty_stretch_is_neutral() -> None:
    played = realize('<bml id="b"><wait id="w" duration="3"/></bml>', idle=False)
    assert not played.faps.values.any()


def test_long_documents_have_no_seam_between_windows() -> None:
    document = (
        '<bml id="b"><faceLexeme id="f" lexeme="SMILE" start="8" attackPeak="10" relax="12" end="14"/></bml>'
    )
    values = realize(document, idle=False).faps.values
    assert np.abs(np.diff(values, axis=0)).max() < 40


def test_schedule_of_a_document_that_is_no_block_is_an_error() -> None:
    with pytest.raises(BMLError, match="id"):
        schedule("<bml/>")


def test_sound_is_mixed_where_it_belongs() -> None:
    played = realize('<bml id="b"><wait id="w" duration="2"/></bml>', idle=False)
    tone = Utterance(0.5, (), (), {}, 8000, np.full(4000, 1000, np.int16))
    object.__setattr__(
        played, "speaking", (Speaking(1.0, float("inf"), tone, 0), Speaking(1.2, 1.3, tone, 0))
    )
    sound = played.sound(16000)
    assert len(sound) == 32000
    assert sound[:16000].max() == 0
    assert sound[int(1.1 * 16000)] == 1000
    assert sound[int(1.25 * 16000)] == 2000
    assert sound[int(1.4 * 16000)] == 1000


def test_visemes_are_those_of_their_character_and_end_where_the_speech_is_cut_off() -> None:
    played = realize('<bml id="b"><wait id="w" duration="2"/></bml>', idle=False, fps=50)
    vowel = Utterance(1.0, (), (Phoneme(0.0, 1.0, "ɑ"),), {})
    object.__setattr__(
        played, "speaking", (Speaking(0.5, float("inf"), vowel, 1), Speaking(1.0, 1.4, vowel, 0))
    )
    said = played.visemes()
    assert (said[:51, 0] == 1).all()
    assert said[65, 10] > 0.9
    assert (said[77:, 0] == 1).all()
    assert played.visemes(1)[50, 10] > 0.9


def test_a_scene_is_read_from_lines_or_json() -> None:
    scene = {"cup": (0.1, -0.2, 0.5)}
    assert parse_scene("# what she sees\ncup 0.1 -0.2 0.5\n") == scene
    assert parse_scene('{"cup": [0.1, -0.2, 0.5]}') == scene
    with pytest.raises(ValueError, match="cup: wanted three numbers"):
        parse_scene("cup 1 2")


@pytest.mark.parametrize("name", ["greeting", "nod-on-a-word", "gaze-and-back"])
def test_frames_are_the_golden_ones(name: str, request: pytest.FixtureRequest) -> None:
    """FAP frames at 25 fps as text, one frame a line: a change is a diff that can be read."""
    played = realize(examples()[name], voice=SilentVoice())
    used = [i for i in range(68) if played.faps.integers()[:, i].any()]
    lines = [" ".join(["frame", *(faps()[i].name for i in used)])]
    lines += [" ".join(map(str, [k, *row[used]])) for k, row in enumerate(played.faps.integers())]
    golden = GOLDEN / f"{name}.fap.txt"
    if request.config.getoption("--update-golden"):
        golden.write_text("\n".join(lines) + "\n")
    head, *rows = golden.read_text().splitlines()
    assert lines[0] == head
    ours = np.array([line.split() for line in lines[1:]], int)
    theirs = np.array([row.split() for row in rows], int)
    assert ours.shape == theirs.shape
    # One unit for the last bit of another machine's arithmetic.
    assert np.abs(ours - theirs).max() <= 1


@pytest.fixture
def spoken() -> Realization:
    """The nod on a word, really spoken, without idle motion."""
    if find_spec("espeakng_loader") is None:
        pytest.skip("no speech extra: pip install 'bml-realizer[speech]'")
    return realize(examples()["nod-on-a-word"], voice="espeak", idle=False)


@pytest.mark.espeak
def test_the_nods_deepest_frame_falls_on_its_word(spoken: Realization) -> None:
    planned = spoken.schedules[0]
    (start, utterance), word = spoken.speech[0], planned.at("yes", "really")
    heard = next(w for w in utterance.words if w.text.strip(".,").lower() == "really")
    assert start + heard.start == pytest.approx(word, abs=0.005)
    pitch = spoken.faps.values[:, 47]  # FAP 48, down is positive
    assert abs(spoken.faps.times[np.argmax(pitch)] - word) <= 1 / spoken.fps


@pytest.mark.espeak
def test_the_sound_lasts_as_long_as_the_words_and_starts_with_them(spoken: Realization) -> None:
    (start, utterance), sound = spoken.speech[0], spoken.sound(22050)
    assert utterance.pcm is not None
    assert len(sound) == round(spoken.duration * 22050)
    loud = np.flatnonzero(np.abs(sound) > 300) / 22050
    voiced = [p for p in utterance.phonemes if p.ipa]
    assert loud[0] == pytest.approx(start + voiced[0].start, abs=0.08)
    assert loud[-1] <= start + utterance.duration


@pytest.mark.espeak
def test_the_lips_meet_in_every_p_b_m_as_streamed() -> None:
    document = '<bml id="b"><speech id="s"><text>My baby came up to me, maybe.</text></speech></bml>'
    played = realize(document, voice="espeak", idle=False)
    ((start, utterance),) = played.speech
    faps = played.faps.values
    gap = -faps[:, 3] - faps[:, 4]  # FAP 4 moves the upper lip down, FAP 5 the lower lip up; MNS / 1024
    bilabial = [p for p in utterance.phonemes if p.ipa and p.ipa.strip("ˈˌ")[:1] in "pbm"]
    assert len(bilabial) >= 6
    for phoneme in bilabial:
        inside = (played.faps.times >= start + phoneme.start - 0.04) & (
            played.faps.times <= start + phoneme.end + 0.04
        )
        assert gap[inside].min() < 0.03 * 1024, phoneme
    assert gap.max() > 150, "between them the mouth opens"


def test_warnings_that_arise_while_blocks_play_are_among_the_warnings() -> None:
    bmla = 'xmlns:bmla="http://www.asap-project.org/bmla"'
    played = realize(f'<bml id="b" {bmla} bmla:onStart="q"><bmla:interrupt id="i" target="nobody"/></bml>')
    assert [(w.id, w.type) for w in played.warnings] == [
        ("b", "EXECUTION_FAILURE"),
        ("b:i", "EXECUTION_FAILURE"),
    ]
