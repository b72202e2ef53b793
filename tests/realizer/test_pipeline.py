"""Documents in; schedule, frames, sound and feedback out, without a clock."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from bml_schema import BMLError
from realizer import realize, schedule
from realizer.examples import examples
from realizer.realization import Realization
from realizer.speech.silent import SilentVoice
from realizer.tables import faps

GOLDEN = Path(__file__).parent.parent / "golden"
HELLO = examples()["greeting"]


@pytest.mark.parametrize("name", examples())
def test_the_examples_play_without_a_warning(name: str) -> None:
    played = realize(examples()[name], voice=SilentVoice())
    assert played.warnings == ()
    assert played.duration > 1


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
